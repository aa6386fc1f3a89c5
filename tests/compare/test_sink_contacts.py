"""A sink whose oxide touches behind contacts, in 3D and in the 1D models that stand on the plate."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare.options import Options
from compare.pipeline import solve as answer
from fem3d.runs import sink as sink_run
from reduced1d import ladder
from reduced1d.ladder.plate import film, stored
from scenes.free import as_dict
from scenes.loading import load
from scenes.sink import Sink

RESISTANCE = 1e-6


@cache
def solved(resistance=RESISTANCE, **more):
    return sink_run.solve(Sink(contact_resistance=resistance, **more))


@cache
def plate(resistance, **more):
    return ladder.solve(Sink(contact_resistance=resistance, **more), "plate", times=solved(**more).traces.time)


@pytest.mark.long
@pytest.mark.parametrize("more", [{}, {"electrodes": "pad-edge"}])
def test_3d_and_the_plate_agree_at_rest_and_over_time(more):
    three, one = solved(**more), plate(RESISTANCE, **more)
    twin = plate(1.02 * RESISTANCE, **more)
    # Of the anchor resistance the plate may leave out its remainder, which moves all rises as that moves the end's.
    part = one.details["thin_plate_remainder"] * one.steady["end_rise_K"].value
    for name in ("peak_rise_K", "end_rise_K", "mean_rise_K"):
        a, b = three.steady[name], one.steady[name]
        assert abs(a.value - b.value) <= a.error + b.error + part, name
        assert abs(a.value - twin.steady[name].value) > 3 * (a.error + b.error + part), name
    for name in ("peak_K", "end_K"):
        late = three.traces.time >= 1e-5
        off = np.abs(three.traces.values[name] - one.traces.values[name])[late].max()
        assert off <= three.traces.errors[name] + one.traces.errors[name] + part, name


def test_the_oxide_between_contacts_stores_as_the_rise_that_they_leave_it():
    plain = Sink()
    assert stored(plain) == pytest.approx(1 / 3)
    # Between large contacts all oxide is at half of the temperature above.
    assert stored(replace(plain, contact_resistance=1.0)) == pytest.approx(1 / 4, rel=1e-4)
    one = replace(plain, contact_resistance=RESISTANCE)
    assert 1 / film(one) - 1 / film(plain) == pytest.approx(2 * RESISTANCE)


def test_every_face_of_the_oxide_has_a_contact():
    def joints(sink):
        document = as_dict(sink.scene())
        ends = [b["name"] for b in document["boundary"] if "contact_resistance" in b]
        return [tuple(c["between"]) for c in document.get("contact", ())], ends

    assert joints(Sink()) == ([], [])
    pads = [("pad-0", "oxide-0"), ("pad-1", "oxide-1")]
    assert joints(Sink(contact_resistance=1e-7)) == (pads, ["substrate-0", "substrate-1"])
    below = [("oxide-0", "substrate"), ("oxide-1", "substrate")]
    found, ends = joints(Sink(contact_resistance=1e-7, substrate_thickness=5e-4))
    assert (sorted(found), ends) == (sorted([*pads, *below]), [])
    found, ends = joints(Sink(contact_resistance=1e-7, spans=2))
    assert (found, len(ends)) == ([("bridge-1", "island-1"), *pads], 3)


def test_contacts_are_an_assumption_of_their_own():
    sink = Sink(contact_resistance=RESISTANCE)
    outcome = answer(sink, Options(steady=True, why=True))
    (peak,) = [split for split in outcome.analyses["why"].steady if split.quantity == "peak"]
    parts = {part.blame: part.value for part in peak.parts}
    without = ladder.solve(Sink(), "plate", steady_only=True).steady["peak_rise_K"].value
    behind = plate(RESISTANCE).steady["peak_rise_K"].value
    assert parts["contacts"] == pytest.approx(without - behind, rel=1e-3)
    assert sum(parts.values()) == pytest.approx(peak.total, rel=1e-9)
    # The paper's equations are as they are.
    assert outcome.reduced1d.steady["peak_rise_K"].value == pytest.approx(
        ladder.solve(Sink(), "paper", steady_only=True).steady["peak_rise_K"].value
    )
    assert "contacts" in [step.step for step in outcome.plan]


@pytest.mark.long
@pytest.mark.parametrize(("key", "value"), [("current", 3e-3), ("series_resistance", 50.0)])
def test_both_models_follow_a_contact_and_what_drives(key, value):
    """A percent of each against runs with that percent more and less."""
    sink = replace(Sink(contact_resistance=1e-6, accuracy=1e-3), **{key: value})
    keys = {"anchor.contact_resistance": "contact_resistance", f"drive.{key}": key}
    slopes = answer(sink, Options(steady=True, reduction="plate", sensitivities=True)).slopes
    for key, name in keys.items():
        up, down = (
            answer(replace(sink, **{name: getattr(sink, name) * (1 + s)}), Options(steady=True, reduction="plate"))
            for s in (0.01, -0.01)
        )
        for quantity in ("peak_rise_K", "end_rise_K", "power_W"):
            for model, each in slopes.items():
                value = each.relative[key][quantity].value
                more, less = (getattr(o, model).steady[quantity].value for o in (up, down))
                difference = np.log(more / less) / np.log(1.01 / 0.99)
                assert value == pytest.approx(difference, abs=3e-4), (key, quantity, model)
        assert abs(slopes["fem3d"].relative[key]["peak_rise_K"].value) > 0.01


@pytest.mark.long
def test_contacts_are_solved_beside_gas_on_a_substrate():
    """Heat that the gas doesn't take passes the contacts: they make the peak warmer, by more than both errors."""
    others = ["gap_gas_conductivity=0.026", "substrate.thickness=0.5mm", "run.accuracy=1e-2"]
    request = Options(steady=True, only="3d")
    without, beside = (
        sink_run.solve(load("sink", [*others, *more]), request).steady["peak_rise_K"]
        for more in ([], ["contact_resistance=1e-5"])
    )
    assert beside.value - without.value > without.error + beside.error
