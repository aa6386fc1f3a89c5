"""Sinks in 3D: on a substrate, against the spreading resistance of a plate; in a row, against the second path; and the
quarter against the whole."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from fem3d.runs.scene import solve
from meshes import symmetry
from reduced1d import ladder
from reduced1d.ladder.plate import below
from scenes.model import Boundary, Box, Probe, Scene
from scenes.sink import SUBSTRATE, Sink
from tests.fem3d import drawn, gap, plain_grid, silicon, state_on
from validate.verify.second_path import SecondPath

TERMS = 800
ON = Sink(substrate_thickness=0.5e-3)


def spreading(k, plate, source, at=(0.0,)):
    """The mean rise (K) of a rectangle in the middle of a plate's top for 1 W into it, evenly spread: by the double
    cosine series of a plate with adiabatic sides and a cold bottom (Muzychka, Culham and Yovanovich, J. Electron.
    Packag. 125, 2003). ``at`` are places along y (m) of rectangles with 1 W each; told is the first one's rise.
    """
    (a, b, t), (c, d) = plate, source
    m, n = np.arange(TERMS)[:, None], np.arange(TERMS)[None, :]
    # Of a source off the middle all cosines between the plate's ends count, of one in the middle every second.
    y = np.asarray(at) + b / 2
    along, across = np.pi * n / b, 2 * np.pi * m / a
    size = np.hypot(across, along)
    size[0, 0] = 1.0
    response = np.tanh(size * t) / (k * size)
    response[0, 0] = t / k
    own = np.sinc(across * c / 2 / np.pi) * np.sinc(along * d / 2 / np.pi)
    weight = np.where(m > 0, 2.0, 1.0) * np.where(n > 0, 2.0, 1.0) / (a * b)
    shapes = np.cos(along[..., None] * y)
    return float((weight * response * own**2 * shapes[..., 0] * shapes.sum(axis=-1)).sum())


def plate(thickness=0.5e-3):
    """1 W into a square of 100 um in the middle of a plate."""
    a, b, s = 1e-3, 0.8e-3, 100e-6
    half = s / 2
    top = ((-half, -half, 0.0), (half, half, 0.0))
    boundaries = (
        Boundary("in", "heat_flux", *top, 1.0 / s**2),
        Boundary("out", "temperature", (-a / 2, -b / 2, -thickness), (a / 2, b / 2, -thickness), 293.0),
    )
    box = Box("plate", SUBSTRATE, (-a / 2, -b / 2, -thickness), (a / 2, b / 2, 0.0))
    return Scene("plate", (box,), boundaries, (Probe("source", *top),), accuracy=1e-3, steady=True)


@pytest.mark.long
def test_a_square_on_a_plate_has_the_spreading_resistance_of_its_series():
    found = scene_run.solve(plate()).steady["source"]
    exact = 293.0 + spreading(SUBSTRATE.thermal_conductivity, (1e-3, 0.8e-3, 0.5e-3), (1e-4, 1e-4))
    assert abs(found.value - exact) < found.error < 1e-3 * (exact - 293.0)
    thicker = scene_run.solve(plate(0.52e-3)).steady["source"]
    assert abs(thicker.value - exact) > 5 * thicker.error


CLOSE = 3e-4
BARE = Sink()


@cache
def at_rest(sink):
    """The steady state, to a part in 3,000: the substrate adds 3 % of the rise."""
    return sink_run.solve(replace(sink, accuracy=CLOSE), transient=False).steady


@pytest.mark.long
def test_the_substrate_adds_what_lies_between_an_even_temperature_and_an_even_flux_under_the_oxide():
    bare, on = at_rest(BARE), at_rest(ON)
    added = (on["anchor_resistance_K_per_W"], bare["anchor_resistance_K_per_W"])
    even = spreading(SUBSTRATE.thermal_conductivity, (3e-3, 3e-3, 0.5e-3), (5e-5, 5e-5), (-575e-6, 575e-6))
    # A square at one temperature on a half space has 0.932 of the resistance that one with an even flux has
    # (Yovanovich, 1976: 0.4412 and 0.4732 over k times its side); further away the two don't differ.
    one = 0.4732 / (SUBSTRATE.thermal_conductivity * 5e-5)
    least = even - (1 - 0.4412 / 0.4732) * one
    off = added[0].error + added[1].error
    assert least - off < added[0].value - added[1].value < even + off
    assert off < 0.25 * (even - least)
    peaks = [found["peak_rise_K"] for found in (bare, on)]
    assert peaks[1].value / peaks[0].value - 1 == pytest.approx(0.0057, abs=0.0001)


@pytest.mark.long
@pytest.mark.parametrize("name", ["fin", "plate"])
def test_models_on_the_plate_rise_by_what_3d_does(name):
    # Both lie on one mesh, whose error their difference doesn't have.
    rises = [ladder.solve(sink, name, steady_only=True).steady["end_rise_K"].value for sink in (BARE, ON)]
    in_3d = [at_rest(sink)["end_rise_K"] for sink in (BARE, ON)]
    added = in_3d[1].value - in_3d[0].value
    # 1D overstates it: a resistance for each place under the oxide, where more heat flows near the beam, is the mean
    # of the flux's square, and the series is of an even flux, 7 % above that of an even temperature.
    off = in_3d[0].error + in_3d[1].error
    assert added - off < rises[1] - rises[0] < 1.1 * added + off
    assert off < 0.03 * added
    assert below(BARE) == 0


@pytest.mark.long
def test_what_a_substrate_is_given_leaves_through_its_bottom_and_both_mirrors_stay():
    found = sink_run.solve(ON, transient=True)
    steady = found.steady
    assert steady["heat_out_W"].value == pytest.approx(steady["power_W"].value, rel=1e-9)
    assert found.details["symmetry"] == "the quarter"
    traces, bare = found.traces, sink_run.solve(Sink(), transient=True).traces
    early = [np.interp(2e-5, t.time, t.values["peak_K"]) - 293.0 for t in (traces, bare)]
    # Heat is then no further than sqrt(D t) = 40 um from the beam's middle: it does not reach the substrate yet.
    assert early[0] == pytest.approx(early[1], abs=traces.errors["peak_K"] + bare.errors["peak_K"])
    end = traces.values["end_K"][-1] - 293.0
    assert end == pytest.approx(steady["end_rise_K"].value, rel=2e-3)


ROW = Sink(spans=3, length=400e-6, convection_coefficient=10.0)


def difference(sink: Sink, other: Sink) -> float:
    """Return the largest relative difference of the rises of a row and those of another one by the second path."""
    part = symmetry.reduce(other.scene())
    grid = plain_grid(part.scene, 1)
    scene = replace(part.scene, probes=tuple(p for p in part.scene.probes if p.reduce == "mean"))
    path = SecondPath(scene, grid)
    means = path.readings(path.steady())
    row = symmetry.reduce(sink.scene())
    _, found = state_on(sink, plain_grid(row.scene, 1), row)
    off = [found[f"{name}_rise_K"] / (value - scene.initial_temperature) - 1 for name, value in means.items()]
    return float(np.abs(off).max())


def test_row_agrees_with_second_path():
    assert difference(ROW, ROW) < 1e-9
    assert difference(replace(ROW, island_length=45e-6), ROW) > 1e-3


@pytest.mark.long
def test_spans_and_islands_carry_all_heat():
    """Every watt leaves through an anchor or an island."""
    for spans in (2, 3, 20):
        found = sink_run.solve(Sink(spans=spans, accuracy=1e-2), False)
        value = {name: e.value for name, e in found.steady.items()}
        islands = [value[f"island{min(k, spans - k)}_heat_W"] for k in range(1, spans)]
        assert 2 * value["anchor_heat_W"] + sum(islands) == pytest.approx(value["heat_out_W"], rel=1e-12)
        assert value["heat_out_W"] == pytest.approx(value["power_W"], rel=1e-3)
        assert found.details["energy_imbalance"] < 1e-9


def test_ends_of_row_are_like_those_of_one_span():
    """An anchor resistance is the anchor's own, whatever heat passes."""
    one, row_of_three = (sink_run.solve(Sink(spans=n, accuracy=1e-2), False).steady for n in (1, 3))
    name = "anchor_resistance_K_per_W"
    assert row_of_three[name].value == pytest.approx(one[name].value, rel=1e-3)


