"""The interface of an analysis: a computation beside the models and their checks."""

from abc import ABC, abstractmethod
from typing import ClassVar, Generic, TypeVar

from compare.options import Options
from compare.outcome import AnyOutcome, Progress, Solvable
from compare.report import Section, Style
from scenes.result import Step, step

T = TypeVar("T")
"""The type of an analysis's result."""


class Analysis(ABC, Generic[T]):
    """An optional study of a run, such as the sensitivities.

    The pipeline calls ``prepare`` of each analysis that an option requests before the models are solved, and ``run``
    afterwards, in the order of `compare.analyses.ANALYSES`. ``prepare`` may set ``outcome.scene``, as calibration
    does. Reports take ``section`` and ``enter``.

    Attributes
    ----------
    name : its key in `Outcome.analyses`; by default also its option (with underscores)
    about : its line in the plan, unless ``plan`` is overridden
    """

    name: ClassVar[str]
    about: ClassVar[str] = ""

    def asked(self, options: Options) -> bool:
        """Whether the options request the analysis."""
        return bool(getattr(options, self.name))

    def plan(self, scene: Solvable, options: Options) -> Step:
        """Return the line of the analysis in the plan."""
        return step(self.name, self.about)

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

    def enter(self, summary: dict[str, object], found: T, outcome: AnyOutcome) -> None:
        """Put the result into summary.json, by default as it is, under the name of the analysis."""
        summary[self.name] = found
