"""Arrays of every kind go in and out, without a copy where there need not be one."""

import array

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH, same_bits

CPU = [info for info in fathom.devices() if info.cpu]
on_cpu = pytest.mark.skipif(not CPU, reason="no CPU device: nothing is shared")


@pytest.fixture
def expected(millimetres, kinect):
    return fathom.linearize(millimetres, kinect)


def test_results_are_new_contiguous_float32(millimetres, kinect, expected):
    assert type(expected) is numpy.ndarray
    assert expected.dtype == numpy.float32 and expected.shape == (HEIGHT, WIDTH)
    assert expected.flags.c_contiguous and expected.flags.writeable
    assert numpy.isnan(expected[0, 0]) and abs(expected[30, 40] - 2.0) < 0.001
    assert fathom.unproject(millimetres, kinect).shape == (HEIGHT, WIDTH, 3)
    assert fathom.unproject(millimetres, kinect, channels=4).shape == (HEIGHT, WIDTH, 4)
    assert fathom.normals(millimetres, kinect).shape == (HEIGHT, WIDTH, 3)


def test_a_result_outlives_its_inputs(kinect, millimetres, expected):
    result = fathom.linearize(millimetres.copy(), kinect)
    copy = result.copy()
    for _ in range(20):
        fathom.linearize(millimetres.copy(), kinect)
    assert same_bits(result, copy)


VIEWS = {
    "rows with gaps": lambda a: numpy.pad(a, ((0, 0), (0, 13)))[:, :-13],
    "every other row": lambda a: numpy.repeat(a, 2, axis=0)[::2],
    "every other column": lambda a: numpy.repeat(a, 2, axis=1)[:, ::2],
    "rows backwards": lambda a: a[::-1].copy()[::-1],
    "columns backwards": lambda a: a[:, ::-1].copy()[:, ::-1],
    "columns first": lambda a: numpy.asfortranarray(a),
    "one channel": lambda a: a[..., None],
    "the other byte order": lambda a: a.astype(a.dtype.newbyteorder()),
    "an odd address": lambda a: numpy.frombuffer(b"\0" + a.tobytes(), numpy.uint8)[1:].view(a.dtype).reshape(a.shape),
    "a memoryview": lambda a: memoryview(a),
    "a read-only array": lambda a: numpy.lib.stride_tricks.as_strided(a, writeable=False),
    "a field of a record": lambda a: numpy.rec.fromarrays([a, numpy.zeros(a.shape, numpy.uint8)])["f0"],
}


@pytest.mark.parametrize("view", VIEWS)
def test_any_layout_gives_the_same_bits(millimetres, kinect, expected, view):
    assert same_bits(fathom.linearize(VIEWS[view](millimetres), kinect), expected)


def test_a_broadcast_array_is_read(kinect):
    row = numpy.arange(500, 500 + WIDTH, dtype=numpy.uint16)
    got = fathom.linearize(numpy.broadcast_to(row, (HEIGHT, WIDTH)), kinect)
    assert same_bits(got, fathom.linearize(numpy.tile(row, (HEIGHT, 1)), kinect))


def test_single_rows_and_columns():
    for shape in ((1, 7), (7, 1), (1, 1)):
        camera = fathom.Camera(fov_y_deg=60, encoding="view-z")
        z = numpy.full(shape, 2, numpy.float32)
        assert (fathom.linearize(z[::-1, ::-1], camera) == 2).all()


def test_the_buffer_protocol_alone_will_do():
    camera = fathom.Camera(fov_y_deg=60, encoding="view-z")
    flat = memoryview(array.array("f", [1, 2, 3, 4, 5, 6])).cast("B").cast("f", (2, 3))
    assert fathom.linearize(flat, camera).tolist() == [[1, 2, 3], [4, 5, 6]]


class DlpackOnly:
    """Has nothing but DLPack's two methods."""

    def __init__(self, made_of, device=None):
        self.made_of, self.device = made_of, device
        self.asked = False

    def __dlpack__(self, **options):
        self.asked = True
        return self.made_of.__dlpack__()

    def __dlpack_device__(self):
        return self.device or self.made_of.__dlpack_device__()


def test_dlpack_alone_will_do(millimetres, kinect, expected):
    assert same_bits(fathom.linearize(DlpackOnly(millimetres), kinect), expected)
    assert same_bits(
        fathom.linearize(DlpackOnly(millimetres[::-1]), kinect), fathom.linearize(millimetres[::-1], kinect)
    )
    out = numpy.zeros_like(expected)
    fathom.linearize(millimetres, kinect, out=DlpackOnly(out))
    assert same_bits(out, expected)


def test_an_array_of_another_device_is_refused_before_it_is_asked(millimetres, kinect):
    stub = DlpackOnly(millimetres, (2, 0))
    with pytest.raises(ValueError, match="depth: lies on another device; copy it to the CPU"):
        fathom.linearize(stub, kinect)
    assert not stub.asked


