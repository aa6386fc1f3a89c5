"""The compact model of a scene: a few states that stand for the 3D problem, with its error."""

from typing import Any

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table


class CompactExport(Analysis[dict[str, Any]]):
    name, about = "export", "a compact model, compared with the full one for a step of every input"

    def prepare(self, outcome: Outcome[Any], progress: Progress) -> None:
        from fem3d.runs.compact import refuse

        if (scene := kind_of(outcome.scene).exported(outcome.scene, outcome.options)) is not None:
            refuse(scene)

    def run(self, outcome: Outcome[Any], progress: Progress) -> dict[str, Any]:
        document: dict[str, Any] = kind_of(outcome.scene).compact(outcome, progress)
        outcome.warn(*document["warnings"])
        return document

    def section(self, found: dict[str, Any], outcome: Outcome[Any], style: Style) -> Section:
        from statespace.document import names, validity
        from statespace.export import MISSING, fmu_available

        rows = [tuple(entry.values()) for entry in names(found)]
        words = "a compact model and its controllers" if "controllers" in found else "a compact model"
        without = "" if fmu_available() else f"; {MISSING}"
        said = f"Exported {words} ({validity(found)}{without}) to {outcome.options.export.folder}/"
        return Section("Compact model", [said, Table(("name", "SPICE node", "FMU variable"), rows)], headed=False)

    def enter(self, summary: dict[str, Any], found: dict[str, Any], outcome: Outcome[Any]) -> None:
        """The model has a document of its own, in its folder."""
