"""Sensitivities over time, against closed forms."""

from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs.sensitivities import of_scene
from scenes.free import from_dict
from scenes.loading import load_free
from tests.fem3d.test_sensitivities import bar, solved

HEATED: dict[str, Any] = {
    "scene": {"initial_temperature": 300.0},
    "run": {"end_time": 2e-3, "accuracy": 1e-2},
    "material": [{"name": "m", "thermal_conductivity": 1.0, "density": 1000.0, "specific_heat": 1000.0}],
    "box": [{"name": "bar", "material": "m", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 2e-5],
             "heat_source": 1e9}],
    "boundary": [{"name": "cold", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 0], "temperature": 300.0}],
    "probe": [{"name": "top", "lower": [0, 0, 2e-5], "upper": [1e-5, 1e-5, 2e-5]},
              {"name": "most", "lower": [0, 0, 0], "upper": [1e-5, 1e-5, 2e-5], "reduce": "max"}],
}  # fmt: skip


@pytest.mark.long
def test_over_time():
    """A heated bar: by the source all goes in proportion; material and source times one factor leave the rise as it is;
    the diffusion time goes with the square of the length."""
    scene = from_dict(deepcopy(HEATED))
    result = scene_run.solve(scene, None, True)
    found = of_scene(
        scene, result,
        ("box.bar.heat_source", "material.m.thermal_conductivity", "material.m.density", "box.bar.upper.z"),
    )  # fmt: skip
    course = {key: by_name["top"] for key, by_name in found.course.values.items()}
    own = np.interp(found.course.times, result.traces.time, result.traces.values["top"]) - 300.0
    size = own.max()
    # Traces are within 1e-2.
    source, conductivity, density, length = course.values()
    assert source == pytest.approx(own, abs=5e-3 * size)
    assert np.abs(source + conductivity + density).max() < 1e-4 * size
    assert np.abs(conductivity).max() > 0.5 * size
    # q L^2 / k times a function of k t / (c L^2): L acts like the square root of q and c, and the inverse one of 1 / k.
    assert length == pytest.approx(2 * source + 2 * density, abs=1e-4 * size)
    # The slopes are of the largest rise, at the top.
    for by_name in found.steady.values():
        assert by_name["most"].value == pytest.approx(by_name["top"].value, abs=by_name["most"].error)


def test_a_voltage_over_time():
    """At a constant resistivity rises go with the square of the voltage, the current in proportion."""
    found = solved(bar(run={"end_time": 1e-4, "accuracy": 1e-2}), "boundary.voltage near.voltage")
    by_name = found.steady["boundary.voltage near.voltage"]
    for name, exponent in (("peak", 2), ("mean", 2), ("current", 1)):
        assert by_name[name].value == pytest.approx(exponent, abs=1e-4)
        assert abs(by_name[name].value - exponent) <= by_name[name].error < 2e-2


def test_a_current_alone_over_time():
    """No temperature acts on it: there is no dual problem."""
    scene = bar(run={"end_time": 1e-4, "accuracy": 1e-2})
    scene = replace(scene, probes=tuple(p for p in scene.probes if p.quantity == "current"))
    slope = solved(scene, "material.m.resistivity").steady["material.m.resistivity"]["current"]
    assert abs(slope.value + 1) <= slope.error < 2e-2


def test_density_and_specific_heat_act_alike():
    """On a hot plate, whose fields of many loads and dual problems nearly depend on each other."""
    keys = "material.platinum.density", "material.platinum.specific_heat"
    density, heat = solved(load_free("hotplate", ["run.accuracy=2e-2"]), *keys).steady.values()
    for name, slope in density.items():
        assert slope.value == pytest.approx(heat[name].value, abs=slope.error)
        assert 0 < abs(slope.value) < 0.1


def test_inputs_that_jump():
    """The scene is linear in its source and in all temperatures together."""
    given = deepcopy(HEATED)
    given["probe"] = given["probe"][:1]
    jumping: dict[str, Any] = {"times": [0.0, 1e-3, 1e-3, 2e-3]}
    given["box"][0]["heat_source"] = jumping | {"values": [1e9, 1e9, 3e9, 3e9]}
    given["boundary"][0]["temperature"] = jumping | {"values": [300.0, 300.0, 330.0, 330.0]}
    scene = from_dict(given)
    result = scene_run.solve(scene, None, True)
    found = of_scene(scene, result, ("box.bar.heat_source", "boundary.cold.temperature", "scene.initial_temperature"))
    traces, together = result.over_time, sum(by_name["top"] for by_name in found.course.values.values())
    rows = np.interp(found.course.times, traces.time, traces.values["top"]) - 300.0
    late = np.abs(found.course.times - 1e-3) > 2e-5
    assert together[late] == pytest.approx(rows[late], abs=5e-3 * found.values["top"].value)
    assert np.abs(found.course.values["boundary.cold.temperature"]["top"]).max() > 100
