"""No result leaves the range that options() describes: random small images, from Python and from the program."""

import json

import numpy
import pytest

import fathom
from conftest import same_bits
from test_same_bits import write_pfm

IMAGES, OF_PROGRAM = 300, 40  # of each operation; the C++ tests have thousands
KEYS = {"perspective": {"fov_y_deg": 60, "near": 0.1, "far": 100}, "encoding": "view-z"}
LENS = {"focus": 2.4, "f_stop": 0.1, "sensor_mm": 36, "max_coc_px": 40}
LENS_OPTIONS = ["--focus", 2.4, "--f-stop", 0.1, "--sensor-mm", 36, "--max-coc-px", 40]
ROUNDING = 2.0**-18  # of the largest number that a mean is made of
OF_NORMALS = 2.0**-22
QUALITIES = ("fast", "balanced", "accurate")
RANGES = {
    (operation["name"], result["name"]): (float(result["least"]), float(result["most"]))
    for operation in fathom.options()
    for result in operation["results"]
}
MASKS = [name for operation, name in RANGES if operation == "dof_masks" and name != "coc"]
CALLS = {
    "normals": lambda d, c, color, quality: {"result": fathom.normals(d, c)},
    "ssao": lambda d, c, color, quality: vars_of(
        fathom.ssao(d, c, radius=0.5, quality=quality, bent_normal=True, confidence=True),
        ["visibility", "bent_normal", "confidence"],
    ),
    "dof_masks": lambda d, c, color, quality: vars_of(
        fathom.dof_masks(d, c, **LENS, **dict.fromkeys(MASKS, True)), MASKS
    ),
    "dof": lambda d, c, color, quality: {"result": fathom.dof(d, c, color, **LENS, quality=quality)},
    "fog": lambda d, c, color, quality: {"result": fathom.fog(d, c, color, 0.3)},
}


def vars_of(results, names):
    return {name: getattr(results, name) for name in names}


def random_image(random):
    """Depth with steps, hair, noise and pixels without one, and a picture of lamps."""
    height, width = random.integers(1, 24), random.integers(1, 40)
    depth = numpy.full((height, width), random.uniform(0.5, 9), numpy.float32)
    depth[:, random.integers(0, width) :] = random.uniform(0.5, 9)
    depth[random.random(depth.shape) < random.choice([0, 0.1, 1])] = random.uniform(0.5, 9)
    depth[random.random(depth.shape) < 0.05] = random.choice([numpy.nan, numpy.inf, -1, 0])
    color = random.random((height, width, 3), numpy.float32)
    color[random.random(depth.shape) < 0.05] = random.choice([0, 1, 400, 65504])
    return depth, color


def check(operation, name, result, color):
    least, most = RANGES[operation, name]
    known = result[~numpy.isnan(result)]
    if operation == "dof":
        least, most = color.min(), color.max()
    elif operation == "fog":
        least, most = numpy.minimum(color, [0.5, 0.6, 0.7]), numpy.maximum(color, [0.5, 0.6, 0.7])
        known = result
    if operation in ("dof", "fog"):
        slack = ROUNDING * numpy.maximum(numpy.abs(least), numpy.abs(most))
    else:
        slack = OF_NORMALS if name == "bent_normal" or operation == "normals" else 0
    least, most = least - slack, most + slack
    assert numpy.all((known >= least) & (known <= most)), (operation, name)
    if name == "bent_normal" or operation == "normals":
        lengths = numpy.linalg.norm(result.astype(float), axis=-1)
        assert numpy.all(numpy.isnan(lengths) | (lengths == 0) | (numpy.abs(lengths - 1) < 1e-5)), (operation, name)


@pytest.mark.parametrize("operation", CALLS)
def test_results_stay_in_their_ranges(operation):
    random = numpy.random.default_rng(1)
    for number in range(IMAGES):
        depth, color = random_image(random)
        camera = fathom.Camera(**KEYS, width=depth.shape[1], height=depth.shape[0])
        results = CALLS[operation](depth, camera, color, QUALITIES[number % 3])
        for name, result in results.items():
            check(operation, name, numpy.asarray(result), color)


@pytest.mark.parametrize(
    "operation, options", [("dof", [*LENS_OPTIONS, "--quality", "balanced"]), ("fog", ["--density", 0.3])]
)
def test_results_of_the_program_stay_in_their_ranges(tmp_path, program, operation, options):
    random = numpy.random.default_rng(2)
    images = [random_image(random) for _ in range(OF_PROGRAM)]
    (tmp_path / "camera.json").write_text(json.dumps(KEYS))
    for number, (depth, color) in enumerate(images):
        numpy.save(tmp_path / f"d.{number:04}.npy", depth)
        write_pfm(tmp_path / f"c.{number:04}.pfm", color)
    frames = [tmp_path / "d.####.npy", "--color", tmp_path / "c.####.pfm", "-o", tmp_path / "r.####.npy"]
    program(operation, *frames, "--camera", tmp_path / "camera.json", *options)
    for number, (depth, color) in enumerate(images):
        result = numpy.load(tmp_path / f"r.{number:04}.npy")
        check(operation, "result", result, color)
        camera = fathom.Camera(**KEYS, width=depth.shape[1], height=depth.shape[0])
        assert same_bits(result, CALLS[operation](depth, camera, color, "balanced")["result"])
