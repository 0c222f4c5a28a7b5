"""Exact post-processing of depth images.

    import fathom
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    points = fathom.unproject(depth, camera)    # (H, W, 3) float32, metres

docs/python.md explains the rest.
"""

from . import _operations
from ._fathom import (
    BackDepth,
    Camera,
    CameraWarning,
    Device,
    DeviceInfo,
    Error,
    Image,
    NoDevice,
    __version__,
    devices,
    options,
    presets,
)
from ._more import (
    depth_at,
    load as _load,
    preset_camera,
    restore_highlights,
    upsample_along_edges,
)
from ._operations import *

__all__ = [
    "BackDepth",
    "Camera",
    "CameraWarning",
    "Device",
    "DeviceInfo",
    "Error",
    "Image",
    "NoDevice",
    "__version__",
    "depth_at",
    "devices",
    "options",
    "preset_camera",
    "presets",
    "restore_highlights",
    "upsample_along_edges",
]
__all__ += _operations.__all__

for _name in __all__:
    if not hasattr(globals()[_name], "__nb_signature__") and hasattr(globals()[_name], "__module__"):
        globals()[_name].__module__ = __name__  # where people find it
del _name
setattr(Camera, "load", staticmethod(_load))
