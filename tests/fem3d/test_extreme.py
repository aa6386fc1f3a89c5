"""Largest and smallest values of the cells' polynomials, against a dense sampling of the same functions."""

from itertools import pairwise

import numpy as np
import pytest

from fem3d.results.probes import Extreme
from fem3d.spaces.domain import boxes
from fem3d.spaces.element import modes
from scenes.model import Box, Probe, Scene
from scenes.sink import SILICON
from tests.fem3d import grid_of

BOX = Box("box", SILICON, (0.0, 0.0, 0.0), (2.0, 1.0, 1.0))
PROBES = [
    Probe("volume", BOX.lower, BOX.upper),
    Probe("half", (1.0, 0.0, 0.0), (2.0, 1.0, 1.0)),
    Probe("face", (0.0, 0.0, 1.0), (2.0, 1.0, 1.0)),
    Probe("line", (0.0, 1.0, 1.0), (2.0, 1.0, 1.0)),
    Probe("point", (0.37, 0.21, 0.8), (0.37, 0.21, 0.8)),
]
SCENE = Scene("box", (BOX,), (), tuple(PROBES))


def domain(degree):
    return boxes(SCENE, grid_of(SCENE, ([0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 0.4, 1.0]), degree))


def dense(space, probe, u, count=41):
    """Values on a lattice of a probe, dense in each cell and with its faces."""
    at = []
    for d, (a, b) in enumerate(zip(probe.lower, probe.upper, strict=True)):
        inner = [x for x in space.grid.breaks[d] if a < x < b]
        ends = [a, *inner, b]
        pieces = [np.linspace(x, y, count) for x, y in pairwise(ends)]
        at.append(np.unique(np.concatenate(pieces)))
    return space.sample(u, *at)


def functions(space, count, seed, fall=0.25):
    """Random functions whose modes beyond the second fall with their degree, as in solutions."""
    found = np.random.default_rng(seed).normal(size=(count, space.size))
    of_mode = np.where(modes(space.p) > 1, modes(space.p), 0).sum(axis=1)
    scale = np.empty(space.size)
    scale[space.dofs] = fall ** np.maximum(of_mode - 2, 0)[:, None]
    return found * scale


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("probe", PROBES, ids=lambda p: p.name)
def test_extremes_equal_dense_sampling_within_error(degree, probe):
    own = domain(degree)
    fields = functions(own.space, 12, degree + 10)
    everywhere = [dense(own.space, probe, u) for u in fields]
    for sign in (1.0, -1.0):
        values, left = Extreme(own.space, own.patches(probe), sign)(fields, np.eye(12))
        sampled = np.array([sign * (sign * found).max() for found in everywhere])
        size = np.abs(sampled).max()
        assert (sign * (values - sampled) >= -left - 1e-4 * size).all()
        assert (sign * (values - sampled) <= 2e-3 * size).all()
        assert (left <= 2e-3 * size).all()
        assert (left >= 0).all()
