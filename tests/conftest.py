"""A 3D result that is made of the 1D models, so that the comparison can be tested without a 3D solver."""

import json
import os
import shlex
import shutil
import signal
import sys

from compare.processes import one_thread

# ruff: noqa: E402
one_thread()

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from compare.options import Options
from compare.verdict import Check
from reduced1d import ladder as reduction
from scenes.result import Estimate, Result, Step, Traces
from scenes.sink import Sink
from tests.fin import solve_fin

RESISTANCE = 2663.0


@dataclass(frozen=True)
class Case:
    """A sink with the two results that are compared."""

    sink: Sink
    fem3d: Result
    reduced1d: Result

    def change(self, **steady: float) -> "Case":
        """With other values of steady 3D quantities, their errors kept."""
        changed = {k: Estimate(v, self.fem3d.steady[k].error) for k, v in steady.items()}
        return replace(self, fem3d=replace(self.fem3d, steady={**self.fem3d.steady, **changed}))

    def errors(self, relative: float) -> "Case":
        """With all steady 3D errors at a part of their values."""
        steady = {k: Estimate(e.value, relative * abs(e.value)) for k, e in self.fem3d.steady.items()}
        return replace(self, fem3d=replace(self.fem3d, steady=steady))


def judged(
    sink: Sink, fem3d: Result, reduced1d: Result | None = None, options: Options | None = None,
    single: Result | None = None,
) -> dict[str, Check]:  # fmt: skip
    """The checks of a sink's results by their ids."""
    from compare.kinds import KINDS
    from compare.outcome import Outcome

    results = {"fem3d": fem3d, "reduced1d": reduced1d, "single": single}
    given = {name: result for name, result in results.items() if result is not None}
    return {check.id: check for check in KINDS["sink"].checks(Outcome(sink, options or Options(), given))}


def stand_in(
    sink: Sink, transient: bool = True, progress: object = None, earlier: object = None, resistance: float = RESISTANCE
) -> Result:
    """A result like the 3D model's: the exact fin on a given anchor resistance, its traces the 1D model's in shape."""
    fin = solve_fin(sink, resistance)
    values = {
        "peak_rise_K": fin.peak_rise, "end_rise_K": fin.end_rise, "mean_rise_K": fin.mean_rise,
        "current_A": fin.current, "power_W": fin.power, "heat_out_W": fin.power,
        "anchor_resistance_K_per_W": resistance, "end_flow_W": fin.end_rise / resistance,
    }  # fmt: skip
    y = np.linspace(0.0, sink.length, 401)
    fields = StandInFields(sink)
    return Result(
        "fem3d",
        {key: Estimate(value, 1e-4 * abs(value)) for key, value in values.items()},
        _traces(sink, values) if transient else None,
        {
            "unknowns": 8, "steps": 5, "energy_imbalance": 1e-11, "transient_imbalance": 1e-5, "mesh": {"cells": 1},
            "symmetry": "the whole", "plan": plan_of_stand_in(sink, transient), "warnings": [],
            "profile": {"y_m": y, "rise_K": fin.rise(y)}, "fields": fields,
        },
    )  # fmt: skip


class StandInFields:
    """One cell the size of the beam, as ``fem3d.results.fields.Fields``; the steady rise is 7 K, and less over time."""

    cells = np.arange(27)[None]
    material = np.array([0])
    material_names = ("silicon",)
    cell_type = "hexahedron27"
    has_steady = True
    steady = np.linspace(293.0, 300.0, 27)

    def __init__(self, sink: Sink) -> None:
        from skfem import ElementHex2

        from fem3d.results.fields import _hexahedron

        places = np.asarray(ElementHex2().doflocs)
        places = places[_hexahedron(places)]
        self._sink, self.points = sink, places * [sink.width, sink.length, sink.thickness]

    def at(self, times: np.ndarray) -> np.ndarray:
        return np.full((len(times), 27), 293.0)

    def snapshot(self, time: float | None) -> SimpleNamespace:
        y = self.points[:, 1] / self._sink.length
        rise = 7.0 if time is None else 6.0 / (1.0 + time / 1e-3)
        return SimpleNamespace(
            temperature=self._sink.room_temperature + rise * y, potential=1 - y, distance=1e-3,
            current_density=np.array([[0.0, 1e7, 0.0]]), heat_source=np.array([1e10]),
        )  # fmt: skip


