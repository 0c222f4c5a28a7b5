"""A call from Python costs little more than the same call from C++, and leaks nothing."""

import ctypes
import gc
import os
import time

import numpy
import pytest

import fathom
from fathom import _fathom

_fathom._time_calls()
FRACTION, SECONDS = 0.05, 50e-6  # of the C++ call's time, or at least so much


def test_a_call_costs_as_much_as_in_cpp():
    """1080p, linearize, both with `out`. Calls alternate.

    What Python adds is work of the calling thread. That is compared by the thread's own clock, which other programs on the
    machine do not disturb as they do the times that pass.
    """
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100, width=1920, height=1080)
    depth = numpy.linspace(0.1, 0.99, 1920 * 1080, dtype=numpy.float32).reshape(1080, 1920)
    out = numpy.empty_like(depth)
    device = fathom.Device()

    def python():
        start, worked = time.perf_counter(), time.thread_time()
        fathom.linearize(depth, camera, out=out, device=device)
        return time.perf_counter() - start, time.thread_time() - worked

    def cpp():
        return _fathom._seconds_of_linearize(depth, camera, out, device=device)

    times = {python: [], cpp: []}
    for _ in range(1000):
        for call in times:
            times[call].append(call())
    # Other work on the machine only adds to a time.
    in_python, in_cpp = (numpy.quantile(times[call][5:], 0.1, axis=0) for call in times)
    more = in_python - in_cpp
    for name, python_s, cpp_s, more_s in zip(("passed", "worked by the calling thread"), in_python, in_cpp, more):
        print(f"linearize 1080p, {name}: Python {1e6 * python_s:.0f} us, C++ {1e6 * cpp_s:.0f} us, {1e6 * more_s:+.0f} us")
    assert more[1] <= max(FRACTION * in_cpp[0], SECONDS)
    assert more[0] <= 0.25 * in_cpp[0] + 1e-3  # a wait or a copy in other threads would take far longer


LENS = {"focus": 1, "f_stop": 2, "sensor_mm": 36}
WEIGHTS = {"near_weight": True, "focus_weight": True, "far_weight": True}
OPERATIONS = {
    "unproject": lambda d, c, p, out: fathom.unproject(d, c, out=out),
    "normals": lambda d, c, p, out: fathom.normals(d, c, out=out),
    "ssao": lambda d, c, p, out: fathom.ssao(d, c, radius=0.1, quality="fast", out=out),
    "dof_masks": lambda d, c, p, out: fathom.dof_masks(d, c, **LENS, **WEIGHTS, out=out),
    "dof": lambda d, c, p, out: fathom.dof(d, c, p, **LENS, quality="fast", out=out),
    "fog": lambda d, c, p, out: fathom.fog(d, c, p, 0.1, out=out),
}


@pytest.mark.parametrize("operation", OPERATIONS)
def test_little_is_outside_of_the_operation(operation):
    """1080p, with `out`. What C++ does not have: arguments, arrays, and Python's call."""
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100, width=1920, height=1080)
    depth = numpy.linspace(0.1, 0.99, 1920 * 1080, dtype=numpy.float32).reshape(1080, 1920)
    color = numpy.full((1080, 1920, 3), 0.5, numpy.float32)
    out = numpy.empty((1080, 1920) if operation == "ssao" else (1080, 1920, 3), numpy.float32)
    if operation == "dof_masks":
        out = fathom.dof_masks(depth, camera, **LENS, **WEIGHTS)
    times = []
    for _ in range(15 if operation in ("ssao", "dof") else 100):
        start = time.perf_counter(), time.thread_time()
        OPERATIONS[operation](depth, camera, color, out)
        whole = time.perf_counter() - start[0], time.thread_time() - start[1]
        times.append([*whole, *_fathom._seconds_of_last_run()])
    whole, worked, inside, worked_inside = numpy.array(times[3:]).T
    whole, inside = numpy.median([whole, inside], axis=1)
    outside = numpy.quantile(worked - worked_inside, 0.1)  # other work on the machine only adds to it
    print(f"{operation} 1080p: {1e6 * whole:.0f} us, {1e6 * outside:.0f} us of work outside of the operation")
    assert outside <= max(FRACTION * inside, SECONDS)


HUGE_PAGES = "/sys/kernel/mm/transparent_hugepage/enabled"
PR_SET_THP_DISABLE = 41
GAIN = 1.5  # of about 3


def huge_pages_are_off():
    return not os.path.exists(HUGE_PAGES) or "[never]" in open(HUGE_PAGES).read()


@pytest.mark.skipif(huge_pages_are_off(), reason=f"{HUGE_PAGES} says that nobody gets huge pages")
def test_a_new_array_is_made_of_huge_pages():
    """4K, unproject: each page of a new array costs when it is first written to. In turn without huge pages for the process."""
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100, width=3840, height=2160)
    depth = numpy.linspace(0.1, 0.99, 3840 * 2160, dtype=numpy.float32).reshape(2160, 3840)
    times = {False: [], True: []}
    process = ctypes.CDLL(None)
    try:
        for _ in range(20):
            for small in times:
                assert process.prctl(PR_SET_THP_DISABLE, int(small), 0, 0, 0) == 0
                start = time.perf_counter()
                fathom.unproject(depth, camera)
                times[small].append(time.perf_counter() - start)
    finally:
        process.prctl(PR_SET_THP_DISABLE, 0, 0, 0, 0)
    huge, small = (numpy.median(times[each][3:]) for each in (False, True))
    print(f"unproject 4K into a new array: {1e3 * huge:.1f} ms, without huge pages {1e3 * small:.1f} ms")
    assert small >= GAIN * huge


def resident_bytes():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


LEAK = 100  # bytes a call that would be seen


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_memory_does_not_grow():
    """10,000 calls of every kind, errors and images among them. The allocator may keep half of what a leak would be."""
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100)
    depth = numpy.full((16, 24), 0.9, numpy.float32)
    color = numpy.full((16, 24, 3), 0.5, numpy.float32)
    out = numpy.empty((16, 24, 3), numpy.float32)
    lens = {"focus": 1, "f_stop": 2, "sensor_mm": 36}

    def refused():
        with pytest.raises(ValueError):
            fathom.linearize(depth, camera, out=color)
        with pytest.raises(TypeError):
            fathom.ssao(depth, camera, radius="big")

    kinds = (
        lambda: fathom.linearize(depth, camera),
        lambda: fathom.unproject(depth[::-1], camera),
        lambda: fathom.normals(fathom.Image(depth), camera).numpy(),
        lambda: fathom.normals(depth, camera, out=out),
        lambda: fathom.ssao(depth, camera, radius=0.1, quality="fast", bent_normal=True),
        lambda: fathom.dof_masks(depth, camera, **lens, **WEIGHTS),
        lambda: fathom.dof(depth, camera, color, **lens, quality="fast"),
        lambda: fathom.dof(depth, camera, color, **lens, quality="fast", out=out),
        lambda: fathom.fog(depth, camera, color, 0.1),
        refused,
    )

    def calls(rounds):
        for _ in range(rounds):
            for call in kinds:
                call()

    calls(200)
    gc.collect()
    before = resident_bytes()
    calls(1000)
    gc.collect()
    grown = resident_bytes() - before
    print(f"10,000 calls: {grown / 2**10:+.0f} KiB")
    assert grown <= 10000 * LEAK / 2
