"""Bad input gets one clear exception, and nothing is written."""

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH


def test_exceptions_are_what_python_expects():
    assert issubclass(fathom.Error, RuntimeError) and issubclass(fathom.NoDevice, fathom.Error)
    assert fathom.Error.__module__ == "fathom"


DEPTHS = {
    "float64": (lambda d: d.astype(float), r"depth: its dtype is float64; it must be float32.*astype\(numpy.float32\)"),
    "int16": (lambda d: d.astype(numpy.int16), "depth: its dtype is int16"),
    "int64": (lambda d: d.astype(numpy.int64), "depth: its dtype is int64"),
    "bool": (lambda d: d > 0, "depth: its dtype is bool"),
    "complex": (lambda d: d.astype(numpy.complex64), "depth: its dtype is complex64"),
    "text": (lambda d: d.astype(str), "depth: its dtype is <U5"),
    "objects": (lambda d: d.astype(object), "depth: its dtype is object"),
    "no rows": (lambda d: d[:0], r"depth: its shape is \(0, 96\); every side must be at least 1"),
    "no columns": (lambda d: d[:, :0], r"depth: its shape is \(64, 0\)"),
    "no channels": (lambda d: d[..., None][..., :0], r"depth: its shape is \(64, 96, 0\)"),
    "one dimension": (lambda d: d.ravel(), r"depth: its shape is \(6144,\); it must be \(height, width\)"),
    "four dimensions": (lambda d: d[None, ..., None], "depth: its shape is"),
    "two channels": (lambda d: numpy.stack([d, d], -1), "depth: it holds uint16 in 2 channels; depth has one channel"),
    "bytes": (lambda d: (d >> 8).astype(numpy.uint8), "depth: it holds uint8, which may be a picture; .*storage='uint8'"),
    "a picture": (lambda d: numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8), "'bgr8-red-low'"),
    "a list": (lambda d: d.tolist(), "depth: a list is no array"),
    "nothing": (lambda d: None, "depth"),
}


@pytest.mark.parametrize("kind", DEPTHS)
def test_depth_of_no_use(millimetres, kinect, kind):
    make, message = DEPTHS[kind]
    out = numpy.full((HEIGHT, WIDTH), 7, numpy.float32)
    with pytest.raises((ValueError, TypeError), match=message):
        fathom.linearize(make(millimetres), kinect, out=out)
    assert (out == 7).all()


def test_an_image_of_another_size(millimetres, kinect):
    with pytest.raises(fathom.Error, match="is for 96 x 64 pixels, the image has 96 x 60"):
        fathom.linearize(millimetres[:60], kinect)


def read_only(a):
    a.flags.writeable = False
    return a


OUTS = {
    "float64": (lambda: numpy.full((HEIGHT, WIDTH), 7.0), "out: its dtype is float64; it must be float32"),
    "too small": (lambda: numpy.full((HEIGHT - 1, WIDTH), 7, numpy.float32), r"out: its shape is \(63, 96\); it must be \(64, 96\)"),
    "three channels": (lambda: numpy.full((HEIGHT, WIDTH, 3), 7, numpy.float32), r"out: its shape is \(64, 96, 3\)"),
    "gaps": (lambda: numpy.full((HEIGHT, 2 * WIDTH), 7, numpy.float32)[:, ::2], "out: has gaps between its columns"),
    "backwards": (lambda: numpy.full((HEIGHT, WIDTH), 7, numpy.float32)[::-1], "out: has gaps .* go backwards"),
    "columns first": (lambda: numpy.full((WIDTH, HEIGHT), 7, numpy.float32).T, "out: has gaps"),
    "read-only": (lambda: read_only(numpy.full((HEIGHT, WIDTH), 7, numpy.float32)), "out: is read-only"),
    "overlapping rows": (
        lambda: numpy.lib.stride_tricks.as_strided(numpy.full(9999, 7, numpy.float32), (HEIGHT, WIDTH), (40, 4)),
        "out: has gaps",
    ),
}


@pytest.mark.parametrize("kind", OUTS)
def test_an_out_that_does_not_fit(millimetres, kinect, kind):
    make, message = OUTS[kind]
    out = make()
    with pytest.raises(ValueError, match=message):
        fathom.linearize(millimetres, kinect, out=out)
    assert (out == 7).all()


def test_an_out_over_an_input(metres, keys):
    whole = numpy.zeros((HEIGHT + 1, WIDTH), numpy.float32)
    whole[1:] = metres
    with pytest.raises(ValueError, match="shares memory with the stored depth"):
        fathom.linearize(whole[1:], fathom.Camera(**keys), out=whole[:-1])


