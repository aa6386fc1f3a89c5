"""Free scenes against closed forms: probes of every kind, given temperatures and voltages that vary in time."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

from fem3d.runs.scene import clipped, solve
from meshes import symmetry
from scenes.errors import NumericsError
from scenes.model import Boundary, Box, Material, Probe, Scene, Schedule

UM = 1e-6
STEEL = Material("steel", 35.0, 7200.0, 440.5)
WIRE = Material("wire", 130.0, 2330.0, 712.0, 6e-5, 5e-4, 293.0)
LENGTH, SIDE = 0.1, 0.01


def face(name, kind, y, value, ambient=293.0):
    """A condition on a bar's end face."""
    return Boundary(name, kind, (0.0, y, 0.0), (SIDE, y, SIDE), value, ambient)


def at(name, y):
    return Probe(name, (0.0, y, 0.0), (0.0, y, 0.0))


def bar(*boundaries, probes, steady=True, accuracy=1e-4, material=STEEL, end=100.0, times=()):
    box = Box("bar", material, (0.0, 0.0, 0.0), (SIDE, LENGTH, SIDE))
    return Scene("bar", (box,), boundaries, probes, 293.0, end, accuracy, steady, times)


def through(name, y, quantity="heat_flow"):
    return Probe(name, (0.0, y, 0.0), (SIDE, y, SIDE), quantity)


def test_a_bar_between_two_temperatures_and_the_signs_of_what_flows():
    scene = bar(
        face("hot", "temperature", 0.0, 393.0), face("cold", "temperature", LENGTH, 273.0),
        probes=(at("a", 0.03), through("in", 0.0), through("out", LENGTH), through("inside", 0.04),
                Probe("top", (0.0, 0.0, 0.0), (SIDE, LENGTH, SIDE), reduce="max"),
                Probe("low", (0.0, 0.02, 0.0), (SIDE, 0.05, SIDE), reduce="min")),
    )  # fmt: skip
    found = {name: e.value for name, e in solve(scene).steady.items()}
    flow = 35.0 * SIDE**2 * 120.0 / LENGTH
    expected = {"a": 357.0, "in": flow, "out": -flow, "inside": flow, "top": 393.0, "low": 333.0}
    assert {n: found[n] for n in expected} == pytest.approx(expected, rel=1e-9)


def sudden(y, time):
    """A slab at 293 K whose faces jump to 393 K at t = 0 (Carslaw and Jaeger, 3.3)."""
    n = 2 * np.arange(400)[:, None] + 1
    rate = STEEL.thermal_conductivity / STEEL.heat_capacity * (n * np.pi / LENGTH) ** 2
    return 393.0 - 400 / np.pi * (np.sin(n * np.pi * y / LENGTH) / n * np.exp(-rate * time)).sum(axis=0)


def test_a_slab_whose_faces_jump_and_a_twin_with_another_conductivity():
    faces = (face("a", "temperature", 0.0, 393.0), face("b", "temperature", LENGTH, 393.0))
    times = (1.0, 5.0, 30.0, 100.0)
    scene = bar(*faces, probes=(at("mid", 0.05), at("off", 0.02)), steady=False, times=times)
    traces = solve(scene).traces
    rows = np.searchsorted(traces.time, times)
    assert np.allclose(traces.time[rows], times, rtol=1e-12)
    for name, y in (("mid", 0.05), ("off", 0.02)):
        assert np.abs(traces.values[name][rows] - sudden(y, np.array(times))).max() <= traces.errors[name] < 0.02
    assert np.abs(np.interp(times, traces.time, traces.values["off"]) - sudden(0.021, np.array(times))).max() > 0.5


def test_a_face_that_follows_a_schedule_is_duhamel_s_integral():
    end = 40.0
    schedule = Schedule((0.0, 10.0, 10.0, 25.0), (293.0, 323.0, 303.0, 313.0))
    faces = (face("a", "temperature", 0.0, schedule), face("b", "temperature", LENGTH, schedule))
    traces = solve(bar(*faces, probes=(at("x", 0.03),), steady=False, end=end, times=(9.0, 12.0, end))).traces

    def step(time):
        return (sudden(0.03, np.maximum(time, 0.0)) - 293.0) / 100.0 * (time > 0)

    def ramp(slope, start, stop, time):
        points, weights = np.polynomial.legendre.leggauss(60)
        at = start + (min(stop, time) - start) * (points + 1) / 2
        return slope * (min(stop, time) - start) / 2 * float(weights @ step(time - at)) if time > start else 0.0

    for time in (9.0, 12.0, end):
        exact = 293.0 + ramp(3.0, 0.0, 10.0, time) - 20.0 * float(step(np.array([time - 10.0]))[0])
        exact += ramp(10 / 15, 10.0, 25.0, time)
        assert abs(float(np.interp(time, traces.time, traces.values["x"])) - exact) <= traces.errors["x"] + 2e-4
    assert traces.errors["x"] < 0.01


