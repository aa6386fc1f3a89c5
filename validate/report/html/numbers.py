"""The sections of numbers: steady state, values over time, error budget, energy balance, mesh, and what is to blame."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.formats import Column, percent, quantity
from validate.report.budget import others
from validate.report.html.parts import (  # fmt: skip
    PLUS_MINUS,
    Document,
    error_text,
    named,
    number,
    probe_or_quantity,
    section,
    shown,
    steady_of,
    table,
    text,
    value_of,
    value_with_error,
    values,
)


def quantities(document: Document) -> str:
    """The steady state of each model, 3D with its error."""
    fem3d, reduced1d = (steady_of(document, model) for model in ("fem3d", "reduced1d"))
    if (not fem3d and not reduced1d) or "steady_before" in (document.get("reduced1d") or {}):
        return ""
    name = (document.get("reduced1d") or {}).get("name")
    heads = ["quantity", *(["3D"] if fem3d else []), *([f"1D ({name})" if name else "1D"] if reduced1d else [])]
    if fem3d and reduced1d:
        heads.append("1D/3D - 1")
    rows = []
    for key in [*fem3d, *(k for k in reduced1d if k not in fem3d)]:
        label, unit = probe_or_quantity(document, key)
        cells = [text(label)]
        if fem3d:
            cells.append(value_with_error(fem3d.get(key), unit))
        if reduced1d:
            cells.append(shown(value_of(reduced1d.get(key)), unit) if key in reduced1d else "")
        if fem3d and reduced1d:
            a, b = value_of(reduced1d.get(key)), value_of(fem3d.get(key))
            cells.append(text(percent(a / b - 1, sign=True)) if a is not None and b else "")
        rows.append(cells)
    return section("Steady state", table(heads, rows, range(1, len(heads))))


def over_time(document: Document) -> str:
    """Where a transient ends and what it passes through, and its values at the times that were asked for."""
    found = (document.get("fem3d") or {}).get("transient") or {}
    ranges, errors = found.get("range") or {}, found.get("errors") or {}
    if not ranges:
        return ""
    names = {key: probe_or_quantity(document, key) for key in ranges}
    columns = {
        key: Column.of(max(abs(item["least"]), abs(item["largest"])), errors[key], names[key][1])
        for key, item in ranges.items()
    }

    def cell(key: str, value: float) -> str:
        column = columns[key]
        return text(f"{column.show(value)} {PLUS_MINUS} {column.show_error(errors[key])} {column.unit}")

    kinds = {"end": "at the end", "least": "least", "largest": "largest"}
    rows = [[text(names[key][0]), *(cell(key, item[kind]) for kind in kinds)] for key, item in ranges.items()]
    parts = [table(("probe", *kinds.values()), rows, (1, 2, 3))]
    times, values_at = found.get("time_s") or (), found.get("values") or {}
    if len(times) > 1:
        rows = [[shown(t, "s"), *(cell(key, v[i]) for key, v in values_at.items())] for i, t in enumerate(times)]
        heads = ["time", *(names[key][0] for key in values_at)]
        parts.append(f'<div class="wide">{table(heads, rows, range(len(heads)))}</div>')
    return section("Over time", *parts)


def errors(document: Document) -> str:
    """Where the numerical error stands against each tolerance, and what bounds it."""
    fem3d = document.get("fem3d") or {}
    rows = []
    over_time = (fem3d.get("transient") or {}).get("errors") or {}
    for key, item in steady_of(document, "fem3d").items():
        label, unit = probe_or_quantity(document, key)
        error, value = number(item.get("error")), number(item.get("value"))
        rows.append([text(label), error_text(error, unit), text(percent(error / abs(value))) if value else ""])
    parts = [table(("steady", "estimated error", "of the value"), rows, (1, 2))] if rows else []
    if over_time:
        listed = [
            [text(name), error_text(error, unit)]
            for (name, unit), error in ((probe_or_quantity(document, k), e) for k, e in over_time.items())
        ]
        parts.append(table((f"over time, {_since(fem3d['transient'])}", "estimated error"), listed, (1,)))
    judged = [c for c in document.get("checks", ()) if c["u_num"]]
    if judged:
        listed = [
            [f"<code>{text(c['id'])}</code>", *(text(percent(number(c[k]), 1)) for k in ("u_num", "tolerance")),
             text(percent(number(c["u_num"]) / number(c["tolerance"]), 1))]
            for c in judged
        ]  # fmt: skip
        heads = ("check", "error of the difference", "tolerance", "error / tolerance")
        parts.append(table(heads, listed, (1, 2, 3)))
    found = (document.get("reduced1d") or {}).get("errors")
    if isinstance(found, Mapping) and found:
        listed = [
            [text(name), error_text(number(error), unit)] for k, error in found.items() for name, unit in [named(k)]
        ]
        parts.append(table(("1D model, over time", "estimated error"), listed, (1,)))
    if not parts:
        return ""
    said = (
        "<p>Errors are estimated bounds of the numerical error alone; the model's own assumptions are not in them.</p>"
    )
    return section("Error budget", said, *parts)


def _since(over_time: Mapping[str, Any]) -> str:
    """From when on errors over time hold; a sink's summary doesn't say, for it is always the same."""
    start = over_time.get("accurate_from_s", 1e-5)
    again = ", and that long after each jump of a given temperature" if over_time.get("jumps") else ""
    return f"from {quantity(start, 's', 2)} on{again}" if start else "at every time"


def energy(document: Document) -> str:
    """How well what enters is balanced by what leaves and is stored."""
    fem3d = document.get("fem3d") or {}
    steady = steady_of(document, "fem3d")
    found: dict[str, str] = {}
    for key in ("power_W", "heat_out_W"):
        if key in steady:
            label, unit = named(key)
            found[label] = value_with_error(steady[key], unit)
    if fem3d.get("energy_imbalance") is not None:
        found["imbalance of the steady state, of the power"] = text(f"{fem3d['energy_imbalance']:.1e}")
    over_time = (fem3d.get("transient") or {}).get("imbalance")
    if over_time is not None:
        found["largest imbalance over time, of the heat supplied until then"] = text(f"{over_time:.1e}")
    rows = "".join(f"<dt>{text(name)}</dt><dd>{value}</dd>" for name, value in found.items())
    return section("Energy balance", f"<dl>{rows}</dl>" if rows else "")


def mesh(document: Document) -> str:
    """Statistics of the mesh that the 3D answer is from."""
    fem3d = document.get("fem3d") or {}
    found = {"part solved": fem3d.get("symmetry"), "unknowns": fem3d.get("dofs"), "time steps": fem3d.get("steps")}
    if fem3d.get("field_error"):
        found["error of the steady field at its worst place, of its largest rise"] = f"{fem3d['field_error']:.2g}"
    found = {key: value for key, value in found.items() if value is not None}
    return section("Mesh", values({**found, **(fem3d.get("mesh") or {})}) if found or fem3d.get("mesh") else "")


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
