"""Fin, plate and moments of materials whose properties follow the temperature."""

from dataclasses import replace

import numpy as np
import pytest

from reduced1d import ladder
from reduced1d.ladder.few_states import over_time, steady
from reduced1d.ladder.following import HOTTEST
from reduced1d.ladder.levels import Levels
from scenes.errors import RunawayError
from scenes.laws import PowerLaw, Table
from scenes.sink import Sink

ROOM = Sink().room_temperature
POWER = PowerLaw(130.0, ROOM, -1.3)
TABLE = Table((293.0, 400.0, 600.0, 1000.0, 1600.0), (130.0, 90.0, 55.0, 30.0, 22.0))
AT = np.array([0.0, 1e-5, 1e-4, 1e-3, 2e-2])


def alike(law, **more) -> Sink:
    """A sink of constant resistivity whose silicon and oxide conduct, and hold, by the same power law: in Kirchhoff's
    variable, the integral of k, all its equations are linear. The oxide holds next to nothing: where in it the
    temperature is that counts is not Kirchhoff's."""
    sink = Sink(**more)
    silicon, oxide = (
        replace(
            m, thermal_conductivity=replace(law, value=m.thermal_conductivity),
            specific_heat=replace(law, value=m.specific_heat), temperature_coefficient=0.0,
        )
        for m in (sink.silicon, replace(sink.oxide, density=1e-3))
    )  # fmt: skip
    return replace(sink, silicon=silicon, oxide=oxide)


def transformed(law, rise):
    """Kirchhoff's variable over the conductivity at room temperature (K)."""
    return (law.integral(ROOM + rise) - law.integral(ROOM)) / law(ROOM)


OFF = 2e-4
"""Of the end's rise: what the oxide conducts along the layer and the silicon's own thickness are, at one temperature
each, not Kirchhoff's; 1.05e-4 on both meshes."""


@pytest.mark.long
@pytest.mark.parametrize("build", ["fin", "whole_plate"])
def test_kirchhoffs_variable_is_that_of_the_linear_model(build):
    law = PowerLaw(1.0, ROOM, -1.3)
    sink = alike(law, voltage=4.0)
    model, linear = (getattr(Levels(each).coarse, build)() for each in (sink, sink.plain))
    found, exact = steady(model), steady(linear)
    for name in ("peak_rise_K", "end_rise_K"):
        assert transformed(law, found[name]) == pytest.approx(exact[name], rel=OFF), name
        assert transformed(replace(law, exponent=-1.31), found[name]) != pytest.approx(exact[name], rel=OFF), name
    assert found["power_W"] == pytest.approx(exact["power_W"], rel=1e-12)
    # Over time too, as the capacities follow alike; the fin's anchor keeps the shape of its steady state.
    course, straight = over_time(model, AT), over_time(linear, AT)
    for name, off in (("peak_K", OFF), ("end_K", OFF if build == "whole_plate" else 3e-3)):
        final = exact[name.replace("_K", "_rise_K")]
        assert np.abs(transformed(law, course[name]) - straight[name]).max() <= off * final, name
        assert np.abs(transformed(replace(law, exponent=-1.4), course[name]) - straight[name]).max() > off * final, name


@pytest.mark.long
@pytest.mark.parametrize(
    "more",
    [
        {"electrodes": "pad-edge", "convection_coefficient": 1e3, "gap_gas_conductivity": 0.01},
        {"contact_resistance": 1e-6, "current": 3e-3},
        {"spans": 3},
    ],
)
def test_laws_that_change_nothing_change_nothing(more):
    plain = Sink(voltage=2.0, series_resistance=0.0 if "current" in more else 50.0, **more)
    a = plain.silicon.temperature_coefficient
    table = Table((200.0, 1293.0), tuple(plain.silicon.resistivity * (1 + a * (t - ROOM)) for t in (200.0, 1293.0)))
    flat = {"thermal_conductivity": PowerLaw(130.0, ROOM, 0.0), "specific_heat": PowerLaw(712.0, ROOM, 0.0)}
    silicon = replace(plain.silicon, **flat, resistivity=table, temperature_coefficient=0.0)
    oxide = replace(plain.oxide, thermal_conductivity=Table((200.0, 900.0), (1.38, 1.38)))
    sink = replace(plain, silicon=silicon, oxide=oxide)
    assert sink.plain.silicon.temperature_coefficient == pytest.approx(a)
    for build in ("fin",) if plain.spans > 1 else ("fin", "whole_plate"):
        model, linear = (getattr(Levels(each).coarse, build)() for each in (sink, plain))
        found, exact = steady(model), steady(linear)
        # An anchor that is heated takes its shape from the heated plate, not from one heated in the beam alone.
        apart = build == "fin" and "electrodes" in more
        assert found == pytest.approx(exact, rel=3e-3 if apart else 2e-6)
        course, straight = over_time(model, AT), over_time(linear, AT)
        for name, value in straight.items():
            assert np.abs(course[name] - value).max() <= (5e-3 if apart else 5e-4) * np.abs(value).max(), name


