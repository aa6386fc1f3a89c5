"""The steady field of a free scene: its own estimated error, honest, and refined for where no probe sees it."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks import invariants
from benchmarks.random_boxes import draw
from fem3d.adaptivity import mesh, nested
from fem3d.adaptivity.adapt import adapt
from fem3d.runs import probe_quantities
from fem3d.runs.scene import clipped, solve
from fem3d.spaces.domain import boxes
from meshes import grading, symmetry
from scenes.model import Boundary, Box, Material, Probe, Scene

WIDE, THIN = 1e-4, 5e-7


@pytest.fixture(scope="module")
def plate():
    """A thin plate, cold below and heated at one edge, where it is warm within a part of its thickness; the mean of the
    whole, the only probe, needs few cells."""
    high = (WIDE, WIDE, THIN)
    boundaries = (
        Boundary("cold", "temperature", (0.0, 0.0, 0.0), (WIDE, WIDE, 0.0), 293.0),
        Boundary("flux", "heat_flux", (0.0, 0.0, 0.0), (0.0, WIDE, THIN), 1e5),
    )
    box = Box("plate", Material("polymer", 0.15, 970.0, 1460.0), (0.0, 0.0, 0.0), high)
    return Scene(
        "plate", (box,), boundaries, (Probe("mean", (0.0, 0.0, 0.0), high),), 293.0, accuracy=1e-2, steady=True
    )


def study_of(scene):
    return probe_quantities.study(scene, symmetry.reduce(clipped(scene)))


def swings(state):
    """How far a field that nothing cools is below the start, over its largest rise."""
    space = state.heat.domain.space
    lattice = [np.linspace(b[0], b[-1], 60) for b in space.grid.breaks]
    field = space.sample(state.heat.field(state.rise), *lattice)
    return -field.min() / field.max()


def distance(state, better):
    """The largest distance of two fields, over the largest rise, at points of the better one's cells."""
    space = better.heat.domain.space
    at = [(b[:-1, None] + np.diff(b)[:, None] * np.linspace(0.02, 0.98, 9)).ravel() for b in space.grid.breaks]
    one, other = (s.heat.domain.space.sample(s.heat.field(s.rise), *at) for s in (state, better))
    return float(np.abs(one - other).max() / other.max())


def test_field_far_from_probes_is_refined(plate):
    study = study_of(plate)
    probes_alone = adapt(replace(study, field=None), False).fine.state
    found = adapt(study, False)
    assert found.field <= study.field
    state = found.fine.state
    # Against cells of a degree so high that their error doesn't count.
    grid = state.heat.domain.space.grid
    for _ in range(3):
        grid = grading.raised(grid)
    best = nested.solution(study, nested.problems(boxes(study.part.scene, grid), 1e-6)).state
    assert 0.01 * found.field < distance(state, best) <= found.field
    assert distance(probes_alone, best) > 3 * distance(state, best)
    assert swings(state) <= found.field
    assert swings(probes_alone) > 2 * swings(state)


def test_result_states_error_of_field(plate, monkeypatch):
    found = solve(plate)
    assert 0 < found.details["field_error"] <= probe_quantities.FIELD
    assert not found.details["warnings"]
    monkeypatch.setattr(mesh, "MOST_LEVELS", 0)
    warned = solve(plate)
    assert warned.details["field_error"] > 0.3
    assert "the field away from the probes may be off by" in warned.details["warnings"][0]
    assert warned.steady["mean"].value == pytest.approx(found.steady["mean"].value, abs=warned.steady["mean"].error)


def test_good_field_needs_no_further_level(plate):
    far = replace(plate.boundaries[1], kind="temperature", value=303.0)
    across = replace(plate.boundaries[0], upper=(0.0, WIDE, THIN))
    bar = replace(plate, boundaries=(across, replace(far, lower=(WIDE, 0.0, 0.0), upper=(WIDE, WIDE, THIN))))
    said = []
    found = solve(bar, said.append)
    assert found.details["field_error"] < 1e-6
    assert not any("for the field" in line for line in said)
    cold = replace(plate, boundaries=plate.boundaries[:1])
    assert solve(cold).details["field_error"] == 0.0


def test_field_error_holds_beside_steep_decay():
    """It falls below the cold face by 1.85 times the change by the last degree."""
    drawn = draw(1726)
    result = invariants.solve(drawn.scene)
    assert invariants.undershoot(drawn, result) < 1
    less = replace(result, details={**result.details, "field_error": 0.75 * result.details["field_error"]})
    assert invariants.undershoot(drawn, less) > 1
