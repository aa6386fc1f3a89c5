"""The budget of a difference in words: as tables, and for summary.json."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from scenes.formats import difference_text, percent, quantity
from validate.report.table import Row, Section, Style, Table

if TYPE_CHECKING:
    from compare.budget import Budget, Part, Split
    from compare.outcome import Outcome
    from scenes.sink import Sink


def section(outcome: Outcome[Sink], style: Style) -> Section:
    """Its parts in percent of the final rise or of the current or its change, then the sentence."""
    from compare.budget import of_current

    budget = outcome.why
    assert budget is not None
    parts: list[Table | str] = [
        f"in % of the final rise, or of the {of_current(outcome.scene)}",
        _parts("steady state", budget.steady, style),
    ]
    if budget.transient:
        if _same(budget.steady, budget.transient):
            when = ", ".join(dict.fromkeys(quantity(split.time or 0.0, "s", 3) for split in budget.transient))
            parts.append(f"over time the whole is largest at {when}: as in the steady state")
        else:
            parts.append(_parts("when it is largest", budget.transient, style))
        cells = [[_at_its_time(part, split.scale) for part in split.parts] for split in budget.transient]
        rows = _grouped(budget.transient, cells, lambda part: part.largest or 0.0, style)
        heads = [split.quantity for split in budget.transient]
        parts += ["each at its largest from 10 us on (they do not add up)", Table(("", *heads), rows)]
    said = f"{budget.sentence[0].upper()}{budget.sentence[1:]}."
    return Section(f"Why {named(budget.start)} differs from 3D", [*parts, said])


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


def _parts(title: str, splits: Sequence[Split], style: Style) -> Table:
    """What each part adds, and the whole."""
    heads = [
        split.quantity if split.time is None else f"{split.quantity} at {quantity(split.time, 's', 3)}"
        for split in splits
    ]
    cells = [[_cell(part.value, part.error, split.scale, style) for part in split.parts] for split in splits]
    totals = [_cell(split.total, split.error, split.scale, style) for split in splits]
    return Table((title, *heads), [*_grouped(splits, cells, lambda part: part.value, style), ["in all", *totals]])


def _grouped(
    splits: Sequence[Split], cells: Sequence[Sequence[str]], value: Callable[[Part], float], style: Style
) -> list[Row]:
    """A row for each part; those that are nothing but their numerical error in one, with their names below."""
    names = [part.blame for part in splits[0].parts]
    nothing = [n for n in range(len(names)) if all(abs(value(s.parts[n])) <= s.parts[n].error for s in splits)]
    if len(nothing) < 2:
        nothing = []
    rows = [Row([name, *(column[n] for column in cells)]) for n, name in enumerate(names) if n not in nothing]
    if nothing:
        most = [max(split.parts[n].error for n in nothing) for split in splits]
        zeros = (_cell(0.0, error, split.scale, style) for error, split in zip(most, splits, strict=True))
        zeros = (zero.replace("+", "", 1) for zero in zeros)
        rows.append(Row([f"{len(nothing)} others, each", *zeros], below=", ".join(names[n] for n in nothing)))
    return rows


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
