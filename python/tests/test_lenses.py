"""Rays through lenses beside those of COLMAP's own library."""

import numpy
import pytest

import fathom

pycolmap = pytest.importorskip("pycolmap")
pytest.importorskip("fathom._importers")

SIZE = 640, 480
MODELS = {
    "SIMPLE_PINHOLE": [500, 322, 237],
    "PINHOLE": [500, 505, 322, 237],
    "SIMPLE_RADIAL": [500, 322, 237, -0.1],
    "RADIAL": [400, 322, 237, -0.35, 0.13],
    "OPENCV": [500, 505, 322, 237, -0.2, 0.05, 1e-3, -5e-4],
    "FULL_OPENCV": [504.9, 504.8, 326.2, 234, 5.6, 3.6, 7e-5, -9e-5, 0.19, 5.9, 5.4, 1],
    "SIMPLE_RADIAL_FISHEYE": [230, 322, 237, 0.02],
    "RADIAL_FISHEYE": [230, 322, 237, 0.05, -0.01],
    "OPENCV_FISHEYE": [230, 231, 322, 237, 0.05, -0.01, 0.002, -3e-4],
}
TOLERANCE_PX = 1e-9
LEAST_AHEAD = numpy.cos(numpy.radians(89.9))  # COLMAP projects what lies before the camera


@pytest.mark.parametrize("model", MODELS)
def test_rays_are_those_of_colmap(model, tmp_path):
    line = " ".join(map(str, [1, model, *SIZE, *MODELS[model]]))
    (tmp_path / "cameras.txt").write_text(line + "\n")
    camera = fathom.Camera.load(tmp_path / "cameras.txt", preset="colmap")
    theirs = pycolmap.Camera(camera_id=1, model=model, width=SIZE[0], height=SIZE[1], params=MODELS[model])
    pixels = numpy.stack(numpy.meshgrid(numpy.arange(0.5, SIZE[0], 3), numpy.arange(0.5, SIZE[1], 3)), -1).reshape(-1, 2)
    rays = camera.ray_of(pixels)
    assert numpy.isfinite(rays).all()
    ahead = rays[:, 2] > LEAST_AHEAD
    assert ahead.mean() > 0.9
    pixels, rays = pixels[ahead], rays[ahead]

    # A ray, seen in its pixel by COLMAP, and a point in any place, seen by both.
    worst = numpy.abs(theirs.img_from_cam(rays) - pixels).max()
    points = rays * numpy.random.default_rng(5).uniform(0.1, 50, (len(rays), 1))
    apart = numpy.abs(theirs.img_from_cam(points) - camera.pixel_of(points)).max()
    print(f"{model}: {len(pixels)} rays, the worst is {worst:.1e} px off, a point {apart:.1e} px")
    assert max(worst, apart) <= TOLERANCE_PX
