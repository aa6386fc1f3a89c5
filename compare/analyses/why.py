"""The difference between the models in parts, one for each assumption, or each joint of a network."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from compare.analyses.base import Analysis
from compare.blame import Budget, Part, Split, budget, network_budget
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table
from scenes.errors import NumericsError
from scenes.formats import difference_text, quantity
from scenes.result import Estimate


class Why(Analysis[Budget]):
    name, about = "why", "the models between the 1D model and 3D, one assumption each"

    def run(self, outcome: Outcome[Any], progress: Progress) -> Budget | None:
        if outcome.reduced1d is None or outcome.fem3d is None:
            return None
        from reduced1d.ladder.levels import Levels

        scene = outcome.scene
        if scene.kind == "sink":
            return budget(outcome.options.reduction, outcome.solved, Levels(scene), progress)
        if not outcome.solved.steady:
            outcome.warn("--why is of the steady state, and a drive varies in time: give it one value")
            return None
        progress("solving in 3D with the joints of the network")
        try:
            return network_budget(scene, outcome.solved, outcome.reduced1d)
        except NumericsError as error:
            outcome.warn(f"no joint is to blame: {error}")
            return None

    def section(self, found: Budget, outcome: Outcome[Any], style: Style) -> Section:
        """Its parts in percent of the final rise or of the current or its change, then the sentence."""

        def cell(parts: Sequence[Part | Estimate], scale: float) -> str:
            if not scale:
                return "-"
            value, error = sum(part.value for part in parts) / scale, sum(part.error for part in parts) / abs(scale)
            return difference_text(value, error, style.plus_minus).removesuffix(" %")

        def table(title: str, splits: Sequence[Split]) -> Table:
            heads = [s.quantity + ("" if s.time_s is None else f" at {quantity(s.time_s, 's', 3)}") for s in splits]
            rows = []
            for name, joints in Counter(part.assumption for part in splits[0].parts).items():
                cells = (cell([part for part in s.parts if part.assumption == name], s.scale) for s in splits)
                rows.append([name + f", {joints} joints" * (joints > 1), *cells])
            return Table((title, *heads), [*rows, ["in all", *(cell([s.difference], s.scale) for s in splits)]])

        most = len(found.steady) if style.page else 3  # that a terminal has room for
        blocks = [found.steady[n : n + most] for n in range(0, len(found.steady), most)]
        scales = "in % of the steady 3D rise or value"
        parts: list[Table | str] = [scales, *(table("steady state", block) for block in blocks)]
        if found.transient:
            parts.append(table("when it is largest", found.transient))
        said = f"{found.sentence[0].upper()}{found.sentence[1:]}."
        name = "the paper's model" if found.start == "paper" else found.start
        return Section(f"Why {name} differs from 3D", [*parts, said])

    def enter(self, summary: dict[str, Any], found: Budget, outcome: Outcome[Any]) -> None:
        def entry(split: Split) -> dict[str, Any]:
            return {key: value for key, value in asdict(split).items() if key != "quantity" and value is not None}

        steady, transient = ({s.quantity: entry(s) for s in splits} for splits in (found.steady, found.transient))
        of = {"reduction": found.start, "sentence": found.sentence}
        summary["why"] = of | {"steady": steady, "transient": transient}
