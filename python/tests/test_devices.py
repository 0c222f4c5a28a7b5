"""Devices, images that stay there, pyopencl, no driver, fork, threads."""

import os
import subprocess
import sys
import textwrap
import time

import numpy
import pytest

import fathom
from conftest import HEIGHT, WIDTH, same_bits


def run(code, timeout=120, **environment):
    """A new interpreter, so that nothing of this process takes part."""
    script = "import fathom, numpy, os, sys\n" + textwrap.dedent(code)
    environment = {**os.environ, "PYTHONFAULTHANDLER": "1", **environment}
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=timeout, env=environment
    )


def test_devices_are_listed():
    infos = fathom.devices()
    assert infos and [info.index for info in infos] == list(range(len(infos)))
    assert infos[0].name in repr(infos[0]) and infos[0].compute_units > 0 and infos[0].memory_bytes > 0
    assert fathom.Device("0").info.name == infos[0].name


def test_a_device_is_chosen_by_index_and_by_what_devices_lists(millimetres, kinect):
    info = fathom.devices()[0]
    expected = fathom.linearize(millimetres, kinect)
    for chosen in (0, numpy.int64(0), info):
        assert fathom.Device(chosen).info.name == info.name
        assert same_bits(fathom.linearize(millimetres, kinect, device=chosen), expected)
        assert fathom.Image(millimetres, device=chosen).device.info.name == info.name
    for wrong in (-1, 3.5, [0]):
        with pytest.raises(ValueError, match="device: .* is none"):
            fathom.linearize(millimetres, kinect, device=wrong)
        with pytest.raises(ValueError, match="wanted: .* is none"):
            fathom.Device(wrong)
    with pytest.raises(fathom.NoDevice, match="99"):
        fathom.Device(99)


def test_devices_give_the_same_bits(millimetres, kinect):
    expected = fathom.normals(millimetres, kinect)
    for device in ("0", fathom.Device(vector_width=1), fathom.Device(group_size=16), fathom.Device(memory_budget=4 << 20)):
        assert same_bits(fathom.normals(millimetres, kinect, device=device), expected)
    with pytest.raises(fathom.Error, match="normals of .* pixels needs a memory budget of"):
        fathom.normals(millimetres, kinect, device=fathom.Device(memory_budget=1))


def test_images_chain_on_the_device(millimetres, kinect):
    z = fathom.linearize(millimetres, kinect)
    of_z = kinect.for_view_depth()
    stored = fathom.Image(millimetres)
    assert (stored.shape, stored.dtype) == ((HEIGHT, WIDTH), "uint16")
    z_there = fathom.linearize(stored, kinect)
    assert isinstance(z_there, fathom.Image) and z_there.dtype == "float32"
    n_there = fathom.normals(z_there, of_z)
    ao_there = fathom.ssao(z_there, of_z, radius=0.4, normals=n_there, confidence=True)
    assert isinstance(ao_there.visibility, fathom.Image)
    n = fathom.normals(z, of_z)
    ao = fathom.ssao(z, of_z, radius=0.4, normals=n, confidence=True)
    assert same_bits(z_there.numpy(), z) and same_bits(n_there.numpy(), n)
    assert same_bits(ao_there.visibility.numpy(), ao.visibility) and same_bits(
        ao_there.confidence.numpy(), ao.confidence
    )


def test_arrays_and_images_mix(millimetres, kinect):
    color = numpy.full((HEIGHT, WIDTH, 3), 0.5, numpy.float32)
    expected = fathom.fog(millimetres, kinect, color, 0.2)
    there = fathom.fog(fathom.Image(millimetres), kinect, color, 0.2)
    assert isinstance(there, fathom.Image) and there.shape == (HEIGHT, WIDTH, 3) and same_bits(there.numpy(), expected)
    assert same_bits(fathom.fog(millimetres, kinect, fathom.Image(color), 0.2), expected)
    out = numpy.zeros_like(expected)
    assert fathom.fog(fathom.Image(millimetres), kinect, color, 0.2, out=out) is out and same_bits(out, expected)
    again = fathom.Image(numpy.zeros_like(expected))
    assert fathom.fog(millimetres, kinect, color, 0.2, out=again) is again and same_bits(again.numpy(), expected)


def test_an_array_may_go_while_the_device_reads_it(metres, keys):
    camera = fathom.Camera(**keys)
    expected = fathom.ssao(metres.astype(numpy.float32), camera, radius=0.5, quality="accurate")
    for _ in range(20):
        image = fathom.Image(metres.astype(numpy.float32))
        result = fathom.ssao(image, camera, radius=0.5, quality="accurate")
        del image  # freed memory is used again, and overwritten
        over = [numpy.full(metres.shape, 9, numpy.float32) for _ in range(50)]
        assert same_bits(result.numpy(), expected)
        del over