def test_the_second_out_is_checked_before_the_first_is_written(millimetres, kinect):
    good, bad = numpy.full((HEIGHT, WIDTH), 7, numpy.float32), numpy.zeros((HEIGHT, WIDTH))
    with pytest.raises(ValueError, match="out.confidence: its dtype is float64"):
        fathom.ssao(millimetres, kinect, radius=0.3, confidence=True, out=(good, None, bad))
    assert (good == 7).all()
    with pytest.raises(ValueError, match="out: must be a tuple of 3"):
        fathom.ssao(millimetres, kinect, radius=0.3, confidence=True, out=good)


CALLS = {
    "background": (lambda d, c: fathom.linearize(d, c, background="black"), "background = 'black' is unknown; it is inf, decode or nan"),
    "a number for a word": (lambda d, c: fathom.ssao(d, c, 0.3, quality=3), "quality = 3 is unknown; it is fast, balanced or accurate"),
    "storage": (lambda d, c: fathom.linearize(d, c, storage="uint8"), "depth: it holds uint16, which the storage 'uint8' does not"),
    "channels": (lambda d, c: fathom.unproject(d, c, channels=2), "channels = 2 must be 3 or 4"),
    "radius": (lambda d, c: fathom.ssao(d, c, radius=float("nan")), "radius = nan must be finite"),
    "no radius": (lambda d, c: fathom.ssao(d, c), 'radius: missing, and the camera has no "ao_distance"'),
    "slices": (lambda d, c: fathom.ssao(d, c, 0.3, slices=0), "slices = 0 must be 1 to 64"),
    "region": (lambda d, c: fathom.ssao(d, c, 0.3, region=(90, 0, 10, 10)), "region 10 x 10 at .90, 0. does not lie in"),
    "no f_stop": (lambda d, c: fathom.dof_masks(d, c, focus=2), 'f_stop: missing, and the camera has no "f_stop"'),
    "no focus": (lambda d, c: fathom.dof_masks(d, c, f_stop=2), 'focus: missing, and the camera has no "focus_distance"'),
    "two focuses": (lambda d, c: fathom.dof_masks(d, c, focus=2, focus_at=(1, 2), f_stop=2), "three ways to say one depth"),
    "circle and lens": (lambda d, c: fathom.dof_masks(d, c, focus=2, circle=(1, 2)), "leave one of the two out"),
    "focus on nothing": (lambda d, c: fathom.dof_masks(d, c, focus_at=(0, 0), f_stop=2, sensor_mm=36), "invalid"),
    "half a clean plate": (
        lambda d, c: fathom.dof(numpy.zeros((HEIGHT, WIDTH, 3), numpy.float32), d, c, circle=(1, 1), clean_plate_depth=d),
        "belong together",
    ),
    "a grey picture": (lambda d, c: fathom.fog(numpy.zeros((HEIGHT, WIDTH), numpy.float32), d, c, 0.1), "channels"),
    "another picture": (lambda d, c: fathom.fog(numpy.zeros((9, 9, 3), numpy.float32), d, c, 0.1), "9 x 9 pixels"),
    "density": (lambda d, c: fathom.fog(numpy.zeros((HEIGHT, WIDTH, 3), numpy.float32), d, c, -1), "density = -1"),
    "device": (lambda d, c: fathom.linearize(d, c, device=3.5), "device: 3.5 is none"),
    "thickness twice": (lambda d, c: fathom.ssao(d, c, 0.3, thickness=1, thickness_map=d), "leave one of the two out"),
    "thickness of codes": (lambda d, c: fathom.ssao(d, c, 0.3, thickness_map=d), "thickness"),
}


@pytest.mark.parametrize("kind", CALLS)
def test_arguments_out_of_range(millimetres, kinect, kind):
    call, message = CALLS[kind]
    with pytest.raises(ValueError, match=message):
        call(millimetres, kinect)


def test_an_unknown_device_names_those_that_are_there(millimetres, kinect):
    with pytest.raises(fathom.NoDevice, match='no OpenCL device answers to "abacus"; there is: 0 '):
        fathom.linearize(millimetres, kinect, device="abacus")
    with pytest.raises(ValueError, match="vector_width = 3 must be 1, 4, 8 or 16"):
        fathom.Device("", vector_width=3)


def test_unknown_keywords_are_type_errors(millimetres, kinect):
    with pytest.raises(TypeError):
        fathom.linearize(millimetres, kinect, backgruond="nan")
    with pytest.raises(TypeError):
        fathom.linearize(millimetres, {"width": 96})
