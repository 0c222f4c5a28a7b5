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
    "int32": (
        lambda d: d.astype(numpy.int32),
        r"depth: its dtype is int32; .*as .astype\(numpy.uint16\) makes it of numbers from 0 to 65535",
    ),
    "bool": (lambda d: d > 0, "depth: its dtype is bool; .*that is a mask"),
    "BGRA": (lambda d: numpy.zeros((HEIGHT, WIDTH, 4), numpy.uint8), r"uint8 in 4 channels; .*\[\.\.\., :3\]"),
    "too large": (
        lambda d: numpy.broadcast_to(numpy.zeros(1, numpy.uint8), (1, 2**31)),
        r"depth: its shape is \(1, 2147483648\); a side may be 1 to 1073741824",
    ),
    "objects": (lambda d: d.astype(object), "depth: its dtype is object"),
    "no rows": (lambda d: d[:0], r"depth: its shape is \(0, 96\); a side may be 1 to"),
    "one dimension": (lambda d: d.ravel(), r"depth: its shape is \(6144,\); it must be \(height, width\)"),
    "two channels": (lambda d: numpy.stack([d, d], -1), "depth: it holds uint16 in 2 channels; depth has one channel"),
    "bytes": (
        lambda d: (d >> 8).astype(numpy.uint8),
        "depth: it holds uint8, which may be a picture; .*storage='uint8'",
    ),
    "a picture": (lambda d: numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8), "'bgr8-red-low'"),
    "a list": (lambda d: d.tolist(), "depth: list is no array"),
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
    "of the other byte order": (
        lambda: numpy.full((HEIGHT, WIDTH), 7, numpy.dtype(numpy.float32).newbyteorder()),
        "out: its dtype is >f4, which cannot be used as it lies; .*this machine's byte order",
    ),
    "too small": (
        lambda: numpy.full((HEIGHT - 1, WIDTH), 7, numpy.float32),
        r"out: its shape is \(63, 96\); it must be \(64, 96\)",
    ),
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
    "storage": (
        lambda d, c: fathom.linearize(d, c, storage="uint8"),
        "depth: it holds uint16, which the storage 'uint8' does not",
    ),
    "no radius": (lambda d, c: fathom.ssao(d, c), 'radius: missing, and the camera has no "ao_distance"'),
    "a grey picture": (lambda d, c: fathom.fog(d, c, numpy.zeros((HEIGHT, WIDTH), numpy.float32), 0.1), "channels"),
    "a picture of float64": (
        lambda d, c: fathom.fog(d, c, numpy.zeros((HEIGHT, WIDTH, 3)), 0.1),
        r"color: its dtype is float64; it must be float32, float16, uint16 or uint8, as .astype\(numpy.float32\)",
    ),
    "a picture of numbers": (
        lambda d, c: fathom.fog(d, c, numpy.zeros((HEIGHT, WIDTH, 3), "U1"), 0.1),
        "color: its dtype is <U1.*; it must be float32, float16, uint16 or uint8",
    ),
    "relative depth of float64": (
        lambda d, c: fathom.dof_masks(d.astype(float), None, relative="low-is-near", blur_px=9, focus_at=(1, 2)),
        r"depth: its dtype is float64; it must be float32, float16, uint16 or uint8, as .astype\(numpy.float32\)",
    ),
    "normals of float64": (
        lambda d, c: fathom.ssao(d, c, 0.3, normals=numpy.zeros((HEIGHT, WIDTH, 3))),
        "normals: its dtype is float64; it must be float32, as",
    ),
    "fog of bytes": (
        lambda d, c: fathom.fog(d, c, numpy.zeros((HEIGHT, WIDTH, 3), numpy.uint8), 0.1, fog_color=(128, 153, 179)),
        r"fog_color = \(128.0, 153.0, 179.0\): .*0 to 1 for uint8, too; divide by 255",
    ),
    "a tuple for one result": (
        lambda d, c: fathom.linearize(d, c, out=(numpy.zeros((HEIGHT, WIDTH), numpy.float32),)),
        "out: a tuple is given, but this call has one result",
    ),
    "device": (lambda d, c: fathom.linearize(d, c, device=3.5), "device: 3.5 is none"),
    "thickness of codes": (lambda d, c: fathom.ssao(d, c, 0.3, thickness=d), "thickness: its dtype is uint16"),
    "thickness of a word": (
        lambda d, c: fathom.ssao(d, c, 0.3, thickness="thin"),
        "thickness = 'thin' is unknown; it is a number, an array, 'silhouette' or a fathom.BackDepth",
    ),
    "a target of what is not asked for": (
        lambda d, c: fathom.ssao(
            d, c, 0.3, bent_normal=True, out=(None, None, numpy.zeros((HEIGHT, WIDTH), numpy.float32))
        ),
        "out.confidence: is given, but the call does not ask for this result",
    ),
    "light of bytes": (
        lambda d, c: fathom.restore_highlights(numpy.zeros((2, 2, 3), numpy.uint8), 2),
        "color: its dtype is uint8; it must be float32",
    ),
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