SINKS = [
    Sink(voltage=8.0, convection_coefficient=200.0),
    Sink(voltage=-5.0, electrodes="pad-edge", room_temperature=280.0),
    Sink(voltage=4.0, silicon=silicon(-5e-4), oxide_offset=20e-6),
]


@pytest.mark.parametrize("sink", [SINKS[0], *(pytest.param(sink, marks=pytest.mark.long) for sink in SINKS[1:])])
def test_quarter_has_values_of_whole(sink):
    scene = replace(sink.scene(), steady=True, accuracy=1e-2)
    quarter, whole = solve(scene), solve(scene, whole=True)
    assert (quarter.details["symmetry"], whole.details["symmetry"]) == ("the quarter", "the whole")
    assert gap(quarter, whole) <= 1


def test_cubes_without_free_node_or_on_their_shared_facet_alone_have_values_of_part():
    scenes = (drawn(name) for name in ("cold cube", "cold cubes"))
    assert max(gap(solve(scene), solve(scene, whole=True)) for scene in scenes) <= 1


@pytest.mark.long
def test_traces_of_quarter_are_those_of_whole():
    scene = replace(SINKS[0].scene(), accuracy=1e-2)
    assert gap(solve(scene), solve(scene, whole=True), np.geomspace(1e-5, 0.02, 20)) <= 1
