"""What a run found, whichever kind of scene it is of, and how long its stages took."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from scenes.errors import NumericsError, SceneError
from scenes.plan import Request, Step

if TYPE_CHECKING:
    from compare.against import Data
    from compare.blame import Budget
    from compare.checks import Varied
    from compare.models import Model
    from compare.verdict import Check
    from fem3d.device.runs import Solved
    from reduced1d.device.design import Design
    from scenes.result import Result
    from statespace.result import Runs
    from validate.inputs.calibration import Fit
    from validate.inputs.left_out import LeftOut
    from validate.inputs.propagation import Propagated, Sampled
    from validate.inputs.sensitivities import Sensitivities
    from validate.inputs.validation import Validation

S = TypeVar("S", covariant=True)
"""The kind of scene: a Sink, a Device, or a free scene."""


@dataclass(frozen=True)
class Exported:
    """A compact model: what is said of it, its document, and the folder that its files go to."""

    words: str
    document: Mapping[str, Any]
    folder: Path


@dataclass(frozen=True)
class Outcome(Generic[S]):
    """What a run found: the plan as carried out, each model's result (``None`` where not asked for), the checks, the
    remarks on the run, the answer in a sentence, how long each stage took (s), the folder with its files, which earlier
    run it replaced; and what was asked for beside: of a sink ``why`` (the budget of the 1D model's differences),
    ``varied`` (how those of a row run), the 3D result of one span alone (``single``),
    what both models leave out (``left_out``) and a
    user's own traces (``against``); of any the few-state model (``exported``), and what inputs do; of a
    device its runs and a designer's answers. ``own_model`` is the user's; ``interrupted`` says that the user's own
    model was, and what stands here is without it, and ``failed`` is why that has no answer. Of a free scene over time
    ``shown``: the time (s) whose field is drawn, and whether it is then above the initial temperature; ``runs_away``
    says when its heating does, and that it is solved until shortly before, ``scene`` ending then.
    """

    scene: S
    request: Request
    plan: tuple[Step, ...]
    fem3d: Result | None = None
    reduced1d: Result | None = None
    checks: tuple[Check, ...] = ()
    warnings: tuple[str, ...] = ()
    answer: str = ""
    timing: dict[str, float] = field(default_factory=dict)
    folder: Path = Path()
    replaced: str = ""
    files: tuple[str, ...] = ()
    why: Budget | None = None
    exported: Exported | None = None
    varied: tuple[Varied, ...] = ()
    left_out: LeftOut | None = None
    against: Data | None = None
    sensitivities: Sensitivities | None = None
    propagated: Propagated | None = None
    sampled: Sampled | None = None
    validation: Validation | None = None
    fit: Fit | None = None
    single: Result | None = None
    simulated: Runs | None = None
    device_3d: Solved | None = None
    design: Design | None = None
    shown: tuple[float, bool] | None = None
    runs_away: str = ""
    interrupted: bool = False
    failed: SceneError | NumericsError | None = None
    own_model: Model | None = None

    @property
    def solved(self) -> Result:
        """The 3D result; ValueError where there is none."""
        if self.fem3d is None:
            raise ValueError("this run has no 3D model")
        return self.fem3d

    def without_model(self, name: str, failed: SceneError | NumericsError | None = None) -> Outcome[S]:
        """What there is where a model of the user's has ``failed`` as it was asked, or else was interrupted."""
        if isinstance(failed, NumericsError):
            failed = NumericsError(f"{name} has no answer: {failed}")
        why = f"{name} was interrupted" if failed is None else str(failed)
        said = f"{why}; what 3D found is kept, and nothing is compared with it"
        return replace(self, warnings=(*self.warnings, said), interrupted=failed is None, failed=failed)

    @property
    def runs(self) -> Runs:
        """The runs of the device; ValueError where the scene is none."""
        if self.simulated is None:
            raise ValueError("this run is not one of a device")
        return self.simulated


class Clock:
    """Seconds by stage, and since it was made as "total"."""

    def __init__(self) -> None:
        self._start = time.perf_counter()
        self._stages: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self._stages[name] = self._stages.get(name, 0.0) + time.perf_counter() - start

    def all(self) -> dict[str, float]:
        return {**self._stages, "total": time.perf_counter() - self._start}


@dataclass(frozen=True)
class Run:
    """What is solved, what is asked of it, who is told of the progress, and the clock of its stages."""

    scene: Any
    request: Request
    say: Callable[[str], None] = lambda _: None
    clock: Clock = field(default_factory=Clock)
