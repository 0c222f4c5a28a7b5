"""The snippets of docs/python.md and of the README run, and so do the examples."""

import json
import pathlib
import re
import subprocess
import sys

import numpy
import pytest

import fathom

ROOT = pathlib.Path(__file__).parents[2]
PAGE = (ROOT / "docs/python.md").read_text()
EXAMPLES = ROOT / "examples/python"


def test_the_snippets_of_the_page_run_one_after_the_other():
    snippets = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(snippets) >= 6
    names = {}
    for snippet in snippets:
        exec(compile(snippet, "docs/python.md", "exec"), names)
    assert abs(names["n"].numpy()[240, 320] - [0, 0, -1]).max() < 1e-6


def test_integer_depth_goes_on_from_the_stored_depth():
    """Why the page does not pass the distances of integers on: a tilted plane in millimetres, 2 to 3 m away."""
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    y, x = numpy.mgrid[0:480, 0:640]
    truth = numpy.array([0.3, 0.1, -1]) / numpy.linalg.norm([0.3, 0.1, -1])
    rays = numpy.stack([(x - 319.5) / 525, (y - 239.5) / 525, numpy.ones(x.shape)], axis=-1)
    depth = numpy.rint(2500 * truth[2] / (rays @ truth)).astype(numpy.uint16)

    def mean_error(normals):
        return numpy.degrees(numpy.arccos(numpy.clip(normals[8:-8, 8:-8] @ truth, -1, 1))).mean()

    stored = mean_error(fathom.normals(depth, camera))
    passed_on = mean_error(fathom.normals(fathom.linearize(depth, camera), camera.for_view_depth()))
    print(f"normals of millimetres: mean error {stored:.2f} degrees, through distances {passed_on:.2f} degrees")
    assert stored < passed_on / 3


def test_the_snippet_of_the_readme_runs():
    (snippet,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    names = {}
    exec(compile(snippet, "README.md", "exec"), names)
    assert names["points"].shape == (480, 640, 3) and abs(names["points"][240, 320, 2] - 1.5) < 1e-6


def test_every_function_is_documented_and_typed():
    files = [pathlib.Path(fathom.__file__).with_name(name) for name in ("_camera.py", "_fathom.pyi", "_more.py", "_operations.pyi")]
    assert pathlib.Path(fathom.__file__).with_name("py.typed").exists()
    for file in files:
        compile(file.read_text(), file.name, "exec")
    stubs = "\n".join(file.read_text() for file in files)
    for name in fathom.__all__:
        assert getattr(fathom, name).__doc__, name
        assert re.search(rf"^(def|class) {name}\b", stubs, re.MULTILINE) or name == "__version__", name
    for operation in ("linearize", "unproject", "normals", "ssao", "dof_masks", "dof", "fog"):
        text = getattr(fathom, operation).__doc__
        assert "Returns" in text and "Raises ValueError" in text and "@" not in text


def example(name, *arguments, cwd):
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name), *map(str, arguments)], cwd=cwd, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_every_example_is_run_here_and_linked():
    names = {file.name for file in EXAMPLES.glob("*.py")}
    assert names == {
        "window_buffer.py",
        "kinect.py",
        "occlusion_and_bokeh.py",
        "rays_of_a_lens.py",
        "vapoursynth_blur.py",
        "dask_frames.py",
    }
    for name in names:
        assert f"../examples/python/{name}" in PAGE


def test_window_buffer(tmp_path):
    said = example("window_buffer.py", cwd=tmp_path)
    points = numpy.load(tmp_path / "points.npy")
    assert points.shape == (240, 320, 3) and "2.0000" in said


def test_kinect(tmp_path):
    pytest.importorskip("PIL")
    said = example("kinect.py", ROOT / "tests/kinect.png", cwd=tmp_path)
    assert re.search(r"the middle lies at \[.*\] m, its normal is \[.*\]", said)


def test_rays_of_a_lens(tmp_path):
    """Mei's model without its sphere and its distortion is a pinhole, and with them its own projection finds each pixel again."""
    size = {"width": 60, "height": 40, "encoding": "view-z", "view_axes": "opencv"}

    def camera(*numbers):
        example("rays_of_a_lens.py", 60, 40, *numbers, "rays.npy", cwd=tmp_path)
        (tmp_path / "camera.json").write_text(json.dumps({**size, "lens": {"rays": "rays.npy"}}))
        return fathom.Camera.load(tmp_path / "camera.json")

    z = numpy.full((40, 60), 2, numpy.float32)
    pinhole = fathom.Camera(**size, fx=50, fy=51, cx=29, cy=20, pixel_origin="centre")
    assert numpy.allclose(fathom.unproject(z, camera(50, 51, 29, 20, 0, 0, 0, 0, 0)), fathom.unproject(z, pinhole), atol=1e-6)

    xi, k1, k2, p1, p2 = 0.9, -0.1, 0.02, 1e-3, -2e-3
    p = fathom.unproject(z, camera(80, 80, 29, 20, xi, k1, k2, p1, p2)).astype(float)
    x, y = (p[..., i] / (p[..., 2] + xi * numpy.linalg.norm(p, axis=-1)) for i in range(2))
    r = x * x + y * y
    u = x * (1 + k1 * r + k2 * r**2) + 2 * p1 * x * y + p2 * (r + 2 * x * x)
    v = y * (1 + k1 * r + k2 * r**2) + p1 * (r + 2 * y * y) + 2 * p2 * x * y
    row, column = numpy.mgrid[:40, :60]
    assert numpy.abs(u * 80 + 29 - column).max() < 1e-4 and numpy.abs(v * 80 + 20 - row).max() < 1e-4


