"""The figures of a sweep: lines over one key, a map over two, pairs and shares over more."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator
from matplotlib.tri import LinearTriInterpolator, Triangulation

from scenes.formats import percent, scale
from validate.report.figures import INK
from validate.report.figures.drawing import new_figure
from validate.sweep.table import COLOURS, TITLES, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw(table: Table) -> dict[str, Figure]:
    """The figures that a sweep of so many keys has, by their names."""
    scope = table.job.scope
    if not table.ok.any():
        return {}
    if table.cells is not None:
        return {"figure_map": _map(table, scope.reductions[0])}
    if len(table.keys) == 1 or any(values.dtype == object for values in table.keys.values()):
        return {"figure_lines": _lines(table)}
    if len(table.keys) == 2 and table.relative:
        known = [name for name in scope.reductions if scope.check in table.series(name)]
        ends = {name: "" if name == scope.reductions[0] else "_" + name.replace(":", "") for name in known}
        return {f"figure_map{ends[name]}": _map(table, name) for name in known}
    return {"figure_pairs": _pairs(table)} | _shares(table)


def _lines(table: Table) -> Figure:
    """A panel for every check's difference (or every probe) over the first key that is a number; a line for each
    combination of the others and each reduction, with its error; grey is within the tolerance."""
    panels = list(table.series())
    key = next((k for k, v in table.keys.items() if v.dtype != object), next(iter(table.keys)))
    across = min(len(panels), 3)
    down = math.ceil(len(panels) / across)
    said = "differences from 3D, by check" if table.relative else "probes"
    title = f"{table.job.base.name}: {said}"
    figure = new_figure(3.7 * across + 0.6, 2.5 * down + 0.9, title, [], bottom=0.85, left=0.75)
    x, label = _axis(table, key)
    others = {name: values for name, values in table.keys.items() if name != key}
    groups: dict[tuple[str, ...], list[int]] = {}
    for n in np.argsort(x, kind="stable"):
        groups.setdefault(tuple(str(values[n]) for values in others.values()), []).append(int(n))
    names = table.job.scope.reductions if table.relative else ("",)
    lines = [(group, name) for group in groups for name in names]
    for number, panel in enumerate(panels, 1):
        ax = figure.add_subplot(down, across, number)
        for n, (group, name) in enumerate(lines):
            if panel in table.series(name):
                values, errors = table.series(name)[panel]
                at, factor = groups[group], 100.0 if table.relative else 1.0
                _line(ax, x[at], factor * values[at], factor * errors[at], COLOURS[n % len(COLOURS)])
        if panel in table.tolerances:
            most = 100 * table.tolerances[panel]
            ax.axhspan(-most, most, color="#e8e8e8", zorder=0)
        lost = ~table.ok
        ax.plot(x[lost], np.full(lost.sum(), 0.03), "x", color=INK, transform=ax.get_xaxis_transform(), ms=5)
        ax.set_title(panel, fontsize=10)
        _scale(ax, table, key, "x")
        if number > len(panels) - across:
            ax.set_xlabel(label)
        if (number - 1) % across == 0:
            ax.set_ylabel("1D/3D - 1 (%)" if table.relative else "SI units")
    figure.subplots_adjust(wspace=0.32, hspace=0.5)
    labels = [", ".join(filter(None, (*group, name if len(names) > 1 else ""))) for group, name in lines]
    handles = [Line2D([], [], color=COLOURS[i % len(COLOURS)], label=name) for i, name in enumerate(labels) if name]
    if 1 < len(handles) <= len(COLOURS):
        figure.legend(handles=handles, loc="lower right", ncols=min(len(handles), 6), fontsize=9)
    return figure


def _line(ax: Axes, x: np.ndarray, y: np.ndarray, band: np.ndarray, colour: str) -> None:
    """One line with its error band."""
    ax.plot(x, y, color=colour, marker="o" if len(x) <= 40 else "", ms=3)
    ax.fill_between(x, y - band, y + band, color=colour, alpha=0.3, lw=0)


def _map(table: Table, reduction: str) -> Figure:
    """|1D/3D - 1| over two keys, the tolerance as a bold line, the points that were solved as dots and those without an
    answer as crosses; beside it the assumption to blame where the tolerance is exceeded."""
    check, ok, cells = table.job.scope.check, table.ok, table.cells
    tolerance = table.tolerances[check]
    (x, label_x), (y, label_y) = (_axis(table, key) for key in table.keys)
    if cells is None:
        across, up, size = x, y, np.abs(table.series(reduction)[check][0])
        own = reduction == table.job.scope.reductions[0]
        words = table.columns["blame"] if own else np.full(len(table), "", object)
    else:
        design = table.job.design
        grid = np.array([design.point(n) for n in range(design.count)], float)
        across, up = (grid[:, i] * _factor(table, key) for i, key in enumerate(table.keys))
        size, words = np.abs(cells.surface.value.ravel()), cells.blames.ravel()
    known = np.isfinite(size)
    net = Triangulation(across, up)
    net.set_mask(~known[net.triangles].all(axis=1))
    percents, most = np.where(known, 100 * size, 0.0), float(100 * size[known].max())
    names = sorted({str(word) for word, s in zip(words, size, strict=True) if word and s > tolerance})
    model = "the paper" if reduction == "paper" else reduction
    title = f"{table.job.base.name}: |1D/3D - 1| of {TITLES.get(check, check)}, {model}"
    figure = new_figure(10.4 if names else 6.0, 4.7, title, [], bottom=0.95)
    axes = figure.subplots(1, 1 + bool(names), squeeze=False)[0]
    levels = MaxNLocator(10).tick_values(0.0, most or 1.0)
    filled = axes[0].tricontourf(net, percents, levels=levels, cmap="viridis")
    figure.colorbar(filled, ax=axes[0], format="%g", pad=0.02).set_label("|1D/3D - 1| (%)")
    if names:
        _blamed(axes[1], net, percents, [names.index(w) if w in names else 0 for w in words], 100 * tolerance)
        figure.legend(
            handles=[Patch(color=COLOURS[i], label=n) for i, n in enumerate(names)], loc="lower right", ncols=4
        )
        axes[1].set_title("to blame beyond the tolerance", fontsize=10)
    crossed = percents[known].min() < 100 * tolerance < most
    for ax in axes:
        if crossed:
            ax.tricontour(net, percents, levels=[100 * tolerance], colors=[INK], linewidths=2.4)
        ax.plot(x[~ok], y[~ok], "x", color="#d55e00", ms=5, clip_on=False)
        ax.set(xlabel=label_x, ylabel=label_y, xlim=(across.min(), across.max()), ylim=(up.min(), up.max()))
        for key, side in zip(table.keys, "xy", strict=True):
            _scale(ax, table, key, side)
        ax.grid(False)
    axes[0].plot(x[ok], y[ok], "o", color="white", ms=2.2, mec=INK, mew=0.4, clip_on=False)
    notes = [
        f"bold: {100 * tolerance:g} %" if crossed else f"the line of {100 * tolerance:g} % is not in the range",
        "dots: solved",
    ] + ([] if ok.all() else ["crosses: no answer"])
    figure.text(0.012, 0.02, "; ".join(notes), fontsize=9, color=INK)
    figure.subplots_adjust(wspace=0.24)
    return figure


def _blamed(ax: Axes, net: Triangulation, percents: np.ndarray, words: list[int], tolerance: float) -> None:
    """The word of the nearest point as a colour where the tolerance is exceeded."""
    from scipy.interpolate import NearestNDInterpolator

    sides = [np.linspace(side.min(), side.max(), 300) for side in (net.x, net.y)]
    places = np.stack(np.meshgrid(*sides), axis=-1)
    spans = np.array([np.ptp(net.x) or 1.0, np.ptp(net.y) or 1.0])
    nearest = NearestNDInterpolator(np.column_stack([net.x, net.y]) / spans, words)(places / spans)
    size = LinearTriInterpolator(net, percents)(places[..., 0], places[..., 1]).filled(0.0)
    shown = np.where(size > tolerance, nearest, np.nan)
    ax.pcolormesh(*sides, shown, cmap=ListedColormap(COLOURS), vmin=-0.5, vmax=len(COLOURS) - 0.5, rasterized=True)


def _pairs(table: Table) -> Figure:
    """Every pair of keys, each point coloured by the size of its difference; those beyond the tolerance on top."""
    keys, ok = list(table.keys), table.ok
    name, (values, _) = next(iter(table.series().items()))
    size = 100 * np.abs(values) if table.relative else values
    order = [n for n in np.argsort(np.where(np.isfinite(size), size, -1.0)) if ok[n]]
    n = len(keys) - 1
    side = 2.6
    figure = new_figure(
        side * n + 1.6, side * n + 0.9, f"{table.job.base.name}: every pair of keys", [], bottom=0.6, left=0.8
    )
    figure.subplots_adjust(right=1 - 1.25 / (side * n + 1.6))
    shades: Any = None
    for i in range(n):
        for j in range(i, n):
            ax = figure.add_subplot(n, n, 1 + j * n + i)
            (x, label_x), (y, label_y) = _axis(table, keys[i]), _axis(table, keys[j + 1])
            shades = ax.scatter(x[order], y[order], c=size[order], s=12, cmap="viridis")
            ax.plot(x[~ok], y[~ok], "x", color="#d55e00", ms=5)
            _scale(ax, table, keys[i], "x")
            _scale(ax, table, keys[j + 1], "y")
            if j == n - 1:
                ax.set_xlabel(label_x)
            if i == 0:
                ax.set_ylabel(label_y)
    width = side * n + 1.6
    bar = figure.colorbar(shades, cax=figure.add_axes((1 - 0.95 / width, 0.3, 0.16 / width, 0.4)))
    bar.set_label(f"|1D/3D - 1| of {name} (%)" if table.relative else name)
    if name in table.tolerances:
        bar.ax.axhline(100 * table.tolerances[name], color=INK, lw=2.4)
    return figure


def _shares(table: Table) -> dict[str, Figure]:
    """How much of the variance each key explains, alone and with all others."""
    from validate.sweep.indices import indices

    found = indices(table)
    if found is None:
        return {}
    figure = new_figure(
        6.4, 0.75 * len(found.keys) + 1.7, f"{table.job.base.name}: how much each key explains", [], left=2.2
    )
    ax = figure.add_subplot()
    at = np.arange(len(found.keys))
    for values, errors, shift, colour, name in (
        (found.first, found.first_error, -0.18, COLOURS[0], "alone (first order)"),
        (found.total, found.total_error, 0.18, COLOURS[1], "with the others (total)"),
    ):
        ax.barh(at + shift, values, 0.34, xerr=errors, color=colour, label=name, error_kw={"lw": 1.0, "capsize": 2})
    ax.set(
        yticks=at,
        yticklabels=found.keys,
        xlabel=f"Sobol' index; the surface explains {percent(found.explained, 3)} of the variance",
    )
    ax.invert_yaxis()
    ax.legend(fontsize=9)
    return {"figure_indices": figure}


def _factor(table: Table, key: str) -> float:
    """From SI to the unit that suits a key's values."""
    return scale(float(np.abs(table.keys[key]).max()), table.units[key])[0]


def _axis(table: Table, key: str) -> tuple[np.ndarray, str]:
    """A key's values in the unit that suits them, and its label; words by their number."""
    values = table.keys[key]
    if values.dtype == object:
        words = [str(word) for word in next(axis for axis in table.job.design.axes if axis.key == key).values]
        return np.array([words.index(str(value)) for value in values], float), key
    unit = scale(float(np.abs(values).max()), table.units[key])[1]
    return values * _factor(table, key), f"{key} ({unit})" if unit else key


def _scale(ax: Axes, table: Table, key: str, side: str) -> None:
    """A logarithmic axis where the key is so spaced; words where it has words."""
    axis = next(a for a in table.job.design.axes if a.key == key)
    own = ax.xaxis if side == "x" else ax.yaxis
    if axis.log:
        (ax.set_xscale if side == "x" else ax.set_yscale)("log")
        own.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        own.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        own.set_minor_formatter(FuncFormatter(lambda value, _: ""))
    elif table.job.base.counts(key):
        own.set_major_locator(MaxNLocator(integer=True))
    elif not axis.numeric:
        own.set_ticks(range(len(axis.values)), [str(value) for value in axis.values])
