"""What several tests need: a scene with its depth in every dtype, and the program."""

import os
import shutil
import subprocess

import numpy
import pytest

import fathom

WIDTH, HEIGHT = 96, 64


@pytest.fixture(scope="session")
def program():
    """Runs the program: FATHOM_PROGRAM, or `fathom` on the path."""
    path = os.environ.get("FATHOM_PROGRAM") or shutil.which("fathom")
    if not path:
        pytest.skip("no program: set FATHOM_PROGRAM")

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done

    return run


@pytest.fixture
def metres():
    """A wavy wall with a sphere before it, background in a corner. Metres along the view axis."""
    y, x = numpy.mgrid[0:HEIGHT, 0:WIDTH].astype(numpy.float64)
    z = 4 + 0.2 * numpy.sin(x / 9) * numpy.cos(y / 7) + 0.01 * x
    sphere = 1 - ((x - 40) / 16) ** 2 - ((y - 30) / 16) ** 2
    return numpy.where(sphere > 0, 2.5 - 0.5 * numpy.sqrt(numpy.maximum(sphere, 0)), z)


@pytest.fixture
def keys():
    """The keys of a camera file for that scene."""
    return {
        "width": WIDTH,
        "height": HEIGHT,
        "intrinsics": {"fx": 90, "fy": 88, "cx": 47.25, "cy": 33.5},
        "encoding": "view-z",
        "view": [[0, 1, 0, 0.5], [-1, 0, 0, 0.25], [0, 0, 1, -2], [0, 0, 0, 1]],
    }


@pytest.fixture
def millimetres(metres):
    """As a Kinect has it: 0 where nothing was measured."""
    codes = numpy.rint(metres * 1000).astype(numpy.uint16)
    codes[:4, :6] = 0
    return codes


@pytest.fixture
def kinect(keys):
    return fathom.Camera(**keys, scale=0.001, missing=0)


def same_bits(a, b):
    """Are these the same numbers, NaN for NaN? The bits of a NaN may differ."""
    return a.dtype == b.dtype and a.shape == b.shape and numpy.array_equal(a, b, equal_nan=a.dtype.kind == "f")
