"""What is made of depth and pictures beside the operations."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from . import _fathom as _module

_fathom: Any = _module  # the stubs name what is public
_load = _module.Camera.load

if TYPE_CHECKING:
    from ._fathom import Camera, Image
    from ._operations import Array, NumpyArray


def load(
    path: str | os.PathLike[str],
    *,
    image: str = "",
    node: str = "",
    preset: str = "",
    undistorted: bool = False,
    storage: str | None = None,
    depth: str | os.PathLike[str] = "",
) -> Camera:
    return _load(os.fspath(path), image=image, node=node, preset=preset, undistorted=undistorted, storage=storage, depth=depth)


load.__doc__ = _load.__doc__


def preset_camera(text: str, width: int, height: int) -> Camera:
    """The camera of a source of depth, from the text that the program's --preset takes.

        preset_camera("kinect:fx=525,fy=525,cx=319.5,cy=239.5", 640, 480)

    Raises ValueError naming what is missing.
    """
    return _fathom._preset_camera(text, width, height)


def depth_at(depth: Array | Image, camera: Camera, x: int, y: int, *, storage: str | None = None, device: Any = None) -> float:
    """The depth at pixel x, y, counted from 0: what a lens focuses on. inf for the background.

    Raises ValueError for a pixel outside the image, or that is invalid.
    """
    return _fathom._depth_at(locals(), (x, y))


def restore_highlights(color: Array | Image, highlights: float) -> NumpyArray:
    """A picture whose white is brighter, which a file of integers has cut off.

    color: (H, W, 3) or (H, W, 4) float32, linear light from 0 to 1. Light from 0.97 on grows smoothly, to highlights times of
    itself at 1, so that a blur shows lamps as bright discs. Two channels have to be that bright, or one of a saturated colour:
    pale surfaces stay as they are. Try 1.05 for a JPEG.

    Returns (H, W, 3) or (H, W, 4) float32.
    """
    return _fathom._restore_highlights(color, highlights)


def upsample_along_edges(depth: Array | Image, color: Array | Image) -> NumpyArray:
    """Depth on the grid of a picture of another size, with its edges where the picture has them.

    depth: (h, w) float32, NaN where nothing is known. color: (H, W, 3) or (H, W, 4) float32, linear light. Both show the same.

    Returns (H, W) float32.
    """
    return _fathom._upsample_along_edges(depth, color)
