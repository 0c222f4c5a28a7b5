"""Lets OpenCL's loader find Intel's driver for CPUs where pip has put it, which the extra `cpu` brings. It is imported before a
device is asked for: only then does the loader look, and only once."""

from __future__ import annotations

import ctypes
import glob
import os
from importlib import metadata

from ._fathom import devices


def _installed() -> str | None:
    try:
        files = metadata.files("intel-opencl-rt") or []
    except metadata.PackageNotFoundError:
        return None
    return next((os.path.realpath(file.locate()) for file in files if file.name == "libintelocl.so"), None)


def _driver() -> str | None:
    if (said := os.environ.get("FATHOM_CPU", "")) not in ("", "off"):
        raise ValueError(f"FATHOM_CPU={said}: the only value is off, which refuses the driver of fathom-depth[cpu]")
    installed, named = _installed(), os.environ.get("OCL_ICD_VENDORS")
    is_other = glob.glob("/etc/OpenCL/vendors/*.icd") if named is None else os.path.realpath(named) != installed
    return None if said or is_other else installed


def _prefer_own(folder: str) -> None:
    """A library of the same name that somebody has loaded, as numba does with a system's TBB, would be taken for the driver's."""
    with open("/proc/self/maps", encoding="utf-8", errors="surrogateescape") as maps:
        loaded = {line.split(maxsplit=5)[5].strip() for line in maps if ".so" in line}
    for name in ("libintlc.so.5", "libimf.so", "libsvml.so", "libtbb.so.12"):
        if any(os.path.basename(file).startswith(name) and os.path.dirname(file) != folder for file in loaded):
            ctypes.CDLL(os.path.join(folder, name), ctypes.RTLD_GLOBAL)


if (_found := _driver()) and os.path.exists(_found):
    _prefer_own(os.path.dirname(_found))
    if "OCL_ICD_VENDORS" not in os.environ:
        os.environ["OCL_ICD_VENDORS"] = _found
        try:
            devices()
        finally:
            del os.environ["OCL_ICD_VENDORS"]  # other processes look themselves
