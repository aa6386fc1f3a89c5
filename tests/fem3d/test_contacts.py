"""Contacts: exact slabs, steady and over time, the readings of each contact, and a contact that its current warms."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from benchmarks.walls import Layer, step_response
from fem3d.results import outputs
from fem3d.runs.scene import solve
from scenes.free import from_dict
from scenes.free.rules import checked
from scenes.laws import PowerLaw
from scenes.model import Boundary, Box, Contact, Material, Probe, Scene
from tests.fem3d import gap, plain_grid, steady_on, whole
from validate.verify.second_path import SecondPath

LENGTH, SIDE, K, CAPACITY = 1e-3, 0.2e-3, 2.0, 3e6
RESISTANCE = 5e-4  # m2 K/W: as much as the length of a slab


def test_step_behind_contact_follows_series():
    slow = LENGTH**2 * CAPACITY / K
    times = np.array([0.02, 0.1, 0.5, 2.0]) * slow
    document = {
        "scene": {"name": "slab", "initial_temperature": 293.0},
        "material": [{"name": "a", "thermal_conductivity": K, "density": 1.0, "specific_heat": CAPACITY}],
        "box": [{"name": "slab", "material": "a", "lower": [0, 0, 0], "upper": [LENGTH, SIDE, SIDE]}],
        "boundary": [{"name": "held", "lower": [0, 0, 0], "upper": [0, SIDE, SIDE], "temperature": 303.0,
                      "contact_resistance": RESISTANCE}],
        "probe": [{"name": "near", "at": [0, 0, 0]}, {"name": "far", "at": [LENGTH, SIDE, 0]}],
        "run": {"end_time": float(times[-1]), "output_times": times.tolist(), "accuracy": 1e-4},
    }  # fmt: skip
    traces = solve(from_dict(document)).traces
    layers = [Layer(LENGTH, K, CAPACITY)]
    exact, worse = (
        step_response(layers, "film", 10.0, 0.0, times, coefficient=1 / r) for r in (RESISTANCE, 1.01 * RESISTANCE)
    )
    for face, name in enumerate(("near", "far")):
        found = np.interp(times, traces.time, traces.values[name]) - 293.0
        assert np.abs(found - exact[:, face]).max() <= traces.errors[name] < 1e-3 * 10.0
        assert np.abs(found - worse[:, face]).max() > 2 * traces.errors[name]


RHO, VOLTS = 1e-5, 0.1
FAR = (2 * LENGTH, SIDE, SIDE)


def pair(thermal: float, electric: float, behind: float = 0.0, **more: Any) -> Scene:
    """Two bars in a row along x with a contact between, cold and on a voltage at one end, earthed behind another
    contact at the other."""
    a = Material("a", 2.0, 1.0, CAPACITY, RHO)
    b = Material("b", 5.0, 1.0, CAPACITY, 2 * RHO)
    near, face = ((0.0, 0.0, 0.0), (0.0, SIDE, SIDE)), ((LENGTH, 0.0, 0.0), (LENGTH, SIDE, SIDE))
    far = (2 * LENGTH, 0.0, 0.0), FAR
    point = (LENGTH, 0.0, SIDE / 2)
    scene = Scene(
        "pair", (Box("a", a, near[0], face[1]), Box("b", b, face[0], FAR)),
        (
            Boundary("cold", "temperature", *near, 293.0), Boundary("plus", "voltage", *near, VOLTS),
            Boundary("minus", "voltage", *far, 0.0, contact_resistance=behind),
        ),
        (
            *(Probe(f"temperature {box}", point, point, boxes=(box,)) for box in "ab"),
            *(Probe(f"potential {box}", point, point, "potential", boxes=(box,)) for box in "ab"),
            Probe("mean b", *face, boxes=("b",)), Probe("top a", *face, reduce="max", boxes=("a",)), Probe("end", *far),
            Probe("volts at the end", *far, "potential"), Probe("heat", *near, "heat_flow"),
            Probe("current", *near, "current"), Probe("heat across", *face, "heat_flow"),
            Probe("current across", *face, "current"), Probe("power", near[0], FAR, "power"),
            Probe("power a", near[0], face[1], "power"), Probe("power b", face[0], FAR, "power"),
        ),
        contacts=(Contact("c", ("a", "b"), thermal, electric),), **{"steady": True, **more},
    )  # fmt: skip
    return checked(scene)


def exact(thermal: float, electric: float, behind: float) -> dict[str, float]:
    """The probes of `pair`, by resistances in series."""
    j = VOLTS / (3 * RHO * LENGTH + electric + behind)
    in_a, in_b, at_c, at_end = (j**2 * r for r in (RHO * LENGTH, 2 * RHO * LENGTH, electric, behind))
    beyond = in_b + at_end + at_c / 2
    a = (beyond + at_c / 2 + in_a / 2) * LENGTH / 2.0
    b = a + beyond * thermal
    end = b + (in_b / 2 + at_end) * LENGTH / 5.0
    volts = VOLTS - j * RHO * LENGTH
    return {
        "temperature a": 293 + a, "temperature b": 293 + b, "potential a": volts, "potential b": volts - j * electric,
        "mean b": 293 + b, "top a": 293 + a, "end": 293 + end, "volts at the end": j * behind,
        "heat": -(in_a + in_b + at_c + at_end) * SIDE**2, "current": j * SIDE**2, "heat across": -beyond * SIDE**2,
        "current across": j * SIDE**2, "power": VOLTS * j * SIDE**2, "power a": (in_a + at_c / 2) * SIDE**2,
        "power b": (in_b + at_c / 2 + at_end) * SIDE**2,
    }  # fmt: skip


CASES = [(5e-4, 3e-8, 2e-8), (5e-4, 0.0, 0.0), (0.0, 3e-8, 0.0), (0.0, 0.0, 2e-8), (5e-4, 3e-8, 0.0)]


def test_contact_and_series_resistance_add():
    contact, behind, series = 3e-8, 2e-8, 20.0
    scene = pair(0.0, contact, behind)
    ends = (*scene.boundaries[:2], replace(scene.boundaries[2], series_resistance=series))
    found = solve(checked(replace(scene, boundaries=ends))).steady
    area = SIDE**2
    current = VOLTS / ((3 * RHO * LENGTH + contact + behind) / area + series)
    for name, value in (("current", current), ("volts at the end", current * (behind / area + series))):
        assert abs(found[name].value - value) <= found[name].error + 1e-12 * value < 1e-6 * value, name


def _rim(resistance: float, **more: Any) -> Scene:
    """Two blocks side by side on a plate, all of one material, with a contact under the first one: it ends inside."""
    m = Material("m", K, 1.0, CAPACITY)
    low, high, side = LENGTH, 2 * LENGTH, SIDE
    return checked(Scene(
        "rim",
        (
            Box("plate", m, (0.0, 0.0, 0.0), (high, side, low)), Box("block", m, (0.0, 0.0, low), (low, side, high)),
            Box("beside", m, (low, 0.0, low), (high, side, high)),
        ),
        (
            Boundary("cold", "temperature", (0.0, 0.0, 0.0), (high, side, 0.0), 293.0),
            Boundary("hot", "heat_flux", (0.0, 0.0, high), (high, side, high), 1e4),
        ),
        (
            Probe("below", (0.0, 0.0, low), (0.0, 0.0, low), boxes=("plate",)),
            Probe("above", (0.0, 0.0, low), (0.0, 0.0, low), boxes=("block",)),
            Probe("block", (0.0, 0.0, low), (low, side, high)),
            Probe("across", (0.0, 0.0, low), (low, side, low), "heat_flow"),
        ),
        contacts=(Contact("c", ("plate", "block"), resistance),), **{"steady": True, **more},
    ))  # fmt: skip


def test_contact_that_ends_inside_agrees_with_second_path():
    """On one mesh; a contact one percent worse differs."""
    scene = replace(_rim(RESISTANCE), probes=_rim(RESISTANCE).probes[2:3])
    grid = plain_grid(scene, 2, cuts=2)
    path = SecondPath(scene, grid)
    (exact,) = path.readings(path.steady()).values()
    for worse in (1.0, 1.01):
        contacts = (Contact("c", ("plate", "block"), worse * RESISTANCE),)
        other = replace(scene, contacts=contacts)
        out = outputs.of_steady(steady_on(other, grid, 1.0), whole(other))
        apart = abs(293.0 + float(out["probe:block"]) - exact) / (exact - 293.0)
        assert apart < 1e-9 if worse == 1.0 else apart > 1e-4


@pytest.mark.long
def test_errors_hold_where_contact_ends_inside():
    coarse, fine = (solve(_rim(RESISTANCE, accuracy=accuracy)) for accuracy in (1e-2, 1e-4))
    assert gap(coarse, fine) <= 1
    assert all(fine.steady[name].error < 0.1 * found.error for name, found in coarse.steady.items())


def test_part_of_scene_with_contacts_equals_whole():
    m = Material("m", K, 1.0, CAPACITY, RHO)
    low, side = LENGTH, SIDE
    boxes_ = (
        Box("left", m, (-low, 0.0, 0.0), (-side, side, side)),
        Box("right", m, (side, 0.0, 0.0), (low, side, side)),
        Box("middle", m, (-side, 0.0, 0.0), (side, side, side)),
    )
    ends = [((x, 0.0, 0.0), (x, side, side)) for x in (-low, low)]
    at = (side, 0.0, 0.0)
    scene = checked(Scene(
        "row", boxes_,
        (
            Boundary("cold", "temperature", *ends[0], 293.0), Boundary("cold too", "temperature", *ends[1], 293.0),
            Boundary("plus", "voltage", *ends[0], 0.1), Boundary("minus", "voltage", *ends[1], -0.1),
        ),
        (
            Probe("inner", at, at, boxes=("middle",)), Probe("outer", at, at, boxes=("right",)),
            Probe("volts", at, at, "potential", boxes=("right",)), Probe("current", *ends[1], "current"),
        ),
        steady=True,
        contacts=(Contact("l", ("left", "middle"), 1e-4, 1e-8), Contact("r", ("right", "middle"), 1e-4, 1e-8)),
    ))  # fmt: skip
    half, whole = solve(scene), solve(scene, whole=True)
    assert (half.details["symmetry"], whole.details["symmetry"]) == ("the eighth", "the whole")
    assert gap(half, whole) <= 1
    # With another contact on one side there is no plane across x.
    apart = replace(scene, contacts=(scene.contacts[0], replace(scene.contacts[1], thermal_resistance=2e-4)))
    assert solve(apart).details["symmetry"] == "the quarter"


def with_law(scene: Scene, key: str, exponent: float) -> Scene:
    """The scene with a property of all its materials by a law that has its value at 293 K."""
    law = {
        m: replace(m, **{key: PowerLaw(getattr(m, key), 293.0, exponent)}) for m in (b.material for b in scene.boxes)
    }
    return replace(scene, boxes=tuple(replace(b, material=law[b.material]) for b in scene.boxes))


def _warming(electrical: float, end_time: float = 0.0, **resistivity: object) -> dict[str, Any]:
    """A bar of two halves between cold ends that a current warms by a hundred kelvins."""
    start, middle, far, end = [0, 0, 0], [4e-5, 1e-5, 2e-6], [4e-5, 0, 0], [1e-4, 1e-5, 2e-6]
    near, last = {"lower": start, "upper": [0, *end[1:]]}, {"lower": [end[0], 0, 0], "upper": end}
    contact = {"thermal_resistance": 1e-6, **({"electrical_resistance": electrical} if electrical else {})}
    return {
        "scene": {"initial_temperature": 300.0},
        "material": [{"name": "m", "thermal_conductivity": 100.0, "density": 2330.0, "specific_heat": 700.0,
                      "resistivity": 1e-5, **resistivity}],
        "box": [{"name": "p", "material": "m", "lower": start, "upper": middle},
                {"name": "q", "material": "m", "lower": far, "upper": end}],
        "contact": [{"name": "c", "between": ["p", "q"], **contact}],
        "boundary": [{"name": "a", **near, "temperature": 300.0}, {"name": "b", **last, "temperature": 300.0},
                     {"name": "v", **near, "voltage": 0.0}, {"name": "w", **last, "voltage": 0.9}],
        "probe": [{"name": "p", "at": far, "box": "p"}, {"name": "q", "at": far, "box": "q"},
                  {"name": "current", **last, "quantity": "current"}],
        "run": {"end_time": end_time, "accuracy": 1e-3} if end_time else {"steady": True, "accuracy": 1e-3},
    }  # fmt: skip


LINE = {"temperature_coefficient": 2e-3, "reference_temperature": 300.0}
SAID = {"resistivity": {"temperatures": [300.0, 1300.0], "values": [1e-5, 3e-5]}}
"""The same line as a table."""
OTHER = {"resistivity": {"temperatures": [300.0, 1300.0], "values": [1e-5, 2.9e-5]}}


@pytest.mark.parametrize("electrical", [0.0, 3e-10])
def test_table_of_line_beside_contact_equals_line(electrical):
    line, law, other = (solve(from_dict(_warming(electrical, **of))).steady for of in (LINE, SAID, OTHER))
    for name, value in line.items():
        assert abs(law[name].value - value.value) <= law[name].error + value.error
        assert abs(other[name].value - value.value) > other[name].error + value.error


def warmed_bar(
    lengths: tuple[float, float], area: float, k: float, line: tuple[float, float], thermal: float, electric: float,
    voltage: float,
) -> tuple[float, float, float]:  # fmt: skip
    """The rises (K) at both sides of a contact between two halves with cold ends, and the current (A); the resistivity
    is ``line`` = (rho, a), rho (1 + a rise).

    With m^2 = rho a j^2/k, rise + 1/a = cos(m s)/a + B sin(m s) in each half, s from its cold end. The flow into the
    contact, and half its own heat, crosses it; j follows from the voltage.
    """
    rho, a = line

    def at(j: float) -> tuple[float, np.ndarray]:
        m = j * np.sqrt(rho * a / k)
        c, s = np.cos(m * np.array(lengths)), np.sin(m * np.array(lengths))
        # Unknown are both B: the heat that the halves take up is the contact's own, and half its difference crosses.
        matrix = np.array([k * m * c, np.array([-1, 1]) * (k * m * c / 2 + s / thermal)])
        right = [j**2 * electric + k * m * s.sum() / a, (np.array([-1, 1]) @ (k * m * s / 2 - c / thermal)) / a]
        b = np.linalg.solve(matrix, right)
        inside = j * rho * a * (s / a + b * (1 - c)).sum() / m
        return inside + j * electric - voltage, (c - 1) / a + b * s

    j = brentq(lambda j: at(j)[0], 1e-6 * voltage / electric, voltage / (rho * sum(lengths) + electric), rtol=1e-12)
    return (*at(j)[1].tolist(), j * area)


@pytest.mark.long
@pytest.mark.parametrize(("electrical", "of"), [(3e-10, SAID), (1e-11, LINE)])
def test_warmed_bar_with_contact_ends_in_steady_state(electrical, of):
    names = ("p", "q", "current")
    values, others = (
        warmed_bar((4e-5, 6e-5), 2e-11, 100.0, (1e-5, slope), 1e-6, electrical, 0.9) for slope in (2e-3, 1.9e-3)
    )
    # The slowest mode has decayed by exp(-12).
    traces = solve(from_dict(_warming(electrical, 3e-4, **of))).over_time
    for name, value, other in zip(names, values, others, strict=True):
        last = traces.values[name][-1] - (0.0 if name == "current" else 300.0)
        assert abs(last - value) <= traces.errors[name] < 1e-3 * abs(value)
        assert abs(last - other) > traces.errors[name]
