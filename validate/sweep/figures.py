"""The figures of a sweep: lines over one key, a map over two, points over each of more."""

from __future__ import annotations

import math
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.tri import Triangulation

from compare.report.checks import with_mu
from scenes.formats import scale
from scenes.model import UNITS
from validate.report.figures import INK, PARTS
from validate.report.figures.drawing import band, logarithmic, new_figure
from validate.sweep.table import TITLES, Table

_LOST: dict[str, Any] = {"marker": "x", "ls": "", "color": "#d55e00", "ms": 5, "clip_on": False}
BROAD = 30  # Characters of a line of an axis's label: the smallest panel's side.


def draw(table: Table) -> dict[str, Figure]:
    """The figures that a sweep of so many keys has, by their names."""
    scope, numeric = table.job.scope, all(values.dtype != object for values in table.keys.values())
    if not table.ok.any():
        return {}
    if table.map:
        return {"figure_map": _map(table, scope.reductions[0])}
    if len(table.keys) == 2 and table.relative and numeric:
        known = [name for name in scope.reductions if scope.check in table.series(name)]
        ends = {name: "" if name == scope.reductions[0] else "_" + name.replace(":", "") for name in known}
        return {f"figure_map{ends[name]}": _map(table, name) for name in known}
    return {"figure_lines": _lines(table, len(table.keys) > 1 and numeric)}


def _lines(table: Table, of_keys: bool) -> Figure:
    """The differences of checks, or the probes, over keys, with their errors; grey is within the tolerance.

    A panel for every check (or probe) over the first key that is a number, with a line for each combination of the
    others and each reduction; or ``of_keys`` a panel for every key with the points of the sweep's own check.
    """
    key = next((k for k, v in table.keys.items() if v.dtype != object), next(iter(table.keys)))
    names = table.job.scope.reductions if table.relative else ("",)
    panels = [(check, key) for check in table.series()]
    if of_keys:
        panels = [(panels[0][0], each) for each in table.keys]
    across = min(len(panels), 3)
    down = math.ceil(len(panels) / across)
    title = f"{table.job.base.name}: {'differences from 3D, by check' if table.relative else 'each probe'}"
    figure = new_figure(3.7 * across + 0.6, (2.9 if of_keys else 2.5) * down + 0.9, title, [], bottom=0.85, left=0.75)
    others = [values for name, values in table.keys.items() if name != key]
    groups: dict[tuple[str, ...], list[int]] = {}
    for n in np.argsort(_shown(table, key, table.keys[key]), kind="stable").tolist():
        groups.setdefault(() if of_keys else tuple(str(values[n]) for values in others), []).append(n)
    lines = [(group, name) for group in groups for name in names]
    for number, (panel, key) in enumerate(panels, 1):
        x, ax = _shown(table, key, table.keys[key]), figure.add_subplot(down, across, number)
        factor, unit = (100.0, "%") if table.relative else _of_probe(table, panel)
        for (group, name), colour in zip(lines, cycle(PARTS)):
            if panel in table.series(name):
                at = groups[group]
                values, errors = (factor * given[at] for given in table.series(name)[panel])
                if of_keys:
                    ax.errorbar(x[at], values, errors, color=colour, fmt="o", ms=3, lw=0.8)
                else:
                    ax.plot(x[at], values, color=colour, marker="o" if len(at) <= 40 else "", ms=3)
                    band(ax, x[at], values, errors, colour)
        if panel in table.tolerances:
            most = 100 * table.tolerances[panel]
            ax.axhspan(-most, most, color="#e8e8e8", zorder=0)
        unanswered = x[~table.ok]
        ax.plot(unanswered, np.full(len(unanswered), 0.03), "x", color=INK, transform=ax.get_xaxis_transform(), ms=5)
        ax.set_title(panel, fontsize=10)
        _axis(ax, "x", table, key, labelled=of_keys or number > len(panels) - across)
        if not table.relative:
            ax.set_ylabel(with_mu(unit))
        elif (number - 1) % across == 0:
            ax.set_ylabel("1D/3D - 1 (%)")
    figure.subplots_adjust(wspace=0.32, hspace=0.75 if of_keys else 0.5)
    labels = [", ".join(filter(None, (*group, name if len(names) > 1 else ""))) for group, name in lines]
    handles = [Line2D([], [], color=c, label=label) for label, c in zip(labels, cycle(PARTS)) if label]
    if 1 < len(handles) <= len(PARTS):
        figure.legend(handles=handles, loc="lower right", ncols=min(len(handles), 6), fontsize=9)
    return figure


def _of_probe(table: Table, name: str) -> tuple[float, str]:
    """The factor from SI to the unit that suits a probe's values, and that unit."""
    scene: Any = table.job.base.at(())
    unit = next((UNITS[probe.quantity] for probe in scene.probes if probe.name == name), "")
    values = np.abs(table.series()[name][0])
    return scale(float(values[np.isfinite(values)].max(initial=0.0)), unit)


