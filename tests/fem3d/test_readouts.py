"""Probes of resistance and power: a thermometer strip beside a heater on a film, read by its resistance."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs import sensitivities
from scenes.errors import SceneError
from scenes.free import rules
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule

METAL = Material("platinum", 71.0, 21450.0, 130.0, 1.06e-7, 3e-3, 293.0)
FILM = Material("oxide", 1.4, 2200.0, 700.0)
L, W, T = 1e-4, 4e-5, 2e-7
HEATER, STRIP = (1e-5, 1.4e-5), (2.4e-5, 2.7e-5)


def across(x, y=(0.0, W), z=(-1e-6, T)):
    return (x, y[0], z[0]), (x, y[1], z[1])


def wire(name, y):
    return Box(name, METAL, (0.0, y[0], 0.0), (L, y[1], T))


def electrode(name, x, y, value, series=0.0):
    return Boundary(name, "voltage", *across(x, y, (0.0, T)), value, series_resistance=series)


def chip(volts=0.05, read=1.8e-4, series=0.0, accuracy=1e-2, steady=True, probes=(), **more):
    """A heater and a strip, both along x, on a film between cold ends."""
    boxes = Box("film", FILM, (0.0, 0.0, -1e-6), (L, W, 0.0)), wire("heater", HEATER), wire("strip", STRIP)
    conditions = (
        Boundary("cold 0", "temperature", *across(0.0), 293.0), Boundary("cold 1", "temperature", *across(L), 293.0),
        electrode("plus", 0.0, HEATER, volts), electrode("minus", L, HEATER, 0.0),
        electrode("read", 0.0, STRIP, read, series), electrode("ground", L, STRIP, 0.0),
    )  # fmt: skip
    readings = (
        Probe("strip", *across(0.0, STRIP, (0.0, T)), "resistance"),
        Probe("heater", *across(0.0, HEATER, (0.0, T)), "resistance"),
        Probe("current", *across(0.0, HEATER, (0.0, T)), "current"),
        Probe("whole", (0.0, 0.0, 0.0), (L, 2e-5, T), "power"),
        Probe("half", (0.0, 0.0, 0.0), (L / 2, 2e-5, T), "power"),
        Probe("mean", (0.0, STRIP[0], 0.0), (L, STRIP[1], T)),
    )
    return Scene("chip", boxes, conditions, (*readings, *probes), accuracy=accuracy, steady=steady, **more)


def resistance(width, rise):
    return METAL.resistivity * L / (width * T) * (1 + METAL.temperature_coefficient * rise)


@pytest.fixture(scope="module")
def read():
    return scene_run.solve(chip(accuracy=3e-3))


def test_a_strip_is_a_thermometer(read):
    """Current runs along the strip alone, so that its resistance follows its mean temperature; with the mean of
    1 + a u across it, not of its inverse, the difference is the square of the variation of a u there: 2e-7."""
    found = read.steady
    u = found["mean"].value - 293.0
    assert u > 7.0
    of_mean = resistance(STRIP[1] - STRIP[0], u)
    slack = found["strip"].error + of_mean * METAL.temperature_coefficient * found["mean"].error + 1e-6 * of_mean
    assert abs(found["strip"].value - of_mean) < slack
    # A strip whose temperature were 1 % off is seen.
    assert abs(found["strip"].value - resistance(STRIP[1] - STRIP[0], 1.01 * u)) > slack


@pytest.mark.parametrize(("volts", "series"), [(1e-5, inf), (3.6e-4, 18.0)])
def test_it_is_the_same_however_it_is_read(read, volts, series):
    """By a current of 10 uA, or behind a resistance: the strip heats itself by less than 1e-5 of the heater.
    Two wires that get warm differently share no pattern of the current."""
    other = scene_run.solve(chip(read=volts, series=series, accuracy=3e-3)).steady["strip"]
    one = read.steady["strip"]
    assert abs(other.value - one.value) < one.error + other.error + 1e-5 * one.value
    assert one.error < 1e-4 * one.value


def test_powers_are_what_the_electrodes_supply(read):
    found = read.steady
    supplied = 0.05 * found["current"].value
    assert found["whole"].value == pytest.approx(supplied, rel=1e-9)
    assert found["half"].value == pytest.approx(supplied / 2, rel=1e-9)
    assert found["heater"].value == pytest.approx(0.05 / found["current"].value, rel=1e-12)


def test_over_time_it_rises_with_the_strip():
    """From a ramp that starts at no voltage: the resistance there is the cold strip's."""
    ramp = Schedule((0.0, 5e-5), (0.0, 0.05))
    scene = chip(ramp, ramp, accuracy=1e-2, steady=False, end_time=1e-4, output_times=(5e-5,))
    traces = scene_run.solve(scene).traces
    values, error = traces.values["strip"], traces.errors["strip"]
    assert np.isfinite(values).all()
    width = STRIP[1] - STRIP[0]
    assert values[0] == pytest.approx(resistance(width, 0.0), abs=error)
    of_mean = resistance(width, traces.values["mean"] - 293.0)
    slack = error + of_mean * METAL.temperature_coefficient * traces.errors["mean"]
    assert (np.abs(values - of_mean) < slack).all()
    assert values[-1] - values[0] > 10 * error
    power = traces.values["whole"][-1]
    assert power == pytest.approx(0.05 * traces.values["current"][-1], abs=traces.errors["whole"])


