"""The line probe: a line through the structure, what the fields are on it, and their plot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyvista as pv

from validate.report.figures import LINES
from validate.viewer.source import Source
from validate.viewer.state import QUANTITIES, View

POINTS = 401


@dataclass(frozen=True)
class Line:
    """Points (n, 3) in m along an axis (0, 1, 2 for x, y, z)."""

    points: np.ndarray
    axis: int


def through(source: Source, bounds: np.ndarray) -> Line:
    """The line through the middle of the structure along its longest side; of a sink, through the beam's own middle.

    ``bounds`` (3, 2) in m.
    """
    sides = np.ptp(bounds, axis=1)
    axis = int(np.argmax(sides))
    points = np.tile(bounds.mean(axis=1), (POINTS, 1))
    if source.reduction is not None:
        points[:, 2] = source.reduction.sink.thickness / 2
    points[:, axis] = bounds[axis, 0] + np.linspace(1e-6, 1 - 1e-6, POINTS) * sides[axis]
    return Line(points, axis)


def sampled(source: Source, line: Line, view: View) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Places along the line (um) inside the solid, and the values there by model."""
    found = pv.PolyData(line.points).sample(source.grid(view.step))
    inside = np.asarray(found["vtkValidPointMask"], dtype=bool)
    values = np.asarray(found[view.quantity])[inside]
    curves = {"3D": np.linalg.norm(values, axis=1) if values.ndim > 1 else values}
    if view.quantity == "rise" and source.reduction is not None:
        curves["1D"] = source.reduction.rise(line.points[inside], source.times[view.step])
    return line.points[inside, line.axis] * 1e6, curves


def plot(source: Source, line: Line, view: View) -> Any:
    """The curves as a chart."""
    label, unit = QUANTITIES[view.quantity]
    where, curves = sampled(source, line, view)
    chart = pv.Chart2D(
        size=(0.96, 0.96), loc=(0.02, 0.02), x_label=f"{'xyz'[line.axis]} (um)", y_label=f"{label} ({unit})"
    )
    styles = {"3D": ("-", LINES["peak_K"]), "1D": ("--", LINES["end_K"])}
    for model, values in curves.items():
        good = np.isfinite(values)
        style, colour = styles[model]
        chart.line(where[good], values[good], color=colour, width=2.0, style=style, label=model)
    chart.legend_visible = len(curves) > 1
    return chart