def _traces(sink: Sink, steady: dict[str, float]) -> Traces:
    time = np.concatenate([[0.0], np.geomspace(1e-6, sink.end_time, 200)])
    traces = reduction.solve(sink, times=time).traces
    grown = (traces.values["mean_K"] - sink.room_temperature) / reduction.solve(sink).steady["mean_rise_K"].value
    room, cold = sink.room_temperature, float(traces.values["current_A"][0])
    values = {
        "peak_K": room + steady["peak_rise_K"] * grown,
        "end_K": room + steady["end_rise_K"] * grown,
        "mean_K": room + steady["mean_rise_K"] * grown,
        "current_A": cold + (steady["current_A"] - cold) * grown,
    }
    values["power_W"] = sink.voltage * values["current_A"]
    return Traces(time, values, {"peak_K": 2e-3, "end_K": 4e-4, "mean_K": 2e-3, "current_A": 3e-8, "power_W": 3e-8})


def plan_of_stand_in(sink: Sink, transient: bool) -> tuple[Step, ...]:
    """One line of the page."""
    return (Step("stand-in", "done", "a fin in place of the 3D model"),)


@pytest.fixture(scope="session", autouse=True)
def _plugins():
    """The functions that an installation registers as entry points, also in a checkout that is not installed anew."""
    from compare.pipeline import PLUGINS
    from validate.report.output import run
    from validate.report.page import excerpt
    from validate.report.text import report
    from validate.sweep.run import sweep

    PLUGINS.update(write=run, sweep=sweep, report=report, excerpt=excerpt)


def pytest_configure() -> None:
    """Ctrl-C reaches the commands that tests start, also where a shell runs the suite in the background, with it
    ignored. Python writes bytecode: else every process of the suite, and every command that a test starts, compiles
    all modules again."""
    if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.dont_write_bytecode = False
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Skip a test whose marker ``needs`` names a program that is not on the path."""
    needed = [program for mark in item.iter_markers("needs") for program in mark.args]
    missing = [program for program in needed if not shutil.which(program)]
    if missing:
        pytest.skip(f"{', '.join(missing)} not installed")


@pytest.fixture(scope="session")
def case():
    """The built-in sink, undeclared."""
    sink = Sink()
    fem3d = stand_in(sink)
    return Case(sink, fem3d, reduction.solve(sink, times=fem3d.traces.time))


@pytest.fixture
def ran(tmp_path, capsys):
    """Run a command without figures, into "run"; return its summary and its text, of 80 columns at most."""
    from validate.cli import main

    def run(command: str, *more: str, status: int = 0) -> tuple[dict[str, Any], str]:
        folder = tmp_path / "run"
        assert main([*shlex.split(command), *more, "--no-figures", "--out", str(folder)]) == status
        said = capsys.readouterr().out
        assert all(len(line) <= 80 or line.startswith("Results in") for line in said.splitlines())
        return json.loads((folder / "summary.json").read_text(encoding="utf-8")), said

    return run


_RUNGS: dict[object, Result] = {}


@pytest.fixture
def no_solver(monkeypatch):
    """The stand-in in place of the 3D solver; the models of the ladder, most of a run's time then, are solved once."""
    import fem3d.runs.sink
    from reduced1d.ladder import levels

    def once(of: levels.Levels, rung: levels.Rung, steady_only: bool, times: np.ndarray | None) -> Result:
        key = of.sink, of.rough, rung, steady_only, None if times is None else times.tobytes()
        if key not in _RUNGS:
            _RUNGS[key] = solve(of, rung, steady_only, times)
        return _RUNGS[key]

    solve = levels.solve
    monkeypatch.setattr(levels, "solve", once)
    monkeypatch.setattr(fem3d.runs.sink, "solve", stand_in)
    monkeypatch.setattr(fem3d.runs.sink, "plan", plan_of_stand_in)