@pytest.mark.long
def test_slopes_are_differences():
    """By a voltage, which the resistance holds beside the current, and by the resistivity."""
    scene = chip()
    result = scene_run.solve(scene, whole=True)
    table = sensitivities.of_scene(scene, result, ["boundary.plus.voltage", "material.platinum.resistivity"]).steady

    def beside(factor, of_voltage):
        if of_voltage:
            return chip(0.05 * factor)
        metal = replace(METAL, resistivity=METAL.resistivity * factor)
        return replace(scene, boxes=tuple(replace(b, material=metal) if b.name != "film" else b for b in scene.boxes))

    for key, of_voltage in (("boundary.plus.voltage", True), ("material.platinum.resistivity", False)):
        low, high = (scene_run.solve(beside(f, of_voltage), whole=True).steady for f in (0.98, 1.02))
        for name in ("strip", "heater", "half"):
            slope = np.log(high[name].value / low[name].value) / np.log(1.02 / 0.98)
            # The errors of both ends, which are alike, and the curvature of the difference: below 1e-3.
            assert table[key][name].value == pytest.approx(slope, abs=1e-3)
    assert table["boundary.plus.voltage"]["heater"].value > 0.03


def refused(scene):
    with pytest.raises(SceneError) as caught:
        rules.checked(scene)
    return str(caught.value)


def test_what_is_no_resistance_is_refused():
    elsewhere = Probe("r", *across(0.0, (2e-5, 2.2e-5), (0.0, T)), "resistance")
    assert 'no electrode is there: give the corners of one, of "plus", "minus", "read" and "ground"' in refused(
        chip(probes=(elsewhere,))
    )
    assert 'for some time no voltage drives one between "read" and "ground"' in refused(chip(read=0.0))
    late = Schedule((0.0, 1e-5, 2e-5), (0.0, 0.0, 0.05))
    assert "for some time no voltage drives one" in refused(chip(read=late, steady=False, end_time=1e-4))
    third = chip()
    side = Boundary("tap", "voltage", (4e-5, STRIP[0], T), (6e-5, STRIP[1], T), 1e-4)
    assert 'the conductor of "read" has 2 others, "ground" and "tap"' in refused(
        replace(third, boundaries=(*third.boundaries, side))
    )
    sheet = Probe("p", *across(0.0, HEATER, (0.0, T)), "power")
    assert 'probe "p" asks for a power in what is no volume' in refused(chip(probes=(sheet,)))
    film = Probe("p", (0.0, 0.0, -1e-6), (L, W, 0.0), "power")
    assert 'probe "p" asks for a power where nothing conducts' in refused(chip(probes=(film,)))
