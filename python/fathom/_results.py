"""Results of operations that have several."""

from __future__ import annotations

from typing import NamedTuple, Optional, Union

import numpy

from ._fathom import Image

Pixels = Union[numpy.ndarray, Image]


class Occlusion(NamedTuple):
    """Results of `ssao`; None for what was not asked for."""

    visibility: Pixels
    """(H, W) float32: 1 open, 0 blocked"""
    bent_normal: Optional[Pixels]
    """(H, W, 3) float32, unit length, view space: the mean open direction"""
    confidence: Optional[Pixels]
    """(H, W) float32: fraction of samples that hit valid pixels inside the image"""


class DofMasks(NamedTuple):
    """Results of `dof_masks`, (H, W) float32 each; None for what was not asked for."""

    coc: Pixels
    """diameter of the circle of confusion in pixels, positive behind the focus; NaN for invalid pixels"""
    near_weight: Optional[Pixels]
    """1 before the focus, 0 in it and behind it"""
    focus_weight: Optional[Pixels]
    """1 in focus"""
    far_weight: Optional[Pixels]
    """1 behind the focus, 0 in it and before it"""
    max_near_coc: Optional[Pixels]
    """the largest near circle that reaches each pixel, pixels"""
    near_alpha: Optional[Pixels]
    """how much of each pixel the blurred near field covers"""
    disocclusion: Optional[Pixels]
    """1 where a blur shows what lies behind the near field"""
    mixed_pixels: Optional[Pixels]
    """1 where depth was averaged over an edge"""
    tile_min_coc: Optional[Pixels]
    """the smallest circle of each tile, pixels"""
    tile_max_coc: Optional[Pixels]
    """the largest circle of each tile, pixels"""
