"""What follows of a comparison with data, in the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from compare.against import QUANTITIES
from compare.inputs.validation import COVERS
from scenes.formats import quantity, signed
from validate.report.table import Style, columns_text, wrapped

if TYPE_CHECKING:
    from compare.inputs.validation import Validation

NOTHING = 1e-6
_NAMES = {key: name for name, key in QUANTITIES.items()}


def validation_text(found: Validation, style: Style) -> str:
    """A line for each model and quantity where it is worst and at the end: E, its parts, and the model's error."""
    rows = [["S - D", "at", "E", "u_num", "u_input", "u_D", "u_val", "error of the model"]]
    for s in found.statements:
        unit = s.quantity.rpartition("_")[2]
        parts = [_known(u, s.u_val, unit) for u in (s.u_num, s.u_input, s.u_data, s.u_val)]
        rows.append([
            f"{_NAMES[s.quantity]} {s.model}", quantity(s.time, "s", 3), signed(s.E, unit, 2), *parts,
            s.said() if s.seen else "not seen: |E| < u_val",
        ])  # fmt: skip
    points = [
        f"{_NAMES[c.quantity]} {c.model} {int((np.abs(c.error) <= COVERS * c.u_val).sum())} of {len(c.times)}"
        for c in found.courses
    ]
    lines = [*columns_text(rows, 1, style), wrapped(f"Points of the data within 2 u_val: {', '.join(points)}.")]
    exact = " and ".join(["the inputs"] * (not found.inputs) + ["the data"] * (not found.data))
    return "\n".join([*lines, *([wrapped(f"Taken as exact: {exact}.")] if exact else [])])


def _known(u: float, u_val: float, unit: str) -> str:
    """An uncertainty; none where nobody could see it beside the whole."""
    if not np.isfinite(u):
        return "?"
    return quantity(u, unit, 2) if u > NOTHING * u_val else "0"