def test_torch(metres, keys):
    torch = pytest.importorskip("torch")
    camera = fathom.Camera(**keys)
    depth = torch.tensor(metres.tolist(), dtype=torch.float32)
    expected = fathom.linearize(metres.astype(numpy.float32), camera)
    assert same_bits(fathom.linearize(depth, camera), expected)
    halves = metres.astype(numpy.float32).astype(numpy.float16)
    assert same_bits(fathom.linearize(depth.half(), camera), fathom.linearize(halves, camera))
    out = torch.zeros(HEIGHT, WIDTH)
    assert fathom.linearize(depth, camera, out=out) is out
    assert out.tolist() == expected.tolist()


def test_out_is_written_and_returned(millimetres, kinect, expected):
    whole = numpy.full((HEIGHT + 4, WIDTH + 9), 7, numpy.float32)
    for out in (numpy.empty_like(expected), whole[2:-2, 3:-6]):
        assert fathom.linearize(millimetres, kinect, out=out) is out
        assert same_bits(out.copy(), expected)
    assert (
        (whole[:2] == 7).all() and (whole[-2:] == 7).all() and (whole[:, :3] == 7).all() and (whole[:, -6:] == 7).all()
    )


def test_out_of_several_results(millimetres, kinect):
    first = fathom.ssao(millimetres, kinect, radius=0.3, confidence=True)
    again = fathom.Occlusion(*(None if field is None else numpy.zeros_like(field) for field in first))
    second = fathom.ssao(millimetres, kinect, radius=0.3, confidence=True, out=again)
    assert second.bent_normal is None and second.confidence is again.confidence
    assert same_bits(second.visibility, first.visibility) and same_bits(second.confidence, first.confidence)


@on_cpu
def test_nothing_is_copied_on_a_cpu_device(millimetres, kinect):
    """The device's buffers lie where the arrays lie."""
    cl = pytest.importorskip("pyopencl")

    for view in (millimetres, millimetres[3:, 5:]):
        image = fathom.Image(view, device="cpu")
        buffer = cl.Buffer.from_int_ptr(image.int_ptr, retain=True)
        assert buffer.get_info(cl.mem_info.FLAGS) & cl.mem_flags.USE_HOST_PTR
        host = buffer.get_host_array(image.shape, view.dtype)
        assert host.__array_interface__["data"][0] == view.__array_interface__["data"][0]

    result = numpy.zeros((HEIGHT, WIDTH), numpy.float32)
    there = fathom.Image(result, device="cpu")
    fathom.linearize(millimetres, kinect, out=there, device="cpu")  # waits, and copies nothing to the host
    assert same_bits(result, fathom.linearize(millimetres, kinect))


class ReadOnlyDlpack:
    """DLPack's second version, whose flags say that the memory is only read."""

    def __init__(self, array):
        self.array = array
        self.array.flags.writeable = False

    def __dlpack__(self, *, max_version=None, **options):
        return self.array.__dlpack__(max_version=max_version)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


READ_ONLY = {
    "a read-only array": lambda a: numpy.lib.stride_tricks.as_strided(a, writeable=False),
    "bytes": lambda a: numpy.frombuffer(a.tobytes(), a.dtype).reshape(a.shape),
    "a memoryview": lambda a: memoryview(a).toreadonly(),
    "DLPack": lambda a: ReadOnlyDlpack(a),
}


@pytest.mark.parametrize("kind", READ_ONLY)
def test_a_read_only_array_is_never_written(millimetres, kinect, expected, kind):
    if kind == "DLPack" and numpy.lib.NumpyVersion(numpy.__version__) < "2.1.0":
        pytest.skip("this NumPy has only DLPack's first version, which cannot say that memory is read-only")
    memory = numpy.full((HEIGHT, WIDTH), 7, numpy.float32)
    given = READ_ONLY[kind](memory)
    for out in (given, fathom.Image(given)):
        with pytest.raises(ValueError, match="out: .*read-only"):
            fathom.linearize(millimetres, kinect, out=out)
    assert (memory == 7).all() and (fathom.Image(given).numpy() == 7).all()
    kept = millimetres.copy()
    assert same_bits(fathom.linearize(fathom.Image(READ_ONLY[kind](millimetres)), kinect).numpy(), expected)
    assert (millimetres == kept).all()


@pytest.mark.parametrize(
    "view",
    [
        lambda a: a[:, ::2],
        lambda a: a[::-1],
        lambda a: numpy.lib.stride_tricks.as_strided(a, strides=(4, 4)),
        lambda a: a.view(">f4"),
        lambda a: numpy.empty(a.nbytes + 1, numpy.uint8)[1:].view(a.dtype).reshape(a.shape),
    ],
)
def test_an_image_that_had_to_be_a_copy_is_no_out(view):
    given = view(numpy.full((8, 8), 7, numpy.float32))
    depth = numpy.ones(given.shape, numpy.float32)
    camera = fathom.Camera(fov_y_deg=60, encoding="view-z")
    with pytest.raises(ValueError, match="out: .*a copy"):
        fathom.linearize(depth, camera, out=fathom.Image(given))


