"""The user's own data against 3D: the largest distance of each quantity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from compare.analyses.base import Analysis
from compare.analyses.uncertainty import by_differences
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report.table import Section, Style
from scenes.result import Step, step

if TYPE_CHECKING:
    from compare.against import Data


class Against(Analysis["Data"]):
    name = "against"

    def plan(self, scene: Any, options: Options) -> Step:
        data: Data = options.against
        said = data.said().partition(": ")[2].rstrip(".")
        return step(f"against {data.name}", f"{said}; {'at rest' if data.at_rest else 'at its own times'}")

    def run(self, outcome: Outcome[Any], progress: Progress) -> Data:
        from compare import quantities
        from compare.against import evaluate

        data, scene, fem3d = outcome.options.against, outcome.scene, outcome.solved
        checks = evaluate(scene, data, fem3d)
        if outcome.options.uncertain is not None and data.curve is None:
            checks = _with_u_input(checks, outcome)
        outcome.checks = (*outcome.checks, *checks)
        outcome.warn(*(f"{data.name}: {text}" for text in data.warnings))
        sure = quantities.of(scene, fem3d).sure(data.time)
        if data.curve is None and 2 * sure.sum() < len(sure):
            why = "the others are outside of the run, too soon after its start or a jump of a drive, or at one"
            outcome.warn(f"{data.name}: {sure.sum()} of {len(sure)} rows are compared: {why}")
        return data

    def section(self, found: Data, outcome: Outcome[Any], style: Style) -> Section:
        return Section("Your data", [found.said()], headed=False)

    def document(self, found: Data, outcome: Outcome[Any]) -> dict[str, Any]:
        return found.document()


def _with_u_input(checks: Any, outcome: Outcome[Any]) -> Any:
    """The checks with u_input, at the rows at which the distances are largest."""
    from compare.against import checked, distance, furthest
    from compare.verdict import part

    data, scene, fem3d = outcome.options.against, outcome.scene, outcome.solved
    names = checked(scene, data)
    rows = {check: furthest(scene, data, fem3d, name)[0] for check, name in names.items()}

    def differences(nearby: Outcome[Any]) -> dict[str, float]:
        distances = {c: distance(nearby.scene, data, nearby.solved, name, rows[c]) for c, name in names.items()}
        return {c: part(off, abs(scale)) for c, (off, scale, _) in distances.items()}

    return by_differences(checks, outcome, differences)
