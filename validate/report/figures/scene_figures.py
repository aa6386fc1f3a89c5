"""Figures over time: the probes of a free scene, and the rises and the current of a sink (Figures 6 and 7)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from compare.report.checks import with_mu
from compare.verdict import PAPERS, Check
from scenes import physics
from scenes.formats import cut, quantity, scale, sink_text
from scenes.model import UNITS, Schedule
from scenes.result import Traces
from scenes.sink import OF_A_SINK, Sink
from validate.report.figures import LINES, PARTS
from validate.report.figures.drawing import VISIBLE, band, new_figure, smooth

_DASHES = ("-", (0, (5, 2.5)), (0, (1.5, 1.5)))
MOST_NAME = 24
"""Characters of a name that there is room for."""
_EARLY, _SEEN = 0.05, 0.01
"""Time is logarithmic where a trace has half its change within the first part of the run; its axis starts where the
trace has moved by the second part of its change."""

Panel = tuple[str, str, float, Mapping[str, str]]
"""The label and the unit of an axis, the value at its zero, and the words of its traces by name."""


def rises(outcome: Outcome[Sink]) -> Figure:
    """Figure 6: the rises of peak, mean (the paper's equivalent temperature) and end."""
    names = {OF_A_SINK[word].trace: word for word in ("peak", "mean", "end")}
    return _of_sink(outcome, 6, "rise", ("rise above room", "K", outcome.scene.room_temperature, names))


def current(outcome: Outcome[Sink]) -> Figure:
    """Figure 7: the current."""
    return _of_sink(outcome, 7, "current", ("current", "A", 0.0, {"current_A": "current"}))


def _of_sink(outcome: Outcome[Sink], number: int, what: str, panel: Panel) -> Figure:
    starts = (f"fig{number}", *(f"against_{word}" for word in panel[3].values()))
    title = f"Figure {number}: {what} against time, {sink_text(outcome.scene)}"
    return traces(outcome, title, [panel], [check for check in outcome.checks if check.id.startswith(starts)])


def traces(
    outcome: Outcome[Any], title: str = "", panels: Sequence[Panel] = (), checks: Sequence[Check] = ()
) -> Figure:
    """Draw traces from the start on: 3D with a band for its errors, a 1D model dashed, a user's data as dots.

    By default they are all probes of a free scene. Time is logarithmic where a trace has done half of all it does in
    the first twentieth of the run, and nothing that drives the scene changes later.
    """
    scene, data = outcome.scene, outcome.options.against
    results = [each for each in (outcome.fem3d, outcome.reduced1d) if each is not None and each.traces is not None]
    given = scene.scene() if scene.kind == "sink" else scene
    if not panels:
        by_quantity: dict[str, dict[str, str]] = {}
        for probe in scene.probes:
            by_quantity.setdefault(probe.quantity, {})[probe.name] = probe.name
        panels = [(q.replace("_", " "), UNITS[q], 0.0, by_quantity[q]) for q in UNITS if q in by_quantity]
    first, (factor, time_unit) = _first(given, results[0].over_time), scale(scene.end_time, "s")
    height = 1.1 + 0.2 * len(checks) + (2.4 if len(panels) > 1 else 3.4) * len(panels)
    figure = new_figure(9.5, height, title or f"{scene.name}: probes against time", checks, left=0.9, bottom=0.8)
    figure.subplots_adjust(right=0.78)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    wider = list[str]()
    for ax, (label, unit, zero, names) in zip(axes, panels, strict=True):
        sizes = [r.over_time.values[n] - zero for r in results[:1] for n in names if n in r.over_time.values]
        per, shown = scale(max((float(np.abs(size).max()) for size in sizes), default=1.0), unit)
        for number, (name, word) in enumerate(names.items()):
            colour, dash = PARTS[number % len(PARTS)], _DASHES[number // len(PARTS) % len(_DASHES)]
            colour = LINES.get(name, colour)
            for result in results:
                course = result.over_time
                if name not in course.values:
                    continue
                times, values = course.time, course.values[name]
                if first:  # Rows are few where a straight line over time does, which a logarithmic axis bends.
                    times = np.geomspace(first, scene.end_time, 400)
                    values = smooth(course.time, values, times)
                values = per * (values - zero)
                who = "1D" if result.model in PAPERS else result.model
                look: dict[str, Any] = {"ls": ":", "lw": 2.4, "label": cut(f"{word}, {who}", MOST_NAME)}
                if result is outcome.fem3d:
                    bound = per * course.error_at(name, times)
                    values = np.where(np.isfinite(bound), values, np.nan)
                    band(ax, times * factor, values, bound, colour)
                    look = {"ls": dash, "label": cut(word, MOST_NAME)}
                ax.plot(times * factor, values, color=colour, **look)
            if data is not None and name in data.values:
                dots = per * (data.values[name] - zero)
                ax.plot(data.time * factor, dots, ".", color=colour, ms=5, zorder=1, label=f"{word}, {data.name[:24]}")
        low, high = ax.get_ylim()
        if outcome.fem3d is not None and outcome.fem3d.traces is not None:
            errors = outcome.fem3d.traces.errors
            wider += [word for name, word in names.items() if errors[name] * per > VISIBLE * (high - low)]
        ax.set_ylabel(with_mu(f"{label} ({shown})"))
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    axes[-1].set(xlabel=with_mu(f"time ({time_unit})"), xscale="log" if first else "linear")
    axes[-1].set_xlim(first * factor, scene.end_time * factor)
    listed = ", ".join(cut(word, MOST_NAME) for word in wider[:3]) + " and more" * (len(wider) > 3)
    note = f"is shaded where it is wider than the line: {listed}" if wider else "is narrower than the lines"
    if (since := results[0].over_time.since) > first:
        note += f"; it is larger until {quantity(since, 's', 2)} after the start"
        note += " and each jump of a given temperature" * bool(results[0].over_time.jumps)
    figure.text(0.5, 0.12 / height, with_mu(f"the estimated error of the traces {note}"), ha="center", fontsize=9)
    return figure


def _first(scene: Any, traces: Traces) -> float:
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
