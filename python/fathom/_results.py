"""Results of operations that have several. Their types stand in _results.pyi."""

from collections import namedtuple


def _documented(kind, doc, fields):
    kind.__doc__ = doc
    for name, text in fields.items():
        getattr(kind, name).__doc__ = text
    return kind


_OCCLUSION = {
    "visibility": "(H, W) float32: 1 open, 0 blocked; NaN for invalid pixels",
    "bent_normal": "(H, W, 3) float32, the mean open direction: unit length, in view space, whatever normals_space is",
    "confidence": "(H, W) float32: fraction of samples that hit valid pixels inside the image",
}
Occlusion = _documented(
    namedtuple("Occlusion", _OCCLUSION, module="fathom"),
    "Results of `ssao`; None for what was not asked for.",
    _OCCLUSION,
)

_TILES = "(ceil(H / tile_px), ceil(W / tile_px)) float32: "
_DOF_MASKS = {
    "coc": "(H, W) float32: diameter of the circle of confusion in pixels, positive behind the focus; NaN if invalid",
    "near_weight": "(H, W) float32: 1 before the focus, 0 in it and behind it",
    "focus_weight": "(H, W) float32: 1 in focus",
    "far_weight": "(H, W) float32: 1 behind the focus, 0 in it and before it",
    "max_near_coc": "(H, W) float32: the largest near circle that reaches each pixel, pixels",
    "near_alpha": "(H, W) float32: how much of each pixel the blurred near field covers",
    "disocclusion": "(H, W) float32: 1 where a blur shows what lies behind the near field",
    "mixed_pixels": "(H, W) float32: 1 where depth was averaged over an edge",
    "tile_min_coc": _TILES + "the smallest circle of each tile, pixels",
    "tile_max_coc": _TILES + "the largest circle of each tile, pixels",
}
DofMasks = _documented(
    namedtuple("DofMasks", _DOF_MASKS, module="fathom"),
    "Results of `dof_masks`; None for what was not asked for.",
    _DOF_MASKS,
)
