"""A call costs little beside the operation, and leaks nothing."""

import ctypes
import gc
import os
import time

import numpy
import pytest

import fathom

MOST = 500e-6  # of the calling thread, with an enqueued kernel: about 10 us on a quiet machine


def test_a_call_costs_little_beside_the_operation():
    """A call on few pixels is arguments, arrays and the driver. Other work on the machine only adds to it."""
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100, width=64, height=64)
    depth, out = numpy.full((64, 64), 0.5, numpy.float32), numpy.empty((64, 64), numpy.float32)
    times = []
    for _ in range(500):
        start = time.thread_time()
        fathom.linearize(depth, camera, out=out)
        times.append(time.thread_time() - start)
    print(f"linearize 64 x 64: {1e6 * min(times):.0f} us of the calling thread")
    assert min(times) <= MOST


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
        lambda: fathom.dof_masks(depth, camera, **lens, near_weight=True, focus_weight=True, far_weight=True),
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
