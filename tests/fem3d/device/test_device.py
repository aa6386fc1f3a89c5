"""The 3D device: against every unknown stepped implicitly on another mesh, and balances of its heat."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.runs.device import Solved, reduce_structure
from reduced1d.device.lumped import DEGREE, lump, modes
from reduced1d.device.schemes import solve_accurate
from scenes.device import Device
from statespace.device_model import closed_loop, compact
from statespace.march import march
from statespace.result import Run, Runs, stepped
from statespace.runtime import CompactModel

ACCURACY = 1e-3
SAMPLES = 11
# Triquadratic bricks of a quarter on a mesh of its own, every unknown stepped by TR-BDF2 between samples
# (`tests/fem3d/device/full_order.py` at commit 72b18aa0): rises (K) of sink and sensor at each sample from cold, ...
FROM_COLD = np.array(
    [
        (0.000000, 0.000000),
        (0.452527, 0.266395),
        (2.050447, 1.191783),
        (5.056687, 2.962458),
        (9.281104, 5.608935),
        (14.115142, 8.966245),
        (18.769130, 12.698517),
    ]
)
# ... and by a substrate 1 K warmer the changes (uW) of their powers, with 273 K outside.
BY_WARMER_SUBSTRATE = 1e-6 * np.array(
    [
        (0.00000, 0.00000),
        (-15.72564, -0.08654),
        (-44.94949, -1.12439),
        (-81.77784, -4.29863),
        (-122.35963, -9.98887),
        (-164.01513, -17.97418),
        (-204.77958, -27.73149),
        (-243.18457, -38.60858),
        (-278.14296, -49.92346),
    ]
)


@pytest.fixture(scope="module")
def states():
    return reduce_structure(Device(), ACCURACY)


@pytest.fixture(scope="module")
def short():
    return replace(Device(), end_time=(SAMPLES - 1) * 1e-4)


@pytest.mark.long
def test_the_start_is_that_of_every_unknown_stepped_on_another_mesh(states, short):
    # The check's own steps leave 6e-4 (with twice, four times as many 3e-4, 1.4e-4), the model half its accuracy.
    tolerance = 6e-4 + ACCURACY / 2
    found, one = (
        np.column_stack([run.sink_K, run.sensor_K])[: len(FROM_COLD)] - 293
        for run in (states.solve(short)[0], solve_accurate(short))
    )
    assert np.abs(found - FROM_COLD).max() < tolerance * 17.5
    assert np.abs(one - FROM_COLD).max() > 5 * tolerance * 17.5


def test_what_enters_the_polymer_leaves_it_or_stays_in_it(states):
    run = states.solve(replace(Device(), end_time=0.3))[0]
    late = run.time_s > 0.2
    steady = late & (run.time_s <= 0.25)
    assert run.polymer_top_W[steady] == pytest.approx(run.polymer_flux_W[steady], rel=1e-6)
    assert np.abs(run.polymer_top_W - run.polymer_flux_W)[late].max() > run.after.polymer_flux_W


def test_the_sensor_pays_for_what_leaves_through_the_polymer(states):
    for outer in (273.0, 293.0):
        state = states.steady(Device(), outer)
        assert state.polymer_flux_W == pytest.approx(0.15 * 1e-7 / 100e-6 * (310.5 - outer), rel=1e-5)
        apart = abs(state.sensor_power_W - state.polymer_flux_W)
        assert 1e-7 * state.sensor_power_W < apart < 1e-5 * state.sensor_power_W
    cold = states.steady(replace(Device(), control=replace(Device().control, sink_gain=0.0)), 273.0)
    assert cold.sensor_power_W > 1.2 * cold.polymer_flux_W  # without the active sink it pays for the substrate too


def test_errors_hold_where_the_mesh_is_coarser(states):
    short = replace(Device(), end_time=0.02)
    run, lower = states.solve(short)
    rough = reduce_structure(Device(), 1e-2)
    coarse = rough.solve(short)[0]
    for name in ("sink_K", "sensor_K"):
        apart = np.abs(run.trace(name) - coarse.trace(name)).max()
        assert apart < coarse.errors[name] + run.errors[name]
        assert np.abs(run.trace(name) - lower.trace(name)).max() > run.errors[name] / 2
    fine, found, error = states.steady(Device()), rough.steady(Device()), rough.steady_errors(Device())
    apart = abs(fine.sink_power_W - found.sink_power_W)
    assert 0 < apart < error["sink_power_W"] < 1e-2 * fine.sink_power_W


def test_the_error_of_the_flow_holds_right_after_an_outer_step(states):
    """Within 0.5 ms a step at the polymer's top gets some 7 um into its 100 um: the heat that enters it below is
    unchanged, and any swing of the trace is error."""
    step = replace(Device().external, step_time=0.001)
    run, _ = states.solve(replace(Device(), external=step, end_time=0.0015), start="settled")
    after = run.time_s > 0.001
    off = np.abs(run.polymer_flux_W[after] - run.before.polymer_flux_W).max()
    assert run.errors["polymer_flux_W"] / 30 < off < run.errors["polymer_flux_W"]


def test_the_sink_shields_the_sensor_from_the_substrate(states):
    """A 3D solution by other means has 20 pW, -251.9 uW, -215.0 uW with the sink off."""
    found, errors = states.shielding
    closed = "sensor_power_per_substrate_W_per_K"
    assert abs(found.sensor_power_per_substrate_W_per_K) + errors[closed] < 1e-10
    assert errors[closed] > 1e-13
    expected = {"sink_power_per_substrate_W_per_K": -251.9e-6, "sensor_power_per_substrate_sink_off_W_per_K": -215.0e-6}
    for name, value in expected.items():
        assert getattr(found, name) == pytest.approx(value, rel=1e-3)
        assert errors[name] < 1e-3 * abs(value)
    grounded = replace(Device(), control=replace(Device().control, ground_resistance=1e-3))
    shared, _ = replace(states, device=grounded).shielding
    assert abs(shared.sensor_power_per_substrate_W_per_K) > 1e-6


@pytest.mark.long
def test_exported_it_is_within_what_it_states(states, short):
    """The few states of the file against the 3D model's own run, within the stated errors; the 1D model is
    further off than that."""
    result, lower = states.solve(short)
    runs = Runs(Run(short, result, lambda at: states.stability(at).eigenvalue, reference=lower), None, ())
    made = compact(Solved(states, runs).exported, None, ACCURACY)
    assert made["states"] < states.fine.count
    exported, stated = CompactModel(made), made["error"]["closed loop"]["over time"]
    rows = closed_loop(exported, short, len(result.time_s))
    for name in ("sink_K", "sensor_K", "sensor_power_W"):
        assert np.abs(rows[name] - result.trace(name)).max() + result.errors[name] <= stated[name]["error"] * (1 + 1e-9)
        assert np.abs(rows[name] - solve_accurate(short).trace(name)).max() > 3 * stated[name]["error"]
    g = np.array([0.5, 0.05, 300.0, 285.0])
    read = exported.read(g, np.zeros(4), exported.rest(g))
    films = sum(exported.named(read)[f"{film}_power_W"] for film in ("sink", "sensor"))
    entering = [read[entry["port"]["row"]] for entry in made["inputs"][2:]]
    # As little as the few states leave of the heat at rest.
    assert sum(entering) == pytest.approx(-films, abs=1e-6 * films)


@pytest.mark.long
def test_what_the_gas_takes_is_the_substrates_and_what_the_air_takes_nobodys():
    """With the gas and all else a kelvin warmer both films are warmer too; the air takes the heat of its film."""
    sink = replace(Device().sink, gap_gas_conductivity=0.026, convection_coefficient=1000.0)
    gassy = reduce_structure(replace(Device(), sink=sink), 3e-2)
    modal, structure = gassy.fine, gassy.structure
    to_air = 1 - modal.external[:2] - modal.substrate.external[:2]
    assert (to_air > 3e-3).all()
    taken = modal.outside.taken - modal.substrate.flux[0]
    assert taken == pytest.approx(structure.to_air(structure.heat.lifts[structure.channels[0]]), rel=1e-6)


@pytest.mark.long
def test_contacts_of_the_oxide_stand_in_series_with_it(states):
    """Two under each end; the heat of a warmer substrate through them equals the heat through its film."""

    def bare(found):
        power = found.steady(found.device).sink_power_W
        return found.device.set_rise / (power / 2)

    plain, resistance = Device(), 1e-6
    sink = replace(plain.sink, contact_resistance=resistance, convection_coefficient=1000.0)
    touching = reduce_structure(replace(plain, sink=sink), 3e-2)
    aired = reduce_structure(replace(plain, sink=replace(plain.sink, convection_coefficient=1000.0)), 3e-2)
    area = sink.oxide_length * sink.oxide_width
    # The flow is crowded at the oxide's edges: a contact spreads it, and reduces the resistance of pad and oxide.
    assert bare(touching) - bare(aired) == pytest.approx(2 * resistance / area, rel=0.15)

    structure, modal = touching.structure, touching.fine
    heat, channel = structure.heat, structure.channels[1]
    rise = heat.lifts[channel] + heat.whole(heat.solve_steady(heat.loads[channel][: heat.free]))
    films = [film for name, film in heat.face_flows.items() if name.startswith("substrate")]
    entering = structure.copies * sum(float(f.entering[channel] + f.per_kelvin @ rise) for f in films)
    assert modal.substrate.taken == pytest.approx(entering, rel=1e-6)
    assert abs(structure.to_air(rise)) > 1e-3 * entering


def by_warmer_substrate(modal, nodes: int) -> np.ndarray:
    """(samples, 2): the change of the powers of sink and sensor after a step of the substrate by 1 K, with -20 K
    outside."""
    run = march(modal.above_substrate(-20.0), nodes, stepped(Device(), 1.0), 1e-9, start="settled")
    return run.powers[20:] - run.powers[19]  # the step comes after 20 samples


@pytest.mark.long
def test_a_warmer_substrate_over_time_is_that_of_every_unknown_stepped_on_another_mesh(states):
    """The check's own mesh and steps leave 3e-4 of the largest change (with steps a third as long 2e-4 more), the model
    half its accuracy."""
    full, samples = BY_WARMER_SUBSTRATE, len(BY_WARMER_SUBSTRATE)
    found = by_warmer_substrate(states.fine, states.nodes)
    tolerance = (ACCURACY / 2 + 5e-4) * np.abs(full).max()
    assert np.abs(found[:samples] - full).max() < tolerance
    in_1d = by_warmer_substrate(modes(lump(Device()), DEGREE), states.nodes)
    assert np.abs(in_1d[:samples] - full)[:, 0].max() > 10 * tolerance
    # Sampled at other times the loops answer otherwise.
    assert (np.abs(found[1 : samples + 1] - full).max(axis=0) > 10 * tolerance).all()