@pytest.fixture
def opencl():
    cl = pytest.importorskip("pyopencl")
    device = cl.get_platforms()[0].get_devices()[0]
    context = cl.Context([device])
    queue = cl.CommandQueue(context, device)
    ours = fathom.Device.from_int_ptr(context=context.int_ptr, device=device.int_ptr, queue=queue.int_ptr)
    return cl, context, queue, ours


def test_buffers_of_pyopencl(opencl, millimetres, kinect):
    cl, context, queue, device = opencl
    expected = fathom.linearize(millimetres, kinect)
    flags = cl.mem_flags
    stored = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=millimetres)
    image = fathom.Image.from_int_ptr(device, stored.int_ptr, dtype="uint16", shape=millimetres.shape)
    z = fathom.linearize(image, kinect)
    result = numpy.empty_like(expected)
    buffer = cl.Buffer.from_int_ptr(z.int_ptr, retain=True)
    rows = numpy.empty((HEIGHT, z.row_stride), numpy.float32)
    cl.enqueue_copy(queue, rows.ravel()[: (HEIGHT - 1) * z.row_stride + WIDTH], buffer)
    assert same_bits(rows[:, :WIDTH].copy(), expected)

    onto = cl.Buffer(context, flags.READ_WRITE, expected.nbytes)
    there = fathom.Image.from_int_ptr(device, onto.int_ptr, dtype="float32", shape=expected.shape)
    assert fathom.linearize(image, kinect, out=there) is there
    cl.enqueue_copy(queue, result, onto)
    assert same_bits(result, expected)


def test_rows_of_pyopencls_buffers_have_gaps_and_an_offset(opencl, millimetres, kinect):
    cl, context, queue, device = opencl
    padded = numpy.zeros((HEIGHT + 1, WIDTH + 5), numpy.uint16)
    padded[1:, 3:-2] = millimetres
    stored = cl.Buffer(context, cl.mem_flags.COPY_HOST_PTR, hostbuf=padded)
    image = fathom.Image.from_int_ptr(
        device, stored.int_ptr, dtype="uint16", shape=millimetres.shape, row_stride=WIDTH + 5, offset=WIDTH + 5 + 3
    )
    assert same_bits(fathom.linearize(image, kinect).numpy(), fathom.linearize(millimetres, kinect))


def test_foreign_handles_that_do_not_fit(opencl):
    cl, context, _, device = opencl
    small = cl.Buffer(context, cl.mem_flags.READ_WRITE, 100)
    with pytest.raises(ValueError, match="a buffer of 100 bytes is too small"):
        fathom.Image.from_int_ptr(device, small.int_ptr, dtype="float32", shape=(64, 96))
    with pytest.raises(ValueError, match="dtype: float64 must be float32"):
        fathom.Image.from_int_ptr(device, small.int_ptr, dtype="float64", shape=(1, 1))
    for stride in (2**62, 2**63 - 1):
        with pytest.raises(ValueError, match="row_stride|too small|too large"):
            fathom.Image.from_int_ptr(device, small.int_ptr, dtype="float32", shape=(2, 2), row_stride=stride)
    with pytest.raises(ValueError, match="null"):
        fathom.Device.from_int_ptr(context=0, device=0, queue=0)


def test_a_buffer_that_kernels_only_read_is_no_out(opencl, millimetres, kinect):
    cl, context, _, device = opencl
    kept = numpy.full((HEIGHT, WIDTH), 7, numpy.float32)
    buffer = cl.Buffer(context, cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR, hostbuf=kept)
    image = fathom.Image.from_int_ptr(device, buffer.int_ptr, dtype="float32", shape=kept.shape)
    with pytest.raises(ValueError, match="out: .*read-only"):
        fathom.linearize(millimetres, kinect, out=image, device=device)
    assert (image.numpy() == 7).all()


def test_without_a_driver_the_first_use_names_the_package():
    done = run(
        """
        camera = fathom.Camera(preset="kinect", fx=5, fy=5, cx=4, cy=4)
        assert fathom.devices() == []
        try:
            fathom.linearize(numpy.ones((8, 8), numpy.uint16), camera)
        except fathom.NoDevice as error:
            print(error)
        """,
        OCL_ICD_VENDORS="/nonexistent",
    )
    assert done.returncode == 0, done.stderr
    assert "no OpenCL device is found in /nonexistent" in done.stdout and "fathom-depth[cpu]" in done.stdout


