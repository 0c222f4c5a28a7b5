"""What a type checker and help() know about the package."""

import inspect
import pathlib
import re
import subprocess
import sys

import numpy
import pytest

import fathom

ROOT = pathlib.Path(__file__).parents[2]
PACKAGE = pathlib.Path(fathom.__file__).parent
OPERATIONS = ("linearize", "unproject", "normals", "ssao", "dof_masks", "dof", "fog", "fill_invalid", "grow_foreground")


@pytest.fixture(scope="module")
def checked(tmp_path_factory):
    """What mypy says."""
    pytest.importorskip("mypy")
    cache = tmp_path_factory.mktemp("mypy")

    def check(*arguments):
        command = [
            sys.executable,
            "-m",
            "mypy",
            "--ignore-missing-imports",
            "--cache-dir",
            str(cache),
            *map(str, arguments),
        ]
        return subprocess.run(command, capture_output=True, text=True).stdout

    return check


def test_the_page_and_the_examples_are_typed(tmp_path, checked):
    page = tmp_path / "page.py"
    page.write_text("\n".join(re.findall(r"```python\n(.*?)```", (ROOT / "docs/python.md").read_text(), re.DOTALL)))
    examples = sorted((ROOT / "examples/python").glob("*.py"))
    assert len(examples) == 6
    for file in (page, *examples):
        said = checked("--allow-redefinition", file)
        assert "Success" in said, said


def test_the_package_is_typed(checked):
    said = checked("-p", "fathom")
    assert "Success" in said, said


def test_types_of_results(tmp_path, checked):
    known = {
        "fathom.linearize(a, c)": "numpy.ndarray",
        "fathom.linearize(i, c)": "fathom._fathom.Image",
        "fathom.linearize(i, c, out=a)": "numpy.ndarray",
        "fathom.fog(memoryview(a), c, a, 0.1)": "numpy.ndarray",
        "fathom.fog(i, c, a, 0.1)": "fathom._fathom.Image",
        "fathom.ssao(a, c)": "numpy.ndarray",
        "fathom.ssao(i, c)": "fathom._fathom.Image",
        "fathom.ssao(a, c, confidence=True)": "fathom._operations.Occlusion[numpy.ndarray",
        "fathom.ssao(i, c, bent_normal=True).visibility": "fathom._fathom.Image",
        "fathom.dof_masks(a, c).coc": "numpy.ndarray",
        "fathom.dof_masks(i, c).tile_min_coc": "fathom._fathom.Image | Any",
        "fathom.fill_invalid(i, c)": "fathom._fathom.Image",
        "fathom.grow_foreground(a, c, 2)": "numpy.ndarray",
        "fathom.depth_at(a, c, 1, 2)": "float",
        "fathom.upsample_along_edges(a, a)": "numpy.ndarray",
        "fathom.ssao(a, c, thickness=fathom.BackDepth(a))": "numpy.ndarray",
        "fathom.ssao(a, c, thickness='silhouette')": "numpy.ndarray",
        "fathom.dof(a, c, a, clean_plate=a, clean_plate_depth=a)": "numpy.ndarray",
        "fathom.ssao(a, c, confidence=bool(a[0, 0]))": "fathom._operations.Occlusion[numpy.ndarray",
        "fathom.dof(a, None, a, relative='high-is-near', blur_px=24, focus_at=(3, 4))": "numpy.ndarray",
        "fathom.fog(a, c, a, 0.1, fog_color=numpy.array([1, 2, 3]))": "numpy.ndarray",
        "fathom.check(a, c, circle=(3, 1), sky='sharp')": "list[str]",
        "fathom.devices()": "fathom._fathom.DeviceInfo]",
        "fathom.presets()": "dict[",
        "fathom.__version__": "str",
    }
    lines = ["import fathom, numpy", "def f(a: numpy.ndarray, i: fathom.Image, c: fathom.Camera) -> None:"]
    (tmp_path / "results.py").write_text("\n".join([*lines, *(f"    reveal_type({call})" for call in known)]))
    said = [line for line in checked(tmp_path / "results.py").splitlines() if "Revealed" in line]
    assert len(said) == len(known)
    for line, (call, wanted) in zip(said, known.items()):
        assert wanted in line, (call, line)


def test_mistakes_are_type_errors(tmp_path, checked):
    calls = (
        "fathom.linearize([[1.0]], c)",
        "fathom.linearize(a, {})",
        "fathom.ssao(a, c, quality='best')",
        "fathom.fog(a, c, a)",
        "fathom.ssao(a, c, thickness='thin')",
    )
    lines = ["import fathom, numpy", "def f(a: numpy.ndarray, c: fathom.Camera) -> None:"]
    (tmp_path / "wrong.py").write_text("\n".join([*lines, *(f"    {call}" for call in calls)]))
    said = checked(tmp_path / "wrong.py")
    for number in range(3, 3 + len(calls)):
        assert re.search(rf"wrong.py:{number}: error", said), (calls[number - 3], said)


def test_signatures_are_those_of_python():
    for name in OPERATIONS:
        function = getattr(fathom, name)
        parameters = inspect.signature(function).parameters
        assert "camera" in parameters and parameters["device"].default is None
        assert function.__module__ == "fathom" and function.__qualname__ == name
        assert not function.__doc__.startswith(name)  # as help() shows the signature already
    assert list(inspect.signature(fathom.preset_camera).parameters) == ["text", "width", "height"]
    assert list(inspect.signature(fathom.dof).parameters)[:3] == ["depth", "camera", "color"]
    assert inspect.signature(fathom.Camera.load).parameters["undistorted"].default is False


def test_fields_are_documented():
    for kind in (fathom.Occlusion, fathom.DofMasks):
        for name in kind._fields:
            text = getattr(kind, name).__doc__
            assert "float32" in text and ("(H, W" in text or "ceil(H / tile_px)" in text)
        stub = (PACKAGE / "_operations.pyi").read_text().partition(f"class {kind.__name__}(")[2].partition("class ")[0]
        assert tuple(re.findall(r"^    (\w+):", stub, re.MULTILINE)) == kind._fields


def test_tiles_have_the_shape_that_is_documented(millimetres, kinect):
    masks = fathom.dof_masks(millimetres, kinect, circle=(4, 4), tile_px=10, tile_min_coc=True, tile_max_coc=True)
    assert (
        masks.tile_min_coc.shape == masks.tile_max_coc.shape == tuple(numpy.ceil(numpy.divide(millimetres.shape, 10)))
    )
