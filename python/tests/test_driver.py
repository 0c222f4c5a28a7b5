"""Intel's driver, which the extra `cpu` brings: where it is taken, and that it leaves others alone.

What needs the driver itself runs where it is installed and the system has no other, as in the bare systems of scripts/test-wheel.
"""

import glob
import importlib
import os
import sys
from importlib import metadata
from pathlib import PurePosixPath

import pytest

import fathom
from test_devices import run

fathom.devices()
driver = importlib.import_module("fathom._driver")


class Installed(PurePosixPath):
    def locate(self):
        return self


@pytest.fixture
def alone(monkeypatch):
    """The extra is installed, and nothing else is there."""
    monkeypatch.setattr(os.path, "exists", lambda _: True)
    monkeypatch.delenv("OCL_ICD_VENDORS", raising=False)
    monkeypatch.delenv("FATHOM_CPU", raising=False)
    monkeypatch.setattr(glob, "glob", lambda _: [])
    monkeypatch.setattr(metadata, "files", lambda _: [Installed("/there/lib/cl.cfg"), Installed("/there/lib/libintelocl.so")])


def test_the_extras_driver_is_taken_where_there_is_no_other(alone):
    assert driver._driver() == "/there/lib/libintelocl.so"


@pytest.mark.parametrize("name, value", [("FATHOM_CPU", "off"), ("OCL_ICD_VENDORS", "/elsewhere"), ("OCL_ICD_VENDORS", "")])
def test_a_variable_refuses_it(alone, monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    assert driver._driver() is None


def test_a_driver_of_the_system_comes_first(alone, monkeypatch):
    monkeypatch.setattr(glob, "glob", lambda pattern: [pattern.replace("*", "pocl")])
    assert driver._driver() is None


def test_a_variable_that_names_it_takes_it_like_no_variable(alone, monkeypatch):
    """So that its libraries come before those that others have loaded, whatever the system has."""
    monkeypatch.setattr(glob, "glob", lambda _: ["dead.icd"])
    monkeypatch.setenv("OCL_ICD_VENDORS", "/there/lib/../lib/libintelocl.so")
    assert driver._driver() == "/there/lib/libintelocl.so"


def test_another_value_is_refused_by_name():
    done = run("fathom.devices()", FATHOM_CPU="no")
    assert "ValueError: FATHOM_CPU=no: the only value is off" in done.stderr


@pytest.mark.parametrize("files", [None, [], [Installed("/there/lib/cl.cfg")]])
def test_an_extra_without_its_files_is_none(alone, monkeypatch, files):
    monkeypatch.setattr(metadata, "files", lambda _: files)
    assert driver._driver() is None


def test_without_the_extra_there_is_none(alone, monkeypatch):
    def none(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "files", none)
    assert driver._driver() is None


def test_import_looks_for_no_driver():
    done = run("print([name for name in sys.modules if name == 'fathom._driver'])")
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


try:
    metadata.version("intel-opencl-rt")
    installed = not glob.glob("/etc/OpenCL/vendors/*.icd")
except metadata.PackageNotFoundError:
    installed = False
with_driver = pytest.mark.skipif(not installed, reason="fathom-depth[cpu] is not the only driver here")


def run_alone(code, **environment):
    """As a user runs it, in whose environment no variable names a driver."""
    return run(
        """
        del os.environ["OCL_ICD_VENDORS"]
        def maps(*names):
            return sorted({line.split()[-1] for line in open("/proc/self/maps") if any(name in line for name in names)})
        def use():
            camera = fathom.Camera(preset="kinect", fx=5, fy=5, cx=4, cy=4)
            assert (fathom.linearize(numpy.full((8, 8), 1500, numpy.uint16), camera) == 1.5).all()
        """
        + code,
        **{"OCL_ICD_VENDORS": "", **environment},
    )


@with_driver
def test_it_is_loaded_at_the_first_use_and_leaves_the_environment_alone():
    done = run_alone(
        """
        before = dict(os.environ)
        assert not maps("libintelocl")
        use()
        assert maps("libintelocl") and os.environ == before
        print(fathom.devices()[0].platform)
        import subprocess  # another process finds it, too
        subprocess.run([sys.executable, "-c", "import fathom; assert fathom.devices()"], check=True)
        import ctypes
        assert not hasattr(ctypes.CDLL(None), "__svml_sin2") and not hasattr(ctypes.CDLL(None), "TBB_runtime_version")
        """
    )
    assert (done.returncode, done.stdout) == (0, "Intel(R) OpenCL\n"), done.stderr


@with_driver
def test_it_can_be_refused():
    done = run_alone(
        """
        try:
            use()
        except fathom.NoDevice as error:
            print(error, maps("libintelocl"))
        """,
        FATHOM_CPU="off",
    )
    assert "FATHOM_CPU is not off []\n" in done.stdout, done.stdout + done.stderr


OTHERS = """
        import hashlib, math
        def others():
            import numba, torch
            assert not numba.config.USING_SVML
            @numba.njit(parallel=True)
            def waves(x):
                y = numpy.empty_like(x)
                for i in numba.prange(x.size):
                    y[i] = math.sin(x[i]) * math.exp(x[i])
                return y
            x = numpy.linspace(0, 3, 100003)
            t = torch.linspace(0, 3, 40000).reshape(200, 200)
            results = waves(x), (t @ torch.sin(t).exp()).numpy()
            return numba.threading_layer(), *(hashlib.sha256(each.tobytes()).hexdigest() for each in results)
        """


@with_driver
@pytest.mark.parametrize("layer", ["workqueue", "tbb"])
def test_numba_and_torch_compute_the_same_beside_it(layer):
    """In either order, and where numba has loaded a TBB of the system's, which the driver cannot use."""
    pytest.importorskip("numba")
    pytest.importorskip("torch")
    orders = "print(*others())", "use()\n        print(*others())", "print(*others())\n        use()\n        assert others()"
    alone, after, before = (run_alone(OTHERS + order, NUMBA_THREADING_LAYER=layer) for order in orders)
    assert alone.returncode == after.returncode == before.returncode == 0, alone.stderr + after.stderr + before.stderr
    assert alone.stdout == after.stdout == before.stdout and layer in alone.stdout
