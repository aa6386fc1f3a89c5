"""Electrodes of unknown potential: given currents and series resistances against closed forms and given voltages."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from scenes.errors import BeyondLawError, RunawayError, RunawayInTimeError
from scenes.free import from_dict
from scenes.loading import load_free
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule
from tests.meshes.grouped import boxes as meshed
from tests.meshes.grouped.scenes import bridge

SIZE = (1e-5, 2e-4, 2e-6)
AREA = SIZE[0] * SIZE[2]
METAL = Material("metal", 80.0, 3000.0, 500.0, 1e-6, 2e-3, 293.0)


def end(name, y, value, series=0.0, kind="voltage"):
    """A condition on the bar's cross section at y."""
    return Boundary(name, kind, (0.0, y, 0.0), (SIZE[0], y, SIZE[2]), value, series_resistance=series)


def bar(*electrodes, metal=METAL, steady=True, accuracy=1e-4, probes=(), **more):
    """A bar along y between cold ends."""
    cold = end("cold 0", 0.0, 293.0, kind="temperature"), end("cold 1", SIZE[1], 293.0, kind="temperature")
    whole = Box("bar", metal, (0.0, 0.0, 0.0), SIZE)
    probes = (Probe("mean", whole.lower, whole.upper), *probes)
    return Scene("bar", (whole,), (*cold, *electrodes), probes, accuracy=accuracy, steady=steady, **more)


def current_at(y):
    return Probe(f"current {y:g}", (0.0, y, 0.0), (SIZE[0], y, SIZE[2]), "current")


def test_a_current_fed_into_the_middle_parts_as_the_conductances_say():
    """Ground at one end, 0.1 V behind R at the other, I into a cross section at a quarter: U = (I + G V) / (G + G0)."""
    metal, y = replace(METAL, temperature_coefficient=0.0), SIZE[1] / 4
    near, far = (metal.resistivity * length / AREA for length in (y, SIZE[1] - y))
    series, given, volts = 7.0, 3e-3, 0.1
    scene = bar(
        end("ground", 0.0, 0.0), end("feed", y, given, inf), end("source", SIZE[1], volts, series), metal=metal,
        probes=(current_at(0.0), current_at(SIZE[1]),
                Probe("feed's", (0.0, y, 0.0), (SIZE[0], y, SIZE[2]), "potential"),
                Probe("source's", (0.0, SIZE[1], 0.0), SIZE, "potential")),
    )  # fmt: skip
    found = {name: e.value for name, e in scene_run.solve(scene).steady.items()}
    conductance = 1 / (far + series)
    fed = (given + conductance * volts) / (conductance + 1 / near)
    from_source = conductance * (volts - fed)
    # The potential is linear along the bar, which every space holds: solvers' tolerance, 1e-3 of the accuracy, squared.
    assert found["current 0"] == pytest.approx(-fed / near, rel=1e-9)
    assert found["current 0.0002"] == pytest.approx(from_source, rel=1e-9)
    assert found["feed's"] == pytest.approx(fed, rel=1e-9)
    assert found["source's"] == pytest.approx(volts - series * from_source, rel=1e-9)


def test_beyond_an_electrode_inside_where_nothing_passes_the_potential_is_the_electrodes_own():
    """Half the bar carries current, from 0.1 V behind as much resistance: 0.05 V at the electrode and in the rest."""
    metal, y = replace(METAL, temperature_coefficient=0.0), SIZE[1] / 2
    series = metal.resistivity * y / AREA
    beyond = Probe("beyond", (0.0, 1.5 * y, 0.0), (0.0, 1.5 * y, 0.0), "potential")
    scene = bar(end("ground", 0.0, 0.0), end("source", y, 0.1, series), metal=metal, probes=(beyond,))
    for steady in (True, False):
        again = replace(scene, steady=steady, end_time=1e-3, output_times=() if steady else (1e-3,))
        found = scene_run.solve(again)
        value = found.steady["beyond"].value if steady else found.traces.values["beyond"][-1]
        # Linear along the bar, as above.
        assert value == pytest.approx(0.05, rel=1e-9)


def mean_rise(current, times, terms=400):
    """(times,): the mean rise (K) of the bar at a current from rest: c T' = k T'' + J^2 rho (1 + a T), mode by mode."""
    n = 2 * np.arange(terms) + 1
    heat = (current / AREA) ** 2 * METAL.resistivity
    capacity = METAL.heat_capacity
    a = METAL.temperature_coefficient
    rate = (METAL.thermal_conductivity * (n * np.pi / SIZE[1]) ** 2 - heat * a) / capacity
    parts = 8 / (n * np.pi) ** 2 * heat / capacity / rate
    return -np.expm1(-np.outer(times, rate)) @ parts


