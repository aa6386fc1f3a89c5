"""Derivatives of steady states with contacts, given currents and resistances in front of electrodes: against
differences of the same problem on the same grid."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.results.outputs import of_steady
from fem3d.runs import probe_quantities
from fem3d.sensitivity.motion import STEP, motion, moved
from fem3d.sensitivity.neighbour import Beside
from fem3d.sensitivity.steady import Tangent
from fem3d.solution import steady
from fem3d.spaces.domain import boxes
from meshes import connected
from scenes.free import from_dict
from scenes.model import Probe
from scenes.varied import neighbour, numbers
from tests.fem3d import grid_of, whole

END = 180e-6
FACES = {"in": ([0, 0, 0], [0, 20e-6, 10e-6]), "out": ([END, 0, 0], [END, 20e-6, 10e-6])}
BOTTOM = {"lower": [0, 0, -5e-6], "upper": [END, 20e-6, -5e-6]}
DRIVES = {
    "voltage": {"voltage": 1.0},
    "behind a contact": {"voltage": 1.0, "contact_resistance": 2e-9},
    "behind a resistance": {"voltage": 1.0, "series_resistance": 30.0},
    "current": {"current": 10e-3},
}
CONTACTS = [
    {"name": "ab", "between": ["a", "b"], "thermal_resistance": 2e-7, "electrical_resistance": 3e-9},
    {"name": "ao", "between": ["a", "o"], "thermal_resistance": 4e-7},
]


def joined(drive):
    """Two conductors on an oxide, with contacts: with each other for heat and current, and with the oxide for heat."""
    silicon = {
        "name": "si", "thermal_conductivity": 100.0, "resistivity": 1e-4, "temperature_coefficient": 1e-3,
        "reference_temperature": 293.0,
    }  # fmt: skip
    probes = [
        {"name": "mean", "quantity": "temperature", "lower": [0, 0, 0], "upper": [100e-6, 20e-6, 10e-6]},
        {"name": "side", "quantity": "temperature", "box": "b", "at": [100e-6, 10e-6, 5e-6]},
        {"name": "potential", "quantity": "potential", "at": [50e-6, 10e-6, 5e-6]},
        {"name": "heat", "quantity": "heat_flow", **BOTTOM},
        {"name": "current", "quantity": "current", "lower": [70e-6, 0, 0], "upper": [70e-6, 20e-6, 10e-6]},
        {"name": "power", "quantity": "power", "lower": [0, 0, 0], "upper": [100e-6, 20e-6, 10e-6]},
    ]
    return from_dict({
        "scene": {"name": "joined", "initial_temperature": 293.0},
        "material": [silicon, {"name": "ox", "thermal_conductivity": 5.0}],
        "box": [
            {"name": "a", "material": "si", "lower": [0, 0, 0], "upper": [100e-6, 20e-6, 10e-6]},
            {"name": "b", "material": "si", "lower": [100e-6, 0, 0], "upper": [END, 20e-6, 10e-6]},
            {"name": "o", "material": "ox", "lower": [0, 0, -5e-6], "upper": [END, 20e-6, 0.0]},
        ],
        "boundary": [
            {"name": "bottom", "temperature": 293.0, **BOTTOM},
            {"name": "in", **DRIVES[drive], **dict(zip(("lower", "upper"), FACES["in"], strict=True))},
            {"name": "out", "voltage": 0.0, **dict(zip(("lower", "upper"), FACES["out"], strict=True))},
        ],
        "contact": CONTACTS,
        "probe": probes,
        "run": {"steady": True},
    })  # fmt: skip


def solved(scene):
    grid = grid_of(scene, [np.array(connected.scene_planes(scene, d)) for d in range(3)], 2)
    heat = assemble(boxes(scene, grid))
    state = steady.solve_steady(heat, conductors.find(heat), 1.0, 1e-10)
    study = probe_quantities.study(scene, whole(scene))
    return study, state, study.steady(of_steady(state, study.part))


@pytest.mark.parametrize("drive", [
    pytest.param(drive, marks=pytest.mark.long if "behind" in drive else ()) for drive in DRIVES
])  # fmt: skip
def test_slopes_are_differences(drive):
    scene = joined(drive)
    study, state, values = solved(scene)
    resistances = [f"contact.{c['name']}.{key}" for c in CONTACTS for key in c if key.endswith("resistance")]
    keys = [*resistances, *(f"boundary.in.{key}" for key in DRIVES[drive]), "box.b.lower.x", "box.o.lower.z",
            "material.si.temperature_coefficient"]  # fmt: skip
    assert set(keys) < set(numbers(scene))
    others = {key: neighbour(scene, key, STEP) for key in keys}
    by = {key: motion(state.heat.domain, whole(scene), whole(other), STEP) for key, other in others.items()}
    tangent = Tangent(study, state)
    table = tangent.table(values, by)
    assert not tangent.without

    largest = {name: max(abs(slopes[name]) for slopes in table.values()) for name in values}
    step, moved = 1e-3, set()
    for key in by:
        up, down = (solved(neighbour(scene, key, s))[2] for s in (step, -step))
        for name in values:
            difference = float(up[name] - down[name]) / (2 * step)
            # Central differences miss the square of the step, of the third derivative; rounding is divided by it.
            assert table[key][name] == pytest.approx(difference, rel=2e-5, abs=2e-6 * largest[name]), (key, name)
            if abs(difference) > 1e-3 * largest[name]:
                moved.add(key)
    assert moved == set(keys)


@pytest.mark.parametrize("key", ["contact.ab.thermal_resistance", "contact.ab.electrical_resistance", "box.b.lower.x"])
def test_a_problem_beside_is_that_of_the_changed_scene(key):
    """Slopes over time are made of it."""
    scene = joined("voltage")
    heat, conductor = solved(scene)[1].heat, solved(scene)[1].conductor
    other = neighbour(scene, key, STEP)
    exact = solved(other)[1]
    still = np.zeros(heat.size)

    def patterns(of, currents):
        return [currents.pattern(currents.solve(np.zeros(of.size), currents.voltages[0]))]

    beside = Beside(heat, conductor, still[: heat.free, None], patterns)
    found = beside.projected(moved(heat.domain, whole(scene), whole(other), STEP))
    for new, exactly, before in (
        (found.heat.stiffness, exact.heat.stiffness, heat.stiffness),
        (found.conductor.matrix, exact.conductor.matrix, conductor.matrix),
    ):
        changed = abs(exactly - before).max()
        assert abs(new - exactly).max() <= 1e-9 * max(changed, abs(exactly).max())
    changed = [abs(a - b).max() / abs(b).max() for a, b in ((found.heat.stiffness, heat.stiffness),
               (found.conductor.matrix, conductor.matrix))]  # fmt: skip
    assert max(changed) > STEP / 100


def test_what_passes_a_contact_has_no_slope():
    scene = joined("voltage")
    across = [Probe(q, (100e-6, 0.0, 0.0), (100e-6, 20e-6, 10e-6), q) for q in ("heat_flow", "current")]
    study, state, values = solved(replace(scene, probes=tuple(across)))
    tangent = Tangent(study, state)
    assert not tangent.goals(values)
    assert all("lies on a contact" in why for why in tangent.without.values())
