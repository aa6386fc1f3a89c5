"""The difference between the models in parts, one for each assumption, or each joint of a network."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from compare.analyses.base import Analysis
from compare.kinds.sink import levels_of
from compare.outcome import Outcome, Progress
from compare.report.table import Row, Section, Style, Table
from scenes.errors import NumericsError
from scenes.formats import difference_text, percent, quantity

if TYPE_CHECKING:
    from compare.blame import Budget, Part, Split

PER_BLOCK = 3
"""Columns of a budget that a terminal has room for."""


class Why(Analysis["Budget"]):
    name, about, figure_name = "why", "the models between the 1D model and 3D, one assumption each", "why"

    def run(self, outcome: Outcome[Any], progress: Progress) -> Budget | None:
        if outcome.reduced1d is None or outcome.fem3d is None:
            return None
        with progress.stage("why"):
            return _of_sink(outcome, progress) if outcome.scene.kind == "sink" else _of_network(outcome, progress)

    def section(self, found: Budget, outcome: Outcome[Any], style: Style) -> Section:
        """Its parts in percent of the final rise or of the current or its change, then the sentence."""
        over_time = found.transient
        scales = " or ".join(dict.fromkeys(split.whole for split in found.steady))
        most = len(found.steady) if style.page else PER_BLOCK
        blocks = [found.steady[n : n + most] for n in range(0, len(found.steady), most)]
        parts: list[Table | str] = [
            f"in % of the {scales}", *(_parts("steady state", block, style) for block in blocks)
        ]  # fmt: skip
        if over_time:
            same = all(
                abs(p.value - q.value) <= p.error + q.error
                for s, t in zip(found.steady, over_time, strict=True)
                for p, q in zip(s.parts, t.parts, strict=True)
            )
            when = ", ".join(dict.fromkeys(quantity(split.time or 0.0, "s", 3) for split in over_time))
            said = f"over time the whole is largest at {when}: as in the steady state"
            rows = _rows(over_time, lambda part: part.largest or 0.0, _at_its_time, style)
            parts += [
                said if same else _parts("when it is largest", over_time, style),
                "each at its largest from 10 us on (they do not add up)",
                Table(("", *(split.quantity for split in over_time)), rows),
            ]
        said = f"{found.sentence[0].upper()}{found.sentence[1:]}."
        return Section(f"Why {named(found.start)} differs from 3D", [*parts, said])

    def document(self, found: Budget, outcome: Outcome[Any]) -> dict[str, Any]:
        return {
            "reduction": found.start,
            "sentence": found.sentence,
            "steady": {split.quantity: _document(split) for split in found.steady},
            "transient": {split.quantity: _document(split) for split in found.transient},
        }


def _of_sink(outcome: Outcome[Any], progress: Progress) -> Budget:
    """The ladder of models between the reduction and 3D; of a row of spans also how its differences run."""
    from compare.blame import budget
    from reduced1d.ladder.levels import Levels

    reduced1d = outcome.reduced1d
    levels = levels_of(reduced1d) or Levels(outcome.scene)
    found = budget(outcome.scene, outcome.options.reduction, outcome.solved, levels, progress)
    if "single" in outcome.results:
        from compare.sink_checks import varied

        rows = varied(outcome.scene, outcome.options.reduction, outcome.results["single"], progress)
        outcome.analyses["varied"] = rows
    return found


def _of_network(outcome: Outcome[Any], progress: Progress) -> Budget | None:
    from compare.network_blame import blame

    if not outcome.solved.steady:
        outcome.warn("--why is of the steady state, and there is none, as a drive varies in time: give --steady")
        return None
    progress("solving in 3D with the joints of the network")
    assert outcome.reduced1d is not None
    try:
        return blame(outcome.scene, outcome.solved, outcome.reduced1d)
    except NumericsError as error:
        outcome.warn(f"which joint is to blame is not known: {error}")
        return None


def named(reduction: str) -> str:
    return "the paper's model" if reduction == "paper" else reduction


def _document(split: Split) -> dict[str, Any]:
    def part(given: Part) -> dict[str, Any]:
        when = {} if given.when is None else {"largest": given.largest, "largest_time_s": given.when}
        return {"assumption": given.blame, "value": given.value, "error": given.error} | when

    when = {} if split.time is None else {"time_s": split.time}
    difference = {"value": split.total, "error": split.error}
    whole = {"unit": split.unit, "scale": split.scale, "difference": difference}
    return whole | {"parts": [part(p) for p in split.parts]} | when


def _parts(title: str, splits: Sequence[Split], style: Style) -> Table:
    """A row for each part, and the whole."""
    heads = [s.quantity if s.time is None else f"{s.quantity} at {quantity(s.time, 's', 3)}" for s in splits]
    rows = _rows(splits, lambda p: p.value, lambda p, split: _cell(p.value, p.error, split.scale, style), style)
    return Table((title, *heads), [*rows, ["in all", *(_cell(s.total, s.error, s.scale, style) for s in splits)]])


def _rows(
    splits: Sequence[Split], value: Callable[[Part], float], cell: Callable[[Part, Split], str], style: Style
) -> list[Row]:
    names = [part.blame for part in splits[0].parts]
    nothing = [n for n in range(len(names)) if all(abs(value(s.parts[n])) <= s.parts[n].error for s in splits)]
    if len(nothing) < 2:
        nothing = []
    alike: dict[tuple[str, ...], list[str]] = {}
    for n in range(len(names)):
        if n not in nothing:
            alike.setdefault(tuple(cell(split.parts[n], split) for split in splits), []).append(names[n])
    rows = []
    for cells, same in alike.items():
        others = f"the other {len(same) - 1} alike: {', '.join(same[1:])}" if len(same) > 1 else ""
        rows.append(Row([same[0], *cells], below=others))
    if nothing:
        zeros = (_cell(0.0, max(s.parts[n].error for n in nothing), abs(s.scale), style) for s in splits)
        zero_cells = [f"{len(nothing)} others, each", *(zero.replace("+", "", 1) for zero in zeros)]
        rows.append(Row(zero_cells, below=", ".join(names[n] for n in nothing)))
    return rows


def _at_its_time(part: Part, split: Split) -> str:
    off = percent((part.largest or 0.0) / split.scale, 2, sign=True).removesuffix(" %") if split.scale else "-"
    return f"{off} at {quantity(part.when or 0.0, 's', 3)}"


def _cell(value: float, error: float, scale: float, style: Style) -> str:
    if not scale:
        return "-"
    return difference_text(value / scale, error / abs(scale), style.plus_minus).removesuffix(" %")
