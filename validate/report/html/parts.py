"""What the page is built of: escaped texts, with names and units for what a summary calls by a key; sections, tables
that become cards on a phone, lists of keys and values."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from scenes.formats import quantity
from validate.report.checks import NAMES as DEVICE
from validate.report.sink import QUANTITIES as SINK
from validate.report.table import MARKS, Section, Table

_NAMED = SINK | DEVICE
_UNITS = {
    "_K_per_W": "K/W", "_W_per_m2": "W/m2", "_A_per_m2": "A/m2", "_K": "K", "_A": "A", "_W": "W", "_V": "V", "_s": "s",
    "_m3": "m3", "_m": "m", "_J": "J", "_Hz": "Hz", "_ohm": "ohm",
}  # fmt: skip


def text(value: object) -> str:
    """Escaped, with the numbers of an exponent or a unit kept on one line with it."""
    return re.sub(r"(?<=\d) (?=[A-Za-z%\N{PLUS-MINUS SIGN}])", "&nbsp;", escape(str(value)))


def named(key: str) -> tuple[str, str]:
    """A key as a name and its unit: "peak_rise_K" is ("peak rise", "K")."""
    if key in _NAMED:
        return _NAMED[key]
    ending, unit = next((item for item in _UNITS.items() if key.endswith(item[0])), ("", ""))
    return key.removesuffix(ending).replace("_", " "), unit


def shown(value: Any, unit: str = "") -> str:
    """A value of a summary as a person reads it, or a list of them, escaped."""
    if isinstance(value, (list, tuple)):
        return ", ".join(shown(part, unit) for part in value)
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    if isinstance(value, int):
        return f"{value:,}".replace(",", "&#8239;")
    if isinstance(value, float):
        if not math.isfinite(value):
            return "infinite"
        # A volume takes no prefix: a "pm3" is a cubic picometre.
        return text(quantity(value, unit, 5) if unit and unit != "m3" else f"{value:.6g} {unit}".rstrip())
    return text(value)


def section(title: str, *content: str) -> str:
    """A section under a heading, or nothing where it has no content."""
    filled = "\n".join(part for part in content if part)
    anchor = title.lower().replace(" ", "-")
    return f'<section id="{anchor}"><h2>{text(title)}</h2>\n{filled}\n</section>' if filled else ""


def of_section(given: Section) -> str:
    """A section of a report: its tables, paragraphs and lists."""
    parts = []
    for part in given.filled:
        if isinstance(part, Table):
            parts.append(f'<div class="wide">{_of_table(part)}</div>')
        elif isinstance(part, str):
            parts.append(f"<p>{text(part)}</p>")
        else:
            parts.append(f"<ul>{''.join(f'<li>{text(item)}</li>' for item in part)}</ul>")
    return section(given.title, *parts)


def _of_table(given: Table) -> str:
    """A table of texts, a verdict with its sign and in its colour."""
    heads = [" ".join(head.split()) for head in given.heads]
    numbers, rows = [i for i, side in enumerate(given.aligned) if side == ">"], []
    for row in given.marked:
        if len(row.cells) == 1:
            rows.append(f'<tr class="kind"><th colspan="{len(heads)}">{text(row.cells[0])}</th></tr>')
            continue
        cells, verdict = [text(cell) for cell in row.cells], row.verdict
        if verdict:
            cells[0] = f"<code>{cells[0]}</code>"
            at = -1 if cells[-1] == verdict else 0
            cells[at] = f'<span class="word {verdict}">{MARKS[verdict][0]} {cells[at]}</span>'
        rows.append(_row(heads, cells, numbers, " class='judged'" if row.below else ""))
        if row.below:
            rows.append(f'<tr class="because"><td colspan="{len(heads)}">{text(row.below)}</td></tr>')
    return _framed(heads, rows, numbers)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table of cells that are HTML; columns in ``numbers`` stand to the right."""
    return _framed(heads, (_row(heads, cells, numbers) for cells in rows), numbers)


def _framed(heads: Sequence[str], rows: Iterable[str], numbers: Sequence[int]) -> str:
    tops = (f"<th{_class('n' * (i in numbers))}>{text(head)}</th>" for i, head in enumerate(heads))
    body = "\n".join(rows)
    return f'<table class="cards"><thead><tr>{"".join(tops)}</tr></thead>\n<tbody>\n{body}\n</tbody></table>'


def _row(heads: Sequence[str], cells: Sequence[str], numbers: Sequence[int], kind: str = "") -> str:
    found = (
        f'<td{_class("n" * (i in numbers), "" if cell else "empty")} data-label="{text(head)}">{cell}</td>'
        for i, (head, cell) in enumerate(zip(heads, cells, strict=True))
    )
    return f"<tr{kind}>{''.join(found)}</tr>"


def _class(*names: str) -> str:
    found = " ".join(filter(None, names))
    return f' class="{found}"' if found else ""


def values(items: Mapping[str, Any]) -> str:
    """Keys with their values, those that are tables or lists themselves under headings of their own."""
    rows, parts = [], []
    for key, item in items.items():
        name, unit = named(str(key))
        if not isinstance(item, (Mapping, list, tuple)):
            rows.append(f"<dt>{text(name)}</dt><dd>{shown(item, unit)}</dd>")
        elif not isinstance(item, Mapping) and len(item) < 9 and all(isinstance(p, (int, float, str)) for p in item):
            rows.append(f"<dt>{text(name)}</dt><dd>{shown(item, unit) or 'none'}</dd>")
        elif item:
            parts.append(f'<section class="keep"><h3>{text(name)}</h3>{_anything(item)}</section>')
    return "\n".join([*[f"<dl>{''.join(rows)}</dl>"] * bool(rows), *parts])


def _anything(item: Any) -> str:
    """Any JSON value: a table for rows of the same keys, a list, keys with values, or text."""
    if isinstance(item, Mapping):
        return values(item)
    if not isinstance(item, (list, tuple)):
        return shown(item)
    if item and all(isinstance(part, Mapping) and part.keys() == item[0].keys() for part in item):
        heads = [named(str(key)) for key in item[0]]
        if not any(isinstance(value, Mapping) for part in item for value in part.values()):
            rows = [
                [shown(value, unit) for value, (_, unit) in zip(part.values(), heads, strict=True)] for part in item
            ]
            return f'<div class="wide">{table([name for name, _ in heads], rows)}</div>'
    return "<ul>" + "".join(f"<li>{_anything(part)}</li>" for part in item) + "</ul>"
