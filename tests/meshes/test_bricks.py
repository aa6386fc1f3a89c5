"""Which box owns which cell, blocks and faces, statistics, and refinement."""

import numpy as np
import pytest

from meshes import grading, statistics, symmetry
from meshes.axis import Axis
from meshes.bricks import VOID, BrickMesh, bricks_of
from scenes.model import Box, Scene
from scenes.sink import OXIDE, SILICON, Sink

SINKS = [
    Sink(),
    Sink(width=300e-6, oxide_offset=0.0),
    Sink(
        length=50e-6,
        width=5e-6,
        thickness=20e-6,
        pad_width=30e-6,
        pad_length=40e-6,
        oxide_width=10e-6,
        oxide_length=10e-6,
    ),
]


def exact_volume(sink):
    pads = 2 * sink.pad_length * sink.pad_width * sink.thickness
    oxides = 2 * sink.oxide_length * sink.oxide_width * sink.oxide_thickness
    return sink.length * sink.width * sink.thickness + pads + oxides


@pytest.mark.parametrize("sink", SINKS)
@pytest.mark.parametrize("reduced", [True, False])
def test_the_volume_is_exact_and_blocks_cover_each_cell_once(sink, reduced):
    part = symmetry.reduce(sink.scene())
    scene = part.scene if reduced else sink.scene()
    mesh = grading.first_mesh(scene, 1e-3)
    found = statistics.of(mesh)
    copies = part.copies if reduced else 1
    assert abs(copies * found["volume_m3"] / exact_volume(sink) - 1) < 1e-12
    assert abs(found["volume_m3"] / found["exact_volume_m3"] - 1) < 1e-12
    count = np.zeros(mesh.owner.shape, dtype=int)
    for block in mesh.blocks:
        where = tuple(slice(*span) for span in block.spans)
        assert (mesh.owner[where] == block.box).all()
        count[where] += 1
    assert (count == (mesh.owner != VOID)).all()
    assert found["cells"] == count.sum()


def test_a_missing_cell_is_seen_in_the_volume():
    mesh = grading.first_mesh(Sink().scene(), 1e-2)
    mesh.owner[tuple(np.argwhere(mesh.owner != VOID)[0])] = VOID
    found = statistics.of(mesh)
    assert abs(found["volume_m3"] / found["exact_volume_m3"] - 1) > 1e-9


def test_later_boxes_win():
    lower, upper = (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)
    boxes = (Box("all", SILICON, lower, upper), Box("half", OXIDE, (1.0, 0.0, 0.0), upper))
    x, y, z = Axis(np.array([0.0, 1.0, 2.0]), np.array([1, 1])), *(Axis(np.array([0.0, 1.0]), np.ones(1, int)),) * 2
    assert BrickMesh((x, y, z), boxes).owner.ravel().tolist() == [0, 1]
    assert BrickMesh((x, y, z), boxes[::-1]).owner.ravel().tolist() == [1, 1]


def test_random_labels_are_covered_once():
    labels = np.random.default_rng(2).integers(-1, 3, (5, 4, 3))
    count = np.full(labels.shape, VOID)
    for block in bricks_of(labels):
        where = tuple(slice(*span) for span in block.spans)
        assert (count[where] == VOID).all()
        count[where] = block.box
    assert (count == labels).all()


def test_faces_are_where_the_solid_touches_the_flat_box():
    sink = Sink()
    mesh = grading.first_mesh(sink.scene(), 1e-2)

    def area(lower, upper):
        sizes = [np.diff(axis.breaks) for axis in mesh.axes]
        found = 0.0
        for face in mesh.faces(lower, upper):
            found += np.prod([s[a:b].sum() for s, (a, b) in zip(sizes, face.spans, strict=True) if b > a])
        return found

    far, t = sink.length + sink.pad_length, sink.thickness
    top = area((-75e-6, -sink.pad_length, t), (75e-6, far, t))
    assert abs(top / (1e-3 * 1e-4 + 2 * 150e-6**2) - 1) < 1e-12
    bottom = area((-75e-6, -sink.pad_length, -2e-6), (75e-6, far, -2e-6))
    assert abs(bottom / (2 * 50e-6**2) - 1) < 1e-12


@pytest.mark.parametrize("sink", SINKS)
def test_refinement_keeps_the_planes_and_adds_unknowns(sink):
    scene: Scene = symmetry.reduce(sink.scene()).scene
    mesh, marks = grading.first_mesh(scene, 1e-3), grading.features(scene)
    all_marked = [np.ones(len(axis.degrees), dtype=bool) for axis in mesh.axes]
    finer = grading.refine(mesh, all_marked, marks)
    assert finer.solid.sum() > mesh.solid.sum()
    for d, (axis, before) in enumerate(zip(finer.axes, mesh.axes, strict=True)):
        assert all(plane in axis.breaks for plane in grading.scene_planes(scene, d))
        assert np.isin(before.breaks, axis.breaks).all()
        assert (np.diff(axis.breaks) > 0).all()
        assert axis.degrees.max() <= grading.HIGHEST_DEGREE
    same = grading.refine(mesh, [np.zeros_like(m) for m in all_marked], marks)
    assert all((a.breaks == b.breaks).all() for a, b in zip(same.axes, mesh.axes, strict=True))
    assert finer.boxes == mesh.boxes
