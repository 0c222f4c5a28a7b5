"""Python gives the bits of the program, for every operation and every storage."""

import json

import numpy
import pytest

import fathom
from conftest import same_bits

PIL_Image = pytest.importorskip("PIL.Image")


def in_24_bits(metres):
    return numpy.rint(metres / 10 * 0xFFFFFF).astype(numpy.uint32)


def bytes_of(codes):
    """R, G, B with the lowest byte first."""
    return numpy.stack([codes >> shift & 255 for shift in (0, 8, 16)], axis=-1).astype(numpy.uint8)


PER_CODE = 10 / 0xFFFFFF

# Storage by name: the array, keys of the camera file, the file's extension.
STORAGES = {
    "float32": (lambda z: z.astype(numpy.float32), {}, ".npy"),
    "float16": (lambda z: z.astype(numpy.float16), {}, ".npy"),
    "uint16": (lambda z: numpy.rint(z * 1000).astype(numpy.uint16), {"scale": 0.001, "missing": 0}, ".npy"),
    "uint16-png": (lambda z: numpy.rint(z * 1000).astype(numpy.uint16), {"scale": 0.001, "missing": 0}, ".png"),
    "uint24": (in_24_bits, {"scale": PER_CODE}, ".npy"),
    "uint24-high": (lambda z: in_24_bits(z) << 8, {"scale": PER_CODE, "packing": "uint24-high"}, ".npy"),
    "uint8": (lambda z: numpy.rint(z * 25).astype(numpy.uint8), {"scale": 0.04, "packing": "uint8"}, ".png"),
    "rgb-low-first": (lambda z: bytes_of(in_24_bits(z)), {"scale": PER_CODE, "packing": "rgb-low-first"}, ".png"),
    "rgb-high-first": (
        lambda z: bytes_of(in_24_bits(z))[..., ::-1].copy(),
        {"scale": PER_CODE, "packing": "rgb-high-first"},
        ".png",
    ),
}

LENS = {"focus": 2.4, "f_stop": 0.1, "sensor_mm": 36}  # circles of up to 5 pixels before and behind the focus
LENS_OPTIONS = ["--focus", 2.4, "--f-stop", 0.1, "--sensor-mm", 36]


def masks(name):
    wanted = {} if name == "coc" else {name: True}
    return lambda depth, camera, color: getattr(fathom.dof_masks(depth, camera, **LENS, **wanted), name)


