"""A lens's blur in VapourSynth. In a script: from vapoursynth_blur import blur. By itself it blurs a clip that it makes."""

from __future__ import annotations

from typing import Any

import fathom
import numpy
import vapoursynth as vs


def blur(clip: vs.VideoNode, depth: vs.VideoNode, camera: fathom.Camera | None = None, **options: Any) -> vs.VideoNode:
    """`clip`, RGBS in linear light, as fathom.dof blurs it by `depth`, GRAY16 or GRAYS. Without a camera the depth is
    relative: floats count from 0 to 1 as VapourSynth's do, unless relative_range says from where to where they go in all frames.

    Of a video: clip.resize.Bicubic(format=vs.RGBS, matrix_in_s="709", transfer_s="linear")
    """
    if clip.format.id != vs.RGBS or depth.format.id not in (vs.GRAY16, vs.GRAYS):
        raise ValueError(f"the clip is {clip.format.name} and must be RGBS; the depth is {depth.format.name}, GRAY16 or GRAYS")
    own_range = camera is None and depth.format.id == vs.GRAYS and "relative_range" not in options
    if own_range:
        options["relative_range"] = 0, 1

    def frame(n: int, f: list[vs.VideoFrame]) -> vs.VideoFrame:
        light = numpy.stack([numpy.asarray(f[0][plane]) for plane in range(3)], axis=-1)
        stored = numpy.asarray(f[1][0])
        if own_range and (stored.min() < 0 or stored.max() > 1):
            raise ValueError(f"frame {n}: its depth goes from {stored.min()} to {stored.max()}, beyond 0 to 1; give relative_range")
        blurred = fathom.dof(stored, camera, light, **options)
        made = f[0].copy()
        for plane in range(3):
            numpy.copyto(numpy.asarray(made[plane]), blurred[..., plane])
        return made

    return clip.std.ModifyFrame([clip, depth], frame)


if __name__ in ("__main__", "__vapoursynth__"):  # the second is vspipe's
    near = vs.core.std.BlankClip(format=vs.GRAY16, width=160, height=240, length=24, color=52000)
    far = near.std.BlankClip(color=9000)
    left = near.std.BlankClip(format=vs.RGBS, color=[0.9, 0.2, 0.1])
    right = left.std.BlankClip(color=[0.1, 0.3, 0.8])
    picture, relative = (vs.core.std.StackHorizontal(halves) for halves in ([left, right], [near, far]))
    blurred = blur(picture, relative, relative="high-is-near", blur_px=24, focus_at=(240, 120))
    blurred.set_output()
    print(f"red across the edge: {numpy.asarray(blurred.get_frame(0)[0])[120, 148:176:4]}")
