"""The second path at a contact, the product against the second path on one mesh and over time, and the
refinement of an L-shaped conductor."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from benchmarks import sdirk
from fem3d.runs.scene import solve
from meshes import symmetry
from scenes import load
from scenes.laws import PowerLaw
from scenes.model import Contact
from scenes.sink import SILICON, Sink
from tests.fem3d import BAR, bar, bar_grid, end, plain_grid, silicon, state_on
from validate.verify import orders, second_path
from validate.verify.second_path import SecondPath

ROOM = 293.0
PLAIN = replace(SILICON, temperature_coefficient=0.0)


def halves(resistance, electrical=None, **material):
    """Two halves of a bar, hot at one end and cold at the other, with a contact between."""
    ends = [end(0, "temperature", 400.0), end(1, "temperature", ROOM)]
    if electrical is not None:
        ends += [end(0, "voltage", 1.0), end(1, "voltage", 0.0)]
    scene = bar(replace(PLAIN, **material), *ends)
    (whole,) = scene.boxes
    half = BAR[1] / 2
    boxes = (replace(whole, name="a", upper=(BAR[0], half, BAR[2])),
             replace(whole, name="b", lower=(0.0, half, 0.0)))  # fmt: skip
    scene = replace(scene, boxes=boxes, contacts=(Contact("c", ("a", "b"), resistance, electrical or 0.0),))
    return SecondPath(scene, bar_grid(scene, 3, 2))


def test_a_contact_s_own_heat_enters_either_side():
    electrical, k, rho = 1e-8, 130.0, 6e-5
    path = halves(1e-6, electrical)
    state, places = path.steady(), path.basis.doflocs[1]
    density = 1.0 / (rho * BAR[1] + electrical)
    plus = path.electrodes[0]
    entering = path.assembled(state)[0][1, plus.nodes].sum()
    assert entering == pytest.approx(density * BAR[0] * BAR[2], rel=1e-9)
    # Each half: its own heat, and the heat at the contact; the temperatures of both sides a and b by resistances.
    r, q = BAR[1] / 2 / k, density**2 * rho * BAR[1] / 2
    hot, cold = 400.0 + q * r / 2, ROOM + q * r / 2
    own = density**2 * electrical / 2
    a, b = np.linalg.solve([[1 / r + 1e6, -1e6], [-1e6, 1 / r + 1e6]], [hot / r + own, cold / r + own])
    sides = np.unique(np.round(state[0][np.abs(places - BAR[1] / 2) < 1e-12], 6))
    assert sides == pytest.approx([b, a], abs=1e-6)


SINKS = {
    "hot": Sink(voltage=10.0),
    "pads": Sink(voltage=-6.0, electrodes="pad-edge", convection_coefficient=300.0, room_temperature=320.0),
    "falling": Sink(silicon=silicon(-5e-4), voltage=5.0, electrodes="pad-edge"),
    "substrate": Sink(substrate_thickness=5e-4, electrodes="pad-edge"),
    "air": Sink(convection_coefficient=1e3, silicon=replace(SILICON, reference_temperature=250.0), oxide_offset=1e-5),
}
RISES = ("peak", "end", "mean")


def of_newton(part, grid):
    """The rises (K) and the power (W) of a sink."""
    path = SecondPath(part.scene, grid)
    state = path.steady()
    means, currents = path.readings(state), path.assembled(state)[0][1]
    return [*(means[name] - part.scene.initial_temperature for name in RISES), part.copies * float(state[1] @ currents)]


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


def transient(path, times):
    """Yield the state at each of some times (s, from 0), each interval being one step of the method of `sdirk`."""
    state = path.rest
    for nodes, value in path.held:
        state[0, nodes] = value
    yield state
    for length in np.diff(times):
        begin, by_rate, rates = state[0], 1 / (sdirk.GAMMA * length), []
        for weights in sdirk.TABLEAU:
            start = begin + length * sum((w * r for w, r in zip(weights, rates, strict=False)), 0 * begin)
            state = path.solve(state, before=start, by_rate=by_rate)
            rates.append(np.where(np.isin(np.arange(path.size), path.free), by_rate * (state[0] - start), 0.0))
        yield state


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
    path = SecondPath(scene, bar_grid(scene, 16, 2))

    def means(pieces):
        steps = np.arange(1, pieces + 1) / pieces
        instants = np.concatenate([[0.0], *(a + (b - a) * steps for a, b in pairwise([0.0, *times]))])
        states = list(transient(path, instants))[pieces::pieces]
        return np.array([path.readings(state)["mean"] for state in states])

    coarse, fine = means(1), means(2)
    found = solve(replace(scene, steady=False, end_time=times[-1], output_times=tuple(times), accuracy=1e-3)).over_time
    off = np.abs(np.interp(times, found.time, found.values["mean"]) - fine)
    assert fine[-1] > 343.0
    assert (off <= found.errors["mean"] + np.abs(fine - coarse)).all()


@pytest.mark.long
def test_both_paths_find_the_same_and_another_law_is_caught():
    """The change by halving its intervals bounds the second path's error, also on its coarser mesh."""
    rows = list(second_path.rows())
    assert {row.verdict for row in rows} == {"agrees"}
    scene = load(second_path.BEAM)
    silicon, *others = scene.boxes
    twin = replace(silicon.material, thermal_conductivity=PowerLaw(130.0, 293.0, -1.25))
    found = solve(replace(scene, boxes=(replace(silicon, material=twin), *others))).steady
    assert abs(found["beam"].value - rows[0].expected) > 3 * rows[0].bound


def test_a_mesh_of_few_cells_is_refined_although_halving_most_of_them_is_followed_by_too_many():
    """On 30 cells each trial but the last is followed by so many that the search once ended there."""
    levels = orders.levels(2_000)
    assert levels[-1][0] >= 2_000
    assert levels[-1][1] < levels[0][1] / 5
