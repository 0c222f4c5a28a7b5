"""What is made of depth and pictures beside the operations."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Iterable, Literal, Sequence

import numpy

from . import _fathom
from ._arrays import floats
from ._camera import in_python

if TYPE_CHECKING:
    from ._arrays import Array
    from ._camera import Camera
    from ._fathom import Image


def options() -> list[dict[str, Any]]:
    """What each operation takes and gives, for panels of other programs: names, ranges, defaults, words."""
    return [json.loads(each[0]) for each in _fathom._described()[:-2]]  # the last two are none of the program's


def depth_at(depth: Array | Image, camera: Camera, x: int, y: int, *, storage: str | None = None, device: Any = None) -> float:
    """The depth at pixel x, y, counted from 0: what a lens focuses on. inf for the background.

    Raises ValueError for a pixel outside the image, or that is invalid.
    """
    return _fathom._depth_at(locals(), (x, y))


def check(
    depth: Array | Image,
    camera: Camera,
    *,
    storage: str | None = None,
    radius: float | None = None,
    focus: float | None = None,
    focus_at: Sequence[int] | None = None,
    focus_along: tuple[int, int, float] | None = None,
    f_stop: float | None = None,
    focal_length_mm: float | None = None,
    sensor_mm: float | None = None,
    mm_per_unit: float | None = None,
    circle: Sequence[float] | None = None,
    sky: Literal["blur", "sharp", "exclude"] | None = None,
    max_coc_px: float | None = None,
) -> list[str]:
    """What is probably wrong with the camera for this depth: a sentence each, with the cure.

    If nothing is, and a radius of ssao or a lens of dof is given, what is probably wrong with that: it reaches nothing or
    everything that the image shows, or counts in another unit. What a lens lacks the camera gives, as for dof.

    depth, storage, and what concerns lengths: as for the operations. All pixels count: about 50 ms for 1920 x 1080. Only
    focus_at needs a device. The first call of an operation with a camera looks at a sample of its depth, in at most a
    millisecond, and warns (CameraWarning) of the same.

    Returns a list of str, empty if nothing looks wrong. Raises ValueError and fathom.Error as linearize does.
    """
    if focus_at is not None and focus is None and focus_along is None:
        focus, focus_at = depth_at(depth, camera, *focus_at, storage=storage), None
    return [in_python(each) for each in _fathom._check(locals())]


def restore_highlights(color: Array | Image, highlights: float) -> numpy.ndarray:
    """A picture whose white is brighter, which a file of integers has cut off.

    color: (H, W, 3) or (H, W, 4) float32, linear light from 0 to 1. Light from 0.97 on grows smoothly, to highlights times of
    itself at 1, so that a blur shows lamps as bright discs. Two channels have to be that bright, or one of a saturated colour:
    pale surfaces stay as they are. Try 1.05 for a JPEG.

    Returns (H, W, 3) or (H, W, 4) float32.
    """
    light, _ = floats(color, "numbers", "color")
    _fathom._restore_highlights(light, highlights)
    return light


def steady_ranges(frames: Iterable[Array | Image]) -> numpy.ndarray:
    """Ranges under which relative depth of a shot does not flicker: relative_range for each frame.

    frames: (H, W) arrays of any dtype in their order, each with a scale and an offset of its own, as neural networks give them.
    What keeps its distance keeps its value then, up to the next cut.

    Returns (N, 2) float64: the stored values of each frame that are 0 and 1. Raises ValueError for a frame of one value.
    """
    shot = [_fathom._shot_frame(floats(each, "numbers", "frames")[0]) for each in frames]
    return numpy.array(_fathom._steady_ranges(shot)).reshape(-1, 2)


def upsample_along_edges(depth: Array | Image, color: Array | Image) -> numpy.ndarray:
    """Depth on the grid of a picture of another size, with its edges where the picture has them.

    depth: (h, w) float32, NaN where nothing is known. color: (H, W, 3) or (H, W, 4) float32, linear light. Both show the same.

    Returns (H, W) float32.
    """
    values, light = floats(depth, "numbers", "depth")[0], floats(color, "numbers", "color")[0]
    made = numpy.empty(light.shape[:2], "float32")
    _fathom._upsample_along_edges(values, light, made)
    return made
