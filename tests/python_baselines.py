#!/usr/bin/env python3
"""usage: python_baselines.py

Are the ways of bench/python/baselines.py right where the truth is known? On a plane that a pinhole sees, whose depth, points and
normal have closed forms. Exits 77 where NumPy, Numba or Open3D cannot be imported."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "bench" / "python"))
import baselines  # noqa: E402
import numpy  # noqa: E402

U = 2.0**-24  # half a unit in the last place of a float, relative
WIDTH, HEIGHT, FOCAL, NEAR, FAR = 320, 180, 186.0, 0.5, 50.0
NORMAL = numpy.array([0.3, -0.2, -1]) / numpy.linalg.norm([0.3, -0.2, -1])  # towards the camera

rays = numpy.ones((HEIGHT, WIDTH, 3))
rays[..., 0] = ((numpy.arange(WIDTH) + 0.5) - WIDTH / 2)[None, :] / FOCAL
rays[..., 1] = ((numpy.arange(HEIGHT) + 0.5) - HEIGHT / 2)[:, None] / FOCAL
z = 4 * NORMAL[2] / (rays @ NORMAL)  # the plane through (0, 0, 4)
assert z.min() > NEAR and z.max() < FAR
points = z[..., None] * rays
stored = (FAR - NEAR * FAR / z) / (FAR - NEAR)
frame = baselines.Frame({"near": NEAR, "far": FAR, "focal": FOCAL}, stored.astype(numpy.float32), z.astype(numpy.float32))

# z = NEAR FAR / D with D = FAR - (FAR - NEAR) d. Storing d < 1 is off by U / 2 at most, which is U / 2 FAR of D; rounding the
# product below FAR by U FAR. Of D, which is NEAR FAR / z, that is U / 2 z / NEAR and U z / NEAR; the difference and the quotient
# add U each. Numba's sums are in doubles, so only what is stored and the result are rounded.
largest = z.max() / NEAR
LINEARIZE = {"NumPy": 1.5 * U * largest + 2 * U, "Numba": 0.5 * U * largest + U}
# z, the slope of the pixel's ray, their product, and a quotient in Open3D are rounded.
UNPROJECT = 4 * U
# A normal is that of two differences of points. Each is at least one pixel, z / FOCAL, long and off by twice 4 U |ray| z; they
# meet at an angle whose sine is at least 0.7. More points only average.
down, right = numpy.gradient(points, axis=(0, 1))
sine = numpy.linalg.norm(numpy.cross(down, right), axis=-1) / numpy.linalg.norm(down, axis=-1) / numpy.linalg.norm(right, axis=-1)
assert sine.min() >= 0.7
NORMALS = 2 * 2 * UNPROJECT * numpy.linalg.norm(rays, axis=-1).max() * FOCAL / 0.7

failed = False
for operation, name, method in baselines.METHODS:
    got = baselines.array_of(frame, method(frame)).astype(float)
    if operation == "linearize":
        errors, bound = numpy.abs(got / z - 1), LINEARIZE[name]
    elif operation == "unproject":
        errors, bound = numpy.linalg.norm(got - points, axis=-1) / numpy.linalg.norm(points, axis=-1), UNPROJECT
    else:
        errors, bound = 2 * numpy.arcsin(numpy.linalg.norm(got - NORMAL, axis=-1) / 2), NORMALS
    known = numpy.isfinite(errors)
    # Open3D's map has no normals in the last column and row.
    missing = 0 if "create_normal_map" not in name else WIDTH + HEIGHT - 1
    right = errors[known].max() <= bound and (~known).sum() == missing
    print(f"{operation} {name}: worst error {errors[known].max():.3g} of at most {bound:.3g}, {(~known).sum()} pixels without"
          f"{'' if right else ': WRONG'}")
    failed |= not right
sys.exit(failed)
