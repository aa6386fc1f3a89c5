"""Sinks with gas, contacts, laws of the temperature and other drives: 3D against 1D, closed forms and other codes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare.kinds import KINDS
from compare.options import Options
from compare.pipeline import solve as answer
from fem3d.runs import sink as sink_run
from reduced1d import ladder
from reduced1d.device.lumped import lump
from scenes.device import Device
from scenes.errors import RunawayError
from scenes.free import as_dict
from scenes.laws import PowerLaw
from scenes.sink import SUBSTRATE, Sink
from tests.conftest import judged

STEADY = Options(steady=True)
AIR = Sink(gap_gas_conductivity=0.026)
BEHIND = Sink(contact_resistance=1e-6)
RISES = ("peak_rise_K", "end_rise_K", "mean_rise_K")
EFFECTS = {
    "gas": ("plate", AIR, "gap_gas_conductivity", 1e-4, ["peak_K"]),
    "gas along a fin": ("fin", AIR, "gap_gas_conductivity", 1e-4, ["peak_K"]),
    "contacts": ("plate", BEHIND, "contact_resistance", 1e-5, ["peak_K", "end_K"]),
    "contacts, current in the pads": (
        "plate", replace(BEHIND, electrodes="pad-edge"), "contact_resistance", 1e-5, ["peak_K", "end_K"],
    ),
}  # fmt: skip
"""Model, sink, the field of the effect, and the first time (s) from which some traces agree."""


@cache
def in_3d(sink):
    return sink_run.solve(sink)


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.long) if "," in n else n for n in EFFECTS])
def test_1d_model_agrees_with_3d_at_rest_and_over_time(name):
    reduction, sink, field, first, traces = EFFECTS[name]
    three = in_3d(sink)
    times, one = three.over_time.time, ladder.solve(sink, reduction, times=three.over_time.time)
    twin = ladder.solve(replace(sink, **{field: 1.02 * getattr(sink, field)}), reduction, times=times)
    # Both neglect the second order in the Biot number of the gas, 2e-4; the plate also neglects its remainder.
    part = one.details.get("thin_plate_remainder", 0.0) * one.steady["end_rise_K"].value
    for key in RISES:
        a, b, c = (result.steady[key] for result in (three, one, twin))
        bound = a.error + b.error + 1e-4 * a.value + part
        assert abs(a.value - b.value) <= bound, key
        assert abs(a.value - c.value) > 3 * bound, key
    late = times >= first
    for key in traces:
        off = np.abs(three.over_time.values[key] - one.over_time.values[key])[late].max()
        neglected = 3e-4 * three.steady["peak_rise_K"].value + part
        assert off < three.over_time.errors[key] + one.over_time.errors[key] + neglected, key


def test_sink_in_air_agrees_with_another_code():
    found = in_3d(AIR).steady
    # An independent code of bricks has 2.45725 K, to all these digits.
    assert abs(found["peak_rise_K"].value - 2.45725) < found["peak_rise_K"].error < 1e-3
    assert found["heat_out_W"].value == pytest.approx(found["power_W"].value, rel=1e-9)
    # The beam's heat leaves by its ends and the gas below at the mean rise, whose parabola in z is 1e-6.
    film = AIR.gap_coefficient * AIR.length * AIR.width * found["mean_rise_K"].value
    assert 2 * found["end_flow_W"].value + film == pytest.approx(found["power_W"].value, rel=2e-4)
    steady = ladder.solve(AIR, "paper", steady_only=True).steady
    assert steady["heat_out_W"].value == pytest.approx(steady["power_W"].value, rel=1e-9)


@pytest.mark.long
def test_gas_over_a_substrate_of_metal_and_of_silicon():
    """The gas is boxes then, which conduct across the gap alone."""
    rough, size = replace(AIR, accuracy=1e-2), {"substrate_length": 1.4e-3, "substrate_width": 0.2e-3}
    metal = replace(SUBSTRATE, thermal_conductivity=1e5)
    on = sink_run.solve(replace(rough, substrate_thickness=1e-6, substrate=metal, **size), STEADY).steady
    for name in (*RISES, "end_flow_W", "heat_out_W"):
        known = in_3d(AIR).steady[name]
        assert abs(on[name].value - known.value) < on[name].error + known.error
        assert on[name].error < 2e-2 * known.value
    silicon = replace(rough, substrate_thickness=0.5e-3, **size)
    found, bare = sink_run.solve(silicon, STEADY).steady["mean_rise_K"], in_3d(AIR).steady["mean_rise_K"].value
    added = found.value - bare
    assert added > 2 * found.error
    # In 1D the substrate is a resistance below the whole beam, and one below each oxide, each from even heat.
    assert ladder.solve(silicon, "fin", steady_only=True).steady["mean_rise_K"].value - bare == pytest.approx(
        added, rel=0.2
    )
    # Heat that the gas does not take passes the contacts: they make the peak warmer.
    without, beside = (sink_run.solve(replace(silicon, contact_resistance=r), STEADY).steady["peak_rise_K"]
                       for r in (None, 1e-5))  # fmt: skip
    assert beside.value - without.value > without.error + beside.error


def test_every_face_of_the_oxide_has_a_contact():
    def joints(**more):
        document = as_dict(replace(BEHIND, **more).scene())
        ends = [b["name"] for b in document["boundary"] if "contact_resistance" in b]
        return sorted(tuple(c["between"]) for c in document.get("contact", ())), ends

    pads, below = [("pad-0", "oxide-0"), ("pad-1", "oxide-1")], [("oxide-0", "substrate"), ("oxide-1", "substrate")]
    assert joints(contact_resistance=None) == ([], [])
    assert joints() == (pads, ["substrate-0", "substrate-1"])
    assert joints(substrate_thickness=5e-4) == (sorted([*pads, *below]), [])
    found, ends = joints(spans=2)
    assert (found, len(ends)) == ([("bridge-1", "island-1"), *pads], 3)


LAW = replace(
    Sink(voltage=2.0, accuracy=1e-2),
    silicon=replace(Sink().silicon, thermal_conductivity=PowerLaw(130.0, 293.0, -1.3)),
)


@pytest.mark.parametrize(("sink", "blame"), [(BEHIND, "contacts"), (LAW, "properties at room temperature")])
def test_effect_is_an_assumption_of_its_own(sink, blame):
    outcome = answer(sink, Options(steady=True, why=True))
    (peak,) = [split for split in outcome.analyses["why"].steady if split.quantity == "peak"]
    parts = {part.assumption: part.value for part in peak.parts}
    plain = ladder.solve(replace(sink.plain, contact_resistance=None), "plate", steady_only=True).steady["peak_rise_K"]
    effect = plain.value - outcome.solved.steady["peak_rise_K"].value
    assert parts[blame] == pytest.approx(effect, rel=3e-2)
    assert sum(parts.values()) == pytest.approx(peak.difference.value, rel=1e-9)
    # The paper's equations stay, and all their checks are made.
    paper = ladder.solve(replace(sink.plain, contact_resistance=None), "paper", steady_only=True)
    assert outcome.reduced1d.steady == paper.steady
    checks = {check.id: check for check in outcome.checks}
    assert list(checks) == list(KINDS["sink"].made(sink, STEADY))


@pytest.mark.parametrize("model", ["paper", "anchored", "fin", "plate"])
def test_current_and_series_resistance_give_the_state_of_the_voltage(model):
    """In 3D `tests/fem3d/test_drives.py` compares them."""
    plain = ladder.solve(Sink(), model, steady_only=True).steady
    current = plain["current_A"].value
    for sink in (Sink(current=current), Sink(voltage=2.0, series_resistance=1 / current)):
        found = ladder.solve(sink, model, steady_only=True).steady
        for name, known in plain.items():
            assert found[name].value == pytest.approx(known.value, rel=1e-9)


def test_lump_at_a_given_current_warms_like_an_exponential():
    """C dT/dt = I^2 R0 (1 + a T) - G T is linear."""
    sink, times = Sink(current=6e-3), np.array([0.0, 1e-4, 1e-3, 5e-3, 2e-2])
    model = lump(Device(sink=sink))
    capacity, coefficient, heat = model.capacity[0], model.coefficient[0], sink.current**2 * model.resistance[0]
    rate = (model.conductance - coefficient * heat) / capacity
    traces, exact = ladder.solve(sink, times=times).traces, heat / capacity / rate * -np.expm1(-rate * times)
    assert np.abs(traces.values["mean_K"] - 293.0 - exact).max() < traces.errors["mean_K"] < 1e-4 * exact[-1]
    power = heat * (1 + coefficient * exact)
    assert np.abs(traces.values["power_W"] - power).max() < traces.errors["power_W"] + 1e-12
    twin = ladder.solve(replace(sink, current=1.0001 * 6e-3), times=times).traces
    assert np.abs(twin.values["mean_K"] - 293.0 - exact).max() > 2 * traces.errors["mean_K"]


@pytest.mark.long
def test_largest_current_and_voltage_in_both_models():
    model = lump(Device())
    limit = np.sqrt(model.conductance / model.coefficient[0] / model.resistance[0])
    with pytest.raises(RunawayError, match="rising resistance") as caught:
        ladder.solve(Sink(current=1.001 * limit), steady_only=True)
    assert caught.value.limit == pytest.approx(limit, rel=1e-12)
    with pytest.raises(RunawayError, match="the largest current with a steady state") as in_3d:
        sink_run.solve(Sink(current=2 * limit), STEADY)
    # 3D has the larger anchor resistance, and warms its beam by a sine rather than a parabola.
    assert 0.8 * limit < in_3d.value.limit < limit
    assert sink_run.solve(Sink(current=0.99 * in_3d.value.limit), STEADY).steady["peak_rise_K"].value > 1e4
    falling = replace(Sink().silicon, temperature_coefficient=-1e-3)
    sinks = [Sink(silicon=falling, series_resistance=ohm) for ohm in (0.0, 10.0, 40.0)]
    limits = [ladder.solve(sink, "fin", steady_only=True).details["runaway_voltage_V"] for sink in sinks]
    assert limits[1] > 1.05 * limits[0]
    # Of one lump of r = 300 ohm dV/dI is that resistance and r (1 - y)/(1 + y)^2, at least -r/8, y growing with I.
    assert limits[2] is None
    at = Sink(silicon=falling, series_resistance=10.0, voltage=1.001 * limits[1])
    with pytest.raises(RunawayError, match="no steady state"):
        ladder.solve(at, "fin", steady_only=True)
    with pytest.raises(RunawayError, match="runaway"):
        sink_run.solve(replace(at, voltage=1.2 * limits[1]), STEADY)
    assert sink_run.solve(replace(at, voltage=0.9 * limits[1]), STEADY).steady["peak_rise_K"].value > 100.0


def test_checks_follow_the_drive():
    for drive, followed in (({"current": 3.3e-3}, False), ({"series_resistance": 100.0}, True)):
        sink = Sink(accuracy=1e-2, **drive)
        found = sink_run.solve(sink)
        checks = judged(sink, found, ladder.solve(sink, times=found.over_time.time))
        assert ("fig7_current" in checks) is followed
        assert checks["eq12"].verdict == checks["energy"].verdict == "agrees"
        first = 1 / (300.0 + 100.0) if followed else 3.3e-3
        assert found.over_time.values["current_A"][0] == pytest.approx(first, rel=1e-6)


@pytest.mark.long
@pytest.mark.parametrize(("key", "value"), [("current", 3e-3), ("series_resistance", 50.0)])
def test_slopes_of_contacts_and_drives_agree_with_runs_a_percent_off(key, value):
    sink, options = replace(BEHIND, **{key: value}), Options(steady=True, reduction="plate")
    slopes = answer(sink, options.but(sensitivities=True)).slopes
    for path, name in {"anchor.contact_resistance": "contact_resistance", f"drive.{key}": key}.items():
        up, down = (answer(replace(sink, **{name: getattr(sink, name) * (1 + s)}), options) for s in (0.01, -0.01))
        for quantity in ("peak_rise_K", "end_rise_K", "power_W"):
            for model, each in slopes.items():
                more, less = (getattr(outcome, model).steady[quantity].value for outcome in (up, down))
                difference = np.log(more / less) / np.log(1.01 / 0.99)
                slope = each.relative[path][quantity].value
                assert slope == pytest.approx(difference, abs=3e-4), (path, quantity, model)
        assert abs(slopes["fem3d"].relative[path]["peak_rise_K"].value) > 0.01
