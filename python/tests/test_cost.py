"""A call from Python costs little more than the same call from C++, and leaks nothing."""

import gc
import os
import time

import numpy
import pytest

import fathom
from fathom import _fathom

FRACTION, SECONDS = 0.05, 50e-6  # of the C++ call's time, or at least so much


def test_a_call_costs_as_much_as_in_cpp():
    """1080p, linearize, both with `out`. Calls alternate, so that both meet the same load.

    Other work on the machine only adds time, so that the quickest tenth of many calls is what a call costs.
    """
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100, width=1920, height=1080)
    depth = numpy.linspace(0.1, 0.99, 1920 * 1080, dtype=numpy.float32).reshape(1080, 1920)
    out = numpy.empty_like(depth)
    device = fathom.Device()

    def python():
        start = time.perf_counter()
        fathom.linearize(depth, camera, out=out, device=device)
        return time.perf_counter() - start

    def cpp():
        return _fathom._seconds_of_linearize(depth, camera, out, device=device)

    for warm in (python, cpp) * 5:
        warm()
    times = {python: [], cpp: []}
    for i in range(801):
        for call in (python, cpp) if i % 2 else (cpp, python):
            times[call].append(call())
    in_python, in_cpp = (numpy.percentile(times[call], 10) for call in (python, cpp))
    more = in_python - in_cpp
    print(f"linearize 1080p: Python {in_python * 1e6:.0f} us, C++ {in_cpp * 1e6:.0f} us, {more * 1e6:+.0f} us a call")
    assert more <= max(FRACTION * in_cpp, SECONDS)


def resident_bytes():
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="no /proc")
def test_memory_does_not_grow():
    """10,000 calls with new results, errors and images among them: a leak of 100 bytes a call would be seen."""
    camera = fathom.Camera(fov_y_deg=60, near=0.1, far=100)
    depth = numpy.full((48, 64), 0.9, numpy.float32)
    color = numpy.full((48, 64, 3), 0.5, numpy.float32)

    def calls(count):
        for i in range(count):
            kind = i % 5
            if kind == 0:
                fathom.linearize(depth, camera)
            elif kind == 1:
                fathom.unproject(depth[::-1], camera)
            elif kind == 2:
                fathom.normals(fathom.Image(depth), camera).numpy()
            elif kind == 3:
                fathom.fog(color, depth, camera, 0.1)
            else:
                with pytest.raises(ValueError):
                    fathom.linearize(depth, camera, out=color)

    calls(1000)
    gc.collect()
    before = resident_bytes()
    calls(10000)
    gc.collect()
    grown = resident_bytes() - before
    print(f"10,000 calls: {grown / 2**10:+.0f} KiB")
    assert grown <= 1 << 20
