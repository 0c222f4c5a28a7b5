"""Bad input gets one clear exception of the type that docs/python.md names, and nothing is written."""

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH


def test_exceptions_are_what_python_expects():
    assert issubclass(fathom.Error, RuntimeError) and issubclass(fathom.NoDevice, fathom.Error)
    assert fathom.Error.__module__ == "fathom"


DEPTHS = {
    "float64": (
        lambda d: d.astype(float),
        "depth: .* the dtype float64; it must be .* of float32, float16, uint32, uint16 or uint8",
    ),
    "int32": (lambda d: d.astype(numpy.int32), r"depth: .* the dtype int32; .*\.astype\(\)"),
    "bool": (lambda d: d > 0, "depth: .* the dtype bool; it must be"),
    "objects": (lambda d: d.astype(object), "depth: .* the dtype object"),
    "no rows": (lambda d: d[:0], r"depth: it has the shape \(0, 96\) .* must be \(height, width\)"),
    "one dimension": (lambda d: d.ravel(), r"depth: it has the shape \(6144,\) .* must be \(height, width\)"),
    "too large": (lambda d: numpy.broadcast_to(numpy.zeros(1, numpy.uint8), (1, 2**31)), "from 1 to 1073741824"),
    "two channels": (lambda d: numpy.stack([d, d], -1), "depth: it holds uint16 in 2 channels.* it has one channel"),
    "BGRA": (lambda d: numpy.zeros((HEIGHT, WIDTH, 4), numpy.uint8), "uint8 in 4 channels"),
    "bytes": (lambda d: (d >> 8).astype(numpy.uint8), "uint8 in 1 channel, .*a picture, .*storage= .*'uint8'"),
    "a picture": (lambda d: numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8), "'bgr8-red-low'"),
    "a list": (lambda d: d.tolist(), "depth: list does not give its memory by the buffer protocol or DLPack"),
    "nothing": (lambda d: None, "depth: NoneType"),
}


@pytest.mark.parametrize("kind", DEPTHS)
def test_depth_of_no_use(millimetres, kinect, kind):
    make, message = DEPTHS[kind]
    out = numpy.full((HEIGHT, WIDTH), 7, numpy.float32)
    with pytest.raises(ValueError, match=message):
        fathom.linearize(make(millimetres), kinect, out=out)
    assert (out == 7).all()


def sevens(*shape, dtype=numpy.float32):
    return numpy.full(shape, 7, dtype)


