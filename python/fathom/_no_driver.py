"""What of the extra `cpu` is in the way where no device is found, and the cure: for the message of fathom.NoDevice."""

from __future__ import annotations

import glob
import os

from . import _driver


def cure() -> str:
    driver, icds = _driver._installed(), ", ".join(sorted(glob.glob(_driver._OF_SYSTEM)))
    refused = _driver._refused()
    if driver is None:
        first = f"with {' and '.join(refused)} unset, " if refused else ""
        then = f", which is taken where {icds} is not" if icds and not refused else ""
        return f'{first}pip install "fathom-depth[cpu]" brings a driver for the CPU{then}'
    if not os.path.exists(driver):
        return f"{driver} is missing, which pip install --target leaves out; install fathom-depth[cpu] into a venv"
    if refused:
        return f"unset {' and '.join(refused)}, for the driver of fathom-depth[cpu] is installed"
    if icds and "OCL_ICD_VENDORS" not in os.environ:
        return f"the driver of fathom-depth[cpu] is installed, and OCL_ICD_VENDORS={driver} takes it in spite of {icds}"
    return f'the driver of fathom-depth[cpu] is {driver}, which fails; pip install --force-reinstall "fathom-depth[cpu]" mends it'
