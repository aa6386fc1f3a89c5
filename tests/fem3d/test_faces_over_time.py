"""Faces that radiate, and films whose coefficient follows the temperature, over time: bodies of one temperature by
their ordinary differential equation, and a slab by the method of lines."""

from copy import deepcopy

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fem3d.runs.scene import solve
from scenes.errors import SceneError
from scenes.free import from_dict
from tests.fem3d.test_faces import EMISSIVITY, HOT, LENGTH, ROOM, TABLE, WIDTH, radiated, slab
from tests.meshes.grouped import boxes

DENSITY, CAPACITY = 2000.0, 1e3  # kg/m3, J/(kg K)
SIDE = 1e-5
RADIATION = {"radiation": {"emissivity": EMISSIVITY, "ambient": ROOM}}
BODIES = {
    # start (K), what is at the top, heat source (W/m3), flux (W/m2) that leaves, end (s)
    "cooling": (1500.0, RADIATION, 0.0, radiated, 0.5),
    "heating": (ROOM, RADIATION, 1e10, radiated, 1.0),
    "table": (800.0, {"convection": {"coefficient": TABLE, "ambient": ROOM}}, 0.0,
              lambda t: np.interp(t, TABLE["temperatures"], TABLE["values"]) * (t - ROOM), 0.05),
    "film": (600.0, {"convection": {"coefficient": {"value": 100.0, "at": 300.0, "exponent": 1.5}, "ambient": 1000.0}},
             0.0, lambda t: 100.0 * (t / 300.0) ** 1.5 * (t - 1000.0), 0.1),
}  # fmt: skip


def body(start, top, source, end, accuracy=1e-3):
    """A cube that conducts so well that it has one temperature: the Biot number is below 3e-5."""
    upper = [SIDE] * 3
    heated = {"heat_source": source} if source else {}
    return {
        "scene": {"initial_temperature": start},
        "material": [{"name": "m", "thermal_conductivity": 1e3, "density": DENSITY, "specific_heat": CAPACITY}],
        "box": [{"name": "cube", "material": "m", "lower": [0, 0, 0], "upper": upper, **heated}],
        "boundary": [{"name": "top", "lower": [0, 0, SIDE], "upper": upper, **top}],
        "probe": [
            {"name": "t", "lower": [0, 0, 0], "upper": upper},
            {"name": "flow", "lower": [0, 0, SIDE], "upper": upper, "quantity": "heat_flow"},
            {"name": "part", "lower": [0, 0, SIDE], "upper": [SIDE, SIDE / 4, SIDE], "quantity": "heat_flow"},
        ],
        "run": {"end_time": end, "accuracy": accuracy},
    }


@pytest.mark.long
@pytest.mark.parametrize(("name", "mesh"), [*((name, "") for name in BODIES), ("film", "tetra10")])
def test_a_body_of_one_temperature(name, mesh, tmp_path):
    """rho c L dT/dt = q L - flux(T); on bricks, and on a mesh file."""
    start, top, source, leaves, end = BODIES[name]
    document = body(start, top, source, end)
    if mesh:
        del document["probe"][2]
        boxes.write(boxes.grouped(from_dict(document), mesh, 1), tmp_path / "m.msh", 1e-6)
        found = solve(from_dict(boxes.document(document, "m.msh", 1e-6), folder=str(tmp_path)))
    else:
        found = solve(from_dict(document))
    traces, area = found.over_time, SIDE**2

    def exact(factor=1.0):
        given = solve_ivp(
            lambda _, t: (source * SIDE - factor * leaves(t)) / (DENSITY * CAPACITY * SIDE),
            (0.0, end), [start], "Radau", traces.time, rtol=1e-9, atol=1e-7,
        )  # fmt: skip
        return given.y[0]

    t = exact()
    assert traces.errors["t"] <= 1e-3 * np.ptp(t)
    assert np.abs(traces.values["t"] - t).max() <= traces.errors["t"]
    # With one percent less the body ends elsewhere.
    assert np.abs(traces.values["t"] - exact(0.99)).max() > 3 * traces.errors["t"]
    for probe, part in (("flow", 1.0), ("part", 0.25))[: 1 if mesh else 2]:
        off = np.abs(traces.values[probe] + part * area * leaves(t)).max()
        assert off <= traces.errors[probe] <= 2e-2 * area * np.abs(leaves(t)).max()
    # The accuracy that is asked for; a table's bend costs the integral over time digits.
    assert found.details["transient_imbalance"] < 1e-3


LAW = {"value": 2.0, "at": 300.0, "exponent": -0.8}
TIMES = np.array([0.03, 0.1, 0.3]) * LENGTH**2 * DENSITY * CAPACITY / 2.0 * 3


def lines(emissivity=EMISSIVITY, exponent=-0.8, pieces=400):
    """(2, times): the temperature (K) of the radiating face and what leaves there (W) by the method of lines,
    rho c dT/dt = theta_xx with theta the integral of the conductivity, in equal cells, half a one at the face."""
    h, n, at = LENGTH / pieces, exponent + 1, LAW["at"]

    def theta(t):
        return LAW["value"] * at / n * (t / at) ** n

    def rate(_, t):
        passing = np.diff(theta(np.concatenate([[HOT], t]))) / h
        leaving = np.append(passing[1:], -radiated(t[-1], emissivity))
        return (leaving - passing) / (DENSITY * CAPACITY * np.append(np.full(pieces - 1, h), h / 2))

    start, options = np.full(pieces, ROOM), {"lband": 1, "uband": 1, "rtol": 1e-8, "atol": 1e-6}
    t = solve_ivp(rate, (0.0, TIMES[-1]), start, "LSODA", TIMES, **options).y[-1]
    return np.array([t, radiated(t, emissivity) * WIDTH**2])


@pytest.mark.long
def test_a_slab_has_the_course_of_the_method_of_lines():
    """Heat of one face, which becomes hot at once, reaches the other, which radiates; k falls with the temperature."""
    document = deepcopy(slab(RADIATION, 1e-3, thermal_conductivity=LAW, density=DENSITY, specific_heat=CAPACITY))
    document["probe"][0] = {"name": "face", "lower": [0, 0, LENGTH], "upper": [WIDTH, WIDTH, LENGTH]}
    document["run"] = {"end_time": float(TIMES[-1]), "output_times": TIMES.tolist(), "accuracy": 3e-3}
    traces = solve(from_dict(document)).over_time
    t, leaves = lines()
    # Of order 2: half the cells are off by three times more than what these change.
    off = np.abs(lines(pieces=200) - [t, leaves]).max(axis=1) / 3
    for name, own, apart in (("face", t, off[0]), ("flow", -leaves, off[1])):
        found = np.interp(TIMES, traces.time, traces.values[name])
        assert apart < 0.3 * traces.errors[name]
        assert np.abs(found - own).max() <= traces.errors[name] + apart, name
    assert traces.errors["face"] <= 3e-3 * (t.max() - ROOM)
    found = np.interp(TIMES, traces.time, traces.values["face"])
    for twin in (lines(emissivity=0.4)[0], lines(exponent=-0.6)[0]):
        assert np.abs(found - twin).max() > traces.errors["face"] + off[0]


def test_an_ambient_that_varies_beside_a_law_is_refused():
    """It is one or the other."""
    film = {"coefficient": TABLE, "ambient": {"times": [0.0, 1.0], "values": [300.0, 400.0]}}
    with pytest.raises(SceneError, match='boundary "top": its coefficient follows the temperature and its ambient'):
        solve(from_dict(body(300.0, {"convection": film}, 0.0, 1.0)))
