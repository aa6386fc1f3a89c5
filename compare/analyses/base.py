"""The interface of an analysis: a computation beside the models and their checks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Generic, TypeVar

from compare.options import Options
from compare.outcome import AnyOutcome, Progress, Solvable
from compare.report.table import Section, Style
from scenes.result import Step, step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

T = TypeVar("T")
"""The type of an analysis's result."""


class Analysis(ABC, Generic[T]):
    """An optional study of a run, such as the sensitivities.

    The pipeline calls ``prepare`` of each analysis that an option requests before the models are solved, and
    afterwards ``run`` of those without a ``skip_reason``, in the order of `compare.analyses.ANALYSES`.
    ``prepare`` may set ``outcome.scene``, as calibration does. Reports take ``section``, ``document`` and ``figure``.

    Attributes
    ----------
    name : its key in `Outcome.analyses`; by default also its option (with underscores) and its key in summary.json
    about : its line in the plan, unless ``plan`` is overridden
    figure_name : the file name of its figure without suffix, empty without a figure
    """

    name: ClassVar[str]
    about: ClassVar[str] = ""
    figure_name: ClassVar[str] = ""

    def asked(self, options: Options) -> bool:
        """Whether the options request the analysis."""
        return bool(getattr(options, self.name))

    def skip_reason(self, scene: Solvable, options: Options) -> str:
        """Return why a requested analysis is not run; empty where it is. Asked by the plan before a run, and within a
        run after the models are solved."""
        return ""

    def plan(self, scene: Solvable, options: Options) -> Step:
        """Return the line of the analysis in the plan."""
        return step(self.name, self.about, self.skip_reason(scene, options))

    def prepare(self, outcome: AnyOutcome, progress: Progress) -> None:
        """Act before the models are solved; may solve its own, as calibration does.

        Raises SceneError for a scene that it cannot handle, and ArithmeticError where its own numerics fail.
        """

    @abstractmethod
    def run(self, outcome: AnyOutcome, progress: Progress) -> T | None:
        """Compute the result; may add checks and warnings to the outcome. None: there is no result. An exception ends
        the run."""

    @abstractmethod
    def section(self, found: T, outcome: AnyOutcome, style: Style) -> Section:
        """Return the section of the report."""

    @abstractmethod
    def document(self, found: T, outcome: AnyOutcome) -> dict[str, object]:
        """Return the entry of summary.json."""

    def enter(self, summary: dict[str, object], found: T, outcome: AnyOutcome) -> None:
        """Put the entry into summary.json: by default under ``name``."""
        summary[self.name] = self.document(found, outcome)

    def figure(self, found: T, outcome: AnyOutcome) -> Figure | None:
        """Draw a figure with matplotlib, or None."""
        return None
