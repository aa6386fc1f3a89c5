"""Figures of a free scene: probes over time, the differences of a model, and the network of its boxes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from compare.outcome import Outcome
from compare.report.checks import with_mu
from reduced1d.network.lines import Layout, Touch, layout
from scenes import physics
from scenes.formats import cut, quantity, scale
from scenes.model import OVER_TIME, UNITS, AnyScene, Schedule
from scenes.result import Traces
from validate.report.figures import INK, LINES, PARTS
from validate.report.figures.drawing import VISIBLE, band, legend, new_figure, smooth

_COLOURS = ("#8b1a1a", "#3a86c8", "#f0a030", "#5e3c99", "#2a7f62", "#b04f8c", "#707070")
_DASHES = ("-", (0, (5, 2.5)), (0, (1.5, 1.5)))
_TIMES = ((1.0, "s"), (1e3, "ms"), (1e6, "µs"), (1e9, "ns"))
MOST_NAME = 24
"""Characters of a name that there is room for."""
_PANEL = 2.4  # Inches of a panel.
_EARLY = 0.05  # A trace that has half its change within this part of the run is drawn on a logarithmic axis.
_SEEN = 0.01  # A change below this part of a trace's range can't be seen.
_ROW = 0.32
"""Inches of a bar's row."""
_OF = {"in the steady state": LINES["end_K"], "at its worst over time": LINES["mean_K"]}  # Colours of the bars.
_BEYOND = 10.0
"""Bars are cut at this relative difference, as relative to a scale near zero a difference says nothing."""
_NAMES = 30
"""The most lines that are named."""
_UM = 1e6  # Micrometres per metre.
_WIDE, _TALLEST, _SIDE, _BETWEEN = 7.35, 5.0, 1.4, 0.2
"""Inches: width; height of the view from above at most; height of that from the side at least; gap."""
_ROOM = 1.06
"""Extent of the axes over that of the geometry."""