LIMIT = AREA * np.pi / SIZE[1] * np.sqrt(METAL.thermal_conductivity / METAL.resistivity / METAL.temperature_coefficient)
"""The current (A) from which on the bar's first mode grows."""


def driven(current, **more):
    return bar(end("in", 0.0, current, inf), end("out", SIZE[1], 0.0), **more)


def test_at_a_given_current_the_heat_equation_is_linear_and_its_modes_are_the_answer():
    current, finish = 0.7 * LIMIT, 2e-4
    found = scene_run.solve(driven(current, steady=False, end_time=finish)).traces
    late = found.time >= 1e-3 * finish
    off = np.abs(found.values["mean"] - 293.0 - mean_rise(current, found.time))[late].max()
    assert off < found.errors["mean"] < 2e-4 * mean_rise(current, [finish])[0]
    wrong = np.abs(found.values["mean"] - 293.0 - mean_rise(1.001 * current, found.time))[late].max()
    assert wrong > 2 * found.errors["mean"]
    steady = scene_run.solve(driven(current)).steady["mean"]
    assert abs(steady.value - 293.0 - mean_rise(current, [np.inf])[0]) < steady.error


@pytest.mark.long
def test_a_current_that_is_switched_off_and_on_is_the_sum_of_its_pieces():
    """Off again after t1: while it is off, the modes decay at their own rates; a jump is no place of an error."""
    switched = Schedule((0.0, 3e-5, 3e-5), (0.7 * LIMIT, 0.7 * LIMIT, 0.0))
    found = scene_run.solve(driven(switched, steady=False, end_time=6e-5)).traces
    n = 2 * np.arange(400) + 1
    diffuses = METAL.thermal_conductivity * (n * np.pi / SIZE[1]) ** 2 / METAL.heat_capacity
    grown = (
        diffuses - (0.7 * LIMIT / AREA) ** 2 * METAL.resistivity * METAL.temperature_coefficient / METAL.heat_capacity
    )
    heat = 8 / (n * np.pi) ** 2 * (0.7 * LIMIT / AREA) ** 2 * METAL.resistivity / METAL.heat_capacity / grown
    exact = float((-np.expm1(-grown * 3e-5) * heat * np.exp(-diffuses * 3e-5)).sum())
    assert abs(found.values["mean"][-1] - 293.0 - exact) < found.errors["mean"]


@pytest.mark.long
def test_a_given_current_with_a_rising_resistance_has_a_largest_one():
    with pytest.raises(RunawayError, match="resistance changes as it heats; the largest current") as caught:
        scene_run.solve(driven(1.02 * LIMIT))
    # With u the rise at the middle, 1 + a u = 1 / cos(m L / 2) there, m being in proportion to the current.
    hottest = LIMIT * 2 / np.pi * np.arccos(1 / (1 + METAL.temperature_coefficient * 1e5))
    assert caught.value.limit == pytest.approx(hottest, rel=1e-4)
    assert scene_run.solve(driven(0.98 * LIMIT)).steady["mean"].value > 1000
    # A bridge whose current moves on its way to the limit: it is named all the same.
    document = bridge(steady=True, accuracy=1e-2)
    document["boundary"][2] = {k: v for k, v in document["boundary"][2].items() if k != "voltage"} | {"current": 0.03}
    with pytest.raises(RunawayError, match="the largest current") as caught:
        scene_run.solve(from_dict(document))
    document["boundary"][2]["current"] = 0.95 * caught.value.limit
    assert scene_run.solve(from_dict(document)).steady["tip"].value > 1000
    # Beyond it the heat grows by the same factor in equal times: by 1e5 within 12 of them.
    over = 1.5
    rate = (over**2 - 1) * METAL.thermal_conductivity * (np.pi / SIZE[1]) ** 2 / METAL.heat_capacity
    with pytest.raises(RunawayInTimeError) as late:
        scene_run.solve(driven(over * LIMIT, steady=False, end_time=100 / rate))
    assert 2 / rate < late.value.time < 12 / rate


@pytest.mark.parametrize("current", [70e-3, pytest.param(150e-3, marks=pytest.mark.long)])
def test_a_given_current_that_takes_most_of_a_falling_resistance_leaves_the_hyperbolic_profile(current):
    """With the rise u, k u'' + J^2 rho (1 - u/S) = 0 between cold ends: u = S (1 - cosh(m y)/cosh(m L/2)). At the
    larger current the first meshes overshoot S, where nothing is left."""
    span = 100.0
    falling = replace(METAL, temperature_coefficient=-1 / span)
    m = current / AREA * np.sqrt(METAL.resistivity / span / METAL.thermal_conductivity)
    mean = span * (1 - np.tanh(m * SIZE[1] / 2) / (m * SIZE[1] / 2))
    assert mean > 0.6 * span
    found = scene_run.solve(driven(current, metal=falling, accuracy=5e-4)).steady["mean"]
    assert abs(found.value - 293.0 - mean) < found.error < 1e-3 * span


