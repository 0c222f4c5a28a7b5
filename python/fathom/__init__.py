"""Exact post-processing of depth images.

    import fathom
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    points = fathom.unproject(depth, camera)    # (H, W, 3) float32, metres

docs/python.md explains the rest.
"""

import atexit
import os

from . import _fathom, _operations
from ._camera import Camera, CameraWarning, preset_camera
from ._fathom import BackDepth, Device, DeviceInfo, Error, Image, NoDevice, devices, presets
from ._more import check, depth_at, options, restore_highlights, steady_ranges, upsample_along_edges
from ._operations import *

__version__: str = _fathom._version
__all__ = ["BackDepth", "Camera", "CameraWarning", "Device", "DeviceInfo", "Error", "Image", "NoDevice", "__version__", "check"]
__all__ += ["depth_at", "devices", "options", "preset_camera", "presets", "restore_highlights", "steady_ranges", "upsample_along_edges"]
__all__ += _operations.__all__

atexit.register(_fathom._end_work)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_fathom._begin_child)
for _name in __all__:
    if not hasattr(globals()[_name], "__nb_signature__") and hasattr(globals()[_name], "__module__"):
        globals()[_name].__module__ = __name__  # where people find it
del _name
