"""A gas in the gap under beam and pads, in both models."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from compare.options import Options
from fem3d.runs import sink as sink_run
from reduced1d import ladder
from reduced1d.device.lumped import lump
from reduced1d.sink import gap_conductance
from scenes.device import Device
from scenes.errors import SceneError
from scenes.loading import load
from scenes.sink import SUBSTRATE, Sink, over_gap

STEADY = Options(steady=True)
AIR = Sink(gap_gas_conductivity=0.026)


@cache
def in_air():
    return sink_run.solve(AIR)


def test_the_gas_is_under_the_beam_and_around_the_oxide():
    areas = {name: (b[0] - a[0]) * (b[1] - a[1]) for name, a, b in over_gap(Sink())}
    pad = sum(area for name, area in areas.items() if name.startswith("pad-1"))
    assert areas["beam"] == pytest.approx(1e-3 * 1e-4)
    assert pad == pytest.approx(150e-6**2 - 50e-6**2)
    # An oxide as large as its pad leaves nothing bare.
    assert [name for name, *_ in over_gap(Sink(oxide_length=150e-6, oxide_width=150e-6))] == ["beam"]


def test_in_air_the_sink_hardly_heats():
    found = in_air().steady
    # An independent code of bricks has 2.45725 K, to all these digits.
    assert abs(found["peak_rise_K"].value - 2.45725) < found["peak_rise_K"].error < 1e-3
    assert abs(20.33 - 2.45725) > 1000 * found["peak_rise_K"].error
    assert found["heat_out_W"].value == pytest.approx(found["power_W"].value, rel=1e-9)
    # The beam's heat leaves by its ends and the gas below; the gas at the mean rise, whose parabola in z is 1e-6.
    beam = 2 * found["end_flow_W"].value + gap_conductance(AIR) * found["mean_rise_K"].value
    assert beam == pytest.approx(found["power_W"].value, rel=2e-4)


@pytest.mark.parametrize("reduction", ["fin", "plate"])
def test_the_fin_and_the_plate_are_3d_s_steady_and_over_time(reduction):
    three = in_air()
    one = ladder.solve(AIR, reduction, times=three.traces.time)
    for name in ("peak_rise_K", "end_rise_K", "mean_rise_K", "anchor_resistance_K_per_W", "heat_out_W"):
        known = three.steady[name]
        # Both neglect the second order in the Biot number of the film, 2e-4, and have their own errors.
        assert abs(one.steady[name].value - known.value) < known.error + one.steady[name].error + 1e-4 * known.value
    late = three.traces.time >= 1e-4
    off = np.abs(one.traces.values["peak_K"] - three.traces.values["peak_K"])[late].max()
    assert off < three.traces.errors["peak_K"] + one.traces.errors["peak_K"] + 3e-4 * three.steady["peak_rise_K"].value
    wrong = ladder.solve(replace(AIR, gap_gas_conductivity=0.0261), reduction, times=three.traces.time)
    assert np.abs(wrong.traces.values["peak_K"] - three.traces.values["peak_K"])[late].max() > 2 * off


def test_the_lump_has_it_as_a_conductance():
    assert gap_conductance(AIR) == pytest.approx(0.026 / 2e-6 * 1e-3 * 1e-4)
    assert lump(Device(sink=AIR)).conductance - lump(Device()).conductance == pytest.approx(gap_conductance(AIR))
    steady = ladder.solve(AIR, "paper", steady_only=True).steady
    assert steady["heat_out_W"].value == pytest.approx(steady["power_W"].value, rel=1e-9)


@pytest.mark.long
def test_on_a_plate_that_hardly_resists_it_is_on_room_temperature_and_on_silicon_is_not():
    """The gas is boxes then, which conduct across the gap alone."""
    rough = replace(AIR, accuracy=1e-2)
    small = {"substrate_length": 1.4e-3, "substrate_width": 0.2e-3}
    metal = replace(SUBSTRATE, thermal_conductivity=1e5)
    on = sink_run.solve(replace(rough, substrate_thickness=1e-6, substrate=metal, **small), STEADY).steady
    for name in ("peak_rise_K", "end_rise_K", "mean_rise_K", "end_flow_W", "heat_out_W"):
        known = in_air().steady[name]
        assert abs(on[name].value - known.value) < on[name].error + known.error
        assert on[name].error < 2e-2 * known.value
    silicon = replace(rough, substrate_thickness=0.5e-3, **small)
    found, bare = sink_run.solve(silicon, STEADY).steady, in_air().steady["mean_rise_K"].value
    added = found["mean_rise_K"].value - bare
    assert added > 2 * found["mean_rise_K"].error
    # In 1D that is a resistance below the whole beam, and one below each oxide, each from even heat.
    fin = ladder.solve(silicon, "fin", steady_only=True).steady["mean_rise_K"].value - bare
    assert fin == pytest.approx(added, rel=0.2)


def test_what_is_refused():
    with pytest.raises(SceneError, match="spans = 3 makes a row, and no gas is solved under a row"):
        load("sink", ["sink.spans=3", "gap_gas_conductivity=0.026"])
    with pytest.raises(SceneError, match="gap_gas_conductivity"):
        load("sink", ["gap_gas_conductivity=-0.026"])
