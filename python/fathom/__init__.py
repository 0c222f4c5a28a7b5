"""Exact post-processing of depth images: distances, points, normals, ambient occlusion, depth of field and fog.

    import fathom
    camera = fathom.Camera.preset("kinect", fx=525, fy=525, cx=319.5, cy=239.5)
    points = fathom.unproject(depth, camera)    # (H, W, 3) float32, metres

docs/python.md explains the rest.
"""

from ._fathom import (
    Camera,
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
    ssao,
    unproject,
)
from ._results import DofMasks, Occlusion

__all__ = [
    "Camera",
    "Device",
    "DeviceInfo",
    "DofMasks",
    "Error",
    "Image",
    "NoDevice",
    "Occlusion",
    "devices",
    "dof",
    "dof_masks",
    "fog",
    "linearize",
    "normals",
    "ssao",
    "unproject",
]

for _each in (Camera, Device, DeviceInfo, Error, Image, NoDevice, DofMasks, Occlusion):
    _each.__module__ = __name__  # where people find it
del _each
