"""The product against the second path: two solvers of one discrete problem, and of one scene over time."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fem3d.runs.scene import solve
from meshes import symmetry
from scenes.laws import PowerLaw
from scenes.sink import SILICON, Sink
from tests.fem3d import bar, bar_grid, end, plain_grid, silicon, state_on
from validate.verify import newton, second_path

SINKS = {
    "paper": Sink(),
    "hot": Sink(voltage=10.0),
    "pads": Sink(voltage=-6.0, electrodes="pad-edge", convection_coefficient=300.0, room_temperature=320.0),
    "falling": Sink(silicon=silicon(-5e-4), voltage=5.0, electrodes="pad-edge"),
    "substrate": Sink(substrate_thickness=5e-4, electrodes="pad-edge"),
    "air": Sink(convection_coefficient=1e3, silicon=replace(SILICON, reference_temperature=250.0), oxide_offset=1e-5),
}
RISES = ("peak", "end", "mean")


def of_newton(part, grid):
    """The rises (K) and the power (W) of a sink."""
    basis, *owner_order = second_path.base(part.scene, grid)
    problem = second_path.problem(part.scene, basis, *owner_order)
    state = newton.steady(problem)
    means = second_path.readings(part.scene, basis, state)
    currents = problem.assembled(state)[0][1]
    return [*(means[name] - problem.start for name in RISES), part.copies * float(state[1] @ currents)]


@pytest.mark.parametrize("name", SINKS)
def test_steady_states_agree_to_the_tolerance_of_the_solvers(name):
    sink = SINKS[name]
    part = symmetry.reduce(sink.scene())
    grid = plain_grid(part.scene, 1)
    theirs = np.array(of_newton(part, grid))

    def ours(sink):
        _, found = state_on(sink, grid, part if sink is SINKS[name] else symmetry.reduce(sink.scene()))
        return np.array([*(found[f"{each}_rise_K"] for each in RISES), found["power_W"]], dtype=float)

    assert np.abs(ours(sink) / theirs - 1).max() < 1e-9
    twin = replace(sink, silicon=replace(sink.silicon, thermal_conductivity=130.0 * (1 + 1e-6)))
    assert np.abs(ours(twin) / theirs - 1).max() > 1e-8


@pytest.mark.long
@pytest.mark.parametrize("exponent", [1.0, -0.5])
def test_transients_with_laws_agree_within_their_errors(exponent):
    """Conductivity and resistivity follow the temperature; the second path's steps are halved."""
    law = PowerLaw(SILICON.resistivity, 293.0, exponent)
    falling = PowerLaw(130.0, 293.0, -1.3)
    material = replace(SILICON, thermal_conductivity=falling, resistivity=law, temperature_coefficient=0.0)
    ends = [end(s, kind, value) for s, volts in ((0, 6.0), (1, 0.0))
            for kind, value in (("voltage", volts), ("temperature", 293.0))]  # fmt: skip
    scene, times = bar(material, *ends), 2e-5 * 2.0 ** np.arange(5)
    basis, *owner_order = second_path.base(scene, bar_grid(scene, 16, 2))
    problem = second_path.problem(scene, basis, *owner_order)

    def means(pieces):
        steps = np.arange(1, pieces + 1) / pieces
        instants = np.concatenate([[0.0], *(a + (b - a) * steps for a, b in pairwise([0.0, *times]))])
        states = list(newton.transient(problem, instants))[pieces::pieces]
        return np.array([second_path.readings(scene, basis, state)["mean"] for state in states])

    coarse, fine = means(1), means(2)
    found = solve(replace(scene, steady=False, end_time=times[-1], output_times=tuple(times), accuracy=1e-3)).over_time
    off = np.abs(np.interp(times, found.time, found.values["mean"]) - fine)
    assert fine[-1] > 343.0
    assert (off <= found.errors["mean"] + np.abs(fine - coarse)).all()


def test_the_second_path_takes_one_degree_only():
    scene = Sink().scene()
    with pytest.raises(ValueError, match="one degree, 1 or 2, everywhere"):
        second_path.base(scene, plain_grid(scene, 3))
