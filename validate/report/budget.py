"""The budget of a difference in words: as a table of at most 80 columns, and for summary.json."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from scenes.formats import difference_text, percent, quantity
from validate.report.table import Style, wrapped

if TYPE_CHECKING:
    from compare.budget import Budget, Part, Split


def budget_text(budget: Budget, style: Style) -> str:
    """Its parts in percent of the final rise or of the current's change, then the sentence."""
    lines = [style.paint(f"Why {named(budget.start)} differs from 3D", "heading")]
    lines.append("  in % of the final rise, or of the current's change")
    lines += _table("steady state", budget.steady, style)
    if budget.transient:
        if _same(budget.steady, budget.transient):
            when = ", ".join(dict.fromkeys(quantity(split.time or 0.0, "s", 3) for split in budget.transient))
            lines.append(f"  over time the whole is largest at {when}: as in the steady state")
        else:
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

    def cells(n: int) -> list[str]:
        return [_cell(split.parts[n].value, split.parts[n].error, split.scale, style) for split in splits]

    rows = _grouped(splits, cells, lambda part: part.value, style)
    totals = [_cell(split.total, split.error, split.scale, style) for split in splits]
    return [style.paint(_row(title, heads), "heading"), *rows, _row("in all", totals)]


def _largest(splits: Sequence[Split], style: Style) -> list[str]:
    """What each part does at the time of its own."""

    def cells(n: int) -> list[str]:
        return [_at_its_time(split.parts[n], split.scale) for split in splits]

    head = style.paint("  each at its largest from 10 us on (they do not add up)", "heading")
    return [head, *_grouped(splits, cells, lambda part: part.largest or 0.0, style)]


def _grouped(
    splits: Sequence[Split], cells: Callable[[int], list[str]], value: Callable[[Part], float], style: Style
) -> list[str]:
    """A row for each part; those that are nothing but their numerical error in one, with their names below."""
    parts = range(len(splits[0].parts))
    nothing = [n for n in parts if all(abs(value(s.parts[n])) <= s.parts[n].error for s in splits)]
    if len(nothing) < 2:
        nothing = []
    rows = [_row(splits[0].parts[n].blame, cells(n)) for n in parts if n not in nothing]
    if nothing:
        most = [max(split.parts[n].error for n in nothing) for split in splits]
        zeros = [_cell(0.0, error, split.scale, style) for error, split in zip(most, splits, strict=True)]
        rows.append(_row(others(len(nothing)), [zero.replace("+", "", 1) for zero in zeros]))
        rows.append(f"    {', '.join(splits[0].parts[n].blame for n in nothing)}")
    return rows


def others(count: int) -> str:
    """The name of a row for several parts, none of which is more than its numerical error."""
    return f"{count} others, each"


def _row(name: str, cells: Sequence[str]) -> str:
    return f"  {name:<20}" + "".join(f"{cell:>19}" for cell in cells)


def _at_its_time(part: Part, scale: float) -> str:
    off = percent((part.largest or 0.0) / scale, 2, sign=True).removesuffix(" %") if scale else "-"
    return f"{off} at {quantity(part.when or 0.0, 's', 3)}"


def _same(steady: Sequence[Split], largest: Sequence[Split]) -> bool:
    """Whether the differences when they are largest are the steady ones over again, as far as they are known."""
    return all(
        abs(p.value - q.value) <= p.error + q.error
        for s, t in zip(steady, largest, strict=True)
        for p, q in zip(s.parts, t.parts, strict=True)
    )


def _cell(value: float, error: float, scale: float, style: Style) -> str:
    if not scale:
        return "-"
    return difference_text(value / scale, error / scale, style.plus_minus).removesuffix(" %")