# Operation by name: the program's arguments, and the same call.
OPERATIONS = {
    "linearize": (["linearize", "--background", "decode"], lambda d, c, _: fathom.linearize(d, c, background="decode")),
    "ray-distance": (["linearize", "--as", "ray-distance"], lambda d, c, _: fathom.linearize(d, c, as_="ray-distance")),
    "no-mixed-pixels": (["unproject", "--no-mixed-pixels"], lambda d, c, _: fathom.unproject(d, c, no_mixed_pixels=True)),
    "unproject": (
        ["unproject", "--space", "world", "--origin", "1,2,3"],
        lambda d, c, _: fathom.unproject(d, c, space="world", origin=(1, 2, 3)),
    ),
    "normals": (
        ["normals", "--space", "world", "--method", "least-squares", "--noise", "0.01"],
        lambda d, c, _: fathom.normals(d, c, space="world", method="least-squares", noise=0.01),
    ),
    "ssao": (
        ["ssao", "--radius", 0.5, "--quality", "fast", "--falloff", 0.25, "--seed", 7],
        lambda d, c, _: fathom.ssao(d, c, radius=0.5, quality="fast", falloff=0.25, seed=7),
    ),
    "ssao-silhouette": (
        ["ssao", "--radius", 0.5, "--thickness", "silhouette", "--slices", 3],
        lambda d, c, _: fathom.ssao(d, c, radius=0.5, thickness="silhouette", slices=3),
    ),
    "ssao-region": (
        ["ssao", "--radius", 0.5, "--region", "10,20,30,25"],
        lambda d, c, _: fathom.ssao(d, c, radius=0.5, region=(10, 20, 30, 25)),
    ),
    "coc": (["dof-masks", "--mask", "coc", *LENS_OPTIONS], masks("coc")),
    "near": (["dof-masks", "--mask", "near", *LENS_OPTIONS], masks("near_weight")),
    "focus": (["dof-masks", "--mask", "focus", *LENS_OPTIONS], masks("focus_weight")),
    "far": (["dof-masks", "--mask", "far", *LENS_OPTIONS], masks("far_weight")),
    "focus-at": (
        ["dof-masks", "--mask", "coc", "--focus-at", "40,30", "--f-stop", 0.1, "--sensor-mm", 36],
        lambda d, c, _: fathom.dof_masks(d, c, focus_at=(40, 30), f_stop=0.1, sensor_mm=36).coc,
    ),
    "focus-along": (
        ["dof-masks", "--mask", "coc", "--focus-along", "4,3,3.5", "--f-stop", 0.1, "--sensor-mm", 36],
        lambda d, c, _: fathom.dof_masks(d, c, focus_along=(4, 3, 3.5), f_stop=0.1, sensor_mm=36).coc,
    ),
    "circle": (
        ["dof-masks", "--mask", "coc", "--circle", "8,20"],
        lambda d, c, _: fathom.dof_masks(d, c, circle=(8, 20)).coc,
    ),
    "dof": (
        ["dof", *LENS_OPTIONS, "--aperture", 6, "--rotation-degrees", 15],
        lambda d, c, color: fathom.dof(d, c, color, **LENS, blades=6, rotation_degrees=15),
    ),
    "fog": (
        ["fog", "--density", 0.3, "--fog-color", "0.7,0.5,0.25", "--height-falloff", 0.5, "--up", "0,0,1"],
        lambda d, c, color: fathom.fog(d, c, color, 0.3, fog_color=(0.7, 0.5, 0.25), height_falloff=0.5, up=(0, 0, 1)),
    ),
}


def write_depth(file, depth):
    if file.suffix == ".npy":
        numpy.save(file, depth)
    else:
        PIL_Image.fromarray(depth).save(file)


def write_pfm(file, color):
    height, width, _ = color.shape
    file.write_bytes(b"PF\n%d %d\n-1.0\n" % (width, height) + color[::-1].astype("<f4").tobytes())