def test_a_child_of_fork_gets_an_error():
    """Never a hang. Needs a library that looks for fork."""
    code = """
        import signal
        camera = fathom.Camera(preset="kinect", fx=5, fy=5, cx=4, cy=4)
        depth = numpy.full((480, 640), 1000, numpy.uint16)
        device = fathom.Device()
        stored = fathom.Image(depth)
        fathom.linearize(depth, camera)
        child = os.fork()
        if child == 0:
            signal.alarm(20)
            for use in (
                lambda: fathom.linearize(depth, camera),
                lambda: fathom.linearize(stored, camera),
                lambda: fathom.Image(depth),
                lambda: stored.numpy(),
                lambda: fathom.linearize(depth, camera, out=fathom.Image(depth)),
                lambda: device.finish(),
            ):
                try:
                    use()
                    os._exit(4)
                except fathom.Error as error:
                    print(error, flush=True)
            os._exit(3)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        fathom.linearize(depth, camera)
        """
    done = run(code)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("OpenCL was used before this process was forked") == 6 and done.stdout.endswith(
        "\n3\n"
    ), done.stdout


def test_the_interpreter_goes_on_while_the_library_works():
    done = run("""
        import threading, time
        camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
        depth = (1000 + numpy.random.default_rng(1).integers(0, 50, (480, 640))).astype(numpy.uint16)
        call = lambda: fathom.ssao(depth, camera, radius=0.2, quality="accurate")
        call()
        worker = threading.Thread(target=lambda: [call() for _ in range(3)])
        longest, steps, start = 0, 0, time.perf_counter()
        worker.start()
        last = time.perf_counter()
        while worker.is_alive():
            time.sleep(0.001)
            now = time.perf_counter()
            steps, longest, last = steps + 1, max(longest, now - last), now
        print(steps)
        """)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= 10


def test_threads_share_a_device(millimetres, kinect):
    """Eight threads with mixed operations. Needs a library whose devices may be used from many threads."""
    done = run("""
        from concurrent.futures import ThreadPoolExecutor
        camera = fathom.Camera(preset="kinect", fx=90, fy=90, cx=47, cy=31)
        depth = (1000 + numpy.random.default_rng(1).integers(0, 50, (64, 96))).astype(numpy.uint16)
        operations = [
            lambda: fathom.linearize(depth, camera),
            lambda: fathom.unproject(depth, camera),
            lambda: fathom.normals(depth, camera),
            lambda: fathom.ssao(depth, camera, radius=0.1),
            lambda: fathom.dof_masks(depth, camera, circle=(4, 4)).coc,
        ]
        expected = [operation().tobytes() for operation in operations]
        def work(first):
            return all(operations[i % 5]().tobytes() == expected[i % 5] for i in range(first, first + 50))
        with ThreadPoolExecutor(8) as pool:
            print(all(pool.map(work, range(8))))
        """)
    assert done.returncode == 0 and done.stdout == "True\n", done.stdout + done.stderr


@pytest.mark.parametrize("out", ["", ", out=out"])
@pytest.mark.parametrize("size", [(48, 64), (240, 320)])
def test_threads_that_work_when_the_interpreter_ends(size, out):
    """Daemon threads end with the process, as those in NumPy do: no abort, and nothing is said."""
    done = run(f"""
        import threading, time
        camera = fathom.Camera(fov_y_deg=60, encoding="view-z")
        depth = numpy.full({size}, 2, numpy.float32)
        def work():
            out = numpy.empty((*depth.shape, 3), numpy.float32)
            while True:
                fathom.normals(depth, camera{out})
        for _ in range(3):
            threading.Thread(target=work, daemon=True).start()
        time.sleep(0.3)
        """)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_child_of_fork_ends_while_a_thread_of_the_parent_works():
    """The child's end waits for no call of a thread that it does not have."""
    if fathom.devices()[0].platform.startswith("Intel"):
        pytest.skip("at its end such a child waits for threads of Intel's driver, which it does not have")
    done = run("""
        import signal, threading, time
        camera = fathom.Camera(fov_y_deg=60, encoding="view-z")
        depth = numpy.full((480, 640), 2, numpy.float32)
        def work():
            while True:
                fathom.normals(depth, camera)
        threading.Thread(target=work, daemon=True).start()
        time.sleep(0.3)
        for _ in range(10):
            child = os.fork()
            if child == 0:
                signal.alarm(20)
                sys.exit(3)  # runs what atexit knows
            print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)  # or the next child has it, too
        """)
    assert (done.returncode, done.stdout) == (0, "3\n" * 10), done.stderr
