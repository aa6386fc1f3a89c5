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
    over_time = budget.transient
    parts: list[Table | str] = [
        f"in % of the final rise, or of the {of_current(outcome.scene)}",
        _parts("steady state", budget.steady, style),
    ]
    if over_time:
        heads = [split.quantity for split in over_time]
        same = all(
            abs(p.value - q.value) <= p.error + q.error
            for s, t in zip(budget.steady, over_time, strict=True)
            for p, q in zip(s.parts, t.parts, strict=True)
        )
        when = ", ".join(dict.fromkeys(quantity(split.time or 0.0, "s", 3) for split in over_time))
        said = f"over time the whole is largest at {when}: as in the steady state"
        parts.append(said if same else _parts("when it is largest", over_time, style))
        rows = _rows(over_time, lambda part: part.largest or 0.0, _at_its_time, style)
        parts += ["each at its largest from 10 us on (they do not add up)", Table(("", *heads), rows)]
    said = f"{budget.sentence[0].upper()}{budget.sentence[1:]}."
    return Section(f"Why {named(budget.start)} differs from 3D", [*parts, said])


def named(reduction: str) -> str:
    """A reduction in a sentence."""
    return "the paper's model" if reduction == "paper" else reduction


def document(found: Budget) -> dict[str, Any]:
    """The budget for summary.json."""

    def part(given: Part) -> dict[str, Any]:
        when = {} if given.when is None else {"largest": given.largest, "largest_time_s": given.when}
        return {"assumption": given.blame, "value": given.value, "error": given.error} | when

    def split(given: Split) -> dict[str, Any]:
        whole = {"unit": given.unit, "scale": given.scale, "difference": {"value": given.total, "error": given.error}}
        when = {} if given.time is None else {"time_s": given.time}
        return whole | {"parts": [part(p) for p in given.parts]} | when

    return {
        "reduction": found.start,
        "sentence": found.sentence,
        "steady": {given.quantity: split(given) for given in found.steady},
        "transient": {given.quantity: split(given) for given in found.transient},
    }


def _parts(title: str, splits: Sequence[Split], style: Style) -> Table:
    """What each part adds, and the whole."""
    heads = [s.quantity if s.time is None else f"{s.quantity} at {quantity(s.time, 's', 3)}" for s in splits]
    rows = _rows(splits, lambda p: p.value, lambda p, split: _cell(p.value, p.error, split.scale, style), style)
    return Table((title, *heads), [*rows, ["in all", *(_cell(s.total, s.error, s.scale, style) for s in splits)]])


def _rows(
    splits: Sequence[Split], value: Callable[[Part], float], cell: Callable[[Part, Split], str], style: Style
) -> list[Row]:
    """A row for each part; those that are nothing but their numerical error in one, with their names below."""
    names = [part.blame for part in splits[0].parts]
    nothing = [n for n in range(len(names)) if all(abs(value(s.parts[n])) <= s.parts[n].error for s in splits)]
    if len(nothing) < 2:
        nothing = []
    rows = [
        Row([name, *(cell(split.parts[n], split) for split in splits)])
        for n, name in enumerate(names)
        if n not in nothing
    ]
    if nothing:
        zeros = (_cell(0.0, max(s.parts[n].error for n in nothing), s.scale, style) for s in splits)
        cells = [f"{len(nothing)} others, each", *(zero.replace("+", "", 1) for zero in zeros)]
        rows.append(Row(cells, below=", ".join(names[n] for n in nothing)))
    return rows


def _at_its_time(part: Part, split: Split) -> str:
    off = percent((part.largest or 0.0) / split.scale, 2, sign=True).removesuffix(" %") if split.scale else "-"
    return f"{off} at {quantity(part.when or 0.0, 's', 3)}"


def _cell(value: float, error: float, scale: float, style: Style) -> str:
    if not scale:
        return "-"
    return difference_text(value / scale, error / scale, style.plus_minus).removesuffix(" %")
