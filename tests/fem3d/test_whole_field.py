"""The steady field of a free scene: its own estimated error, honest, and refined for where no probe sees it."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d import adapt, field_error, level, probe_quantities, whole_field
from fem3d.solve_scene import clipped, solve
from meshes import grading, symmetry
from scenes.model import Boundary, Box, Material, Probe, Scene

WIDE, THIN = 1e-4, 5e-7


@pytest.fixture(scope="module")
def plate():
    """A thin plate, cold below and heated at one edge, where it is warm within a part of its thickness; the mean of the
    whole, which is all that is asked for, needs few cells."""
    high = (WIDE, WIDE, THIN)
    boundaries = (
        Boundary("cold", "temperature", (0.0, 0.0, 0.0), (WIDE, WIDE, 0.0), 293.0),
        Boundary("flux", "heat_flux", (0.0, 0.0, 0.0), (0.0, WIDE, THIN), 1e5),
    )
    box = Box("plate", Material("polymer", 0.15, 970.0, 1460.0), (0.0, 0.0, 0.0), high)
    return Scene(
        "plate", (box,), boundaries, (Probe("mean", (0.0, 0.0, 0.0), high),), 293.0, accuracy=1e-2, steady=True
    )


def test_a_field_that_swings_where_no_probe_sees_it_is_refined(plate):
    part = symmetry.reduce(clipped(plate))
    study = probe_quantities.study(plate, part)
    probes_alone = adapt.solve(study, False)
    rise = probes_alone.fine.state.rise
    assert probes_alone.field > 0.3
    assert -rise.min() > 0.05 * rise.max()
    found = whole_field.solve(study)
    assert found.field <= study.field
    better = found.fine.state
    assert -better.rise.min() <= found.field * better.rise.max()
    # Against the same cells with degrees so high that their error doesn't count.
    best = level.solution(study, better.heat.mesh.with_degrees(3, 3, 3)).state
    assert field_error.distance(best, better) <= found.field * better.rise.max()
    assert field_error.distance(best, better) > 0.05 * found.field * better.rise.max()


def test_the_result_says_how_far_the_field_is_off(plate, monkeypatch):
    found = solve(plate)
    assert 0 < found.details["field_error"] <= probe_quantities.FIELD
    assert not found.details["warnings"]
    monkeypatch.setattr(whole_field, "MOST_LEVELS", 0)
    warned = solve(plate)
    assert warned.details["field_error"] > 0.3
    assert "the field away from the probes may be off by" in warned.details["warnings"][0]
    assert warned.steady["mean"].value == pytest.approx(found.steady["mean"].value, abs=warned.steady["mean"].error)


def test_no_further_level_where_the_field_is_good_or_nothing_is_heated(plate):
    far = replace(plate.boundaries[1], kind="temperature", value=303.0)
    across = replace(plate.boundaries[0], upper=(0.0, WIDE, THIN))
    bar = replace(plate, boundaries=(across, replace(far, lower=(WIDE, 0.0, 0.0), upper=(WIDE, WIDE, THIN))))
    said = []
    found = solve(bar, said.append)
    assert found.details["field_error"] < 1e-6
    assert not any("for the field" in line for line in said)
    cold = replace(plate, boundaries=plate.boundaries[:1])
    assert solve(cold).details["field_error"] == 0.0


def test_intervals_are_cut_towards_the_steep_end(plate):
    part = symmetry.reduce(clipped(plate))
    study = probe_quantities.study(plate, part)
    mesh = grading.first_mesh(part.scene, 1e-2)
    finer = field_error.refined(level.solution(study, mesh).state)
    # The flux enters at x = 0.
    assert np.diff(finer.axes[0].breaks)[0] == pytest.approx(grading.RATIO * np.diff(mesh.axes[0].breaks)[0])
