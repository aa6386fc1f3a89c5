"""The section on which assumption of the 1D model is to blame: a table of its parts for each quantity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from validate.report.budget import others
from validate.report.html.parts import section, table
from validate.report.html.values import Document, value_with_error
from validate.report.html.words import text


def why(document: Document) -> str:
    """The budget of the differences in the steady state and, where there is one, over time."""
    found = document.get("why")
    if not isinstance(found, Mapping):
        return ""
    said = found.get("sentence")
    parts = [f"<p>{text(said)}.</p>"] if said else []
    for name, budgets in found.items():
        if isinstance(budgets, Mapping) and all(_is_budget(b) for b in budgets.values()) and budgets:
            parts += [f"<h3>{text(name.replace('_', ' '))}</h3>", _table(budgets)]
    note = "<p>Each line is what dropping one more assumption changes, 1D less 3D; the lines add up to the last.</p>"
    return section("Why", parts[0] if said else "", note, *parts[1 if said else 0 :])


def _is_budget(item: Any) -> bool:
    return isinstance(item, Mapping) and "parts" in item and "difference" in item


def _table(budgets: Mapping[str, Any]) -> str:
    found = {
        name: [next((p for p in b["parts"] if p["assumption"] == name), None) for b in budgets.values()]
        for name in dict.fromkeys(part["assumption"] for b in budgets.values() for part in b["parts"])
    }
    nothing = [name for name, parts in found.items() if all(p is None or abs(p["value"]) <= p["error"] for p in parts)]
    if len(nothing) > 1:
        # What is nothing but its numerical error, in one row.
        most = [max((found[n][i] or {}).get("error", 0.0) for n in nothing) for i in range(len(budgets))]
        found = {name: parts for name, parts in found.items() if name not in nothing}
        found[f"{others(len(nothing))} ({', '.join(nothing)})"] = [{"value": 0.0, "error": error} for error in most]
    units = [budget.get("unit", "") for budget in budgets.values()]
    rows = [
        [text(name), *(value_with_error(part, unit) for part, unit in zip(parts, units, strict=True))]
        for name, parts in found.items()
    ]
    total = [value_with_error(b["difference"], b.get("unit", "")) for b in budgets.values()]
    rows.append(["<strong>difference</strong>", *(f"<strong>{cell}</strong>" for cell in total)])
    heads = [
        "assumption",
        *(f"{key}, at {b['time_s'] * 1e3:.4g} ms" if b.get("time_s") else key for key, b in budgets.items()),
    ]
    return f'<div class="wide">{table(heads, rows, range(1, len(heads)))}</div>'
