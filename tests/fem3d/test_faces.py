"""Faces that radiate, and films whose coefficient follows the temperature: slabs whose one unknown is a root, and a
block against the second path."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from fem3d.results import outputs
from fem3d.runs import sink as sinks
from fem3d.runs.scene import solve
from scenes.free import as_dict, from_dict
from scenes.sink import Sink
from tests.fem3d import gap, plain_grid, steady_on, whole
from validate.verify.second_path import SecondPath

SIGMA = 5.670374419e-8  # W/(m2 K4), CODATA 2018
LENGTH, WIDTH, HOT, ROOM = 1e-3, 1e-5, 1000.0, 300.0
EMISSIVITY, K = 0.8, 2.0
TABLE = {"temperatures": [400.0, 700.0, 900.0], "values": [200.0, 2000.0, 500.0]}
STEADY = False


def slab(top, accuracy=1e-6, more=(), **material):
    """A slab between a hot face below and one with conditions above; ``more`` changes its document."""
    upper = [WIDTH, WIDTH, LENGTH]
    document = {
        "scene": {"initial_temperature": ROOM},
        "material": [{"name": "m", "thermal_conductivity": K, **material}],
        "box": [{"name": "slab", "material": "m", "lower": [0, 0, 0], "upper": upper}],
        "boundary": [
            {"name": "hot", "lower": [0, 0, 0], "upper": [WIDTH, WIDTH, 0], "temperature": HOT},
            {"name": "top", "lower": [0, 0, LENGTH], "upper": upper, **top},
        ],
        "probe": [
            {"name": "face", "at": upper, "box": "slab"},
            {"name": "flow", "lower": [0, 0, LENGTH], "upper": upper, "quantity": "heat_flow"},
        ],
        "run": {"steady": True, "accuracy": accuracy},
    }
    for change in more:
        change(document)
    return document


def radiated(t, emissivity=EMISSIVITY):
    return emissivity * SIGMA * (t**4 - ROOM**4)


def held(found, exact):
    """Whether a value is within its error, apart from rounding."""
    return abs(found.value - exact) <= found.error + 1e-9 * abs(exact)


RADIATION = {"radiation": {"emissivity": EMISSIVITY, "ambient": ROOM}}
FILM = {"convection": {"coefficient": 40.0, "ambient": ROOM}}
FACES = {
    "radiation": (RADIATION, radiated),
    "radiation beside a film": ({**RADIATION, **FILM}, lambda t: radiated(t) + 40 * (t - ROOM)),
    "table": (
        {"convection": {"coefficient": TABLE, "ambient": ROOM}},
        lambda t: np.interp(t, TABLE["temperatures"], TABLE["values"]) * (t - ROOM),
    ),
}


@pytest.mark.parametrize("name", FACES)
def test_slab_balances_conduction_and_radiation(name):
    condition, leaves = FACES[name]
    found = solve(from_dict(slab(condition))).steady
    face = brentq(lambda t: K * (HOT - t) / LENGTH - leaves(t), ROOM, HOT, xtol=1e-12)
    assert held(found["face"], face)
    assert held(found["flow"], -leaves(face) * WIDTH**2)
    # The straight line at room temperature, by which the flux would be less, is detected.
    slope = float((leaves(ROOM + 1e-3) - leaves(ROOM - 1e-3)) / 2e-3)
    straight = brentq(lambda t: K * (HOT - t) / LENGTH - slope * (t - ROOM), ROOM, HOT)
    assert not held(found["face"], straight)


def test_radiation_behind_contact_and_law():
    """From the hot face through a slab whose conductivity falls, a contact and another slab to the air."""
    law, resistance, other = {"value": K, "at": ROOM, "exponent": -1.3}, 2e-4, 0.5

    def second(document):
        document["material"].append({"name": "other", "thermal_conductivity": other})
        upper = [WIDTH, WIDTH, 2 * LENGTH]
        document["box"].append({"name": "upper", "material": "other", "lower": [0, 0, LENGTH], "upper": upper})
        document["boundary"][1] |= {"lower": [0, 0, 2 * LENGTH], "upper": upper}
        document["probe"][1] |= {"lower": [0, 0, 2 * LENGTH], "upper": upper}
        document["probe"].append({"name": "end", "at": upper})
        contact = {"name": "joint", "between": ["slab", "upper"], "thermal_resistance": resistance}
        document["contact"] = [contact]

    found = solve(from_dict(slab({**RADIATION, **FILM}, 1e-5, [second], thermal_conductivity=law))).steady

    def theta(t):
        """Kirchhoff's variable: the integral of the conductivity from room temperature, in W/m."""
        return K * ROOM / -0.3 * ((t / ROOM) ** -0.3 - 1)

    def chain(end):
        flux = radiated(end) + 40 * (end - ROOM)
        return flux, end + flux * (LENGTH / other + resistance)

    def missing(end):
        flux, face = chain(end)
        return (theta(HOT) - theta(face)) / LENGTH - flux

    end = brentq(missing, ROOM, HOT, xtol=1e-12)
    flux, face = chain(end)
    assert held(found["end"], end)
    assert held(found["face"], face)
    assert held(found["flow"], -flux * WIDTH**2)
    # Without the jump at the contact the face would be colder.
    assert not held(found["face"], face - flux * resistance)


