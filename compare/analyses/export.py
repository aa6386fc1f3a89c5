"""The compact model of a scene: a few states that stand for the 3D problem, with its error."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report.table import Section, Style, Table
from scenes.result import Step, step


@dataclass(frozen=True)
class Exported:
    """A compact model: its description, its document, and the folder of its files."""

    words: str
    document: dict[str, Any]
    folder: Path


class CompactExport(Analysis[Exported]):
    name = "export"

    def plan(self, scene: Any, options: Options) -> Step:
        export = options.export
        count = f"of {export.states} states" if export.states else f"of as few states as {export.accuracy:g} takes"
        return step("export", f"a compact model {count}, compared with the full one for a step of every input")

    def prepare(self, outcome: Outcome[Any], progress: Progress) -> None:
        kind_of(outcome.scene).exportable(outcome.scene, outcome.options)

    def run(self, outcome: Outcome[Any], progress: Progress) -> Exported:
        from statespace.document import validity
        from statespace.export import MISSING, fmu_available

        with progress.stage("export"):
            document: dict[str, Any] = kind_of(outcome.scene).compact(outcome, progress)
        outcome.warn(*document["warnings"])
        without = "" if fmu_available() else f"; {MISSING}"
        name = "a compact model and its controllers" if "controllers" in document else "a compact model"
        return Exported(f"{name} ({validity(document)}{without})", document, outcome.options.export.folder)

    def section(self, found: Exported, outcome: Outcome[Any], style: Style) -> Section:
        from statespace.document import names

        rows = [tuple(entry.values()) for entry in names(found.document)]
        said = f"Exported {found.words} to {found.folder}/"
        return Section("Compact model", [said, Table(("name", "SPICE node", "FMU variable"), rows)], headed=False)

    def document(self, found: Exported, outcome: Outcome[Any]) -> dict[str, Any]:
        return {}

    def enter(self, summary: dict[str, Any], found: Exported, outcome: Outcome[Any]) -> None:
        """The model has a document of its own, in its folder."""