TYPES = {
    "unknown": (
        lambda d, c: fathom.ssao(d, c, 0.3, bentnormal=True),
        "ssao() got an unexpected keyword argument 'bentnormal'",
    ),
    "unlike any": (lambda d, c: fathom.linearize(d, c, qqqq=1), "linearize() got an unexpected keyword argument 'qqqq'"),
    "a dict": (
        lambda d, c: fathom.linearize(d, {"width": 96}),
        "linearize(): camera must be a fathom.Camera, not {'width': 96}; fathom.Camera(**keys) makes one",
    ),
    "the order of 0.2": (
        lambda d, c: fathom.fog("picture", "depth", c, 0.1),
        "fog(): camera must be a fathom.Camera, not 'depth'; depth and camera come first, then color",
    ),
    "missing": (lambda d, c: fathom.linearize(d), "linearize() missing 1 required positional argument: 'camera'"),
    "too many": (lambda d, c: fathom.linearize(d, c, "inf"), "linearize() takes 2 positional arguments but 3 were given"),
    "no density": (lambda d, c: fathom.fog(d, c, d), "fog() missing 1 required positional argument: 'density'"),
    "text for a number": (lambda d, c: fathom.ssao(d, c, radius="big"), "ssao(): radius must be a number above 0, not 'big'"),
    "a fraction": (
        lambda d, c: fathom.ssao(d, c, 0.3, slices=10**400),
        "ssao(): slices must be a whole number from 1 to 64, not 100000000000000000...0000000000000000000",
    ),
    "65 bits": (lambda d, c: fathom.depth_at(d, c, 2**64, 0), "depth_at(): pixel must be two whole numbers: x and y, not (18446744073709551616, 0)"),
    "a number for a flag": (
        lambda d, c: fathom.ssao(d, c, 0.3, bent_normal=1),
        "ssao(): bent_normal must be True or False, not 1",
    ),
    "too few": (
        lambda d, c: fathom.ssao(d, c, 0.3, region=(1, 2)),
        "ssao(): region must be four whole numbers: x, y, and a width and a height from 1, not (1, 2)",
    ),
    "an origin": (
        lambda d, c: fathom.unproject(d, c, origin="abc"),
        "unproject(): origin must be three finite numbers, not 'abc'",
    ),
    "a point": (
        lambda d, c: fathom.dof_masks(d, c, focus_at=3, f_stop=2),
        "dof_masks(): focus_at must be two whole numbers: x and y, not 3",
    ),
    "a ray": (
        lambda d, c: fathom.dof_masks(d, c, focus_along=(1, 2), f_stop=2),
        "dof_masks(): focus_along must be a pixel's two whole numbers and a distance above 0, or inf, not (1, 2)",
    ),
    "of load": (lambda d, c: fathom.Camera.load("x", nod="y"), "load() got an unexpected keyword argument 'nod'"),
    "no path": (lambda d, c: fathom.Camera.load(3), "expected str, bytes or os.PathLike object, not int"),
}


@pytest.mark.parametrize("kind", TYPES)
def test_types_that_do_not_fit(millimetres, kinect, kind):
    call, message = TYPES[kind]
    with pytest.raises(TypeError) as caught:
        call(millimetres, kinect)
    assert str(caught.value) == message


def test_a_type_error_of_an_argument_is_its_own(kinect):
    class Wrong:
        def __array_interface__(self):
            pass

        def __dlpack__(self, **options):
            raise ZeroDivisionError("mine")

        def __dlpack_device__(self):
            raise TypeError("mine, too")

    with pytest.raises(TypeError, match="mine, too"):
        fathom.linearize(Wrong(), kinect)


def test_fog_may_be_brighter_than_one_in_floats(millimetres, kinect):
    color = numpy.zeros((HEIGHT, WIDTH, 3), numpy.float32)
    assert fathom.fog(millimetres, kinect, color, 5, fog_color=(0, 4, 0))[20, 20, 1] > 3.9
