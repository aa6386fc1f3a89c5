"""A model that is an FMU, run by fmpy in a process of its own, so that a fault in it is a sentence here.

The scene's values are put in as start values of its parameters and inputs. In the steady state it is run until its
outputs rest; over time twice, with steps of different length, whose difference tells the error.

That process reads what to do from standard input, as JSON, and writes the outputs.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import BadZipFile, ZipFile

import numpy as np

from scenes.errors import SceneError, did_you_mean, listed, printable, quoted
from scenes.formats import quantity
from validate.models import LONGEST, Answer, Asked, command_of, readable, too_long
from validate.processes import with_parent

STEPS = (500, 2000)
"""Numbers of steps of the two runs over time; an FMU integrated here has a relative tolerance of 0.01 over that."""
REST, HORIZONS = 1e-7, tuple(10.0**n for n in range(-4, 7))
"""An FMU is at rest where its outputs change by less than this part from one horizon (s) to the next."""

LARGEST = 2e9
"""Bytes that an FMU may unpack to; those with the data of whole buildings have some hundred million."""


@dataclass
class Fmu:
    """An FMU by its path, and the names of its variables that can be set and read."""

    name: str
    path: Path
    settable: tuple[str, ...]
    readable: tuple[str, ...]
    _known: dict[object, list[dict[str, np.ndarray]]] = field(default_factory=dict)

    def rows(self, question: Asked) -> np.ndarray:
        return np.empty(0)

    def steady(self, question: Asked) -> Answer:
        runs = self._runs_of(question, question.steady, [[horizon, STEPS[0]] for horizon in HORIZONS], rest=True)
        before, now = ({name: float(values[-1]) for name, values in run.items() if name != "time"} for run in runs[-2:])
        if np.isfinite([*now.values()]).all() and not _rests(before, now):
            raise SceneError(
                f"--model {self.name} does not come to rest within {HORIZONS[-1]:g} s: it has no steady state"
            )
        return now, {name: abs(now[name] - before[name]) for name in now}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        runs = self._runs_of(question, question.over_time, [[float(times[-1]), steps] for steps in STEPS])
        # What an output does at an instant it does over a step here: the two runs differ most at the end of the short
        # one, by all but its part of the long one, and at once after the instant the short one is off by all of it.
        everywhere, whole = np.union1d(times, runs[1]["time"]), STEPS[1] / (STEPS[1] - STEPS[0])
        coarse, fine = ({n: partial(np.interp, xp=r["time"], fp=v) for n, v in r.items() if n != "time"} for r in runs)
        errors = {n: whole * float(np.abs(fine[n](everywhere) - coarse[n](everywhere)).max()) for n in fine}
        return {n: fine[n](times) for n in fine}, errors

    def _runs_of(
        self, question: Asked, wanted: Mapping[str, str], runs: list[list[float]], rest: bool = False
    ) -> list[dict[str, np.ndarray]]:  # fmt: skip
        """The columns of some runs, each to an end (s) in some steps; with ``rest`` until the outputs rest."""
        for name in question.parameters:
            if name not in self.settable:
                raise SceneError(
                    f"--model {self.name} has no parameter or input {quoted(name)}: it has "
                    f"{listed(self.settable) or 'none'}{did_you_mean(name, self.settable)}"
                )
        key = (str(runs), rest, *question.parameters.items())
        if key not in self._known:
            outputs = {name: variable for name in wanted if (variable := self._variable(name, question)) is not None}
            if not outputs:
                raise SceneError(
                    f"--model {self.name} has no variable called as a probe ({', '.join(wanted)}; signs and blanks as "
                    f'_): it has {listed(self.readable) or "none"}; say which is which, [model.outputs] probe = "name"'
                )
            task = {"file": str(self.path), "start": dict(question.parameters), "outputs": list(outputs.values()),
                    "runs": runs, "rest": rest}  # fmt: skip
            named = {"time": "time", **outputs}
            self._known[key] = [
                {name: np.array(columns[variable]) for name, variable in named.items()}
                for columns in self._simulated(task)
            ]
        return self._known[key]

    def _variable(self, name: str, question: Asked) -> str | None:
        if name in question.outputs:
            if question.outputs[name] not in self.readable:
                variable = question.outputs[name]
                raise SceneError(
                    f"--model {self.name} has no variable {quoted(variable)} for {quoted(name)}: it has "
                    f"{listed(self.readable)}{did_you_mean(variable, self.readable)}"
                )
            return question.outputs[name]
        plain = {re.sub(r"\W+", "_", variable).lower(): variable for variable in self.readable}
        return plain.get(re.sub(r"\W+", "_", name).lower())

    def _simulated(self, task: Mapping[str, Any]) -> list[dict[str, list[float]]]:
        """The columns that the process of the FMU writes; it ends when this one does, for it waits for its input."""
        command = command_of("validate.models.fmu:simulate")
        with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as child:
            try:
                out, said = child.communicate(json.dumps(task).encode(), LONGEST)
            except subprocess.TimeoutExpired:
                child.kill()
                raise SceneError(too_long(self.name)) from None
            except BaseException:
                child.kill()
                raise
        try:
            columns: list[dict[str, list[float]]] = json.loads(out.decode().rpartition("\n")[2])
        except ValueError:
            lines = said.decode("utf-8", "replace").strip().splitlines() or [f"it ended with status {child.returncode}"]
            raise SceneError(f"--model {self.name} failed: {printable(lines[-1], 200)}") from None
        for run, (end, steps) in zip(columns, task["runs"], strict=False):  # of those to a rest the last are not made
            if run["time"][-1] < end - end / steps / 2:
                until, asked = (quantity(time, "s") for time in (run["time"][-1], end))
                raise SceneError(f"--model {self.name} stops at {until} of {asked}: a step of it says that it failed")
        return columns


def opened(given: str, folder: str) -> Fmu:
    """The FMU of a file, its description read. Raises SceneError."""
    path = readable(given, folder, "an FMU, such as bridge.fmu")
    if find_spec("fmpy") is None:
        raise SceneError(f"--model {quoted(given)} is run by fmpy: pip install 'heated-microstructure-validation[fmu]'")
    from fmpy import read_model_description

    _refuse_bomb(given, path)
    try:
        variables = read_model_description(str(path), validate=False).modelVariables
    except Exception as error:
        raise SceneError(f"--model {quoted(given)} is no FMU that can be read ({printable(str(error), 120)})") from None
    settable = tuple(v.name for v in variables if v.causality in ("parameter", "input"))
    return Fmu(path.name, path.resolve(), settable, tuple(v.name for v in variables if v.causality != "parameter"))


def _refuse_bomb(given: str, path: Path) -> None:
    """SceneError for an archive that would fill a disk."""
    with suppress(OSError, BadZipFile), ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > LARGEST:
            raise SceneError(
                f"--model {quoted(given)} unpacks to {size / 1e9:.3g} GB: give one of {LARGEST / 1e9:g} at most"
            )


def _rests(before: Mapping[str, float], now: Mapping[str, float]) -> bool:
    return bool(before) and all(abs(now[name] - before[name]) <= REST * abs(now[name]) for name in now)


def simulate() -> None:
    """What that process does."""
    with_parent()
    task = json.loads(sys.stdin.read())
    from fmpy import extract, simulate_fmu

    runs: list[dict[str, list[float]]] = []
    with TemporaryDirectory() as folder:
        extract(task["file"], folder)
        for end, steps in task["runs"]:
            columns = simulate_fmu(
                folder, stop_time=end, output_interval=end / steps, step_size=end / steps, output=task["outputs"],
                start_values=task["start"], relative_tolerance=1e-2 / steps, record_events=False,
            )  # fmt: skip
            runs.append({name: [float(value) for value in columns[name]] for name in ("time", *task["outputs"])})
            ends = [{name: runs[n][name][-1] for name in task["outputs"]} for n in range(-min(len(runs), 2), 0)]
            if task["rest"] and len(ends) == 2 and _rests(*ends):
                break
    print("\n" + json.dumps(runs), end="", flush=True)
