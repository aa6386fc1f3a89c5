"""The tables of checks: one with what is compared for the sink's in a terminal, one with the values for the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby

from compare.verdict import Check
from scenes.checks import OF_THE_PAPER, OF_THE_REDUCTION
from scenes.formats import difference_text, percent, quantity
from validate.report.claims import sides
from validate.report.table import Row, Section, Style, Table, sentences

_LONG = 20
"""Characters of an id from which on the titles stand below."""
_NOTE = (
    "A check differs or agrees only where that holds for every value that the difference may have given its numerical "
    "error; else it is unresolved."
)


def sections(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> list[Section]:
    """The sink's checks by what is compared, and why those differ that do."""
    if style.page or not checks:
        return [on_page(checks, contrary)] if checks else []
    below, rows = any(len(check.id) >= _LONG for check in checks), []
    for kind, group in groupby(_sorted(checks), kind_of):
        rows += [Row([kind])] if kind else []
        for c in group:
            difference = difference_text(c.difference, c.u_num, style.plus_minus)
            cells = [c.id, "" if below else c.title, difference, percent(c.tolerance, 1), c.verdict]
            rows.append(Row(cells, c.verdict, c.title if below else ""))
    table = Table(("check", "", "difference", "tolerance", ""), rows, "<<>><")
    against = {check.id: declared(check) for check in contrary}
    told = [(c.id, [text for text in (against.get(c.id, ""), c.because) if text]) for c in checks if c.own]
    reasons = [f"{name}: {'; '.join(said)}" for name, said in told if said]
    return [Section("Checks", [table], headed=False), Section("Why", [sentences(reasons)])]


def on_page(checks: Sequence[Check], contrary: Sequence[Check]) -> Section:
    """Every check with its values, and below it the reason where one is given."""
    rows = []
    for kind, group in groupby(_sorted(checks), kind_of):
        rows += [Row([kind])] if kind else []
        for c in group:
            said = [declared(c) if c in contrary else "", c.because]
            sense = "" if c.sense == "equal" or not math.isfinite(c.predicted) else f"{c.sense} "
            rows.append(Row(
                [c.id, c.title, sense + _value(c.predicted, c.unit), _value(c.measured, c.unit), _difference(c),
                 c.relative_to, percent(c.tolerance, 1), c.verdict],
                c.verdict, " ".join(sentences(["; ".join(filter(None, said))])) if any(said) else "",
            ))  # fmt: skip
    heads = ("check", "of", *_heads(checks), "difference", "relative to", "tolerance", "verdict")
    return Section("Checks", [_NOTE, Table(heads, rows, "<<>>><><")])


def _heads(checks: Sequence[Check]) -> tuple[str, str]:
    """Whose the two values are."""
    found = {sides(check) for check in checks}
    return found.pop() if len(found) == 1 else ("claimed", "found")


def _sorted(checks: Sequence[Check]) -> list[Check]:
    """One model with the other first."""
    return sorted(checks, key=lambda check: check.id not in OF_THE_REDUCTION)


def kind_of(check: Check) -> str:
    """What is compared in a check, in words."""
    if check.id in OF_THE_REDUCTION:
        return "one model against the other: 1D less 3D"
    if check.id in OF_THE_PAPER:
        whose = "the paper's equations" if check.own else "the paper's equations (not this model's)"
        return f"{whose}: 3D numbers in, relative to 3D's own"
    kinds = {
        "slope": "how the models follow a key: 1D less 3D", "air": "the air left out: 3D without it less 3D with it",
        "energy": "3D alone", "islands": "3D alone", "against": "your data less 3D",
    }  # fmt: skip
    return kinds.get(check.id.partition("_")[0], "")


def declared(check: Check) -> str:
    """What the scene declares of a check that came out otherwise."""
    if check.expected is not None and check.verdict != check.expected:
        return f"the scene declares that it {check.expected} (checks.expect_differs)"
    return ""


def _value(value: float, unit: str) -> str:
    if not math.isfinite(value):
        return "never" if unit == "s" else "none"
    return quantity(value, "" if unit == "1" else unit, 5)


def _difference(check: Check) -> str:
    if not (math.isfinite(check.u_num) and math.isfinite(check.difference)):
        return "open" if check.verdict == "unresolved" else "fails"
    if check.sense != "equal" and not check.difference:
        return "holds"
    return difference_text(check.difference, check.u_num, "\N{PLUS-MINUS SIGN}")
