"""The section of the checks."""

from __future__ import annotations

from compare.report.parts import row, section
from compare.report.values import PLUS_MINUS, Document, number
from compare.report.words import shown, text
from compare.scope import OF_THE_REDUCTION
from compare.table import kind_of
from compare.words import difference_text, percent

_MARKS = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}


def checks(document: Document) -> str:
    """Every check, with the reason where one is given."""
    sides = ("1D", "3D") if document.get("fem3d") else ("predicted", "measured")
    heads = ("check", "of", *sides, "difference", "relative to", "tolerance", "verdict")
    numbers, rows, kind = (2, 3, 4, 6), [], ""
    for check in sorted(document.get("checks", ()), key=lambda check: check["id"] not in OF_THE_REDUCTION):
        if (now := kind_of(check["id"], check.get("own", True))) != kind:
            kind = now
            rows.append(f'<tr class="kind"><th colspan="{len(heads)}">{text(kind)}</th></tr>')
        verdict, unit = check["verdict"], "" if check["unit"] == "1" else check["unit"]
        word = f'<span class="word {verdict}">{_MARKS[verdict]} {verdict}</span>'
        cells = [
            f"<code>{text(check['id'])}</code>",
            text(check["title"]),
            *(shown(check[key], unit) for key in ("predicted", "measured")),
            text(difference_text(number(check["difference"]), number(check["u_num"]), PLUS_MINUS)),
            text(check.get("relative_to") or ""),
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
