"""The section of the checks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.checks import OF_THE_REDUCTION
from scenes.formats import difference_text, percent
from validate.report.html.parts import PLUS_MINUS, Document, number, row, section, shown, text
from validate.report.sink import kind_of

_MARKS = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}


def checks(document: Document) -> str:
    """Every check, with the reason where one is given."""
    device = "steady_before" in (document.get("reduced1d") or {})
    in_3d = bool(document.get("fem3d"))
    sides = ("1D", "3D") if in_3d else ("predicted", "measured")
    if device:
        sides = ("claimed", "found") if in_3d else ("the paper", "1D")
    heads = ("check", "of", *sides, "difference", *["relative to"] * (not device), "tolerance", "verdict")
    numbers, rows, kind = (2, 3, 4, len(heads) - 2), [], ""
    for check in sorted(document.get("checks", ()), key=lambda check: check["id"] not in OF_THE_REDUCTION):
        if (now := kind_of(check["id"], check.get("own", True))) != kind:
            kind = now
            rows.append(f'<tr class="kind"><th colspan="{len(heads)}">{text(kind)}</th></tr>')
        verdict, unit = check["verdict"], "" if check["unit"] == "1" else check["unit"]
        word = f'<span class="word {verdict}">{_MARKS[verdict]} {verdict}</span>'
        cells = [
            f"<code>{text(check['id'])}</code>",
            text(check["title"]),
            _side(check) + _value(check["predicted"], unit),
            _value(check["measured"], unit),
            text(_difference(check)),
            *[text(check.get("relative_to") or "")] * (not device),
            text(percent(number(check["tolerance"]), 1)),
            word,
        ]
        because = check.get("because") or ""
        expected = check.get("expected")
        if expected and expected != verdict:
            because = f"the scene declares that it {expected}" + (f"; {because}" if because else "")
        rows.append(row(heads, cells, numbers, "judged" if because else ""))
        if because:
            rows.append(f'<tr class="because"><td colspan="{len(heads)}">{text(because)}.</td></tr>')
    if not rows:
        return ""
    top = "".join(f"<th{' class=n' if i in numbers else ''}>{head}</th>" for i, head in enumerate(heads))
    note = (
        "<p>A check <em>differs</em> or <em>agrees</em> only where that holds for every value that the difference may "
        "have given its numerical error; else it is <em>unresolved</em>.</p>"
    )
    body = "\n".join(rows)
    listed = f'<table class="cards"><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table>'
    return section("Checks", note, f'<div class="wide">{listed}</div>')


def _value(value: float | None, unit: str) -> str:
    return "never" if value is None and unit == "s" else shown(value, unit)


def _side(check: Mapping[str, Any]) -> str:
    """What stands before the value of a claim that is one-sided."""
    sense = check.get("sense", "equal")
    return "" if sense == "equal" or check["predicted"] is None else f"{sense} "


def _difference(check: Mapping[str, Any]) -> str:
    if check["u_num"] is None or check["difference"] is None:
        return "open" if check["verdict"] == "unresolved" else "fails"
    if not check["difference"] and check.get("sense", "equal") != "equal":
        return "holds"
    return difference_text(number(check["difference"]), number(check["u_num"]), PLUS_MINUS)
