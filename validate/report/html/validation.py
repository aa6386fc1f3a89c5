"""The section of the validation against data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from validate.report.html.parts import Document, section, shown, table, text

_PARTS = ("E", "u_num", "u_input", "u_data", "u_val")


def validation(document: Document) -> str:
    """E and its uncertainties where each model is worst and at the end, and what follows for the model's error."""
    found = document.get("validation")
    if not isinstance(found, Mapping):
        return ""
    rows = [_row(statement) for statement in found["statements"]]
    note = (
        "<p>As ASME V&amp;V 20 has it: the comparison error E = S - D, simulation less data, is known to u_val, "
        "u_val<sup>2</sup> = u_num<sup>2</sup> + u_input<sup>2</sup> + u_D<sup>2</sup>, of the numerics, of the inputs "
        "and of the data. The error of the model itself lies within E &minus; 2 u_val and E + 2 u_val (95 %); where "
        "|E| is below u_val, no more can be said than that it is about as small.</p>"
    )
    points = "; ".join(
        f"{p['model']} {p['quantity']}: {p['within_2_u_val']} of {p['points']}" for p in found["points"]
    )  # fmt: skip
    heads = ("quantity", "model", "where", "at", "E", "u_num", "u_input", "u_D", "u_val", "error of the model")
    listed = f'<div class="wide">{table(heads, rows, range(3, 9))}</div>'
    return section("Validation", note, listed, f"<p>Points of the data within 2 u_val: {text(points)}.</p>")


def _row(s: Mapping[str, Any]) -> list[str]:
    unit = str(s["quantity"]).rpartition("_")[2]
    return [
        text(s["quantity"]), text(s["model"]), text(s["where"]), shown(s["time_s"], "s"),
        *(shown(s[part], unit) for part in _PARTS), text(s["said"]),
    ]  # fmt: skip