def test_masks_are_not_forgotten(millimetres, kinect, metres, keys):
    masked = numpy.ma.masked_equal(millimetres, 0)
    with pytest.raises(ValueError, match=r"depth: .*mask.*\.filled\(numpy.nan\).*missing"):
        fathom.linearize(masked, kinect)
    with pytest.raises(ValueError, match="array: .*mask"):
        fathom.Image(masked)
    with pytest.raises(ValueError, match="out: .*mask"):
        fathom.linearize(millimetres, kinect, out=numpy.ma.zeros((HEIGHT, WIDTH), numpy.float32))
    filled = numpy.ma.masked_less(metres.astype(numpy.float32), 3).filled(numpy.nan)
    assert numpy.isnan(fathom.linearize(filled, fathom.Camera(**keys))).sum() == numpy.isnan(filled).sum() > 0


@pytest.mark.parametrize("kind", [KeyboardInterrupt, SystemExit])
def test_an_interrupt_passes_through(kinect, kind):
    class Interrupted(DlpackOnly):
        def __dlpack__(self, **options):
            raise kind("now")

    with pytest.raises(kind, match="now"):
        fathom.linearize(Interrupted(numpy.ones((HEIGHT, WIDTH), numpy.uint16)), kinect)


def test_a_producer_says_why_it_gives_no_memory(kinect):
    class Refusing(DlpackOnly):
        def __dlpack__(self, **options):
            raise BufferError("it needs a gradient")

    with pytest.raises(ValueError, match="depth: Refusing does not give its memory .*: it needs a gradient"):
        fathom.linearize(Refusing(numpy.ones((HEIGHT, WIDTH), numpy.uint16)), kinect)


def test_numpy_takes_images(millimetres, kinect, expected):
    image = fathom.linearize(fathom.Image(millimetres), kinect)
    assert same_bits(numpy.asarray(image), expected) and numpy.asarray(image, float).dtype == float
    assert same_bits(numpy.from_dlpack(image), expected)
    copy = numpy.asarray(image)
    copy[:] = 0
    assert same_bits(image.numpy(), expected)  # the array is a copy
    if numpy.lib.NumpyVersion(numpy.__version__) >= "2.0.0":
        with pytest.raises(ValueError, match="copy"):
            numpy.asarray(image, copy=False)


def numbers(mask, dtype):
    return mask.astype(dtype) * dtype(1)


@pytest.mark.parametrize(
    "kind", [bool, numpy.uint8, numpy.int64, numpy.float32, numpy.float64], ids=lambda kind: kind.__name__
)
def test_ignored_pixels_are_invalid_and_all_others_keep_their_bits(millimetres, kinect, expected, kind):
    mask = numpy.random.default_rng(3).random((HEIGHT, WIDTH)) < 0.3
    without = numpy.where(mask, numpy.float32("nan"), expected)
    ignore = mask if kind is bool else numbers(mask, kind)
    for depth in (millimetres, millimetres.astype(numpy.float32)):
        assert same_bits(fathom.linearize(depth, kinect, ignore=ignore), without)
    assert same_bits(fathom.linearize(millimetres, kinect, ignore=numpy.asfortranarray(ignore)), without)
    image = fathom.linearize(fathom.Image(millimetres), kinect, ignore=ignore)
    assert same_bits(image.numpy(), without)
    assert same_bits(fathom.linearize(millimetres, kinect), expected)  # the array itself is as it was


def test_operations_see_no_more_of_ignored_pixels_than_of_missing_ones(millimetres, kinect):
    mask = numpy.random.default_rng(4).random((HEIGHT, WIDTH)) < 0.1
    holes = numpy.where(mask, numpy.uint16(0), millimetres)
    for call in (
        lambda depth, **more: fathom.normals(depth, kinect, **more),
        lambda depth, **more: fathom.ssao(depth, kinect, 0.5, **more),
        lambda depth, **more: fathom.fill_invalid(depth, kinect, **more),
        lambda depth, **more: fathom.grow_foreground(depth, kinect, 1, **more),
    ):
        assert same_bits(call(millimetres, ignore=mask), call(holes))


def test_signed_shorts_are_codes_or_numbers_below_0(millimetres, keys, kinect):
    same = fathom.linearize(millimetres.astype(numpy.int16), kinect)
    assert numpy.array_equal(same, fathom.linearize(millimetres, kinect), equal_nan=True)
    backwards = fathom.Camera(**{**keys, "width": WIDTH // 2}, scale=-0.001)
    below = -millimetres.astype(numpy.int16)[:, ::2]  # with gaps
    got = fathom.linearize(below, backwards)
    assert numpy.array_equal(got, fathom.linearize(below.astype(numpy.float32), backwards), equal_nan=True)
    measured = below != 0
    assert numpy.array_equal(got[measured], same[:, ::2][measured])