def test_occlusion_and_bokeh(tmp_path):
    pytest.importorskip("matplotlib")
    example("occlusion_and_bokeh.py", "picture.png", cwd=tmp_path)
    assert (tmp_path / "picture.png").read_bytes().startswith(b"\x89PNG")


def test_vapoursynth_blur(tmp_path, monkeypatch):
    """Frames have the bits of the call, whatever their order."""
    vs = pytest.importorskip("vapoursynth")
    said = example("vapoursynth_blur.py", cwd=tmp_path)
    red = [float(number) for number in re.findall(r"\d\.\d+", said)]
    assert red[0] == pytest.approx(0.9) and red[-1] == pytest.approx(0.1) and red == sorted(red, reverse=True)
    assert len({round(value, 3) for value in red}) > 3  # a soft edge
    monkeypatch.syspath_prepend(EXAMPLES)
    from vapoursynth_blur import blur

    y, x = numpy.mgrid[:48, :80].astype(numpy.float32)
    depths = [numpy.where(numpy.hypot(x - 20 - 9 * n, y - 24) < 12, 2, 5 + 0.01 * x).astype(numpy.float32) for n in range(5)]
    lights = [numpy.stack([x / 80, y / 48, (x + n) % 8 / 8], axis=-1) for n in range(5)]

    def clip(kind, frames):
        def filled(n, f):
            made = f.copy()
            for plane in range(made.format.num_planes):
                numpy.copyto(numpy.asarray(made[plane]), frames[n].reshape(48, 80, -1)[..., plane])
            return made

        blank = vs.core.std.BlankClip(format=kind, width=80, height=48, length=len(frames), keep=True)
        return blank.std.ModifyFrame(blank, filled)

    camera = fathom.Camera(fov_y_deg=50, encoding="view-z")
    options = {"focus": 2, "f_stop": 0.05, "sensor_mm": 36}
    blurred = blur(clip(vs.RGBS, lights), clip(vs.GRAYS, depths), camera, **options)
    for n in (3, 0, 4, 1, 2):
        frame = blurred.get_frame(n)
        got = numpy.stack([numpy.asarray(frame[plane]) for plane in range(3)], axis=-1)
        expected = fathom.dof(depths[n], camera, lights[n], **options)
        assert numpy.array_equal(got, expected) and not numpy.array_equal(got, lights[n])

    # Relative floats count from 0 to 1 in every frame, as VapourSynth's do, or by a range that is given.
    relative = {"relative": "low-is-near", "blur_px": 6, "focus_at": (4, 4)}
    fractions = [depth / 8 for depth in depths]
    for frames, given, ends in ((fractions, {}, (0, 1)), (depths, {"relative_range": (1, 8)}, (1, 8))):
        made = blur(clip(vs.RGBS, lights), clip(vs.GRAYS, frames), **relative, **given).get_frame(1)
        got = numpy.stack([numpy.asarray(made[plane]) for plane in range(3)], axis=-1)
        assert numpy.array_equal(got, fathom.dof(frames[1], None, lights[1], **relative, relative_range=ends))
    with pytest.raises(vs.Error, match="frame 1: its depth goes from 2.0 to .*; give relative_range"):
        blur(clip(vs.RGBS, lights), clip(vs.GRAYS, depths), **relative).get_frame(1)
    with pytest.raises(ValueError, match="must be RGBS"):
        blur(clip(vs.GRAYS, depths), clip(vs.GRAYS, depths), camera)


def test_dask_frames(tmp_path):
    """Processes that are spawned give the bits of this one."""
    pytest.importorskip("distributed")
    y, x = numpy.mgrid[:480, :640]
    files = []
    for n in range(4):
        depth = numpy.where(numpy.hypot(x - 200 - 60 * n, y - 240) < 90, 1850, 2000 + x // 8).astype(numpy.uint16)
        files.append(tmp_path / f"frame{n}.npy")
        numpy.save(files[-1], depth)
    for wrong in ([], ["here", tmp_path, *files], [0, tmp_path, *files]):
        done = subprocess.run([sys.executable, EXAMPLES / "dask_frames.py", *map(str, wrong)], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (1, "usage: dask_frames.py WORKERS FOLDER DEPTH.npy...\n")
    said = example("dask_frames.py", 2, tmp_path, *files, cwd=tmp_path)
    assert sorted(said.split()) == [str(file.with_suffix(".ao.npy")) for file in files]
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    for file in files:
        got, expected = numpy.load(file.with_suffix(".ao.npy")), fathom.ssao(numpy.load(file), camera, radius=0.3)
        assert got.min() < 0.9 and numpy.array_equal(got, expected, equal_nan=True)
