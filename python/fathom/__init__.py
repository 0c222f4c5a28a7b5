"""Exact post-processing of depth images: distances, points, normals, ambient occlusion, depth of field and fog.

    import fathom
    camera = fathom.Camera.preset("kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    points = fathom.unproject(depth, camera)    # (H, W, 3) float32, metres

docs/python.md explains the rest.
"""

from ._calls import readable as _readable
from ._fathom import (
    Camera,
    CameraWarning,
    Device,
    DeviceInfo,
    Error,
    Image,
    NoDevice,
    __version__,
    devices,
    dof,
    dof_masks,
    fog,
    linearize,
    normals,
    presets,
    ssao,
    unproject,
)
from ._results import DofMasks, Occlusion

__all__ = [
    "Camera",
    "CameraWarning",
    "Device",
    "DeviceInfo",
    "DofMasks",
    "Error",
    "Image",
    "NoDevice",
    "Occlusion",
    "__version__",
    "devices",
    "dof",
    "dof_masks",
    "fog",
    "linearize",
    "normals",
    "presets",
    "ssao",
    "unproject",
]

for _each in (Camera, Device, DeviceInfo, Error, Image, NoDevice):
    _each.__module__ = __name__  # where people find it
for _function in (dof, dof_masks, fog, linearize, normals, ssao, unproject):
    globals()[_function.__name__] = _readable(_function)
for _name in ("from_json", "load", "preset"):
    setattr(Camera, _name, staticmethod(_readable(getattr(Camera, _name))))
del _each, _function, _name