OUTS = {
    "float64": (lambda: sevens(HEIGHT, WIDTH, dtype=float), "out: .* the dtype <f8, .* of float32"),
    "of the other byte order": (lambda: sevens(HEIGHT, WIDTH, dtype=">f4"), "out: .* the dtype >f4, .* this machine's byte order"),
    "too small": (lambda: sevens(HEIGHT - 1, WIDTH), r"out: has the shape \(63, 96\), .* must be writable, and \(64, 96\)"),
    "three channels": (lambda: sevens(HEIGHT, WIDTH, 3), r"out: has the shape \(64, 96, 3\)"),
    "gaps": (lambda: sevens(HEIGHT, 2 * WIDTH)[:, ::2], "out: .* gaps between rows only"),
    "backwards": (lambda: sevens(HEIGHT, WIDTH)[::-1], "out: .* rows that go forwards"),
    "overlapping rows": (
        lambda: numpy.lib.stride_tricks.as_strided(sevens(9999), (HEIGHT, WIDTH), (40, 4)),
        "out: .* gaps between rows only",
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
    good, bad = sevens(HEIGHT, WIDTH), numpy.zeros((HEIGHT, WIDTH))
    with pytest.raises(ValueError, match="out.confidence: .* the dtype <f8"):
        fathom.ssao(millimetres, kinect, radius=0.3, confidence=True, out=(good, None, bad))
    assert (good == 7).all()
    with pytest.raises(ValueError, match="out: must be a tuple of 3"):
        fathom.ssao(millimetres, kinect, radius=0.3, confidence=True, out=good)


GREY, LIGHT = numpy.zeros((HEIGHT, WIDTH), numpy.float32), numpy.zeros((HEIGHT, WIDTH, 3))
RELATIVE = {"relative": "low-is-near", "blur_px": 9, "focus_at": (1, 2)}
VALUES = {
    "storage": (lambda d, c: fathom.linearize(d, c, storage="uint8"), "depth: it holds uint16 in 1 channel, which is not"),
    "no storage": (lambda d, c: fathom.linearize(d, c, storage="uint12"), "storage = 'uint12' is unknown; it is float32"),
    "no radius": (lambda d, c: fathom.ssao(d, c), 'radius: missing, and the camera has no "ao_distance"'),
    "a grey picture": (lambda d, c: fathom.fog(d, c, GREY, 0.1), "channels"),
    "a picture of float64": (
        lambda d, c: fathom.fog(d, c, LIGHT, 0.1),
        "color: .* the dtype float64; .* of float32, float16, uint16 or uint8",
    ),
    "relative": (
        lambda d, c: fathom.dof_masks(d.astype(float), None, **RELATIVE),
        "depth: .* the dtype float64; .* of float32, float16, uint16 or uint8",
    ),
    "normals of float64": (lambda d, c: fathom.ssao(d, c, 0.3, normals=LIGHT), "normals: .* the dtype float64; .* of float32, as"),
    "light of bytes": (
        lambda d, c: fathom.restore_highlights(numpy.uint8(LIGHT), 2),
        "color: .* the dtype uint8; .* of float32, as",
    ),
    "thickness of codes": (lambda d, c: fathom.ssao(d, c, 0.3, thickness=d), "thickness: .* the dtype uint16"),
    "thickness of a word": (lambda d, c: fathom.ssao(d, c, 0.3, thickness="thin"), "thickness = 'thin' must be silhouette"),
    "a tuple": (lambda d, c: fathom.linearize(d, c, out=(GREY,)), "out: a tuple is given, but this call has one result"),
    "device": (lambda d, c: fathom.linearize(d, c, device=3.5), "device: 3.5 is none"),
    "width": (lambda d, c: fathom.Device("", vector_width=3), "vector_width = 3 must be 1, 4, 8 or 16"),
    "ignore": (
        lambda d, c: fathom.linearize(d, c, ignore=GREY[1:]),
        r"ignore: its shape is \(63, 96\); it must be that of the depth",
    ),
}
TYPES = {
    "unknown": (lambda d, c: fathom.ssao(d, c, 0.3, bentnormal=True), "unexpected keyword argument 'bentnormal'"),
    "a dict": (
        lambda d, c: fathom.linearize(d, {"width": 96}),
        r"camera = {'width': 96} must be a fathom.Camera, as fathom.Camera\(",
    ),
    "no camera": (lambda d, c: fathom.ssao(d, None, 0.3), "camera = None must be a fathom.Camera, .* None is for relative depth"),
    "missing": (lambda d, c: fathom.linearize(d), "missing 1 required positional argument: 'camera'"),
    "too many": (lambda d, c: fathom.linearize(d, c, "inf"), "takes 2 positional arguments but 3 were given"),
    "no density": (lambda d, c: fathom.fog(d, c, d, None), "density = None must be a number from 0"),
    "text for a number": (lambda d, c: fathom.ssao(d, c, radius="big"), "radius = 'big' must be a number above 0"),
    "long": (
        lambda d, c: fathom.ssao(d, c, 0.3, slices=10**400),
        "slices = 10{17}0*\\.\\.\\.0* must be a whole number from 1 to 64",
    ),
    "65 bits": (
        lambda d, c: fathom.depth_at(d, c, 2**64, 0),
        "pixel = .18446744073709551616, 0. must be two whole numbers: x and y",
    ),
    "a number for a flag": (lambda d, c: fathom.ssao(d, c, 0.3, bent_normal=1), "bent_normal = 1 must be yes or no"),
    "too few": (lambda d, c: fathom.ssao(d, c, 0.3, region=(1, 2)), "region = .1, 2. must be four whole numbers"),
    "an origin": (lambda d, c: fathom.unproject(d, c, origin="abc"), "origin = 'abc' must be three finite numbers"),
    "of load": (lambda d, c: fathom.Camera.load("x", nod="y"), "unexpected keyword argument 'nod'"),
    "no path": (lambda d, c: fathom.Camera.load(3), "expected str, bytes or os.PathLike object, not int"),
}
FAILURES = {
    "size": (lambda d, c: fathom.linearize(d[:60], c), "is for 96 x 64 pixels, the image has 96 x 60"),
    "device": (lambda d, c: fathom.linearize(d, c, device="abacus"), 'no OpenCL device answers to "abacus"; there is: 0 '),
}
KINDS = ((ValueError, VALUES), (TypeError, TYPES), (fathom.Error, FAILURES))


@pytest.mark.parametrize("kind, call, message", [(kind, *case) for kind, cases in KINDS for case in cases.values()])
def test_a_mistake_is_told_by_its_type_and_in_one_line(millimetres, kinect, kind, call, message):
    with pytest.raises(kind, match=message) as caught:
        call(millimetres, kinect)
    assert "\n" not in str(caught.value)


def test_a_type_error_of_an_argument_is_its_own(kinect):
    class Wrong:
        def __dlpack__(self, **options):
            raise ZeroDivisionError("mine")

        def __dlpack_device__(self):
            raise TypeError("mine, too")

    with pytest.raises(TypeError, match="mine, too"):
        fathom.linearize(Wrong(), kinect)
