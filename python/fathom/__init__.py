"""Exact post-processing of depth images.

    import fathom
    camera = fathom.Camera(preset="kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    points = fathom.unproject(depth, camera)    # (H, W, 3) float32, metres

docs/python.md explains the rest.
"""

from . import _operations
from ._calls import readable as _readable
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
    check,
    depth_at,
    devices,
    options,
    preset_camera,
    presets,
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
    "check",
    "depth_at",
    "devices",
    "options",
    "preset_camera",
    "presets",
    "restore_highlights",
    "upsample_along_edges",
]
__all__ += _operations.__all__

for _each in (BackDepth, Camera, Device, DeviceInfo, Error, Image, NoDevice):
    _each.__module__ = __name__  # where people find it
for _name in __all__:
    if hasattr(globals()[_name], "__nb_signature__"):  # a function of the compiled module
        globals()[_name] = _readable(globals()[_name])
for _name in ("from_json", "load"):
    setattr(Camera, _name, staticmethod(_readable(getattr(Camera, _name))))
del _each, _name
