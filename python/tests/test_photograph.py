"""What a photograph and its estimated depth need before a blur: tests/test_photograph.cpp has the formulas."""

import numpy

import fathom


def test_highlights_end_at_their_peak():
    light = numpy.array([[[1, 1, 1, 0.5], [0.97, 0.2, 0, 1]]], numpy.float32)
    restored = fathom.restore_highlights(light, 3)
    assert restored.dtype == numpy.float32 and restored.tolist() == [[[3, 3, 3, 0.5], light[0, 1].tolist()]]
    assert light[0, 0, 0] == 1


def test_depth_takes_its_edges_from_the_picture():
    color = numpy.full((32, 48, 3), 0.1, numpy.float32)
    color[:, 21:] = 0.9  # an edge that is none of the depth's grid
    depth = numpy.full((8, 12), 2, numpy.float32)
    depth[:, 5], depth[:, 6:] = 1.25, 1  # one pixel of the depth shows both
    fine = fathom.upsample_along_edges(depth, color)
    assert fine.shape == (32, 48) and fine.dtype == numpy.float32
    assert (abs(fine[:, :16] - 2) < 0.01).all() and (abs(fine[:, 28:] - 1) < 0.01).all()
    turned = fathom.upsample_along_edges(depth[:, ::-1], color[:, ::-1])  # neither lies without gaps
    assert numpy.allclose(turned[:, ::-1], fine, atol=1e-6)
