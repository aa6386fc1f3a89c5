"""Probes: resistance and power, extremes and means over regions, flows of boundaries that meet, and further probes on
the mesh of a scene's own."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs import sensitivities
from fem3d.runs.scene import solve
from scenes.errors import SceneError
from scenes.free import from_dict, rules
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
    assert 'no electrode is there: give corners of one, of "plus", "minus", "read" and "ground"' in refused(
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


MATERIALS = [{"name": "metal", "thermal_conductivity": 100}, {"name": "oxide", "thermal_conductivity": 1}]


def stack(source: float = 1e9, **run: object) -> Scene:
    """Two posts of oxide under a bar of metal, symmetric but for the source in the right one."""
    box = {"left": ("oxide", [-3, 0, 0], [-2, 1, 2]), "right": ("oxide", [2, 0, 0], [3, 1, 2]),
           "bar": ("metal", [-3, 0, 2], [3, 1, 3])}  # fmt: skip
    um = [{"name": n, "material": m, "lower": [c * 1e-6 for c in a], "upper": [c * 1e-6 for c in b]}
          for n, (m, a, b) in box.items()]  # fmt: skip
    um[0]["heat_source"], um[1]["heat_source"] = 1e9, source
    scene = from_dict({
        "run": {"steady": True, "accuracy": 1e-3, **run}, "material": MATERIALS, "box": um,
        "boundary": [{"name": n, "lower": um[i]["lower"], "upper": [*um[i]["upper"][:2], 0], "temperature": 293}
                     for i, n in enumerate(("cold", "cool"))],
        "probe": [
            {"name": "all", "reduce": "max"}, {"name": "oxide", "reduce": "max", "material": "oxide"},
            {"name": "some", "reduce": "max", "boxes": ["bar", "right"]}, {"name": "mean", "boxes": ["left", "right"]},
            {"name": "one", "reduce": "max", "boxes": ["left"]},
        ],
    })  # fmt: skip
    return scene


@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra"])
@pytest.mark.parametrize("source", [1e9, 4e9])
def test_a_region_reads_all_its_boxes(source, mesh):
    scene = stack(source, mesh=mesh)
    each = [Probe(f"{how} {b.name}", b.lower, b.upper, reduce=how) for b in scene.boxes for how in ("max", "mean")]
    found = solve(replace(scene, probes=(*scene.probes, *each))).steady

    def close(name: str, expected: float) -> None:
        rise = found[name].value - 293
        assert rise == pytest.approx(expected - 293, abs=2 * found[name].error + 1e-9 * rise)

    largest = {b.name: found[f"max {b.name}"].value for b in scene.boxes}
    close("all", max(largest.values()))
    close("oxide", max(largest["left"], largest["right"]))
    close("some", max(largest["bar"], largest["right"]))
    close("one", largest["left"])
    close("mean", (found["mean left"].value + found["mean right"].value) / 2)


QUARTER = 10.234092569 / 4  # of a square duct's shape factor per unit length, walls as thick as half its opening


def duct():
    """A square duct, a body around a hole: inside at 400 K, outside at 300 K, k = 1 W/(m K), 0.1 m long."""
    walls = {"l": (-1, -1, -0.5, 1), "r": (0.5, -1, 1, 1), "b": (-0.5, -1, 0.5, -0.5), "t": (-0.5, 0.5, 0.5, 1)}
    sides = {}
    for name, half, temperature in (("i", 0.5, 400.0), ("o", 1.0, 300.0)):
        for side, at in (("l", -half), ("r", half)):
            sides[name + side] = (at, -half, at, half, temperature)
        for side, at in (("b", -half), ("t", half)):
            sides[name + side] = (-half, at, half, at, temperature)
    return from_dict({
        "scene": {"name": "duct", "initial_temperature": 300.0},
        "run": {"steady": True, "accuracy": 1e-3},
        "material": [{"name": "k", "thermal_conductivity": 1.0}],
        "box": [{"name": n, "material": "k", "lower": [*w[:2], 0], "upper": [*w[2:], 0.1]} for n, w in walls.items()],
        "boundary": [
            {"name": n, "lower": [*s[:2], 0], "upper": [*s[2:4], 0.1], "temperature": s[4]} for n, s in sides.items()
        ],
        "probe": [
            {"name": n, "quantity": "heat_flow", "lower": [*sides[n][:2], 0], "upper": [*sides[n][2:4], 0.1]}
            for n in ("il", "ol")
        ],
    })  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3])
def test_side_of_duct_has_quarter_of_heat(accuracy):
    """At its inner edges, re-entrant for the wall, the flux has no bound."""
    found = scene_run.solve(replace(duct(), accuracy=accuracy)).steady
    for name, sign in (("il", 1.0), ("ol", -1.0)):
        each, true = found[name], sign * 10.0 * QUARTER
        assert abs(each.value - true) <= each.error <= accuracy * abs(true)
        assert abs(each.value - 1.03 * true) > each.error


@pytest.mark.parametrize("mesh", ["bricks", "tetrahedra"])
def test_parts_of_one_face_share_uniform_flow_by_area(mesh):
    """The flux through a slab is uniform; its cold face is two boundaries of one temperature."""
    faces = {"left": ((0.0, 0.0, 0.0), (0.3, 1.0, 0.0), 300.0), "right": ((0.3, 0.0, 0.0), (1.0, 1.0, 0.0), 300.0),
             "hot": ((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), 310.0)}  # fmt: skip
    box = Box("box", Material("k", 2.0, 1.0, 1.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    scene = Scene(
        "halves", (box,), tuple(Boundary(n, "temperature", *f) for n, f in faces.items()),
        tuple(Probe(n, *f[:2], "heat_flow") for n, f in faces.items()), 300.0, steady=True, mesh=mesh,
    )  # fmt: skip
    found = {name: e.value for name, e in scene_run.solve(scene).steady.items()}
    assert found == pytest.approx({"left": -6.0, "right": -14.0, "hot": 20.0}, rel=1e-9)
