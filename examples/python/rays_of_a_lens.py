"""The rays of a lens that has no name in a camera file, as an image: Mei's model, as Kalibr and OpenCV's omnidir have it.

usage: rays_of_a_lens.py WIDTH HEIGHT fx fy cx cy xi k1 k2 p1 p2 WRITTEN.npy

cx and cy count from the centre of the first pixel. The camera file then says "lens": {"rays": "WRITTEN.npy"}. Rays are unit vectors
of x right, y down and z ahead, and 0 where a pixel has none. Any other model is written in the same way.
"""

import sys

import numpy


def rays(width, height, fx, fy, cx, cy, xi, k1, k2, p1, p2):
    """(height, width, 3): Mei and Rives 2007, single view point omnidirectional cameras, eq. 1 to 8."""
    column, row = numpy.meshgrid(numpy.arange(width), numpy.arange(height))
    seen = numpy.stack([(column - cx) / fx, (row - cy) / fy])

    def distorted(x, y):
        square = x * x + y * y
        radial = 1 + k1 * square + k2 * square**2
        return numpy.stack(
            [
                x * radial + 2 * p1 * x * y + p2 * (square + 2 * x * x),
                y * radial + p1 * (square + 2 * y * y) + 2 * p2 * x * y,
            ]
        )

    # Newton's steps in two unknowns, with slopes by small differences.
    at, step = seen.copy(), 1e-6
    for _ in range(30):
        off = distorted(*at) - seen
        by_x = (distorted(at[0] + step, at[1]) - distorted(at[0] - step, at[1])) / (2 * step)
        by_y = (distorted(at[0], at[1] + step) - distorted(at[0], at[1] - step)) / (2 * step)
        determinant = by_x[0] * by_y[1] - by_x[1] * by_y[0]
        with numpy.errstate(all="ignore"):
            at = at - numpy.stack([by_y[1] * off[0] - by_y[0] * off[1], by_x[0] * off[1] - by_x[1] * off[0]]) / determinant
    square = (at**2).sum(axis=0)
    with numpy.errstate(all="ignore"):
        scale = (xi + numpy.sqrt(1 + (1 - xi * xi) * square)) / (1 + square)
        found = numpy.stack([scale * at[0], scale * at[1], scale - xi], axis=-1)
        off = numpy.abs(distorted(*at) - seen).max(axis=0)
    found[~(off < 1e-9) | ~(determinant > 0) | ~numpy.isfinite(found).all(axis=-1)] = 0  # beyond a fold
    return found.astype(numpy.float32)


if __name__ == "__main__":
    size, numbers, written = [int(each) for each in sys.argv[1:3]], [float(each) for each in sys.argv[3:12]], sys.argv[12]
    numpy.save(written, rays(*size, *numbers))
