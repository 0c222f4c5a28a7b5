"""What a photograph and its estimated depth need before a blur."""

import numpy

import fathom


def test_highlights_end_at_their_peak():
    light = numpy.zeros((2, 3, 4), numpy.float32)
    light[0] = [1, 1, 1, 0.5]
    light[1] = [0.97, 0.2, 0, 1]
    restored = fathom.restore_highlights(light, 3)
    assert restored.dtype == numpy.float32 and (light[0] == [1, 1, 1, 0.5]).all()
    assert (restored[0] == [3, 3, 3, 0.5]).all()  # an alpha stays
    assert (restored[1] == light[1]).all()
    assert (fathom.restore_highlights(light, 1) == light).all()
    pale, lamp = [[[0.552, 0.839, 1]]], [[[1, 0.578, 0.045]]]  # the codes 196, 236, 255 and 255, 200, 60
    assert numpy.allclose(fathom.restore_highlights(numpy.array(pale, numpy.float32), 4), pale)
    assert numpy.allclose(fathom.restore_highlights(numpy.array(lamp, numpy.float32), 4), 4 * numpy.array(lamp))


def test_depth_takes_its_edges_from_the_picture():
    color = numpy.full((32, 48, 3), 0.1, numpy.float32)
    color[:, 21:] = 0.9  # an edge that is none of the depth's grid
    depth = numpy.full((8, 12), 2, numpy.float32)
    depth[:, 6:] = 1
    depth[:, 5] = (2 * 1 + 1 * 3) / 4  # one pixel of the depth shows both
    fine = fathom.upsample_along_edges(depth, color)
    assert fine.shape == (32, 48) and fine.dtype == numpy.float32
    assert (abs(fine[:, :16] - 2) < 0.01).all() and (abs(fine[:, 28:] - 1) < 0.01).all()
    turned = fathom.upsample_along_edges(depth[:, ::-1], color[:, ::-1])  # neither lies without gaps
    assert numpy.allclose(turned[:, ::-1], fine, atol=1e-6)
    assert numpy.isnan(fathom.upsample_along_edges(numpy.full((4, 6), numpy.nan, numpy.float32), color)).all()