def wire(*boundaries, probes=(), **more):
    """A micrometre wire along y with its ends on 293 K and on electrodes."""
    size = (20 * UM, 1000 * UM, 2 * UM)

    def end(name, kind, y, value):
        return Boundary(name, kind, (0.0, y, 0.0), (size[0], y, size[2]), value)

    ends = [end("cold-0", "temperature", 0.0, 293.0), end("cold-1", "temperature", size[1], 293.0)]
    volts = more.pop("volts", (1.0, 0.0))
    ends += [end(f"e{i}", "voltage", y, v) for i, (y, v) in enumerate(zip((0.0, size[1]), volts, strict=True))]
    return Scene(
        "wire", (Box("wire", WIRE, (0.0, 0.0, 0.0), size),), (*ends, *boundaries), probes, 293.0,
        more.pop("end_time", 2e-3), more.pop("accuracy", 1e-4), more.pop("steady", True), **more,
    )  # fmt: skip


def test_half_of_a_scene_driven_in_time_is_the_whole():
    schedule = Schedule((0.0, 1e-3), (0.5, 2.0))
    probes = (
        at("near", 200 * UM), at("far", 900 * UM),
        Probe("far-phi", (0.0, 900 * UM, 0.0), (0.0, 900 * UM, 0.0), "potential"),
        Probe("far-current", (0.0, 900 * UM, 0.0), (20 * UM, 900 * UM, 2 * UM), "current"),
        Probe("far-heat", (0.0, 900 * UM, 0.0), (20 * UM, 900 * UM, 2 * UM), "heat_flow"),
    )  # fmt: skip
    scene = wire(probes=probes, steady=False, accuracy=3e-3, volts=(schedule, 0.0))
    assert symmetry.reduce(scene).copies == 8
    # An end colder by a hair leaves no mirror plane across the wire.
    tilted = replace(
        scene, boundaries=tuple(replace(b, value=293.0 + 1e-9) if b.name == "cold-1" else b for b in scene.boundaries)
    )
    assert symmetry.reduce(tilted).copies == 4
    part, whole = solve(scene).traces, solve(tilted).traces
    for name in part.values:
        there = np.interp(part.time, whole.time, whole.values[name])
        late = part.time > 1e-5
        assert np.abs(part.values[name] - there)[late].max() <= 2 * (part.errors[name] + whole.errors[name])


def test_a_strip_with_a_partial_electrode_has_the_resistance_of_its_conformal_map():
    # sn takes the sheet to the upper half plane: the bottom edge to (-1, 1), its top corners to -1/k and 1/k, and the
    # electrode, the left half of the top edge, to all below -1/k. The cross ratio of the four ends is the modulus.
    width, height = 40 * UM, 30 * UM
    m = brentq(lambda m: ellipk(1 - m) / ellipk(m) - height / (width / 2), 1e-9, 1 - 1e-9)
    ratio = 2 / (1 + 1 / np.sqrt(m))
    squares = ellipk(1 - ratio) / ellipk(ratio)
    sheet = Material("sheet", 1.0, 1.0, 1.0, 1e-6)
    thick = 2 * UM
    box = Box("sheet", sheet, (0.0, 0.0, 0.0), (width, height, thick))
    base = Boundary("base", "voltage", (0.0, 0.0, 0.0), (width, 0.0, thick), 0.0)
    part = Boundary("part", "voltage", (0.0, height, 0.0), (width / 2, height, thick), 1.0)
    probe = Probe("current", part.lower, part.upper, "current")
    found = solve(Scene("strip", (box,), (base, part), (probe,), 293.0, accuracy=1e-4, steady=True)).steady["current"]
    exact = thick / 1e-6 / squares
    assert abs(found.value - exact) <= found.error < 1e-4 * exact
    twin = thick / 1e-6 * ellipk(1.01 * ratio) / ellipk(1 - 1.01 * ratio)
    assert abs(found.value - twin) > 10 * found.error


