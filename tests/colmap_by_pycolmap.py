#!/usr/bin/env python3
"""usage: colmap_by_pycolmap.py FATHOM

COLMAP's own library writes reconstructions, as binary and as text files, and projects points. `fathom camera` must make cameras
of those files that see every point at the same pixel. Exits 77 where pycolmap cannot be imported."""
import json
import pathlib
import subprocess
import sys
import tempfile

try:
    import numpy
    import pycolmap
except ImportError as error:
    print(f"skipped: {error}; pip install pycolmap")
    sys.exit(77)

TOLERANCE_PX = 1e-10  # 2000 pixels, 20 units of distance over a depth of 1, 2^-53, and a dozen operations
fathom = sys.argv[1]
random = numpy.random.default_rng(7)


def pixels_of(camera, points):
    """The camera file's own formula: docs/camera.md, pixels from the corner."""
    view, k = numpy.array(camera["view"]), camera["intrinsics"]
    assert camera["view_axes"] == "opencv" and k["pixel_origin"] == "corner"
    x, y, z = (points @ view[:3, :3].T + view[:3, 3]).T
    return numpy.stack([k["fx"] * x / z + k["cx"], k["fy"] * y / z + k["cy"]], axis=1)


models = {
    "SIMPLE_PINHOLE": [900, 640.5, 360.25],
    "PINHOLE": [901.5, 899.25, 641, 355],
    "SIMPLE_RADIAL": [900, 640, 360, 0],
    "OPENCV": [900, 905, 640, 360, 0, 0, 0, 0],
}
worst, count = 0.0, 0
with tempfile.TemporaryDirectory() as folder:
    folder = pathlib.Path(folder)
    reconstruction = pycolmap.Reconstruction()
    poses = {}
    for number, (model, params) in enumerate(models.items(), 1):
        camera = pycolmap.Camera(camera_id=number, model=model, width=1280, height=720, params=params)
        reconstruction.add_camera_with_trivial_rig(camera)
        quaternion = random.normal(size=4)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(quaternion / numpy.linalg.norm(quaternion)), random.normal(size=3) * 5)
        image = pycolmap.Image(name=f"left/{model}.jpg", camera_id=number, image_id=number)
        reconstruction.add_image_with_trivial_frame(image, pose)
        poses[image.name] = camera, pose
    for kind, write in ("binary", reconstruction.write_binary), ("text", reconstruction.write_text):
        (folder / kind).mkdir()
        write(str(folder / kind))
        for name, (camera, pose) in poses.items():
            made = subprocess.run([fathom, "camera", folder / kind, "--image", name, "--preset", "colmap"],
                                  check=True, capture_output=True, text=True)
            in_camera = random.uniform([-2, -1, 1], [2, 1, 20], size=(50, 3))
            points = numpy.array([pose.inverse() * p for p in in_camera])
            truth = numpy.array([camera.img_from_cam(pose * p) for p in points])
            worst = max(worst, abs(pixels_of(json.loads(made.stdout), points) - truth).max())
            count += len(points)
print(f"{count} points, the worst is off by {worst:.1e} pixels")
sys.exit(not worst < TOLERANCE_PX)
