"""What a run of a free scene found."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from compare.solve.scope import SolveRequest
from scenes.free.asks import AnyScene
from scenes.plan import Step

if TYPE_CHECKING:
    from scenes.result import Result


@dataclass(frozen=True)
class SolveOutcome:
    """The plan as carried out, the result, how long each stage took (s), and the folder with its files."""

    scene: AnyScene
    request: SolveRequest
    plan: tuple[Step, ...]
    result: Result
    timing: dict[str, float] = field(default_factory=dict)
    folder: Path = Path()
    replaced: str = ""
    files: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """The solver's remarks on the run."""
        return tuple(self.result.details.get("warnings", ()))
