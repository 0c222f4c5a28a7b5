#!/usr/bin/env python3
"""usage: rivals.py

Are the ways of bench/python/rivals.py right where the truth is known? On a plane that a pinhole sees, whose depth, points and
normal have closed forms. Exits 77 where NumPy, Numba or Open3D cannot be imported."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "bench" / "python"))
import numpy  # noqa: E402
import rivals  # noqa: E402

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
frame = rivals.Frame({"near": NEAR, "far": FAR, "focal": FOCAL}, stored.astype(numpy.float32), z.astype(numpy.float32))

# 1/z = (FAR - (FAR - NEAR) d) / (NEAR FAR): an error e of the stored value, below 1, is one of e (FAR - NEAR) z / (NEAR FAR) <
# e z / NEAR of z. Storing has e = U / 2 of the largest power of two, NumPy's product and difference U / 2 each likewise, and
# the subtrahend's factor and the quotient one rounding of U of their own: less than 4 U z / NEAR in all; Numba's sums are in
# double, and only storing and the result are rounded.
largest = z.max() / NEAR
LINEARIZE = {"NumPy": 4 * U * largest, "Numba": U * largest + U}
# z, the pixel's slope and their product are each rounded to floats, and Open3D's pixels as well.
UNPROJECT = 4 * U
# Differences of two pixels are at least z / FOCAL long, and their ends off by 4 U of a distance of at most |ray| z; each normal
# has two such differences, which meet at no less than 45 degrees, and one that leaves the plane by less turns it by less.
LONGEST = numpy.linalg.norm(rays, axis=-1).max()
NORMALS = 2 * 2**0.5 * (2 * 4 * U * LONGEST) * FOCAL

failed = False
for operation, name, method in rivals.METHODS:
    got = rivals.array_of(frame, method(frame)).astype(float)
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
