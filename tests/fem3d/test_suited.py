"""The grid and the state that Newton's method starts from where the conductivity follows the temperature."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.adaptivity.brick_mesh import Bricks
from fem3d.adaptivity.suited import suited
from fem3d.runs import sink as sinks
from fem3d.solution.newton import _accelerated
from fem3d.spaces.bricks import BrickSpace
from meshes import symmetry
from scenes.laws import PowerLaw
from scenes.sink import SILICON, Sink

FALLING = PowerLaw(130.0, 293.0, -1.3)


def started(volts, accuracy=1e-3):
    sink = Sink(voltage=volts, accuracy=accuracy, silicon=replace(SILICON, thermal_conductivity=FALLING))
    study = sinks.study(sink, 1, symmetry.reduce(sink.scene(1)))
    mesh = Bricks.of(study)
    grid, state = suited(mesh.scene, mesh.grid, study)
    return mesh, replace(mesh, grid=grid), state


def test_an_interval_is_cut_where_the_conductivity_changes_much():
    """At 4 V that of the beam falls to a third along its last, long interval; at 1 V by a tenth."""
    mesh, cut, state = started(4.0)
    assert len(cut.grid.degrees[1]) > len(mesh.grid.degrees[1])
    assert set(mesh.grid.breaks[1]) < set(cut.grid.breaks[1])
    assert all((a == b).all() for d in (0, 2) for a, b in zip(mesh.grid.breaks[d], cut.grid.breaks[d], strict=True))
    # Rough, but no other state: the second path has 623.27 K.
    assert np.abs(state.rise).max() == pytest.approx(623.27, rel=0.02)
    mesh, same, state = started(1.0)
    assert same.grid.same(mesh.grid)
    assert np.abs(state.rise).max() == pytest.approx(21.2769, rel=0.02)


def test_a_field_of_another_grid_is_the_same():
    """Of degrees lower by two, of which all cells of the finer one have all functions."""
    mesh, cut, _ = started(4.0)
    coarse, fine = (BrickSpace(each.grid) for each in (mesh, cut))
    points = [b[:-1] + 0.37 * np.diff(b) for b in cut.grid.breaks]
    u = np.random.default_rng(1).standard_normal(coarse.size) * (coarse.depth >= 2)
    inside = cut.grid.solid
    own, others = (space.sample(v, *points)[inside] for space, v in ((fine, fine.interpolated(coarse, u)), (coarse, u)))
    assert np.abs(own - others).max() < 1e-9 * np.abs(others).max()
    u[0] += 1e-6 * np.abs(u).max()
    assert np.abs(own - coarse.sample(u, *points)[inside]).max() > 1e-9 * np.abs(others).max()


def test_secants_take_away_what_shrinks_slowly():
    """Of three unknowns that each step of an iteration brings nearer by a factor, four steps tell the answer."""
    factors, answer = np.array([0.9, -0.6, 0.3]), np.array([1.0, -2.0, 5.0])
    rises = [np.zeros(3)]
    for _ in range(3):
        rises.append(rises[-1] + (1 - factors) * (answer - rises[-1]))
    steps = [(1 - factors) * (answer - rise) for rise in rises]
    assert rises[-1] + _accelerated(rises, steps) == pytest.approx(answer, abs=1e-9)
    assert np.abs(rises[-1] + steps[-1] - answer).max() > 0.5
