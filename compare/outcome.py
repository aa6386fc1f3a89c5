"""A run as it is solved: the scene, the options, the results of the models, the checks, and the analyses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from compare.options import Options
from compare.verdict import Check
from scenes.device import Device
from scenes.model import AnyScene
from scenes.result import Result, Step
from scenes.sink import Sink

if TYPE_CHECKING:
    from compare.models import Model
    from compare.slopes import Slopes
    from fem3d.runs.device import Solved
    from statespace.result import Runs

Solvable = Sink | Device | AnyScene
S = TypeVar("S", bound=Solvable)
"""The type of scene: a Sink, a Device, or a free scene."""
S_co = TypeVar("S_co", bound=Solvable, covariant=True)


@dataclass
class Outcome(Generic[S_co]):
    """A run, filled in as it is solved.

    Attributes
    ----------
    results : by model, "fem3d" and "reduced1d"; of a row of spans also "single", 3D of one span
    slopes : by model how its quantities follow the keys, where an analysis computed that
    analyses : by name of the analysis its result
    plan : the steps as carried out
    alarms : remarks that stand first: results that no real part can have, a model that failed
    answer : the difference between the models in a sentence
    timing : seconds by stage, and "total"
    failure : why the user's model has no answer (KeyboardInterrupt: it was interrupted); 3D is kept
    folder, files, replaced : the results folder, the names of its files, the command of the run that it replaced
    """

    scene: S_co
    options: Options = field(default_factory=Options)
    results: dict[str, Result] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    slopes: dict[str, Slopes] = field(default_factory=dict)
    analyses: dict[str, Any] = field(default_factory=dict)
    plan: tuple[Step, ...] = ()
    alarms: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    answer: str = ""
    timing: dict[str, float] = field(default_factory=dict)
    failure: BaseException | None = None
    folder: Path = Path()
    files: tuple[str, ...] = ()
    replaced: str = ""

    @property
    def fem3d(self) -> Result | None:
        return self.results.get("fem3d")

    @property
    def reduced1d(self) -> Result | None:
        return self.results.get("reduced1d")

    @property
    def solved(self) -> Result:
        """The 3D result; ValueError where there is none."""
        if self.fem3d is None:
            raise ValueError("this run has no 3D model")
        return self.fem3d

    @property
    def reduced(self) -> Result:
        """The 1D result, where there is one."""
        return self.results["reduced1d"]

    @property
    def runs_away(self) -> str:
        """When the heating of a transient runs away, shortly before which the run ends; empty where it does not."""
        return "" if self.fem3d is None else str(self.fem3d.details.get("runs_away", ""))

    @property
    def own_model(self) -> Model | None:
        """The user's own model, if the 1D result is its answer."""
        return None if self.reduced1d is None else self.reduced1d.details.get("own_model")

    @property
    def runs(self) -> Runs:
        """The 1D runs of a device."""
        runs: Runs = self.reduced.details["runs"]
        return runs

    @property
    def device_3d(self) -> Solved:
        """The runs of a device in 3D; ValueError where there are none."""
        runs: Solved = self.solved.details["solved"]
        return runs

    def warn(self, *texts: str) -> None:
        self.warnings = (*self.warnings, *filter(None, texts))


AnyOutcome = Outcome[Solvable]


class Progress:
    """Shows each stage of a run to the user, and measures its time (s)."""

    def __init__(self, say: Callable[[str], None] | None = None) -> None:
        self._say = say or (lambda _: None)
        self._start = time.perf_counter()
        self._stages: dict[str, float] = {}
        self.processor_time: dict[str, float] = {}

    def __call__(self, text: str) -> None:
        self._say(text)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start, processor = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            self._stages[name] = self._stages.get(name, 0.0) + time.perf_counter() - start
            self.processor_time[name] = self.processor_time.get(name, 0.0) + time.process_time() - processor

    def timing(self) -> dict[str, float]:
        return {**self._stages, "total": time.perf_counter() - self._start}
