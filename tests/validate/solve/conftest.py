"""A made-up 3D result of a free scene, so that reports can be tested without a solver."""

import sys
from types import ModuleType

import numpy as np
import pytest

from scenes.model import Scene
from scenes.result import Estimate, Result, Step, Traces
from scenes.sink import Sink
from tests.conftest import StandInFields

STEP = Step("stand-in", "done", "numbers made up in place of the 3D solver")


def solve(scene: Scene, progress: object = None, whole: bool = False) -> Result:
    """Probe number i is i + 1, with an error of a thousandth; over time it jumps there from the half at 1/4 of the
    end time, and is nine times as large before its errors hold."""
    values = {probe.name: float(i + 1) for i, probe in enumerate(scene.probes)}
    errors = {name: 1e-3 * value for name, value in values.items()}
    fields = StandInFields(Sink())
    fields.points, fields.has_steady = 1e-4 * fields.points, scene.steady
    traces = None
    if not scene.steady:
        times = scene.end_time * np.array([0.0, 0.25, 0.25, 1.0])
        times = np.insert(times, 1, 2e-3 * scene.end_time)
        shape = np.array([-9.0, 0.5, 0.5, 1.0, 1.0])
        traces = Traces(times, {name: shape * value for name, value in values.items()}, errors, 1e-3 * scene.end_time)
    return Result(
        "fem3d",
        {name: Estimate(value, errors[name]) for name, value in values.items()} if scene.steady else {},
        traces,
        {
            "unknowns": 8, "steps": 5, "levels": 1, "energy_imbalance": 1e-11, "transient_imbalance": 1e-5,
            "mesh": {"cells": 1},
            "symmetry": "the whole", "plan": plan(scene), "warnings": ["it is made up"],
            "fields": fields,
        },
    )  # fmt: skip


def plan(scene: Scene) -> tuple[Step, ...]:
    """One line of the page."""
    return (STEP,)


@pytest.fixture
def no_solver(monkeypatch):
    """The stand-in in place of the 3D solver."""
    module = ModuleType("fem3d.runs.scene")
    module.__dict__.update(solve=solve, plan=plan)
    monkeypatch.setitem(sys.modules, "fem3d.runs.scene", module)
    monkeypatch.setattr("fem3d.runs.scene", module, raising=False)
