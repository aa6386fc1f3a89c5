"""The budget of a difference in words: as a table of at most 80 columns, and for summary.json."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from compare.words import difference_text, percent, quantity

if TYPE_CHECKING:
    from compare.table import Style
    from compare.why import Budget, Part, Split


def budget_text(budget: Budget, style: Style) -> str:
    """Its parts in percent of the final rise or of the current's change, then the sentence."""
    from compare.table import wrapped

    lines = [style.paint(f"Why {named(budget.start)} differs from 3D", "heading")]
    lines.append("  in % of the final rise, or of the current's change")
    lines += _table("steady state", budget.steady, style)
    if budget.transient:
        lines += _table("when it is largest", budget.transient, style)
        lines += _largest(budget.transient, style)
    return "\n".join([*lines, wrapped(f"{budget.sentence[0].upper()}{budget.sentence[1:]}.", "  ", "  ")])


def named(reduction: str) -> str:
    """A reduction in a sentence."""
    return "the paper's model" if reduction == "paper" else reduction


def document(found: Budget) -> dict[str, Any]:
    """The budget for summary.json."""

    def part(given: Part) -> dict[str, Any]:
        made = {"assumption": given.blame, "value": given.value, "error": given.error}
        return made if given.when is None else {**made, "largest": given.largest, "largest_time_s": given.when}

    def split(given: Split) -> dict[str, Any]:
        made: dict[str, Any] = {
            "unit": given.unit,
            "scale": given.scale,
            "difference": {"value": given.total, "error": given.error},
            "parts": [part(p) for p in given.parts],
        }
        return made if given.time is None else {**made, "time_s": given.time}

    return {
        "reduction": found.start,
        "sentence": found.sentence,
        "steady": {given.quantity: split(given) for given in found.steady},
        "transient": {given.quantity: split(given) for given in found.transient},
    }


def _table(title: str, splits: Sequence[Split], style: Style) -> list[str]:
    heads = [
        split.quantity if split.time is None else f"{split.quantity} at {quantity(split.time, 's', 3)}"
        for split in splits
    ]
    lines = [style.paint(f"  {title:<20}" + "".join(f"{head:>19}" for head in heads), "heading")]
    for n, part in enumerate(splits[0].parts):
        cells = [_cell(split.parts[n].value, split.parts[n].error, split.scale, style) for split in splits]
        lines.append(f"  {part.blame:<20}" + "".join(f"{cell:>19}" for cell in cells))
    totals = [_cell(split.total, split.error, split.scale, style) for split in splits]
    lines.append(f"  {'in all':<20}" + "".join(f"{cell:>19}" for cell in totals))
    return lines


def _largest(splits: Sequence[Split], style: Style) -> list[str]:
    """What each part does at the time of its own."""
    lines = [style.paint("  each at its largest from 10 us on (they do not add up)", "heading")]
    for n, part in enumerate(splits[0].parts):
        cells = []
        for split in splits:
            largest, when = split.parts[n].largest, split.parts[n].when
            off = percent((largest or 0.0) / split.scale, 2, sign=True).removesuffix(" %") if split.scale else "-"
            cells.append(f"{off} at {quantity(when or 0.0, 's', 3)}")
        lines.append(f"  {part.blame:<20}" + "".join(f"{cell:>19}" for cell in cells))
    return lines


def _cell(value: float, error: float, scale: float, style: Style) -> str:
    if not scale:
        return "-"
    return difference_text(value / scale, error / scale, style.plus_minus).removesuffix(" %")