def picture(shape):
    y, x = numpy.mgrid[0 : shape[0], 0 : shape[1]].astype(numpy.float32)
    return numpy.stack([x / 96, y / 64, (x.astype(int) // 8 + y.astype(int) // 8) % 2], axis=-1).astype(numpy.float32)


@pytest.fixture
def agrees(tmp_path, program):
    """Does the program make the same of depth, camera and picture in files?"""

    def agrees(got, arguments, depth, keys=None, color=None, extension=".npy"):
        write_depth(tmp_path / ("depth" + extension), depth)
        if keys is not None:
            (tmp_path / "camera.json").write_text(json.dumps(keys))
            arguments = [*arguments, "--camera", tmp_path / "camera.json"]
        if color is not None:
            write_pfm(tmp_path / "color.pfm", color)
            arguments = [*arguments, "--color", tmp_path / "color.pfm"]
        program(*arguments, tmp_path / ("depth" + extension), "-o", tmp_path / "r.npy")
        return same_bits(got, numpy.load(tmp_path / "r.npy"))

    return agrees


@pytest.fixture
def in_metres(keys):
    """The keys for millimetres."""
    return {**keys, "scale": 0.001, "missing": 0}


# Each storage and each operation: how depth is read does not depend on what is made of it.
PAIRS = [(storage, "linearize") for storage in STORAGES] + [
    (list(STORAGES)[i % len(STORAGES)], operation) for i, operation in enumerate(OPERATIONS)
]


@pytest.mark.parametrize("storage, operation", PAIRS)
def test_the_program_gives_the_same_bits(agrees, metres, keys, storage, operation):
    make, more_keys, extension = STORAGES[storage]
    arguments, call = OPERATIONS[operation]
    depth, camera = make(metres), {**keys, **more_keys}
    color = picture(depth.shape)
    got = call(depth, fathom.Camera(**camera), color)
    assert numpy.unique(got[numpy.isfinite(got)]).size >= 2  # a picture of something
    assert agrees(got, arguments, depth, camera, color if arguments[0] in ("dof", "fog") else None, extension)


def test_depth_of_another_size_is_brought_to_the_pictures(agrees, metres, keys):
    depth = metres.astype(numpy.float32)
    color = picture((3 * depth.shape[0], 3 * depth.shape[1]))
    camera = fathom.Camera(**keys)
    at = {"focus_at": (150, 99), "f_stop": 0.1, "sensor_mm": 36}
    for arguments, got in (
        (["fog", "--density", 0.3], fathom.fog(depth, camera, color, 0.3)),
        (["dof", "--circle", "8,20"], fathom.dof(depth, camera, color, circle=(8, 20))),
        (["dof", "--focus-at", "150,99", "--f-stop", 0.1, "--sensor-mm", 36], fathom.dof(depth, camera, color, **at)),
        (["dof-masks", "--mask", "coc", "--circle", "8,20"], fathom.dof_masks(depth, camera, circle=(8, 20), color=color).coc),
    ):
        assert agrees(got, arguments, depth, keys, color)
    on_device = fathom.fog(fathom.Image(depth), camera, fathom.Image(color), 0.3)
    assert same_bits(on_device.numpy(), fathom.fog(depth, camera, color, 0.3))
    with pytest.raises(ValueError, match="same ratio of width to height"):
        fathom.fog(depth, camera, color[:-20], 0.3)


def test_several_results_are_the_programs(tmp_path, agrees, millimetres, kinect, in_metres):
    """Those that are asked for, and None for the others."""
    for command, first, wanted, got in (
        (
            ["ssao", "--radius", 0.4],
            "visibility",
            ["bent_normal", "confidence"],
            lambda more: fathom.ssao(millimetres, kinect, 0.4, **more),
        ),
        (
            ["dof-masks", "--mask", "coc", *LENS_OPTIONS],
            "coc",
            ["max_near_coc", "near_alpha", "disocclusion", "mixed_pixels", "tile_min_coc", "tile_max_coc"],
            lambda more: fathom.dof_masks(millimetres, kinect, **LENS, **more),
        ),
    ):
        options = [part for name in wanted for part in ("--" + name.replace("_", "-"), tmp_path / (name + ".npy"))]
        made = got(dict.fromkeys(wanted, True))
        assert agrees(getattr(made, first), command + options, millimetres, in_metres)
        for name in wanted:
            assert same_bits(getattr(made, name), numpy.load(tmp_path / (name + ".npy")))
        assert [name for name in made._fields if getattr(made, name) is not None] == [first, *wanted]


def test_thicknesses_are_the_programs(tmp_path, agrees, millimetres, kinect, in_metres):
    thickness = numpy.linspace(0, 0.5, millimetres.size, dtype=numpy.float32).reshape(millimetres.shape)
    numpy.save(tmp_path / "t.npy", thickness)
    got = fathom.ssao(millimetres, kinect, 0.4, thickness=thickness)
    assert agrees(got, ["ssao", "--radius", 0.4, "--thickness-map", tmp_path / "t.npy"], millimetres, in_metres)
    constant = fathom.ssao(millimetres, kinect, 0.4, thickness=numpy.float32(0.25))  # a number of NumPy's is a number
    assert same_bits(constant, fathom.ssao(millimetres, kinect, 0.4, thickness=0.25))
    hollow = fathom.ssao(millimetres, kinect, 0.4, thickness=fathom.BackDepth(millimetres))  # as deep as a thickness of 0
    assert numpy.nanmax(numpy.abs(hollow - fathom.ssao(millimetres, kinect, 0.4, thickness=0))) < 0.01
    assert numpy.nanmean(hollow) > numpy.nanmean(fathom.ssao(millimetres, kinect, 0.4, thickness=float("inf")))


def test_repaired_depth_blurs_as_the_program_does(agrees, millimetres, kinect, in_metres):
    color, image = picture(millimetres.shape), fathom.Image(millimetres)
    for repair, name, repaired, there in (
        (["--invalid", "fill"], {"invalid": "fill"}, fathom.fill_invalid(millimetres, kinect), fathom.fill_invalid(image, kinect)),
        (
            ["--grow-foreground", "2"],
            {"grow_foreground": 2},
            fathom.grow_foreground(millimetres, kinect, 2),
            fathom.grow_foreground(image, kinect, 2),
        ),
    ):
        got = fathom.dof(repaired, kinect, color, **LENS)
        assert repaired.dtype == millimetres.dtype and not same_bits(repaired, millimetres)
        assert same_bits(there.numpy(), repaired)
        assert agrees(got, ["dof", *LENS_OPTIONS, *repair], millimetres, in_metres, color)
        assert same_bits(got, fathom.dof(millimetres, kinect, color, **LENS, **name))
    filled = fathom.fill_invalid(millimetres, kinect)
    assert filled[0, 0] == millimetres[0, 6] and (millimetres[0, :6] == 0).all() and (filled > 0).all()
    assert same_bits(fathom.grow_foreground(millimetres, kinect, pixels=0), millimetres)
    with pytest.raises(ValueError, match="17"):
        fathom.grow_foreground(millimetres, kinect, 17)


def test_soft_edges_become_hard_as_in_the_program(agrees, millimetres, kinect, in_metres):
    y, x = numpy.indices(millimetres.shape)
    hard = numpy.where(numpy.hypot(x - 30, y - 20) < 12, 1000.0, 3000.0)
    soft = sum(numpy.roll(hard, (i, k), (0, 1)) for i in range(-2, 3) for k in range(-2, 3)) / 25
    soft = numpy.rint(soft).astype(millimetres.dtype)
    color = picture(millimetres.shape)
    got = fathom.linearize(soft, kinect, edges="sharpen")
    assert not same_bits(got, fathom.linearize(soft, kinect, edges="keep"))
    assert agrees(got, ["linearize", "--edges", "sharpen"], soft, in_metres)
    blurred = fathom.dof(soft, kinect, color, **LENS, edges="sharpen")
    assert agrees(blurred, ["dof", *LENS_OPTIONS, "--edges", "sharpen"], soft, in_metres, color)
    with pytest.raises(ValueError, match="keep or sharpen"):
        fathom.linearize(soft, kinect, edges="hard")


def test_results_of_a_larger_frame_are_means_as_in_the_program(agrees, millimetres, kinect, in_metres):
    color = picture(millimetres.shape)
    keys = {key: value for key, value in in_metres.items() if key not in ("width", "height")}
    small = fathom.Camera(**keys)
    for name, given, options in (
        ("dof", LENS, LENS_OPTIONS),
        ("ssao", {"radius": 0.5}, ["--radius", "0.5"]),
        ("fog", {"density": 0.1}, ["--density", "0.1"]),
    ):
        images = () if name == "ssao" else (color,)
        got = getattr(fathom, name)(millimetres, small, *images, **given, supersampled=2)
        assert got.shape[:2] == (millimetres.shape[0] // 2, millimetres.shape[1] // 2)
        assert agrees(got, [name, *options, "--supersampled", "2"], millimetres, keys, *images)
        out = numpy.empty_like(got)
        getattr(fathom, name)(millimetres, small, *images, **given, supersampled=2, out=out)
        assert same_bits(out, got)
    for wrong in (5, 0, 1.5, "2"):
        with pytest.raises(ValueError, match="whole number from 1 to 4"):
            fathom.ssao(millimetres, small, 0.5, supersampled=wrong)
    with pytest.raises(ValueError, match="makes no whole number"):
        fathom.ssao(millimetres[:-1], small, 0.5, supersampled=2)


def test_ranges_undo_the_scale_and_offset_of_each_frame():
    random = numpy.random.default_rng(5)
    depth = relative_depth("float32")
    scales, offsets = random.uniform(0.5, 2, 9), random.uniform(-3, 3, 9)
    shot = [(a * depth + b).astype(numpy.float32) for a, b in zip(scales, offsets)]
    ranges = fathom.steady_ranges(shot)
    assert ranges.shape == (9, 2)
    steady = [(frame - least) / (most - least) for frame, (least, most) in zip(shot, ranges)]
    assert numpy.nanmax(numpy.std(steady, axis=0)) < 1e-5
    with pytest.raises(ValueError, match="all values are the same"):
        fathom.steady_ranges([numpy.ones((4, 5), numpy.float32)])


def relative_depth(kind, height=64, width=96):
    """As a network gives it, high for what is near: a slope with a disc before it."""
    y, x = numpy.mgrid[0:height, 0:width] / (height / 64)
    values = 0.1 + 0.004 * x + 0.5 * (numpy.hypot(x - 50, y - 30) < 16)
    if kind == "float32":  # of any range, and with holes
        values = (values * 40 - 7).astype(numpy.float32)
        values[3:6, 5:9] = numpy.nan
        return values
    return numpy.rint(values * numpy.iinfo(kind).max).astype(kind)


@pytest.mark.parametrize("kind, scale", [("uint8", 3), ("uint16", 1), ("float32", 3)])
def test_relative_depth_is_blurred_as_by_the_program(tmp_path, agrees, kind, scale):
    """Its steps, its range, and its size."""
    depth = relative_depth(kind)
    color = picture((scale * depth.shape[0], scale * depth.shape[1]))
    at = (50 * scale, 30 * scale)
    ignored = numpy.zeros(depth.shape, numpy.uint8)
    ignored[40:50, 60:90] = 1
    PIL_Image.fromarray(ignored).save(tmp_path / "ignored.png")
    high = {"relative": "high-is-near", "blur_px": 11}
    common, focus = ["--relative", "high-is-near", "--blur-px", 11], ["--focus-at", "%d,%d" % at]
    made = []
    for arguments, got, picture_of in (
        (["dof", *common, *focus], fathom.dof(depth, None, color, **high, focus_at=at), color),
        (
            ["dof", *common, *focus, "--grow-foreground", 0, "--invalid", "fill", "--ignore", tmp_path / "ignored.png"],
            fathom.dof(depth, None, color, **high, focus_at=at, grow_foreground=0, invalid="fill", ignore=ignored),
            color,
        ),
        (
            ["dof", *common, "--focus-range", "0.2,0.4", "--aperture", 6],
            fathom.dof(depth, None, color, **high, focus_range=(0.2, 0.4), blades=6),
            color,
        ),
        (
            ["dof", "--relative", "low-is-near", "--blur-px", 7, "--relative-range", "2,200", *focus],
            fathom.dof(depth, None, color, relative="low-is-near", blur_px=7, relative_range=(2, 200), focus_at=at),
            color,
        ),
        (
            ["dof-masks", "--mask", "coc", *common, *focus],
            fathom.dof_masks(depth, None, **high, focus_at=at, color=color).coc,
            color,
        ),
        (
            ["dof-masks", "--mask", "near", *common, "--focus-range", "0,0.3"],
            fathom.dof_masks(depth, None, **high, focus_range=(0, 0.3), near_weight=True).near_weight,
            None,
        ),
    ):
        assert agrees(got, arguments, depth, None, picture_of, ".npy" if kind == "float32" else ".png"), arguments
        assert not any(got.shape == other.shape and same_bits(got, other) for other in made)
        made.append(got)
    on_device = fathom.dof(fathom.Image(depth), None, fathom.Image(color), **high, focus_at=at)
    assert same_bits(on_device.numpy(), made[0])
    if kind == "uint8":
        grey = numpy.repeat(depth[..., None], 3, axis=-1)
        assert same_bits(fathom.dof(grey, None, color, **high, focus_at=at), made[0])


def test_what_is_wrong_with_relative_depth_is_refused(metres, keys):
    depth, camera = relative_depth("uint8"), fathom.Camera(**keys)
    color = picture(depth.shape)
    blur = {"relative": "high-is-near", "blur_px": 9, "focus_at": (50, 30)}
    assert numpy.array_equal(fathom.dof(depth, None, color, **{**blur, "blur_px": 0}), color)
    for wrong, given in (
        ("camera: relative depth has none", {"camera": camera}),
        ("storage: relative depth has none", {"storage": "uint8"}),
        ("blur_px: missing", {"blur_px": None}),
        ("focus_at: missing", {"focus_at": None}),
        ("exclude each other", {"f_stop": 2}),
        ("exclude each other", {"clean_plate": color, "clean_plate_depth": depth}),
        ("outside|within", {"focus_at": (400, 4)}),
        ("depth: has no value that is a number", {"ignore": numpy.ones_like(depth)}),
        ("depth: has colours, as at pixel", {"depth": (color * 255).astype(numpy.uint8)}),
        ("same ratio of width to height", {"color": color[:-20]}),
        ("depth: .* the dtype uint32; it must be .* of float32, float16, uint16 or uint8, as", {"depth": depth.astype(numpy.uint32)}),
        ("ignore: its shape", {"ignore": color}),
    ):
        with pytest.raises(ValueError, match=wrong):
            fathom.dof(**{"depth": depth, "camera": None, "color": color, **blur, **given})
    with pytest.raises(TypeError, match="camera = None must be a fathom.Camera, .* None is for relative depth"):
        fathom.dof(depth, None, color, circle=(3, 1))
    for one in (numpy.full_like(depth, 9), numpy.full(depth.shape, 3, numpy.float32)):  # as after a fade to black
        with pytest.warns(fathom.CameraWarning, match="all its values are the same"):
            assert same_bits(fathom.dof(one, None, color, **blur), color)
    with pytest.warns(fathom.CameraWarning, match="relative_range which codes are nearest"):
        fathom.dof(depth // 32 + 3, None, color, **{**blur, "relative": "low-is-near"})


@pytest.mark.parametrize("operation", ["dof", "fog"])
@pytest.mark.parametrize("dtype", [numpy.float16, numpy.uint16, numpy.uint8])
def test_pictures_are_the_programs(tmp_path, program, metres, keys, dtype, operation):
    """The program reads and writes integers as PNG. It has halves as floats, which NumPy rounds."""
    png = pytest.importorskip("png")
    depth = metres.astype(numpy.float32)
    color = picture(depth.shape)
    integers = dtype != numpy.float16
    stored = numpy.rint(color * numpy.iinfo(dtype).max).astype(dtype) if integers else color.astype(dtype)
    (tmp_path / "camera.json").write_text(json.dumps(keys))
    numpy.save(tmp_path / "depth.npy", depth)
    file, result = (tmp_path / (name + (".png" if integers else ".npy")) for name in ("color", "result"))
    height, width, channels = stored.shape
    if integers:
        png.from_array(stored.reshape(height, -1), f"RGB;{8 * stored.itemsize}").save(file)
    else:
        numpy.save(file, stored)
    arguments, call = OPERATIONS[operation]
    program(
        *(*arguments, "--color", file, "--color-space", "linear", tmp_path / "depth.npy"),
        *("--camera", tmp_path / "camera.json", "-o", result),
    )
    if integers:
        rows = png.Reader(str(result)).read()[2]
        expected = numpy.vstack([numpy.frombuffer(row, dtype) for row in rows]).reshape(height, width, channels)
    else:
        expected = numpy.load(result).astype(dtype)
    got = call(depth, fathom.Camera(**keys), stored)
    assert got.dtype == dtype and not same_bits(got, stored)
    assert same_bits(got, expected)