def test_conductors_without_current_have_their_electrode_s_potential():
    beam = Box("beam", WIRE, (0.0, 0.0, 0.0), (20 * UM, 100 * UM, 2 * UM))
    pad = Box("pad", WIRE, (0.0, -50 * UM, 0.0), (20 * UM, 0.0, 2 * UM))
    volts = [
        Boundary(n, "voltage", (0.0, y, 0.0), (20 * UM, y, 2 * UM), v)
        for n, y, v in (("a", 0.0, 3.0), ("b", 1e-4, 1.0))
    ]
    probes = (
        Probe("pad", (0.0, -20 * UM, 0.0), (0.0, -20 * UM, 0.0), "potential"),
        Probe("all", (0.0, -50 * UM, 0.0), (20 * UM, 100 * UM, 2 * UM), "potential"),
        Probe("into", (0.0, 0.0, 0.0), (20 * UM, 0.0, 2 * UM), "current"),
        Probe("along", (0.0, 1e-4, 0.0), (20 * UM, 1e-4, 2 * UM), "current"),
    )  # fmt: skip
    found = solve(Scene("s", (beam, pad), tuple(volts), probes, accuracy=1e-4, steady=True)).steady
    current = 2.0 / (6e-5 * 1e-4 / (20 * UM * 2 * UM))
    assert found["pad"].value == pytest.approx(3.0, rel=1e-12)
    assert found["all"].value == pytest.approx((50 * 3.0 + 100 * 2.0) / 150, rel=1e-9)
    # Inside the solid along the axis; on its surface into it.
    assert found["into"].value == pytest.approx(current, rel=1e-9)
    assert found["along"].value == pytest.approx(-current, rel=1e-9)


def test_what_has_no_steady_state_is_refused():
    lone = bar(face("a", "heat_flux", 0.0, 1.0), probes=(at("x", 0.05),))
    with pytest.raises(NumericsError, match="no exit for heat"):
        solve(lone)
    # Over time it just gets warmer: evenly, around the profile that drives the flux through the bar (Carslaw and
    # Jaeger, 3.8).
    traces = solve(replace(lone, steady=False, end_time=2000.0, accuracy=1e-3)).traces
    exact = 293.0 + 1.0 * 2000.0 / (STEEL.heat_capacity * LENGTH) - 1.0 * LENGTH / (24 * STEEL.thermal_conductivity)
    assert abs(traces.values["x"][-1] - exact) <= traces.errors["x"] < 2e-5


def test_a_singularity_that_no_mesh_resolves_is_refused_by_its_place_and_power():
    # A given temperature that ends where a good conductor meets a bad one: tan(s pi / 2)^2 = 0.15 / 20.
    good, bad = Material("good", 20.0, 1.0, 1.0), Material("bad", 0.15, 1.0, 1.0)
    boxes = (Box("good", good, (0.0, 0.0, 0.0), (6.0, 13.0, 5.0)), Box("bad", bad, (0.0, 0.0, 5.0), (6.0, 13.0, 8.0)))
    cold = Boundary("cold", "temperature", (0.0, 13.0, 5.0), (6.0, 13.0, 8.0), 293.0)
    flux = Boundary("flux", "heat_flux", (0.0, 0.0, 0.0), (6.0, 0.0, 5.0), 100.0)
    scene = Scene(
        "s", boxes, (cold, flux), (Probe("mean", boxes[0].lower, boxes[0].upper),), accuracy=1e-2, steady=True
    )
    with pytest.raises(NumericsError, match=r"at y = 13 m a given value ends.* to the power 0\.05"):
        solve(scene)
    assert solve(replace(scene, boxes=(boxes[0], replace(boxes[1], material=good)))).steady["mean"].value > 293.0


def test_a_body_that_only_cools_is_in_balance():
    scene = bar(face("sink", "heat_flux", 0.0, -1e4), probes=(at("end", LENGTH),), steady=False, times=(50.0, 100.0))
    assert solve(replace(scene, accuracy=1e-2)).details["transient_imbalance"] < 1e-8