@pytest.mark.parametrize("steady", [True, False])
def test_a_given_current_that_leaves_no_resistance_is_told_so_and_does_not_run_away(steady):
    """Its heat falls with the resistance: a state beyond zero resistance belongs to the mesh alone."""
    falling = replace(METAL, temperature_coefficient=-1e-2)
    with pytest.raises(BeyondLawError, match="temperature coefficient makes the resistivity zero"):
        scene_run.solve(driven(1.0, metal=falling, accuracy=1e-2, steady=steady, end_time=1e-3))


def test_a_heat_source_that_uses_up_the_resistivity_is_refused():
    scene = bar(end("plus", 0.0, 1e-4), end("minus", SIZE[1], 0.0), metal=replace(METAL, temperature_coefficient=-1e-2))
    with pytest.raises(BeyondLawError, match="temperature coefficient makes the resistivity zero"):
        scene_run.solve(replace(scene, boxes=(replace(scene.boxes[0], heat_source=3e13),), accuracy=1e-2))


def test_a_bar_in_one_brick_that_is_held_at_all_its_corners_runs_away_at_a_given_current():
    """A probe of its potential keeps its mirror plane from being used: no corner of the brick is then free."""
    rate = 1.25 * METAL.thermal_conductivity * (np.pi / SIZE[1]) ** 2 / METAL.heat_capacity
    drop = Probe("drop", (0.0, 0.0, 0.0), (SIZE[0], 0.0, SIZE[2]), "potential")
    with pytest.raises(RunawayInTimeError) as late:
        scene_run.solve(driven(1.5 * LIMIT, probes=(drop,), accuracy=1e-2, steady=False, end_time=14 / rate))
    assert 2 / rate < late.value.time < 12 / rate


@pytest.mark.parametrize("potential", [False, True])
def test_a_given_current_and_a_source_behind_a_resistance_are_the_state_of_the_voltage(potential):
    scene = load_free("bridge")
    plain = replace(scene, probes=tuple(p for p in scene.probes if p.quantity != "potential"))
    found = scene_run.solve(plain)
    current = found.steady["current"].value
    volts = next(b.value for b in scene.boundaries if b.value == 1.0)
    for value, series in ((current, inf), (3 * volts, 2 * volts / current)):
        boundaries = tuple(
            replace(b, value=value, series_resistance=series) if b.name == "left electrode" else b
            for b in scene.boundaries
        )
        probes = scene.probes if potential else plain.probes
        same = scene_run.solve(replace(scene, boundaries=boundaries, probes=probes))
        # On one mesh they differ by the solvers' tolerance, 1e-3 of the accuracy; potentials want the whole length.
        assert same.details["symmetry"] == ("the half" if potential else "the quarter")
        for name, known in found.steady.items():
            off = abs(same.steady[name].value - known.value)
            assert off < (same.steady[name].error + known.error if potential else 2e-6 * abs(known.value))


def test_on_a_mesh_file_as_on_bricks(tmp_path):
    document = bridge(steady=True, accuracy=1e-2)
    document["boundary"][2] = {k: v for k, v in document["boundary"][2].items() if k != "voltage"} | {
        "current": "10 mA"
    }
    scene = from_dict(document)
    meshed.write(meshed.grouped(scene, "hexahedron", 2), tmp_path / "m.msh", 1e-6)
    on_file = scene_run.solve(from_dict(meshed.document(document, "m.msh", 1e-6), folder=str(tmp_path)))
    bricks = scene_run.solve(from_dict(document))
    assert on_file.steady["current"].value == pytest.approx(0.01, rel=1e-9)
    for name in ("tip", "mean"):
        one, other = on_file.steady[name], bricks.steady[name]
        assert abs(one.value - other.value) < one.error + other.error
        assert abs(other.value - 300) > 10 * (one.error + other.error)


def test_an_electric_scene_over_time_follows_its_currents_at_once():
    metal = replace(METAL, temperature_coefficient=0.0)
    ramp = Schedule((0.0, 1e-3), (0.0, 2e-3))
    scene = bar(end("in", 0.0, ramp, inf), end("out", SIZE[1], 0.0, 50.0), metal=metal, steady=False, end_time=1e-3)
    probe = Probe("in's", (0.0, 0.0, 0.0), (SIZE[0], 0.0, SIZE[2]), "potential")
    alone = replace(scene, boundaries=scene.boundaries[2:], probes=(probe,))
    found = scene_run.solve(alone).traces
    resistance = metal.resistivity * SIZE[1] / AREA + 50.0
    assert found.values["in's"][-1] == pytest.approx(2e-3 * resistance, rel=1e-9)