@pytest.mark.parametrize(
    ("law", "volts", "peak"),
    [(POWER, 1.0, 21.2769), (POWER, 2.0, 95.871), (POWER, 4.0, 623.27), (TABLE, 1.0, 20.9593), (TABLE, 4.0, 536.79)],
)
def test_the_plate_has_the_peaks_of_an_independent_3d_code(law, volts, peak):
    sink = replace(Sink(voltage=volts), silicon=replace(Sink().silicon, thermal_conductivity=law))
    level = Levels(sink).coarse
    # The plate misses 3D by 3e-5 at the peak, its coarse mesh by a table's kinks 4e-4 more.
    off = 5e-4 if law is TABLE else 5e-5
    assert steady(level.moments(1))["peak_rise_K"] == pytest.approx(peak, rel=off)
    assert steady(level.fin())["peak_rise_K"] == pytest.approx(peak, rel=off)


def test_a_row_loses_what_it_is_heated_by():
    silicon = replace(Sink().silicon, thermal_conductivity=POWER)
    found = steady(Levels(replace(Sink(voltage=2.0, spans=3), silicon=silicon)).coarse.fin())
    lost = 2 * (found["anchor_heat_W"] + found["island1_heat_W"])
    assert lost == pytest.approx(found["power_W"], rel=1e-9)


@pytest.mark.parametrize("exponent", [-1.3, -3.0])
def test_a_conductivity_that_falls_runs_away_where_its_integral_ends(exponent):
    """At a given current the linear peak at 1 A, times its square, is Kirchhoff's variable of the hottest state."""
    law = PowerLaw(1.0, ROOM, exponent)
    sink = alike(law, current=0.1)
    at_1_A = steady(Levels(replace(sink.plain, current=1e-3)).coarse.fin())["peak_rise_K"] * 1e6
    with pytest.raises(RunawayError, match="conductivity falls") as said:
        ladder.solve(sink, "fin", steady_only=True)
    assert said.value.limit == pytest.approx(np.sqrt(transformed(law, HOTTEST) / at_1_A), rel=1e-3)


def test_the_papers_models_take_what_is_at_room_temperature():
    silicon = replace(Sink().silicon, thermal_conductivity=POWER, specific_heat=PowerLaw(712.0, ROOM, 0.3))
    sink = replace(Sink(voltage=2.0), silicon=silicon)
    for name in ("paper", "anchored"):
        found, plain = (ladder.solve(each, name, times=AT) for each in (sink, Sink(voltage=2.0)))
        assert found.steady == plain.steady
        assert all(np.array_equal(found.traces.values[n], v) for n, v in plain.traces.values.items())


def test_a_plate_over_time_is_the_fin_but_for_the_anchors():
    silicon = replace(Sink().silicon, thermal_conductivity=TABLE)
    sink = replace(Sink(voltage=4.0), silicon=silicon)
    level = Levels(sink).coarse
    plate, fin = over_time(level.whole_plate(), AT), over_time(level.fin(), AT)
    # What the fin of a sink without laws is off by, from the page on reductions: 0.006 % of the peak, 0.5 % of the end.
    for name, off in (("peak_K", 5e-4), ("end_K", 6e-3)):
        assert np.abs(plate[name] - fin[name]).max() <= off * plate[name][-1], name
    cold = over_time(Levels(sink.plain).coarse.fin(), AT)
    assert np.abs(cold["peak_K"] - fin["peak_K"]).max() > 0.3 * plate["peak_K"][-1]


def test_what_radiates_is_colder_by_what_an_independent_3d_code_finds():
    sink, still = Sink(emissivity=0.7), steady(Levels(Sink()).coarse.fin())
    level = Levels(sink).coarse
    for found in (steady(level.moments(1)), steady(level.fin())):
        # 20.3322 K without and 20.2391 K with it in 3D: a fall that is known to a thousandth.
        assert found["peak_rise_K"] - still["peak_rise_K"] == pytest.approx(20.2391 - 20.3322, abs=2e-4)
        assert 0 < found["power_W"] - found["heat_out_W"] < 0.01 * found["power_W"]
    # At one temperature all over the flux is Stefan's and Boltzmann's, from the top, from the bottom but for the oxide
    # and from the sides, 2 um high.
    hot = 100.0
    ends = 2 * (150 * 150)
    top, oxide, sides = 1000 * 100 + ends, 2 * 50 * 50, 2 * (2 * 1000 + 2 * (2 * 150 + 150 + 50))
    area = (2 * top - oxide + sides) * 1e-12
    (points,) = level.plate.model.follows.parts
    assert points.bare.sum() == pytest.approx(area, rel=1e-9)
    exact = 0.7 * 5.670374e-8 * ((ROOM + hot) ** 4 - ROOM**4) * area
    assert level.plate.model.follows.given_off(np.full(level.plate.unknowns, hot)) == pytest.approx(exact, rel=1e-6)
    assert ladder.solve(sink, "paper", steady_only=True).steady == ladder.solve(Sink(), steady_only=True).steady
