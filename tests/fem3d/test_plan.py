"""The lines of the plan are true of a run: what is solved for is listed, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from fem3d.problems.heat import HeatProblem
from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from scenes import physics
from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.sink import Sink


def lines(sink, transient=False):
    result = sink_run.solve(replace(sink, accuracy=1e-2), transient)
    return {s.step: s for s in result.details["plan"]}, result


def bodies(conductor):
    """The names of the boxes that carry current."""
    domain = conductor.heat.domain
    return {domain.names[n] for n in domain.body[conductor.cells]}


def test_pads_carry_no_unknowns_between_electrodes_at_the_beam_s_ends():
    found, result = lines(Sink())
    assert 'no current flows in "pad-0" and "oxide-0"' in found["electric problem"].reason
    conductor = result.details["answer"].fine.state.conductor
    space = conductor.heat.domain.space
    assert bodies(conductor) == {"beam"}
    assert len(conductor.free) == result.details["electric_unknowns"]
    of_pads = np.unique(space.dofs[:, space.mesh.p[1, space.mesh.t].min(axis=0) < -1e-9])
    of_beam = np.unique(space.dofs[:, conductor.cells])
    assert not np.isin(conductor.free, np.setdiff1d(of_pads, of_beam)).any()


def test_pads_are_part_of_the_circuit_between_electrodes_at_their_edges():
    found, result = lines(Sink(electrodes="pad-edge"))
    assert found["electric problem"].reason.startswith('in "beam" and "pad-0"')
    assert found["electric problem"].reason.endswith('no current flows in "oxide-0"')
    conductor = result.details["answer"].fine.state.conductor
    assert bodies(conductor) == {"beam", "pad-0"}


def bar(**changes):
    """A bar of 1 mm between two electrodes at 1 V, over 1 ms, with a probe of its current alone."""
    ends = [{"lower": [x, 0, 0], "upper": [x, 1e-4, 2e-6]} for x in (0, 1e-3)]
    found = {
        "scene": {"initial_temperature": 293.0},
        "material": [{"name": "silicon", "resistivity": 6e-5, "thermal_conductivity": 130, "density": 2330,
                      "specific_heat": 712}],
        "box": [{"material": "silicon", "lower": [0, 0, 0], "upper": [1e-3, 1e-4, 2e-6]}],
        "boundary": [{**ends[0], "name": "left", "voltage": 1.0}, {**ends[1], "name": "right", "voltage": 0.0}],
        "probe": [{"name": "current", "quantity": "current", **ends[0]}],
        "run": {"end_time": 1e-3, "accuracy": 1e-2},
    }  # fmt: skip
    for table, items in changes.items():
        found[table] = found[table] + items if table in ("boundary", "probe") else items
    return found


FOLLOWS = [{"name": "silicon", "resistivity": 6e-5, "thermal_conductivity": 130, "density": 2330, "specific_heat": 712,
            "temperature_coefficient": 1e-3}]  # fmt: skip
PEAK = [{"name": "peak", "at": [5e-4, 5e-5, 1e-6]}]
COLD = [{"name": "under", "lower": [0, 0, 0], "upper": [1e-3, 1e-4, 0], "temperature": 293.0}]
SCENES = {
    "a current alone": (bar(), False),
    "a current that follows the temperature": (bar(material=FOLLOWS), True),
    "a temperature": (bar(probe=PEAK), True),
    "a condition of heat": (bar(boundary=COLD), True),
    "a voltage that varies": (
        bar(boundary=[{"name": "gate", "lower": [5e-4, 0, 0], "upper": [5e-4, 1e-4, 2e-6],
                       "voltage": {"times": [0, 5e-4, 5e-4], "values": [0, 1, -1]}}]), False),
}  # fmt: skip


def spy(monkeypatch, name, solved):
    """Every factorization of a heat problem, noted."""
    own = getattr(HeatProblem, name)
    monkeypatch.setattr(HeatProblem, name, lambda *given: solved.append(name) or own(*given))


@pytest.mark.parametrize("name", SCENES)
def test_heat_is_solved_where_the_plan_says_so_and_nowhere_else(name, monkeypatch):
    document, thermal = SCENES[name]
    scene = from_dict(document)
    solved = []
    spy(monkeypatch, "factors", solved)
    result = scene_run.solve(scene)
    planned = {step.step: step.state for step in scene_run.plan(scene)}
    assert (planned["heat"] == "done") == physics.heat(scene) == bool(solved) == thermal
    assert planned["transient"] == "done"
    if not thermal:
        assert result.details["unknowns"] == result.details["electric_unknowns"]


def test_the_current_falls_as_it_heats_only_where_heat_is_solved():
    cold = scene_run.solve(from_dict(bar())).traces
    warm = scene_run.solve(from_dict(bar(material=FOLLOWS))).traces
    assert np.ptp(cold.values["current"]) == 0.0
    assert cold.values["current"][0] == pytest.approx(1 / 300, rel=1e-9)  # R = 6e-5 * 1e-3 / 2e-10 = 300 ohm
    # Adiabatic and uniform: C dT/dt = V^2 / (R (1 + a T)), so I = V / R / sqrt(1 + 2 a V^2 t / (R C)).
    capacity = 2330 * 712 * 1e-3 * 1e-4 * 2e-6
    exact = 1 / 300 / np.sqrt(1 + 2 * 1e-3 * warm.time / (300 * capacity))
    assert warm.values["current"] == pytest.approx(exact, abs=warm.errors["current"])
    # ... which is ten times less than its fall.
    assert exact[-1] < cold.values["current"][0] - 3 * warm.errors["current"]


TOP = {"name": "top", "quantity": "potential", "reduce": "max", "lower": [5e-4, 0, 0], "upper": [1e-3, 1e-4, 2e-6]}


@pytest.mark.parametrize("other", [0, {"times": [0, 1e-3], "values": [0, 1]}])
def test_extreme_under_varying_voltages_is_refused(other):
    document = bar(probe=[TOP])
    for boundary, voltage in zip(document["boundary"], ({"times": [0, 1e-3], "values": [2, -2]}, other), strict=True):
        boundary["voltage"] = voltage
    with pytest.raises(SceneError, match="vary apart or change their sign"):
        scene_run.solve(from_dict(document))
