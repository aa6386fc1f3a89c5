"""The pieces that sections are built of: tables that become cards on a phone, lists of keys and values."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from validate.report.html.words import named, shown, text


def section(title: str, *content: str) -> str:
    """A section under a heading, or nothing where it has no content."""
    filled = "\n".join(part for part in content if part)
    anchor = title.lower().replace(" ", "-")
    return f'<section id="{anchor}"><h2>{text(title)}</h2>\n{filled}\n</section>' if filled else ""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """A table of cells that are HTML; columns in ``numbers`` stand to the right."""
    top = "".join(f"<th{_right(i, numbers)}>{text(head)}</th>" for i, head in enumerate(heads))
    body = "\n".join(row(heads, cells, numbers) for cells in rows)
    return f'<table class="cards"><thead><tr>{top}</tr></thead>\n<tbody>\n{body}\n</tbody></table>'


def row(heads: Sequence[str], cells: Sequence[str], numbers: Sequence[int] = (), kind: str = "") -> str:
    """One row of a table."""
    found = "".join(
        f'<td{_right(i, numbers, "" if cell else " empty")} data-label="{text(head)}">{cell}</td>'
        for i, (head, cell) in enumerate(zip(heads, cells, strict=True))
    )
    return f"<tr{f' class={kind!r}' if kind else ''}>{found}</tr>"


def _right(i: int, numbers: Sequence[int], more: str = "") -> str:
    found = f"{'n' if i in numbers else ''}{more}".strip()
    return f' class="{found}"' if found else ""


def values(items: Mapping[str, Any]) -> str:
    """Keys with their values, those that are tables or lists themselves under headings of their own."""
    plain = {key: item for key, item in items.items() if not isinstance(item, (Mapping, list, tuple))}
    short = {key: item for key, item in items.items() if _is_short(item)}
    rows = []
    for key, item in items.items():
        name, unit = named(str(key))
        if key in plain:
            rows.append(f"<dt>{text(name)}</dt><dd>{shown(item, unit)}</dd>")
        elif key in short:
            rows.append(f"<dt>{text(name)}</dt><dd>{', '.join(shown(part, unit) for part in item) or 'none'}</dd>")
    found = [f"<dl>{''.join(rows)}</dl>"] if rows else []
    for key, item in items.items():
        if key in plain or key in short or not item:
            continue
        found.append(f'<section class="keep"><h3>{text(named(str(key))[0])}</h3>{anything(item)}</section>')
    return "\n".join(found)


def anything(item: Any) -> str:
    """Any JSON value: a table for rows of the same keys, a list, keys with values, or text."""
    if isinstance(item, Mapping):
        return values(item)
    if isinstance(item, (list, tuple)):
        if item and all(isinstance(part, Mapping) and part.keys() == item[0].keys() for part in item):
            heads = [str(key) for key in item[0]]
            flat = all(not isinstance(value, Mapping) for part in item for value in part.values())
            if flat:
                cells = [[_cell(value, head) for head, value in part.items()] for part in item]
                return f'<div class="wide">{table([named(head)[0] for head in heads], cells)}</div>'
        return "<ul>" + "".join(f"<li>{anything(part)}</li>" for part in item) + "</ul>"
    return shown(item)


def _cell(value: Any, head: str) -> str:
    if isinstance(value, (list, tuple)):
        return ", ".join(shown(part) for part in value)
    return shown(value, named(head)[1])


def _is_short(item: Any) -> bool:
    return isinstance(item, (list, tuple)) and len(item) < 9 and all(isinstance(p, (int, float, str)) for p in item)
