"""Dual solutions against closed forms and against differences of the full coupled solution."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.results.voltmeter import Voltmeter
from fem3d.sensitivity.adjoint import Linearized
from fem3d.sensitivity.goals import Goals
from scenes.model import Boundary, Box, Probe
from tests.fem3d import BAR, bar, bar_grid, end, silicon, steady_on, whole

SOURCE = 1e12  # W/m3


def response(scene, grid, voltage, output="probe:mean"):
    """How an output follows a heat source that is uniform over the bar (per W/m3), by its dual solution, and the
    state."""
    state = steady_on(scene, grid, voltage)
    linearized = Linearized(state)
    z, _ = linearized.solve(Goals(linearized, whole(scene)).of(output))
    space = state.heat.domain.space
    cells = np.arange(space.dofs.shape[1])
    return float(z @ space.on(cells).load(np.ones((len(cells), 1)))), state


def test_a_bar_held_at_both_ends_answers_a_uniform_source_by_its_closed_form():
    material = silicon(0.0)
    scene = bar(material, end(0, "temperature", 293.0), end(1, "temperature", 293.0), heat_source=SOURCE)
    slope, _ = response(scene, bar_grid(scene, 2, 4), 0.0)
    exact = BAR[1] ** 2 / (12 * material.thermal_conductivity)
    # The parabola is in the space; the dual solution is solved to 1e-8.
    assert slope == pytest.approx(exact, rel=1e-8, abs=0)
    assert slope != pytest.approx(exact * (1 + 1e-7), rel=1e-8, abs=0)


@pytest.mark.parametrize("output", ["probe:mean", "power"])
def test_with_a_current_that_heating_changes_it_is_the_difference_of_two_solutions(output):
    held = (end(0, "temperature", 293.0), end(1, "temperature", 293.0))
    scene = bar(silicon(2e-3), *held, end(0, "voltage", 2.0), end(1, "voltage", 0.0), heat_source=SOURCE)
    grid = bar_grid(scene, 2, 4)
    slope, _ = response(scene, grid, 2.0, output)

    def value(source):
        heated = replace(scene, boxes=(replace(scene.boxes[0], heat_source=source),))
        state = steady_on(heated, grid, 2.0)
        if output == "power":
            return state.power
        return float(state.heat.take(state.heat.domain.mean(scene.probes[1])) @ state.rise)

    step = 1e-3 * SOURCE
    difference = (value(SOURCE + step) - value(SOURCE - step)) / (2 * step)
    # Central differences of a step of 1e-3 miss some 1e-6 of the slope.
    assert slope == pytest.approx(difference, rel=1e-5, abs=0)
    without_feedback, _ = response(replace(scene, boundaries=held), grid, 0.0)
    assert without_feedback != pytest.approx(difference, rel=1e-2, abs=0)


def test_a_voltmeter_reads_the_potential_in_a_live_part_and_the_voltage_of_a_still_one():
    """Two bars that do not touch: one between 2 V and 0 V, one at 5 V alone."""
    live = Box("live", silicon(0.0), (0.0, 0.0, 0.0), BAR)
    still = Box("still", silicon(0.0), (2 * BAR[0], 0.0, 0.0), (3 * BAR[0], *BAR[1:]))
    at_five = Boundary("five", "voltage", (2 * BAR[0], 0.0, 0.0), (3 * BAR[0], 0.0, BAR[2]), 5.0)
    cold = (end(0, "temperature", 293.0), Boundary("cold", "temperature", at_five.lower, at_five.upper, 293.0))
    ends = (end(0, "voltage", 2.0), end(1, "voltage", 0.0))
    scene = bar(silicon(0.0), *cold, *ends, at_five, boxes=(live, still))
    grid = bar_grid(scene, 2, 3)
    axis = np.array([0.0, BAR[0], 2 * BAR[0], 3 * BAR[0]])
    grid = grid.with_axes((axis, *grid.breaks[1:]), (np.full(3, 3), *grid.degrees[1:]))
    state = steady_on(scene, grid, 2.0)

    def read(**probe):
        return Voltmeter(state.heat.domain, Probe("phi", quantity="potential", **probe)).read(state.potential, 0.0)

    quarter = (BAR[0] / 2, BAR[1] / 4, BAR[2] / 2)
    # The potential is linear, so in the space; its equations are solved by iteration to 1e-13 of the energy.
    assert read(lower=quarter, upper=quarter) == pytest.approx(1.5, rel=1e-6)
    assert read(lower=live.lower, upper=live.upper) == pytest.approx(1.0, rel=1e-6)
    assert read(lower=still.lower, upper=still.upper) == pytest.approx(5.0, rel=1e-12)
    assert read(lower=live.lower, upper=live.upper, reduce="max") == pytest.approx(2.0, rel=1e-6)