SIDES, CONDUCTIVITIES, BELOW, SOURCE = (2e-3, 1e-3, 1.5e-3), (1.4, 20.0), 1e-3, 4e8


def block(accuracy):
    """A good conductor over a bad one, heated, radiating above and at one side, cold below at one half."""
    (a, b, c), z = SIDES, BELOW
    faces = {"top": ([0, 0, c], [a, b, c]), "side": ([a, 0, 0], [a, b, c])}
    return from_dict({
        "scene": {"initial_temperature": ROOM},
        "material": [{"name": f"m{i}", "thermal_conductivity": k} for i, k in enumerate(CONDUCTIVITIES)],
        "box": [
            {"name": "low", "material": "m0", "lower": [0, 0, 0], "upper": [a, b, z]},
            {"name": "high", "material": "m1", "lower": [0, 0, z], "upper": [a, b, c], "heat_source": SOURCE},
        ],
        "boundary": [
            {"name": "cold", "lower": [0, 0, 0], "upper": [a, b, 0], "temperature": ROOM},
            *({"name": n, "lower": at[0], "upper": at[1], **RADIATION} for n, at in faces.items()),
        ],
        "probe": [
            {"name": "corner", "at": [0, 0, c]},
            {"name": "mean", "lower": [0, 0, z], "upper": [a, b, c]},
            {"name": "top", "lower": faces["top"][0], "upper": faces["top"][1], "quantity": "heat_flow"},
        ],
        "run": {"steady": True, "accuracy": accuracy},
    })  # fmt: skip


def test_radiating_block_agrees_with_second_path():
    """On one mesh; an emissivity one percent larger differs."""
    scene = block(1e-3)
    grid = plain_grid(scene, 2)
    path = SecondPath(scene, grid)
    exact = path.readings(path.steady())
    for more in (1.0, 1.01):
        faces = (replace(b, value=more * b.value) if b.kind == "radiation" else b for b in scene.boundaries)
        other = replace(scene, boundaries=tuple(faces))
        out = outputs.of_steady(steady_on(other, grid, 1.0), whole(other))
        apart = max(abs(ROOM + float(out[f"probe:{name}"]) - t) / (t - ROOM) for name, t in exact.items())
        assert apart < 1e-9 if more == 1.0 else apart > 1e-6


@pytest.mark.long
def test_errors_of_radiating_block_hold():
    coarse, fine = (solve(block(accuracy)) for accuracy in (1e-2, 1e-5))
    assert gap(coarse, fine) <= 1
    assert all(fine.steady[name].error < 0.3 * found.error for name, found in coarse.steady.items())


def test_radiating_sink_agrees_with_independent_code():
    found = sinks.solve(Sink(emissivity=0.7), STEADY)
    peak = found.steady["peak_rise_K"]
    # Both sides of the pads and the beam, its edges too, at 1 V; 20.3322 K without.
    assert abs(peak.value - 20.2391) <= peak.error + 5e-5
    assert abs(peak.value - 20.3322) > 10 * peak.error
    assert found.details["energy_imbalance"] < 1e-9
    flows = found.details["answer"].fine.out
    radiating = sum(float(v) for name, v in flows.items() if name.startswith("flow:radiation"))
    assert radiating == pytest.approx(found.steady["heat_out_W"].value - found.steady["power_W"].value, rel=1e-6)


def test_radiating_row_balances_heat():
    sink = Sink(voltage=10.0, spans=2, emissivity=0.7, convection_coefficient=187.5, accuracy=2e-2)
    result = sinks.solve(sink, STEADY)
    steady, out = result.steady, result.details["answer"].fine.out
    # The heat leaves by the faces of spans and bridge, the island and the two ends: the pads carry no current.
    faces = sum(v for n, v in out.items() if n.startswith("flow:") and ("span" in n or "bridge" in n))
    left = 2 * steady["end_flow_W"].value + steady["island1_heat_W"].value - faces
    assert left == pytest.approx(out["power"], rel=1e-9)


def test_convection_and_radiation_survive_writing():
    scene = from_dict(slab({**RADIATION, **FILM}))
    assert [(b.name, b.kind) for b in scene.boundaries[1:]] == [("top", "convection"), ("top radiation", "radiation")]
    assert from_dict(as_dict(scene)) == scene
    table = from_dict(slab(FACES["table"][0]))
    assert from_dict(as_dict(table)) == table