def _map(table: Table, reduction: str) -> Figure:
    """|1D/3D - 1| over two keys: the tolerance is a bold line, solved points are dots, points without an answer are
    crosses; beside it the assumption to blame beyond the tolerance."""
    check, ok = table.job.scope.check, table.ok
    tolerance = table.tolerances[check]
    x, y = (_shown(table, key, values) for key, values in table.keys.items())
    if table.map:
        across, up = (_shown(table, key, table.map[key]) for key in table.keys)
        assert table.cells is not None
        size, words = np.abs(table.cells.value).ravel(), table.map["blame"]
    else:
        across, up, size = x, y, np.abs(table.series(reduction)[check][0])
        is_first = reduction == table.job.scope.reductions[0]
        words = table.columns["blame"] if is_first else np.full(len(table), "", object)
    known = np.isfinite(size)
    net = Triangulation(across, up)
    net.set_mask(~known[net.triangles].all(axis=1))
    percents, most = np.where(known, 100 * size, 0.0), float(100 * size[known].max())
    names = sorted({str(word) for word, s in zip(words, size, strict=True) if word and s > tolerance})
    model = "the paper" if reduction == "paper" else reduction
    title = f"{table.job.base.name}: |1D/3D - 1| of {TITLES.get(check, check)}, {model}"
    several = len(names) > 1  # one assumption alone needs a word, not a panel of one colour
    figure = new_figure(10.4 if several else 6.0, 4.7, title, [], bottom=0.95)
    axes = figure.subplots(1, 1 + several, squeeze=False)[0]
    levels = MaxNLocator(10).tick_values(0.0, most or 1.0)
    filled = axes[0].tricontourf(net, percents, levels=levels, cmap="viridis")
    figure.colorbar(filled, ax=axes[0], format="%g", pad=0.02).set_label("|1D/3D - 1| (%)")
    if several:
        for name, colour in zip(names, PARTS, strict=False):
            there = (words == name) & (size > tolerance)
            axes[1].plot(
                across[there], up[there], "s", color=colour, label=name, ms=2.5 if table.map else 6, clip_on=False
            )
        figure.legend(loc="lower right", ncols=4, markerscale=1.5)
        axes[1].set_title("to blame beyond the tolerance", fontsize=10)
    excess = (
        table.cells.excess.ravel() if table.cells else table.columns.get("past_valid_to_K", np.full(len(table), np.nan))
    )
    molten = bool((excess > 0).any())
    crossed = percents[known].min() < 100 * tolerance < most
    for ax in axes:
        if crossed:
            ax.tricontour(net, percents, levels=[100 * tolerance], colors=[INK], linewidths=2.4)
        if molten:
            colder = np.where(np.isfinite(excess), excess, -1.0)
            ax.tricontourf(net, colder, levels=[0.0, np.inf], colors="none", hatches=["//"])
        ax.plot(x[~ok], y[~ok], **_LOST)
        ax.set(xlim=(across.min(), across.max()), ylim=(up.min(), up.max()))
        for key, side in zip(table.keys, "xy", strict=True):
            _axis(ax, side, table, key)
        ax.grid(False)
    axes[0].plot(x[ok], y[ok], "o", color="white", ms=2.2, mec=INK, mew=0.4, clip_on=False)
    cause = f" (where it is exceeded: {names[0]})" if len(names) == 1 else ""
    line = f"bold: {100 * tolerance:g} %" if crossed else f"the line of {100 * tolerance:g} % is not in the range"
    notes = [
        line + cause,
        "dots: solved",
        *(["hatched: hotter than a material's valid_to"] if molten else []),
        *([] if ok.all() else ["crosses: no answer"]),
    ]
    figure.text(0.012, 0.02, "; ".join(notes), fontsize=9, color=INK)
    figure.subplots_adjust(wspace=0.24)
    return figure


def _unit(table: Table, key: str) -> tuple[float, str]:
    """The factor from SI to the unit that suits a key's values, and that unit."""
    return scale(float(np.abs(table.keys[key]).max()), table.units[key])


def _shown(table: Table, key: str, values: np.ndarray) -> np.ndarray:
    """Values of a key in the unit that suits them; words by their number."""
    if values.dtype != object:
        return values * _unit(table, key)[0]
    words = [str(word) for word in next(axis for axis in table.job.design.axes if axis.key == key).values]
    return np.array([words.index(str(value)) for value in values], float)


def _axis(ax: Axes, side: str, table: Table, key: str, labelled: bool = True) -> None:
    """An axis over a key, logarithmic where the key is so spaced, with words where it has some."""
    axis = next(axis for axis in table.job.design.axes if axis.key == key)
    plot_axis = ax.xaxis if side == "x" else ax.yaxis
    if labelled:
        unit = _unit(table, key)[1] if table.keys[key].dtype != object else ""
        text = with_mu(f"{key} ({unit})" if unit else key)
        plot_axis.set_label_text(text if len(text) <= BROAD else ".\n".join(text.rsplit(".", 1)))
    if axis.log:
        logarithmic(ax, side)
        plot_axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    elif table.job.base.counts(key):
        plot_axis.set_major_locator(MaxNLocator(integer=True))
    elif table.keys[key].dtype == object:
        plot_axis.set_ticks(range(len(axis.values)), [str(value) for value in axis.values])
