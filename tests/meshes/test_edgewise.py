"""Degrees edge by edge: faces and cells follow their edges, and refinement by the indicators of edges."""

from dataclasses import replace

import numpy as np
import pytest

from meshes import edgewise, grading
from meshes.grid import Grid
from scenes.model import Box, Material

SOLID = Material("solid", 1.0, 1.0, 1.0)
NOTHING = grading.Features((frozenset(),) * 3, ({},) * 3)


def cube(degree=2, count=2):
    breaks = tuple(np.linspace(0.0, 1.0, count + 1) for _ in range(3))
    grid = Grid(breaks, tuple(np.full(count, degree) for _ in range(3)), (Box("all", SOLID, (0.0,) * 3, (1.0,) * 3),))
    return edgewise.of_degree(grid, degree)


def test_faces_and_cells_have_the_highest_degree_of_their_edges():
    edges = [e.copy() for e in cube().edges]
    edges[1][2, 0, 1] = 5
    degrees = edgewise.entities(edges[1], 1)
    assert degrees[4, 1, 2] == degrees[3, 1, 2] == degrees[4, 1, 1] == degrees[3, 1, 3] == 5
    # Across the axis, and of vertices, there is none; others are as they were.
    assert not degrees[:, ::2].any()
    assert (degrees[:, 1::2] == 5).sum() == 6
    assert degrees[:, 3].min() == degrees[:, 3].max() == 2


def test_what_cells_have_is_that_of_the_edges_around_them():
    values = np.zeros((2, 2, 2))
    values[0, 1, 1] = 1.0
    for d, around in enumerate(edgewise.of_cells(values)):
        assert around.shape == edgewise.of_degree(cube(), 2).edges[d].shape
        assert around.sum() == 4


@pytest.mark.parametrize(("missed", "degree"), [(0.9, 2), (5.0, 3), (50.0, 4), (1e9, 6)])
def test_edges_gain_the_degrees_that_they_miss_up_to_those_of_the_other_grid(missed, degree):
    grid, missing = cube(), [np.zeros(e.shape) for e in cube().edges]
    missing[2][0, 1, 1] = missed
    found = edgewise.finer(grid, missing, 1.0, replace(cube(6), edges=()))
    assert found.edges[2][0, 1, 1] == found.degrees[2][1] == degree
    assert found.edges[2].sum() == 2 * found.edges[2].size + degree - 2
    assert found.degrees[2][0] == found.degrees[0].max() == 2


def test_an_interval_that_is_cut_leaves_edges_their_degrees():
    grid = cube(8)
    edges = [np.full(e.shape, 3) for e in grid.edges]
    edges[0][0, 0, 0], edges[1][0, 1, 0] = 8, 5
    grid = replace(grid, edges=tuple(edges), degrees=(np.array([8, 3]), np.array([3, 5]), np.array([3, 3])))
    missing = [np.zeros(e.shape) for e in edges]
    missing[0][0, 0, 0] = 1.0
    found = edgewise.refined(grid, missing, 0.5, NOTHING)
    assert found.breaks[0] == pytest.approx([0.0, 0.25, 0.5, 1.0])
    assert found.edges[0][:2, 0, 0].tolist() == [8, 8]
    # The new plane's edges along y have the degrees of their neighbours.
    assert found.edges[1][:, 1, 0].tolist() == [5, 5, 3, 3]


@pytest.mark.parametrize("seed", range(20))
def test_a_grid_that_misses_something_is_refined(seed):
    """For any indicators: also where single edges have small ones, or large ones are not at their interval's highest
    degree."""
    rng = np.random.default_rng(seed)
    grid = cube(5, 3)
    edges = tuple(rng.integers(2, 6, e.shape) for e in grid.edges)
    highest = (e.max(axis=tuple({0, 1, 2} - {d})) for d, e in enumerate(edges))
    grid = replace(grid, edges=edges, degrees=tuple(highest))
    missing = [10 ** rng.uniform(-3, 0, e.shape) * (rng.random(e.shape) < 0.2) for e in edges]
    found = edgewise.refined(grid, missing, 0.5 * sum(float(m.sum()) for m in missing), NOTHING)
    assert not found.same(grid)
