"""The figures of a sweep: lines over one key, a map over two, points over each of more."""

from __future__ import annotations

import math
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator
from matplotlib.tri import Triangulation

from scenes.formats import scale
from scenes.model import UNITS
from validate.report.figures import INK, PARTS, with_mu
from validate.report.figures.drawing import logarithmic, new_figure
from validate.sweep.design import unit
from validate.sweep.table import TITLES, Table


def draw(table: Table) -> dict[str, Figure]:
    """Return the figures that a sweep of so many keys has, by their names."""
    series, words = table.series(), any(values.dtype == object for values in table.keys.values())
    if not table.ok.any() or not series:
        return {}
    mapped = len(table.keys) == 2 and not words and table.relative and table.job.scope.check in series
    figure = _map(table) if mapped else None
    return {"figure_lines": _lines(table)} if figure is None else {"figure_map": figure}


def _lines(table: Table) -> Figure:
    """The differences of checks, or the probes, with their errors; grey is within the tolerance.

    Over one key there is a panel for every check (or probe), with a line for each reduction; over several keys there is
    a panel for every key, with the points of the sweep's own check.
    """
    scope, series, keys = table.job.scope, table.series(), list(table.keys)
    one = len(keys) == 1
    panels = [(check, keys[0]) for check in series] if one else [(next(iter(series)), key) for key in keys]
    across = min(len(panels), 3)
    down = math.ceil(len(panels) / across)
    title = f"{scope.scene.name}: {'differences from 3D, by check' if table.relative else 'each probe'}"
    figure = new_figure(3.7 * across + 0.85, 2.9 * down + 0.9, title, [], bottom=0.85, left=1.0)
    for number, (check, key) in enumerate(panels, 1):
        x, ax = _shown(table, key, table.keys[key]), figure.add_subplot(down, across, number)
        probe = next((probe for probe in getattr(scope.scene, "probes", ()) if probe.name == check), None)
        largest = float(np.nanmax(np.abs(series[check][0]), initial=0.0))
        factor, called = (100.0, "%") if table.relative or probe is None else scale(largest, UNITS[probe.quantity])
        order = np.argsort(x, kind="stable")
        for name, colour in zip(scope.reductions, cycle(PARTS)):
            if check in (found := table.series(name)):
                values, errors = (factor * each[order] for each in found[check])
                ax.errorbar(x[order], values, errors, color=colour, fmt="o-" if one else "o", ms=3, label=name)
        if table.relative:
            most = 100 * scope.scene.tolerance(check)
            ax.axhspan(-most, most, color="#e8e8e8", zorder=0)
        unanswered = x[~table.ok]
        ax.plot(unanswered, np.full(len(unanswered), 0.03), "x", color=INK, transform=ax.get_xaxis_transform(), ms=5)
        ax.set_title(check, fontsize=10)
        _axis(ax, "x", table, key)
        ax.set_ylabel("1D/3D - 1 (%)" if table.relative else with_mu(called))
    figure.subplots_adjust(wspace=0.32, hspace=0.75)
    if len(scope.reductions) > 1:
        figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="lower right", ncols=6, fontsize=9)
    return figure


def _map(table: Table) -> Figure | None:
    """|1D/3D - 1| over two keys: the tolerance is a bold line, solved points are dots, points without an answer are
    crosses; beside it the assumption to blame beyond the tolerance. None where no three neighbours have an answer."""
    scope, ok, rows = table.job.scope, table.ok, table.map or table.columns
    tolerance = 100 * scope.scene.tolerance(scope.check)
    x, y = (_shown(table, key, values) for key, values in table.keys.items())
    across, up = (_shown(table, key, table.map.get(key, values)) for key, values in table.keys.items())
    size = 100 * np.abs(rows["difference"] if table.map else table.series()[scope.check][0])
    known, most = np.isfinite(size), float(np.nanmax(size))
    if len(size) < 3 or not (np.ptp(across) and np.ptp(up)):
        return None
    net = Triangulation(across, up)
    inside = known[net.triangles].all(axis=1)
    if not inside.any():
        return None
    net.set_mask(~inside)
    words = np.where(known & (size > tolerance), rows["blame"], "")
    names = sorted({*words} - {""})
    several = len(names) > 1  # one assumption alone needs a word, not a panel of one colour
    percents = np.where(known, size, 0.0)
    title = f"{scope.scene.name}: |1D/3D - 1| of {TITLES.get(scope.check, scope.check)}, {scope.reductions[0]}"
    figure = new_figure(10.4 if several else 6.0, 4.7, title, [], bottom=0.95)
    axes = figure.subplots(1, 1 + several, squeeze=False)[0]
    levels = MaxNLocator(10).tick_values(0.0, most or 1.0)
    filled = axes[0].tricontourf(net, percents, levels=levels, cmap="viridis")
    figure.colorbar(filled, ax=axes[0], format="%g", pad=0.02).set_label("|1D/3D - 1| (%)")
    if several:
        for name, colour in zip(names, PARTS, strict=False):
            at = words == name
            axes[1].plot(across[at], up[at], "s", color=colour, label=name, ms=2.5 if table.map else 6, clip_on=False)
        figure.legend(loc="lower right", ncols=4, markerscale=1.5)
        axes[1].set_title("to blame beyond the tolerance", fontsize=10)
    crossed = percents[known].min() < tolerance < most
    for ax in axes:
        if crossed:
            ax.tricontour(net, percents, levels=[tolerance], colors=[INK], linewidths=2.4)
        ax.plot(x[~ok], y[~ok], "x", color="#d55e00", ms=5, clip_on=False)
        ax.set(xlim=(across.min(), across.max()), ylim=(up.min(), up.max()))
        for key, side in zip(table.keys, "xy", strict=True):
            _axis(ax, side, table, key)
        ax.grid(False)
    axes[0].plot(x[ok], y[ok], "o", color="white", ms=2.2, mec=INK, mew=0.4, clip_on=False)
    notes = {
        f"bold: {tolerance:g} %": crossed, f"the line of {tolerance:g} % is not in the range": not crossed,
        f"where it is exceeded: {''.join(names[:1])}": len(names) == 1, "dots: solved": True,
        "crosses: no answer": not ok.all(),
    }  # fmt: skip
    figure.text(0.012, 0.02, "; ".join(note for note, holds in notes.items() if holds), fontsize=9, color=INK)
    figure.subplots_adjust(wspace=0.24)
    return figure


def _scale(table: Table, key: str) -> tuple[float, str]:
    """The factor from SI to the unit that suits the values of a key, and that unit."""
    return scale(float(np.abs(table.keys[key]).max()), unit(table.job.scope.scene, key))


def _shown(table: Table, key: str, values: np.ndarray) -> np.ndarray:
    """Values of a key in the unit that suits them, or words."""
    return values.astype(str) if values.dtype == object else values * _scale(table, key)[0]


def _axis(ax: Axes, side: str, table: Table, key: str) -> None:
    """An axis over a key, logarithmic where the key is so spaced."""
    called = "" if table.keys[key].dtype == object else _scale(table, key)[1]
    label = with_mu(f"{key} ({called})" if called else key)
    ax.set(**{f"{side}label": label if len(label) <= 30 else ".\n".join(label.rsplit(".", 1))})
    if any(axis.log for axis in table.job.design.axes if axis.key == key):
        logarithmic(ax, side)
        getattr(ax, f"{side}axis").set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
