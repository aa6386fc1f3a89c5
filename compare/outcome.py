"""What a run of the sink found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from compare.against.data import Data
    from compare.verdict import Check
    from compare.why import Budget
    from scenes.plan import Request, Step
    from scenes.result import Result
    from scenes.sink import Sink


@dataclass(frozen=True)
class Outcome:
    """What a run found: the plan as carried out, each model's result (``None`` where not asked for), the checks, the
    answer that they make in a sentence, the remarks on the run, how long each stage took (s), the folder with its
    files, and which earlier run it replaced. ``why`` is the budget of the differences of the 1D model and ``exported``
    the few-state model's folder, where asked for; ``against`` a user's own traces if there are any."""

    sink: Sink
    request: Request
    plan: tuple[Step, ...]
    fem3d: Result | None
    reduced1d: Result | None
    checks: tuple[Check, ...]
    warnings: tuple[str, ...] = ()
    answer: str = ""
    timing: dict[str, float] = field(default_factory=dict)
    folder: Path = Path()
    replaced: str = ""
    files: tuple[str, ...] = ()
    why: Budget | None = None
    exported: Path | None = None
    against: Data | None = None