def traces(outcome: Outcome[AnyScene]) -> Figure:
    """Draw every probe from the start on, with a band for its errors, a model's dotted, a user's data as dots.

    The axis of time is logarithmic where a trace has done half of all it does in the first twentieth of the run, and
    nothing that drives the scene changes later.
    """
    scene, traces = outcome.scene, outcome.solved.over_time
    model = outcome.reduced1d
    model_traces = None if model is None else model.traces
    first = _first(scene, traces)
    times = np.geomspace(first, scene.end_time, 400) if first else traces.time
    bounds = {name: traces.error_at(name, times) for name in traces.values}
    panels = [q for q in UNITS if any(probe.quantity == q for probe in scene.probes)]
    height = 1.1 + _PANEL * len(panels)
    figure = new_figure(9.5, height, f"{scene.name}: probes against time", [], left=0.9, bottom=0.8)
    figure.subplots_adjust(right=0.78)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    data, wider = outcome.options.against, list[str]()
    factor, unit = next((f, u) for f, u in _TIMES if scene.end_time * f >= 1 or u == "ns")
    for ax, name in zip(axes, panels, strict=True):
        probes = [probe.name for probe in scene.probes if probe.quantity == name]
        largest = max(float(np.abs(traces.values[probe][traces.sure(traces.time)]).max()) for probe in probes)
        per, shown = scale(largest, UNITS[name])
        for number, probe in enumerate(probes):
            values = traces.values[probe]
            # Rows are few where a straight line over time does, which a logarithmic axis bends.
            course, bound = smooth(traces.time, values, times) if first else values, bounds[probe] * per
            drawn = np.where(np.isfinite(bound), per * course, np.nan)
            colour, dash = _COLOURS[number % len(_COLOURS)], _DASHES[number // len(_COLOURS) % len(_DASHES)]
            ax.plot(times * factor, drawn, color=colour, ls=dash, label=cut(probe, MOST_NAME))
            band(ax, times * factor, drawn, bound, colour)
            if data is not None and probe in data.values:
                label = None if number else cut(data.name, MOST_NAME)
                ax.plot(data.time * factor, data.values[probe] * per, ".", color=colour, ms=5, zorder=1, label=label)
            if model is not None and model_traces is not None and probe in model_traces.values:
                label = None if number else model.model
                ax.plot(
                    model_traces.time * factor,
                    model_traces.values[probe] * per,
                    color=colour,
                    ls=":",
                    lw=2.4,
                    label=label,
                )
        low, high = ax.get_ylim()
        wider += [probe for probe in probes if traces.errors[probe] * per > VISIBLE * (high - low)]
        ax.set_ylabel(f"{name.replace('_', ' ')} ({shown})")
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    axes[-1].set(xlabel=f"time ({unit})", xscale="log" if first else "linear")
    axes[-1].set_xlim(first * factor, scene.end_time * factor)
    listed = ", ".join(cut(probe, MOST_NAME) for probe in wider[:3]) + (" and more" if len(wider) > 3 else "")
    note = f"is shaded where it is wider than the line: {listed}" if wider else "is narrower than the lines"
    if not traces.sure(times).all():
        starts = "the start and each jump of a given temperature" if traces.jumps else "the start"
        note += f"; it is larger until {quantity(traces.since, 's', 2)} after {starts}"
    figure.text(0.5, 0.12 / height, with_mu(f"the estimated error of the 3D traces {note}"), ha="center", fontsize=9)
    return figure


def _first(scene: AnyScene, traces: Traces) -> float:
    """Where a logarithmic axis starts (s): before any trace has moved visibly; 0 where a linear one is better."""
    if any(t > 0 for value in physics.driving(scene) if isinstance(value, Schedule) for t in value.times):
        return 0.0
    halves, starts = [], []
    for values in traces.values.values():
        moved = np.abs(values - values[0])
        if moved.max() > 1e-9 * np.abs(values).max():
            halves.append(traces.time[np.argmax(moved > 0.5 * moved.max())])
            starts.append(traces.time[np.argmax(moved > _SEEN * moved.max())])
    if not halves or min(halves) > _EARLY * scene.end_time:
        return 0.0
    return max(10.0 ** np.floor(np.log10(min(starts))), 1e-6 * scene.end_time)


def differences(outcome: Outcome[AnyScene]) -> Figure:
    """A bar for every check, in percent of its scale, with the error of the difference."""
    checks = [c for c in outcome.checks if not c.id.startswith("slope_") and np.isfinite(c.difference)]
    model = outcome.reduced1d.model if outcome.reduced1d is not None else "the model"
    height = 2.0 + _ROW * max(len(checks), 1)
    figure = new_figure(8.5, height, f"{outcome.scene.name}: {model} less 3D", [outcome.answer], 0.95, 2.6)
    ax = figure.subplots()
    rows = np.arange(len(checks))[::-1]
    for word, colour in _OF.items():
        bars = [(row, c) for row, c in zip(rows, checks, strict=True) if (c.time is None) == word.startswith("in")]
        if not bars:
            continue
        at = [row for row, _ in bars]
        off = 100 * np.clip([c.difference for _, c in bars], -_BEYOND, _BEYOND)
        errors = [100 * min(c.u_num, _BEYOND) for _, c in bars]
        ax.barh(at, off, 0.62, xerr=errors, color=colour, ecolor=INK, capsize=3, label=word)
    for row, c in zip(rows, checks, strict=True):
        ax.barh(row, 200 * c.tolerance, 0.9, left=-100 * c.tolerance, color="#dddddd", zorder=0)
    ax.set_yticks(rows, [cut(c.id.removesuffix(OVER_TIME), MOST_NAME) for c in checks])
    ax.axvline(0, color=INK, lw=0.8)
    ax.set_xlabel("difference (%); of a temperature relative to its rise; grey is the tolerance")
    legend(figure, ax)
    return figure


def network(outcome: Outcome[AnyScene]) -> Figure:
    """From above, in true proportions, and from the side with heights drawn out, over one another."""
    shape = layout(outcome.scene)
    low, high = (np.array([f(getattr(line, side)[d] for line in shape.lines) for d in range(3)]) * _UM
                 for f, side in ((min, "lower"), (max, "upper")))  # fmt: skip
    extent, middle = (high - low) * _ROOM, (low + high) / 2
    longer = int(np.argmax(extent[:2]))
    tall = float(np.clip(_WIDE * extent[1 - longer] / extent[longer], _SIDE, _TALLEST))
    said = ["lines with their ends; squares are joints of two lines, dots are conditions"]
    name = f"{outcome.scene.name}: the network of its boxes"
    figure = new_figure(_WIDE + 1.15, 1.33 + tall + _BETWEEN + _SIDE, name, said, 0.6, 0.9)
    space = {"hspace": 2 * _BETWEEN / (tall + _SIDE)}
    above, side = figure.subplots(2, 1, sharex=True, height_ratios=(tall, _SIDE), gridspec_kw=space)
    scale = max(extent[longer] / _WIDE, extent[1 - longer] / tall)  # um per inch, along both
    above.set_xlim(middle[longer] - _WIDE * scale / 2, middle[longer] + _WIDE * scale / 2)
    seen = {above: (1 - longer, tall * scale), side: (2, extent[2])}
    for ax, (up, span) in seen.items():
        _view(ax, shape, longer, up, ax is above and len(shape.lines) <= _NAMES)
        ax.set_ylim(middle[up] - span / 2, middle[up] + span / 2)
        ax.set_ylabel(f"{'xyz'[up]} (um)")
    side.set_xlabel(f"{'xyz'[longer]} (um)")
    return figure


def _view(ax: Any, shape: Layout, across: int, up: int, named: bool) -> None:
    colours = {box: PARTS[n % len(PARTS)] for n, box in enumerate(dict.fromkeys(li.box.name for li in shape.lines))}
    for line in shape.lines:
        corner = line.lower[across] * _UM, line.lower[up] * _UM
        wide, tall = ((line.upper[d] - line.lower[d]) * _UM for d in (across, up))
        colour = colours[line.box.name]
        ax.add_patch(Rectangle(corner, wide, tall, facecolor=colour, edgecolor=INK, alpha=0.18, linewidth=0.6))
        middle = [(a + b) / 2 for a, b in zip(line.lower, line.upper, strict=True)]
        ends = [[*middle], [*middle]]
        ends[0][line.axis], ends[1][line.axis] = line.start, line.stop
        places = [[end[d] * _UM for end in ends] for d in (across, up)]
        ax.plot(*places, color=colour, marker="|" if line.axis == across else "_", markersize=7)
        if named:
            # Of lines that lie over one another the lowest one's name stands on the other side.
            side = -1 if line.lower[2] == min(other.lower[2] for other in shape.lines) else 1
            beside, ha = (0, 8 * side), "center"
            if line.axis != across:
                beside, ha = (4 * side, 0), "left" if side > 0 else "right"
            place = middle[across] * _UM, middle[up] * _UM
            look = {"textcoords": "offset points", "ha": ha, "va": "center", "fontsize": 7, "color": INK}
            ax.annotate(line.name, place, beside, **look)
    joints = [_middle(link.one) for link in shape.heat if link.other]
    conditions = [_middle(link.one) for link in (*shape.heat, *shape.current) if not link.other]
    for centres, mark, colour in ((joints, "s", INK), (conditions, "o", LINES["end_K"])):
        if centres:
            points = np.array(centres) * _UM
            ax.plot(points[:, across], points[:, up], mark, color=colour, markersize=3.5)


def _middle(touch: Touch) -> list[float]:
    return [(a + b) / 2 for a, b in zip(touch.lower, touch.upper, strict=True)]
