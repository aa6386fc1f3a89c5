"""A small structure on a large block: degrees edge by edge from a rough solution, whose errors show the missing
degrees."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.adaptivity import brick_mesh, nested
from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import local
from fem3d.spaces.size import foreseen
from meshes import edgewise, grading
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.sink import Sink
from tests.fem3d import problem

UM = 1e-6
GLASS, SILICON = Material("glass", 1.38, 2200.0, 703.0), Material("silicon", 130.0, 2330.0, 712.0)


def bridge(accuracy=1e-2):
    """A heated plate of 80 x 20 x 2 um on a post of glass, on a block of 400 x 400 x 150 um."""
    low, high = (-200 * UM, -200 * UM, -150 * UM), (200 * UM, 200 * UM, 0.0)
    boxes = (
        Box("block", SILICON, low, high), Box("post", GLASS, (-5 * UM, -5 * UM, 0.0), (5 * UM, 5 * UM, 2 * UM)),
        Box("plate", SILICON, (-30 * UM, -10 * UM, 2 * UM), (50 * UM, 10 * UM, 4 * UM), 1e13),
    )  # fmt: skip
    cold = Boundary("cold", "temperature", low, (*high[:2], low[2]), 293.0)
    probes = Probe("plate", boxes[2].lower, boxes[2].upper), Probe("foot", boxes[1].lower, (5 * UM, 5 * UM, 0.0))
    return Scene("bridge", boxes, (cold,), probes, accuracy=accuracy, steady=True)


@cache
def close():
    """A solution to a part in 1,000 whose degrees are uniform in its intervals."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(brick_mesh, "MANY", np.inf)
        return scene_run.solve(bridge(1e-3)).steady


@cache
def rough_and_first():
    study, mesh = scene_run.start(bridge())
    assert isinstance(mesh, Bricks)
    return study, mesh.begin(), mesh


@pytest.mark.long
def test_a_block_takes_few_of_the_unknowns_that_the_planes_of_what_is_on_it_make():
    first = foreseen(bridge(), rough_and_first()[2].grid).unknowns
    found = scene_run.solve(bridge())
    assert found.details["unknowns"] < 0.7 * first
    for name, truth in close().items():
        value = found.steady[name]
        assert abs(value.value - truth.value) < value.error + truth.error < 1.2e-2 * (truth.value - 293.0)
        assert abs(value.value + 3 * value.error - truth.value) > value.error + truth.error


def test_errors_see_what_rough_degrees_leave_out():
    study, rough, _ = rough_and_first()
    given = rough.problems()
    level = rough.examine(study, given, nested.solution(study, given))
    assert level is not None
    for name, truth in close().items():
        value = level.fine.quantities[name]
        off = abs(float(value) - truth.value)
        assert off < level.errors[name] + truth.error
        # That is not because the error is anything.
        assert level.errors[name] < 50 * off


def test_edges_of_one_degree_are_intervals_of_that_degree():
    scene = bridge()
    grid = grading.first_grid(scene, 0.1, grading.features(scene))
    for degree in (2, 5):
        one = edgewise.of_degree(grid, degree)
        same = replace(one, edges=())
        assert (BrickSpace(one).depth == BrickSpace(same).depth).all()
        ours, theirs = (problem(scene, each).stiffness for each in (one, same))
        assert abs(ours - theirs).max() == 0
        sizes = [foreseen(scene, each) for each in (one, same)]
        assert sizes[0] == sizes[1]
    raised = grading.raised(edgewise.of_degree(grid, 3))
    assert [int(e.min()) for e in raised.edges] == [4, 4, 4]


def test_functions_and_matrices_are_those_of_the_edges():
    scene = bridge()
    grid = edgewise.of_degree(grading.first_grid(scene, 0.1, grading.features(scene)), 2)
    rng = np.random.default_rng(0)
    edges = tuple(rng.integers(2, 6, e.shape) for e in grid.edges)
    grid = replace(grid, degrees=tuple(np.full_like(p, 5) for p in grid.degrees), edges=edges)
    space, full = BrickSpace(grid), BrickSpace(replace(grid, edges=()))
    kept, size = space.nested[-1], foreseen(scene, grid)
    assert size.unknowns == kept.sum() < full.nested[-1].sum()
    assert size.entries == sum(len(local(space.p, d).rows) * len(cells) for d, cells in space._classes)
    # Of an edge along x in the middle of the block its own degree, whatever others have.
    at = np.array([4, 5, 3])
    on = (space.position == 2 * at + [1, 0, 0]).all(axis=1)
    assert (on & kept).sum() == edges[0][tuple(at)] - 1
    one = np.ones(space.ijk.shape[1])
    ours, theirs = (s.matrices(one, one)[0].tocsr()[kept][:, kept] for s in (space, full))
    assert abs(ours - theirs).max() < 1e-12 * abs(theirs).max()


def test_spreads_over_edges_add_up_and_are_shared_as_they_were():
    scene = bridge()
    grid = edgewise.of_degree(grading.first_grid(scene, 0.1, grading.features(scene)), 4)
    space = BrickSpace(grid)
    functions = np.flatnonzero((space.position % 2).any(axis=1))
    values = np.random.default_rng(1).normal(size=len(functions))
    spread = space.spread(functions, values)
    assert sum(float(s.sum()) for s in spread) == pytest.approx(np.abs(values).sum())
    by_intervals = BrickSpace(replace(grid, edges=())).spread(functions, values)
    for one, other in zip(edgewise.by_interval(spread), by_intervals, strict=True):
        assert one == pytest.approx(other)
    for one, other in zip(edgewise.shared(grid, edgewise.pooled(grid, spread), spread), spread, strict=True):
        assert one == pytest.approx(other)


@pytest.mark.long
def test_a_sink_on_its_substrate_takes_a_third_of_the_unknowns_and_its_error_holds():
    """Intervals alone took 44,775 unknowns for 1e-4, and two meshes of which the first had 26,554."""
    sink = Sink(substrate_thickness=0.5e-3, accuracy=1e-4)
    found = sink_run.solve(sink, transient=False)
    assert found.details["unknowns"] < 22_000
    finer = sink_run.solve(replace(sink, accuracy=1e-5), transient=False).steady
    for name, truth in finer.items():
        value = found.steady[name]
        assert abs(value.value - truth.value) < value.error + truth.error
        assert abs(value.value + 3 * value.error - truth.value) > value.error + truth.error
