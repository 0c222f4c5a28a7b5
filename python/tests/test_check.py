"""Mistakes about depth are told: all of them by `check`, and once for each camera by the first call."""

import linecache
import time
import warnings

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH


def told(call):
    """The warnings of a call."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        call()
    return said


def test_metres_under_a_preset_of_millimetres(metres):
    depth = metres.astype(numpy.float32)
    keys = {"preset": "kinect", "fx": 90, "fy": 88, "cx": 47.25, "cy": 33.5}
    (doubt,) = fathom.check(depth, fathom.Camera(**keys))
    assert doubt.startswith("its floats times the scale of 0.001 are ") and doubt.endswith('which is "scale": 1')
    with pytest.warns(fathom.CameraWarning, match="^depth: its floats times the scale of 0.001 are .* at most"):
        fathom.linearize(depth, fathom.Camera(**keys))
    assert fathom.check((1000 * metres).astype(numpy.uint16), fathom.Camera(**keys)) == []


def test_depth_of_another_kind_is_judged_again(metres):
    depth = metres.astype(numpy.float32)
    camera = fathom.Camera(encoding="view-z", perspective={"fov_y_deg": 60}, missing=-1)
    assert not told(lambda: fathom.linearize(depth, camera))
    codes = (1000 * metres).astype(numpy.uint16)
    camera = fathom.Camera(encoding="view-z", perspective={"fov_y_deg": 60})
    assert not told(lambda: fathom.linearize(depth, camera))
    (warning,) = told(lambda: fathom.linearize(codes, camera))
    assert "its integers count as scene units" in str(warning.message)
    assert not told(lambda: fathom.linearize(codes + 1, camera))  # which is like it
    for nothing in (numpy.zeros_like(depth), numpy.full_like(depth, numpy.nan)):
        assert not told(lambda: fathom.linearize(depth, camera))
        (warning,) = told(lambda: fathom.linearize(nothing, camera))
        assert "no pixel has a depth" in str(warning.message)


def test_an_image_in_host_memory_is_looked_at_too(metres):
    depth = metres.astype(numpy.float32)
    keys = {"preset": "kinect", "fx": 90, "fy": 88, "cx": 47.25, "cy": 33.5}
    device = fathom.Device("cpu")
    with pytest.warns(fathom.CameraWarning, match="^depth: its floats times the scale of 0.001 are "):
        fathom.linearize(fathom.Image(depth, device=device), fathom.Camera(**keys))


def test_a_radius_and_a_lens_are_taken_as_an_operation_takes_them(metres, keys):
    camera, depth = fathom.Camera(**keys), metres.astype(numpy.float32)
    for radius in (-1, 0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="^radius = ") as of_operation:
            fathom.ssao(depth, camera, radius)
        with pytest.raises(ValueError, match="^radius = ") as of_check:
            fathom.check(depth, camera, radius=radius)
        assert str(of_check.value) == str(of_operation.value)
    lens = {"f_stop": 2, "sensor_mm": 36}
    for wrong in (
        {"focus": 0, **lens},
        {"focus": 2, "circle": (3, 1)},
        {"mm_per_unit": 0},
        {"mm_per_unit": -5},
        {"focus": 3, "focus_at": (3, 3), **lens},
        {"circle": (3, 1), "mm_per_unit": 10},
        {"focus": 3, "focal_length_mm": float("inf"), **lens},
        {"max_coc_px": 0},
    ):
        needed = {} if "focus" in wrong or "circle" in wrong else {"focus": 2, **lens}
        with pytest.raises(ValueError) as of_operation:
            fathom.dof(depth, camera, numpy.ones((HEIGHT, WIDTH, 3), numpy.float32), **needed, **wrong)
        with pytest.raises(ValueError) as of_check:
            fathom.check(depth, camera, **wrong)
        assert str(of_check.value) == str(of_operation.value)
    assert fathom.check(depth, camera, mm_per_unit=None) == []
    (said,) = fathom.check(depth, camera, focus_along=(3, 3, 2.0), mm_per_unit=1000, **lens)
    assert said.startswith("no circle of confusion is a pixel wide")
    under_pixel = fathom.check(depth, camera, focus_at=(WIDTH // 2, HEIGHT // 2), **lens)
    at_depth = fathom.check(depth, camera, focus=float(metres[HEIGHT // 2, WIDTH // 2]), **lens)
    assert under_pixel == at_depth
    assert fathom.check(depth, camera, circle=(3000, 1)) and not fathom.check(depth, camera, circle=(3, 1))
    with pytest.raises(TypeError, match="unexpected keyword argument 'focus_on'"):
        fathom.check(depth, camera, focus_on=2)


def test_what_is_right_is_not_told(metres, millimetres, keys, kinect):
    camera = fathom.Camera(**keys)
    assert fathom.check(metres.astype(numpy.float32), camera) == []
    assert fathom.check(millimetres, kinect) == []
    assert not told(lambda: fathom.linearize(metres.astype(numpy.float32), camera))
    assert not told(lambda: fathom.ssao(millimetres, kinect, radius=0.3, quality="fast"))


def test_the_first_call_warns_and_says_where(millimetres, keys):
    camera = fathom.Camera(**keys)
    assert not told(lambda: fathom.normals(millimetres, camera, ignore=millimetres == 0))  # in which not all pixels count
    (warning,) = told(lambda: fathom.normals(millimetres, camera))
    assert warning.category is fathom.CameraWarning
    begin, end = "its integers count as scene units, so that depths run from ", 'say "scale": 0.001'
    assert str(warning.message).startswith("depth: " + begin) and str(warning.message).endswith(end)
    (doubt,) = fathom.check(millimetres, camera)  # whose range is that of all pixels
    assert doubt.startswith(begin) and doubt.endswith(end)
    assert "fathom.normals(millimetres, camera)" in linecache.getline(warning.filename, warning.lineno)
    assert not told(lambda: fathom.normals(millimetres, camera))
    assert not told(lambda: fathom.linearize(millimetres, camera))
    assert told(lambda: fathom.linearize(millimetres, fathom.Camera(**keys)))


def test_the_filters_of_warnings_decide(millimetres, keys):
    camera = fathom.Camera(**keys)
    out = numpy.full((HEIGHT, WIDTH), 7, numpy.float32)
    with warnings.catch_warnings():
        warnings.simplefilter("error", fathom.CameraWarning)
        with pytest.raises(fathom.CameraWarning):
            fathom.linearize(millimetres, camera, out=out)
    assert (out == 7).all()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("ignore", fathom.CameraWarning)
        fathom.linearize(millimetres, camera, out=out)
    assert not said and (out != 7).any()


def test_check_takes_what_an_operation_takes(metres, millimetres, keys):
    camera = fathom.Camera(**keys)
    (said,) = fathom.check(millimetres, camera)
    assert fathom.check(fathom.Image(millimetres), camera) == [said]
    assert fathom.check(numpy.asfortranarray(millimetres), camera) == [said]
    assert fathom.check(millimetres[::-1], camera) == [said]
    wide = numpy.zeros((HEIGHT, 2 * WIDTH), numpy.uint16)
    wide[:, :WIDTH] = millimetres
    assert fathom.check(wide[:, :WIDTH], camera) == [said]
    picture = numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8)
    for i in range(3):
        picture[..., i] = numpy.add.outer(range(HEIGHT), range(WIDTH)) + i
    (colours,) = fathom.check(picture, fathom.Camera(**keys, scale=1e-5), storage="rgb8-red-low")
    assert colours.startswith("its bytes change like the colours of a picture")
    centred = keys | {"intrinsics": {"fx": 90, "fy": 88, "cx": 47.5, "cy": 31.5}}
    with pytest.warns(fathom.CameraWarning, match="pixel_origin"):
        doubtful = fathom.Camera(**centred)
    assert [doubt for doubt in fathom.check(millimetres, doubtful) if "pixel_origin" in doubt]
    with pytest.raises(fathom.Error, match="is for 96 x 64 pixels, the image has 96 x 60"):
        fathom.check(millimetres[:60], camera)
    with pytest.raises(ValueError, match="depth: .* the dtype float64"):
        fathom.check(metres, camera)


@pytest.mark.parametrize("dtype", [numpy.float32, numpy.uint16])
def test_a_first_call_takes_a_millisecond_more_at_most(dtype):
    """1080p, linearize, with `out`. New cameras and one that is known, in turns; medians are compared."""
    depth = 1 / numpy.linspace(1 / 2, 1 / 9, 1920 * 1080).reshape(1080, 1920)  # a plane
    depth = depth.astype(dtype) if dtype == numpy.float32 else numpy.rint(1000 * depth).astype(dtype)
    keys = {"fov_y_deg": 60, "encoding": "view-z", "scale": 1 if dtype == numpy.float32 else 0.001}
    known, out, device = fathom.Camera(**keys), numpy.empty((1080, 1920), numpy.float32), fathom.Device()
    fathom.linearize(depth, known, out=out, device=device)

    def seconds(camera):
        start = time.thread_time()
        fathom.linearize(depth, camera, out=out, device=device)
        return time.thread_time() - start

    first, later = zip(*((seconds(fathom.Camera(**keys)), seconds(known)) for _ in range(100)))
    more = numpy.median(first) - numpy.median(later)
    print(f"the first call with a camera, 1080p, {numpy.dtype(dtype)}: {1e6 * more:+.0f} us of the calling thread")
    assert more <= 1e-3

