"""Work-precision plots: time over error, both logarithmic, one line a tool; reductions are points with names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validate.bench.entries import FREEFEM, GIVEN, NGSOLVE, REDUCTION, SCIKIT_FEM, WHOLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOOKS = {
    WHOLE: ("#8b1a1a", "o"), GIVEN: ("#d1495b", "P"), NGSOLVE: ("#3a86c8", "s"), FREEFEM: ("#5e3c99", "^"),
    SCIKIT_FEM: ("#f0a030", "D"), REDUCTION: ("#222222", "*"),
}  # fmt: skip
LINE, WIDE = 10.0, 75.0  # points of the page: from one name to the next, and a name's width
TITLES = {"transient": "The sink's whole transient", "steady": "The sink's steady state"}


def draw(part: str, found: Mapping[str, Any], path: Path) -> None:
    """One plot as PNG; entries that failed are left out, and a line joins those of a tool that are the fastest at their
    error. Reductions are different models, so no line joins them, and each has its name."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from validate.report.figures import drawing

    with drawing.style():
        figure = drawing.new_figure(7.2, 4.6, f"{TITLES[part]}: time against error", ())
        axes = figure.add_subplot()
        for tool, (colour, marker) in LOOKS.items():
            rows = [row for row in found["rows"] if row["tool"] == tool and not row["failure"]]
            points = [(row["error"], row["median_s"]) for row in rows]
            if not points:
                continue
            axes.plot(*zip(*points, strict=True), linestyle="none", marker=marker, color=colour, label=tool)
            if tool != REDUCTION:
                axes.plot(*zip(*fastest(points), strict=True), color=colour, linewidth=1.2)
        doubt = found["reference"]["uncertainty"]
        if doubt is not None:
            axes.axvspan(axes.get_xlim()[0], doubt, color="#dddddd", label="the reference's uncertainty")
        axes.set(xscale="log", yscale="log", xlabel="error, relative", ylabel="processor time, s (start-up apart)")
        axes.set_xlim(0.1 * min(r["error"] for r in found["rows"] if not r["failure"]), 1.0)
        axes.invert_xaxis()
        axes.legend(fontsize=9)
        FigureCanvasAgg(figure)
        _name(axes, [row for row in found["rows"] if row["tool"] == REDUCTION and not row["failure"]])
        figure.savefig(path, dpi=drawing.DPI)


def _name(axes: Axes, rows: Sequence[Mapping[str, Any]]) -> None:
    """Each row's label beside its point, with a thin line to it where names had to make room for each other."""
    axes.figure.draw_without_rendering()  # type: ignore[union-attr]
    colour = LOOKS[REDUCTION][0]
    points = axes.transData.transform([(row["error"], row["median_s"]) for row in rows]) * 72 / axes.figure.dpi
    for row, down in zip(rows, apart(points.tolist()), strict=True):
        axes.annotate(
            row["label"], (row["error"], row["median_s"]), (12.0, -down), textcoords="offset points", fontsize=8,
            color=colour, va="center", arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4},
            bbox={"facecolor": "white", "alpha": 0.6, "edgecolor": "none", "pad": 0.3},
        )  # fmt: skip


def apart(points: Sequence[Sequence[float]]) -> list[float]:
    """How far below its point each name stands (points of a page, as the ``points``), so that names near each other
    are a LINE apart."""
    found = [0.0] * len(points)
    taken: list[tuple[float, float]] = []
    for i in sorted(range(len(points)), key=lambda i: -points[i][1]):
        x, y = points[i]
        at = min([y, *(other - LINE for beside, other in taken if abs(beside - x) < WIDE and other - LINE < y)])
        taken.append((x, at))
        found[i] = y - at
    return found


def fastest(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points (error, time) that no other beats in both, by falling error."""
    kept = [p for p in points if not any(q != p and q[0] <= p[0] and q[1] <= p[1] for q in points)]
    return sorted(kept, reverse=True)
