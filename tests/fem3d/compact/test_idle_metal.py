"""Compact models of scenes with metal that no electrode touches, or one alone: it carries no current."""

from typing import Any

import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs.compact import compact
from scenes.free import from_dict
from statespace.channels import channels, scenarios
from statespace.runtime import CompactModel


def layered(
    resistivity: float | str, conductivity: float = 300.0, strip: bool = False, run: dict[str, Any] | None = None
) -> Any:
    """A heater under oxide under a mirror of metal that no electrode touches, or one alone."""

    def box(name: str, low: float, high: float) -> dict[str, Any]:
        return {"name": name, "material": name, "lower": [0, 0, low], "upper": [1e-4, 2e-5, high]}

    def end(name: str, x: float, high: float = 2e-6, low: float = 0.0, **condition: float) -> dict[str, Any]:
        return {"name": name, "lower": [x, 0, low], "upper": [x, 2e-5, high], **condition}

    def material(name: str, conductivity: float, **others: Any) -> dict[str, Any]:
        return {"name": name, "thermal_conductivity": conductivity, "density": 2e3, "specific_heat": 700} | others

    document: dict[str, Any] = {
        "run": (run or {"steady": True}) | {"accuracy": 1e-2},
        "material": [
            material("heater", 130, resistivity=6e-5, temperature_coefficient=5e-4),
            material("oxide", 1.3),
            material("mirror", conductivity, resistivity=resistivity),
        ],
        "box": [box("heater", 0.0, 2e-6), box("oxide", 2e-6, 3e-6), box("mirror", 3e-6, 3.5e-6)],
        "boundary": [end("cold", 1e-4, temperature=293), end("one", 1e-4, voltage=1), end("two", 0.0, voltage=0)],
        "probe": [{"name": "top", "at": [0, 1e-5, 3.5e-6]}],
    }
    if strip:
        document["boundary"].append(end("strip", 0.0, 3.5e-6, 3e-6, voltage=0.3))
        document["probe"].append({"name": "potential", "quantity": "potential", "at": [5e-5, 1e-5, 3.25e-6]})
    return from_dict(document)


def test_metal_that_no_electrode_touches_is_an_insulator_to_current():
    """To the last digits: both scenes are the same problem of heat. Another conductivity is seen."""
    metal, insulator = (scene_run.solve(layered(r)).steady["top"].value for r in (2e-8, "insulator"))
    assert metal == pytest.approx(insulator, rel=1e-12)
    other = scene_run.solve(layered(2e-8, conductivity=30.0)).steady["top"].value
    assert abs(other - metal) > 1e-4 * (metal - 293)


@pytest.mark.long
@pytest.mark.parametrize("strip", [False, True])
def test_a_model_of_a_scene_with_metal_that_carries_no_current(strip):
    scene = layered(2e-8, strip=strip)
    model = CompactModel(compact(scene, None, 1e-2))
    full = scene_run.solve(scene).steady
    assert model.steady()["top"] - 293 == pytest.approx(full["top"].value - 293, rel=2e-2)
    if strip:
        assert model.steady()["potential"] == pytest.approx(0.3, rel=1e-9)
        assert model.steady({"strip.voltage": 0.2})["potential"] == pytest.approx(0.2, rel=1e-9)


def test_a_voltage_that_warms_nothing_leaves_all_at_rest_over_time():
    """A model is held against the step of each voltage alone, also of one that no other electrode answers."""
    scene = layered(2e-8, strip=True, run={"end_time": 1e-4})
    known = {c.name: c for c in channels(scene)}
    traces = scene_run.solve(scenarios(scene, tuple(known.values()))["step of strip.voltage"]).traces
    assert traces.values["top"] == pytest.approx(293, abs=1e-9)
    assert traces.values["potential"][1:] == pytest.approx(known["strip.voltage"].step, rel=1e-9)
