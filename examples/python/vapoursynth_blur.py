"""A lens's blur in VapourSynth. In a script: from vapoursynth_blur import blur. By itself it blurs a clip that it makes."""

from __future__ import annotations

from typing import Any

import fathom
import numpy
import vapoursynth as vs


def blur(clip: vs.VideoNode, depth: vs.VideoNode, camera: fathom.Camera | None = None, **options: Any) -> vs.VideoNode:
    """`clip`, RGBS in linear light, as fathom.dof blurs it by `depth`, GRAY16 or GRAYS. Without a camera the depth is relative.

    Of a video: clip.resize.Bicubic(format=vs.RGBS, matrix_in_s="709", transfer_s="linear")
    """
    if clip.format.id != vs.RGBS or depth.format.id not in (vs.GRAY16, vs.GRAYS):
        raise ValueError(f"the clip is {clip.format.name} and must be RGBS; the depth is {depth.format.name}, GRAY16 or GRAYS")

    def frame(n: int, f: list[vs.VideoFrame]) -> vs.VideoFrame:
        light = numpy.stack([numpy.asarray(f[0][plane]) for plane in range(3)], axis=-1)
        blurred = fathom.dof(numpy.asarray(f[1][0]), camera, light, **options)
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
