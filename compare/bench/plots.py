"""Work-precision plots: time over error, both logarithmic, one line a tool."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from compare.bench.entries import FREEFEM, NGSOLVE, OURS, PLAIN, REDUCTION

LOOKS = {
    OURS: ("#8b1a1a", "o"), NGSOLVE: ("#3a86c8", "s"), FREEFEM: ("#5e3c99", "^"), PLAIN: ("#f0a030", "D"),
    REDUCTION: ("#222222", "*"),
}  # fmt: skip
TITLES = {"transient": "The sink's whole transient", "steady": "The sink's steady state"}


def draw(part: str, found: Mapping[str, Any], path: Path) -> None:
    """One plot as PNG; entries that failed are left out, and a line joins those of a tool that are the fastest at their
    error."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from compare import drawing

    with drawing.style():
        figure = drawing.new_figure(7.2, 4.6, f"{TITLES[part]}: time against error", ())
        axes = figure.add_subplot()
        for tool, (colour, marker) in LOOKS.items():
            points = [(r["error"], r["median_s"]) for r in found["rows"] if r["tool"] == tool and not r["failure"]]
            if not points:
                continue
            axes.plot(*zip(*points, strict=True), linestyle="none", marker=marker, color=colour, label=tool)
            axes.plot(*zip(*fastest(points), strict=True), color=colour, linewidth=1.2)
        doubt = found["reference"]["uncertainty"]
        if doubt is not None:
            axes.axvspan(axes.get_xlim()[0], doubt, color="#dddddd", label="the reference's uncertainty")
        axes.set(xscale="log", yscale="log", xlabel="error, relative", ylabel="processor time, s (start-up apart)")
        axes.set_xlim(0.3 * min(r["error"] for r in found["rows"] if not r["failure"]), 1.0)
        axes.invert_xaxis()
        axes.legend(fontsize=9)
        FigureCanvasAgg(figure)
        figure.savefig(path, dpi=drawing.DPI)


def fastest(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points (error, time) that no other beats in both, by falling error."""
    kept = [p for p in points if not any(q != p and q[0] <= p[0] and q[1] <= p[1] for q in points)]
    return sorted(kept, reverse=True)
