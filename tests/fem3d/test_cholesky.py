"""Factors by nested dissection (`fem3d.problems.cholesky`): where they are cut, and that they solve."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import spsolve
from scipy.spatial import Delaunay

from fem3d.problems import cholesky
from fem3d.problems.cholesky import SMALLEST, Factors, Ordering, narrowest


def cloud(count: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places (n, 3) of nodes, and the two ends (edges,) of the edges of a mesh of theirs."""
    places = np.random.default_rng(seed).uniform(size=(count, 3)).round(2)
    pairs = Delaunay(places, qhull_options="QJ").simplices[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
    one, other = np.unique(np.sort(pairs.reshape(-1, 2), axis=1), axis=0).T
    return places, one, other


@pytest.mark.parametrize("seed", range(3))
def test_the_cut_is_the_narrowest_of_all(seed: int) -> None:
    places, one, other = cloud(60, seed)
    sizes, along = np.random.default_rng(seed).integers(1, 4, 60), np.sort(places[:, 0])
    cut = narrowest(along, sizes, one, other)
    assert cut is not None
    every = []
    for k in range(59):
        right = np.arange(60) > k
        across = right[one] != right[other]
        ends = np.unique(np.concatenate([one[across], other[across]]))
        share = sizes[~right].sum() / sizes.sum()
        if along[k] < along[k + 1] and SMALLEST <= share <= 1 - SMALLEST:
            every.append(min(sizes[ends[right[ends]]].sum(), sizes[ends[~right[ends]]].sum()))
    assert sizes[cut.joins].sum() == min(every)
    right = np.isin(np.arange(60), cut.right)
    assert along[~right].max() < along[right].min()
    # Without them no edge goes from one side to the other.
    kept = ~np.isin(one, cut.joins) & ~np.isin(other, cut.joins)
    assert (right[one] == right[other])[kept].all()


def test_nodes_at_one_place_are_not_cut() -> None:
    assert narrowest(np.zeros(4), np.ones(4, int), np.array([0, 1]), np.array([2, 3])) is None


@pytest.mark.parametrize("short", [0, 24, 10_000])
def test_factors_solve_however_what_is_left_is_added(short: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """By runs of neighbours, by rows, or by whichever suits."""
    monkeypatch.setattr(cholesky, "SHORT", short)
    places, one, other = cloud(700, 0)
    weights = np.random.default_rng(1).uniform(1.0, 2.0, len(one))
    graph = csc_array((weights, (one, other)), shape=(700, 700))
    laplacian = csc_array(-graph - graph.T)
    matrix = csc_array(laplacian + eye_array(700) * (1e-3 - laplacian.sum(axis=0)))
    b = np.random.default_rng(2).normal(size=700)
    x = Factors(matrix, np.arange(700), Ordering(places)).solve(b)
    assert x == pytest.approx(spsolve(matrix, b), rel=1e-9)
