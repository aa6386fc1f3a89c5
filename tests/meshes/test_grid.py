"""Which box owns which cell, spans and statistics, and that nothing depends on how a grid is turned."""

from dataclasses import replace

import numpy as np
import pytest

from meshes import connected, grading, symmetry
from meshes.grid import VOID, Grid, statistics
from scenes.model import Box, Scene
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


def test_a_missing_cell_is_seen_in_the_volume():
    grid = first(Sink().scene(), 1e-2)
    grid.owner[tuple(np.argwhere(grid.owner != VOID)[0])] = VOID
    found = statistics(grid)
    assert abs(found["volume_m3"] / exact_volume(Sink()) - 1) > 1e-9


def test_later_boxes_win():
    lower, upper = (0.0, 0.0, 0.0), (2.0, 1.0, 1.0)
    boxes = (Box("all", SILICON, lower, upper), Box("half", OXIDE, (1.0, 0.0, 0.0), upper))
    breaks = np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0]), np.array([0.0, 1.0])
    degrees = tuple(np.ones(len(b) - 1, int) for b in breaks)
    assert Grid(breaks, degrees, boxes).owner.ravel().tolist() == [0, 1]
    assert Grid(breaks, degrees, boxes[::-1]).owner.ravel().tolist() == [1, 1]
    grid = Grid(breaks, degrees, boxes)
    assert grid.span(0, 1.0 + 1e-12, 2.0) == (1, 2)
    assert grid.marked(0, {1.0: 0.5, 1.4: 0.1}, np.inf).tolist() == [np.inf, 0.5, np.inf]
    assert grid.same(Grid(breaks, degrees, boxes))
    assert not grid.same(grading.raised(grid))


def turned(scene):
    """The scene with its axes x, y, z as y, z, x."""

    def turn(item):
        return replace(item, lower=(*item.lower[1:], item.lower[0]), upper=(*item.upper[1:], item.upper[0]))

    return replace(
        scene, boxes=tuple(map(turn, scene.boxes)), boundaries=tuple(map(turn, scene.boundaries)),
        probes=tuple(map(turn, scene.probes)),
    )  # fmt: skip


@pytest.mark.parametrize("sink", SINKS)
@pytest.mark.parametrize("accuracy", [1e-2, 1e-4])
def test_a_turned_scene_has_the_same_grid_turned(sink, accuracy):
    scene = symmetry.reduce(sink.scene()).scene
    other = turned(scene)
    grids = [first(scene, accuracy), first(other, accuracy)]
    marks = [grading.features(s) for s in (scene, other)]
    for _ in range(3):
        one, two = grids
        for d in range(3):
            assert (one.breaks[(d + 1) % 3] == two.breaks[d]).all()
            assert (one.degrees[(d + 1) % 3] == two.degrees[d]).all()
        missing = [np.linspace(0.0, 1.0, len(p)) ** 2 for p in one.degrees]
        ours = grading.refined(one, missing, 0.1, marks[0])
        grids = [ours, grading.refined(two, [*missing[1:], missing[0]], 0.1, marks[1])]
        assert not ours.same(one)


@pytest.mark.parametrize("sink", SINKS)
def test_refinement_keeps_the_planes_and_refines_what_misses_most(sink):
    scene: Scene = symmetry.reduce(sink.scene()).scene
    grid, marks = first(scene), grading.features(scene)
    everywhere = [np.ones(len(p)) for p in grid.degrees]
    finer = grading.refined(grid, everywhere, 0.1, marks)
    assert not finer.same(grid)
    for d in range(3):
        assert all(plane in finer.breaks[d] for plane in connected.scene_planes(scene, d))
        assert np.isin(grid.breaks[d], finer.breaks[d]).all()
        assert (np.diff(finer.breaks[d]) > 0).all()
        assert finer.degrees[d].max() <= grading.HIGHEST_DEGREE
        singular = np.isfinite(marks.near(grid)[d])
        cut = np.isin((grid.breaks[d][:-1] + np.diff(grid.breaks[d]) / 2), finer.breaks[d])
        assert not cut.any()  # no interval is halved below the highest degree
        assert len(finer.breaks[d]) - len(grid.breaks[d]) >= singular.sum()
    assert finer.boxes == grid.boxes
    assert grading.refined(grid, [np.zeros_like(m) for m in everywhere], 0.1, marks).same(grid)
    alone = [np.where(np.arange(len(m)) == 0, 1.0, 0.0) if d == 1 else 0 * m for d, m in enumerate(everywhere)]
    one = grading.refined(grid, alone, 0.1, marks)
    assert all((one.breaks[d] == grid.breaks[d]).all() and (one.degrees[d] == grid.degrees[d]).all() for d in (0, 2))
    assert (one.degrees[1][-3:] == grid.degrees[1][-3:]).all()


