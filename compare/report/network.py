"""The report of a network: every line, joint and condition with its formula, to check by hand."""

from __future__ import annotations

from typing import Any

from compare.report.table import Row, Section, Style, Table
from reduced1d.network.lines import layout
from reduced1d.network.table import Row as Entry
from reduced1d.network.table import table
from scenes.formats import quantity
from scenes.model import AnyScene

MOST = 30
"""Rows of a part that a terminal has room for; the page and summary.json have all."""


def entries(scene: AnyScene) -> dict[str, list[Entry]]:
    """Lines, joints and conditions with formulas and values in SI units, as summary.json has them."""
    return table(layout(scene))


def section(scene: AnyScene, style: Style) -> Section:
    """Return a table of lines, joints and conditions, each with its formulas below."""
    parts: list[Table | str] = []
    for name, rows in entries(scene).items():
        shown = rows if style.page else rows[:MOST]
        units = [unit for unit in ("W/K", "J/K", "ohm", "W") if any(unit in row for row in shown)]
        if shown:
            parts.append(Table((name, *units), [_row(row, units) for row in shown]))
        if len(shown) < len(rows):
            parts.append(f"{len(rows) - len(shown)} more {name} are in report.html and summary.json.")
    return Section("The network, to check by hand", parts, headed=False)


def _row(row: Entry, units: list[str]) -> Row:
    values = [quantity(row[unit]["value"], unit) if _known(row, unit) else "" for unit in units]
    formulas = [f"{row[unit]['formula']} = {quantity(row[unit]['value'], unit)}" if _known(row, unit)
                else row[unit]["formula"] for unit in units if unit in row]  # fmt: skip
    return Row([row["what"], *values], below="; ".join([row["how"], *formulas]))


def _known(row: Entry, unit: str) -> bool:
    value: Any = row.get(unit, {}).get("value")
    return value is not None
