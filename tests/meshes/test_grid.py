"""The box that owns each cell, and the volume of the cells."""

import numpy as np
import pytest

from meshes import grading, symmetry
from meshes.grid import VOID, Grid, statistics
from scenes.model import Box
from scenes.sink import OXIDE, SILICON, Sink

SINKS = [
    Sink(),
    Sink(width=300e-6, oxide_offset=0.0),
    Sink(length=50e-6, width=5e-6, thickness=20e-6, pad_width=30e-6, pad_length=40e-6, oxide_width=10e-6,
         oxide_length=10e-6),
]  # fmt: skip


def first(scene, accuracy=1e-3):
    return grading.first_grid(scene, accuracy, grading.features(scene))


def exact_volume(sink):
    pads = 2 * sink.pad_length * sink.pad_width * sink.thickness
    oxides = 2 * sink.oxide_length * sink.oxide_width * sink.oxide_thickness
    return sink.length * sink.width * sink.thickness + pads + oxides


@pytest.mark.parametrize("sink", SINKS)
@pytest.mark.parametrize("reduced", [True, False])
def test_the_volume_is_exact(sink, reduced):
    part = symmetry.reduce(sink.scene())
    grid = first(part.scene if reduced else sink.scene())
    found = statistics(grid)
    assert abs((part.copies if reduced else 1) * found["volume_m3"] / exact_volume(sink) - 1) < 1e-12
    assert found["cells"] == (grid.owner != VOID).sum()


@pytest.mark.parametrize("mirrored", [False, True])
def test_constriction_is_separated_from_smooth_rest(mirrored):
    """The pads stand out by 25 um beside the beam, whose half is 500 um: changes there decay within
    50 um of the layers, whose longest ends at 75 um, or at 150 um of the whole beam."""
    whole = Sink().scene()
    scene = whole if mirrored else symmetry.reduce(whole).scene
    coarse, fine = (set(np.round(first(scene, a).breaks[1] * 1e6, 3).tolist()) for a in (4e-5, 3e-5))
    beyond = {c for c in fine - coarse if 75 < c < 925}
    assert beyond == ({200.0, 800.0} if mirrored else {125.0})


def test_later_boxes_win():
    lower, upper = (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)
    boxes = (Box("all", SILICON, lower, upper), Box("half", OXIDE, (1.0, 0.0, 0.0), upper))
    breaks = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    degrees = tuple(np.ones(len(b) - 1, int) for b in breaks)
    assert Grid(breaks, degrees, boxes).owner.ravel().tolist() == [0, 1]
    assert Grid(breaks, degrees, boxes[::-1]).owner.ravel().tolist() == [1, 1]