def test_an_insulated_block_stores_all_its_heat():
    """Half of its rise in a second of the whole source comes from the second in which that rises from zero."""
    clay, middle = Material("clay", 1.0, 1000.0, 800.0), (SIDE / 2,) * 3
    for source, expected in ((4e6, [295.5, 300.5]), (2e6, [294.25, 296.75])):
        block = Box("block", clay, (0.0, 0.0, 0.0), (SIDE,) * 3, Schedule((0.0, 1.0), (0.0, source)))
        probes = (Probe("centre", middle, middle),)
        found = solve(Scene("block", (block,), (), probes, 293.0, 2.0, 1e-3, False, (1.0, 2.0))).traces
        values = found.values["centre"][np.searchsorted(found.time, (1.0, 2.0))]
        assert values == pytest.approx(expected, abs=found.errors["centre"])
        assert found.errors["centre"] < 1e-3 * 7.5


def test_a_run_that_ends_before_anything_happens_is_in_balance():
    late = Schedule((200.0, 200.0), (293.0, 393.0))
    found = solve(bar(face("hot", "temperature", 0.0, late), probes=(at("end", LENGTH),), steady=False))
    # Rounding alone, 0.9e-3 to 1.3e-3 with the libraries' versions, of a heat that is rounding too.
    assert found.details["transient_imbalance"] < 1e-2
    assert found.traces.values["end"] == pytest.approx(293.0, rel=1e-12)


def test_a_bar_that_nothing_warms_stays_cold():
    found = solve(bar(face("cold", "temperature", 0.0, 293.0), probes=(at("end", LENGTH),), steady=False)).traces
    assert (found.values["end"] == 293.0).all()
    assert found.errors["end"] < 1e-6


def test_current_passes_boxes_that_symmetry_leaves_out():
    """A wire of two boxes, of which the half that is solved has only one."""
    middle = LENGTH / 2
    boxes = tuple(
        Box(name, WIRE, (0.0, low, 0.0), (SIDE, low + middle, SIDE)) for name, low in (("a", 0.0), ("b", middle))
    )
    ends = face("plus", "voltage", 0.0, 1.0), face("minus", "voltage", LENGTH, 0.0)
    scene = replace(bar(*ends, probes=(through("current", 0.0, "current"),), material=WIRE), boxes=boxes)
    found = solve(scene)
    assert len(symmetry.reduce(clipped(scene)).scene.boxes) == 1
    assert found.steady["current"].value == pytest.approx(SIDE**2 / (6e-5 * LENGTH), rel=1e-9)


def test_a_time_so_short_that_hardly_anything_diffuses():
    """All generations of fields are one, of which the projection keeps a handful."""
    oxide, silicon = Material("oxide", 1.4, 2200.0, 703.0), Material("silicon", 130.0, 2330.0, 712.0)
    side, end, source = 8 * UM, 1e-11, 1e12
    boxes = (
        Box("oxide", oxide, (0.0, 0.0, 0.0), (side, side, 2 * UM)),
        Box("silicon", silicon, (0.0, 0.0, 2 * UM), (side, side, 4 * UM), source),
    )
    hot = Boundary("hot", "temperature", (0.0, 0.0, 0.0), (side, side, 0.0), 303.0)
    top = Probe("top", (0.0, 0.0, 4 * UM), (0.0, 0.0, 4 * UM))
    traces = solve(Scene("short", boxes, (hot,), (top,), 293.0, end, 0.1, False, (end,))).traces
    exact = 293.0 + source * end / silicon.heat_capacity
    assert abs(traces.values["top"][-1] - exact) <= traces.errors["top"] < 0.1


def test_traces_start_at_the_initial_temperature_where_no_boundary_gives_another():
    whole = Probe("mean", (0.0, 0.0, 0.0), (SIDE, LENGTH, SIDE))
    scene = bar(
        face("hot", "temperature", 0.0, 393.0),
        probes=(at("near", LENGTH / 100), at("face", 0.0), whole), steady=False, accuracy=1e-2, times=(0.0, 50.0),
    )  # fmt: skip
    traces = solve(scene).traces
    assert {name: values[0] for name, values in traces.values.items()} == pytest.approx(
        {"near": 293.0, "face": 393.0, "mean": 293.0}, abs=1e-9
    )
