"""What a run of a free scene found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from compare.solve.scope import SolveRequest
from scenes.model import AnyScene
from scenes.plan import Step

if TYPE_CHECKING:
    from scenes.result import Result


@dataclass(frozen=True)
class SolveOutcome:
    """The plan as carried out, the result, how long each stage took (s), the folder with its files, and remarks on the
    run; ``shown`` is the time (s) whose field is drawn, and whether it is then above the initial temperature."""

    scene: AnyScene
    request: SolveRequest
    plan: tuple[Step, ...]
    result: Result
    timing: dict[str, float] = field(default_factory=dict)
    folder: Path = Path()
    replaced: str = ""
    files: tuple[str, ...] = ()
    shown: tuple[float, bool] | None = None
    warnings: tuple[str, ...] = ()