def test_smooth_intervals_gain_degrees_by_what_they_miss_and_are_halved_at_the_highest():
    box = Box("box", SILICON, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    scene = Scene("box", (box,), (), ())
    marks = grading.features(scene)
    breaks = np.array([0.0, 1.0])
    for degree, missing, degrees, points in (
        (4, 1.0, [5], 2), (4, 0.01, [4], 2), (grading.HIGHEST_DEGREE, 1.0, [8, 8], 3),
    ):  # fmt: skip
        grid = Grid(3 * (breaks,), 3 * (np.array([degree]),), scene.boxes)
        finer = grading.refined(grid, [np.array([missing]), np.zeros(1), np.zeros(1)], 0.1, marks)
        assert finer.degrees[0].tolist() == degrees
        assert len(finer.breaks[0]) == points
        assert finer.degrees[1].tolist() == [degree]


def test_the_tighter_the_accuracy_the_shorter_the_layers_at_singular_edges_and_the_higher_the_degree():
    scene = symmetry.reduce(Sink().scene()).scene
    grids = [first(scene, a) for a in (1e-2, 1e-3, 1e-4, 1e-5)]
    shortest = [min(float(np.diff(b).min()) for b in g.breaks) for g in grids]
    assert shortest == sorted(shortest, reverse=True)
    assert shortest[0] > 5 * shortest[-1]
    highest = [max(int(p.max()) for p in g.degrees) for g in grids]
    assert highest == sorted(highest)
    assert highest[0] < highest[-1]


def test_a_short_step_sets_lengths_where_it_is_and_nowhere_else():
    """A beam nearly as wide as its pads: 2.5 um beside their corners alone; the layers stay thin."""
    narrow, usual = (first(symmetry.reduce(Sink(width=w).scene()).scene) for w in (145e-6, 100e-6))
    assert [len(p) for p in narrow.degrees][2] == [len(p) for p in usual.degrees][2] == 2
    ends = [g.breaks[1][g.breaks[1] < -30e-6] for g in (narrow, usual)]
    assert ends[0] == pytest.approx(ends[1])
    beside = [np.diff(g.breaks[0])[np.diff(g.breaks[0]).argmin()] for g in (narrow, usual)]
    assert beside[0] < 0.2 * beside[1]


@pytest.mark.parametrize(("target", "refined"), [(1.21, 0), (1.19, 1), (0.31, 1), (0.29, 3)])
def test_so_many_intervals_are_refined_as_bring_all_together_to_a_target(target, refined):
    scene = Scene("box", (Box("box", SILICON, (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)),), (), ())
    grid = Grid(3 * (np.array([0.0, 1.0]),), 3 * (np.array([4]),), scene.boxes)
    missing = [np.array([1.0]), np.array([0.1]), np.array([0.1])]
    finer = grading.refined(grid, missing, target, grading.features(scene))
    assert sum(int(p[0] > 4) for p in finer.degrees) == refined


def test_cells_of_the_coarsest_grid_are_found_on_a_finer_one():
    scene = Sink().scene()
    coarse, fine = connected.coarsest(scene), first(scene)
    assert (fine.refined(coarse, coarse.owner) == fine.owner).all()
