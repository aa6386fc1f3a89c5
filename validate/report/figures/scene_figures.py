"""Figures of a sink (5: profile, 6: rises, 7: current) and of a free scene (traces)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.outcome import Outcome
from compare.sink_checks import profile as sampled
from compare.verdict import PAPER, Check
from reduced1d.equations import parabola
from scenes.formats import cut, quantity, scale, sink_text
from scenes.model import UNITS
from scenes.sink import OF_A_SINK, Sink
from validate.report.figures import INK, LINES, PARTS, with_mu
from validate.report.figures.drawing import band, new_figure

_DASHES = ("-", (0, (5, 2.5)), (0, (1.5, 1.5)))
MOST_NAME = 24
"""Characters of a name that there is room for."""
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

    By default they are all probes of a free scene.
    """
    scene, data = outcome.scene, outcome.options.against
    results = [each for each in (outcome.fem3d, outcome.reduced1d) if each is not None and each.traces is not None]
    if not panels:
        by_quantity: dict[str, dict[str, str]] = {}
        for probe in scene.probes:
            by_quantity.setdefault(probe.quantity, {})[probe.name] = probe.name
        panels = [(q.replace("_", " "), UNITS[q], 0.0, by_quantity[q]) for q in UNITS if q in by_quantity]
    factor, time_unit = scale(scene.end_time, "s")
    lines = len(results) + (data is not None)  # of each trace in the legend, whose height a panel has at least
    heights = [max(2.4 if len(panels) > 1 else 3.4, 0.3 + 0.23 * lines * len(names)) for *_, names in panels]
    height = 1.1 + 0.2 * len(checks) + sum(heights)
    figure = new_figure(9.5, height, title or f"{scene.name}: probes against time", checks, left=0.9, bottom=0.8)
    figure.subplots_adjust(right=0.78)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
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
                values = per * (course.values[name] - zero)
                look: dict[str, Any] = {"ls": ":", "lw": 2.4, "label": f"{cut(word, MOST_NAME - 4)}, 1D"}
                if result is outcome.fem3d:
                    bound = per * course.error_at(name, course.time)
                    values = np.where(np.isfinite(bound), values, np.nan)
                    band(ax, course.time * factor, values, bound, colour)
                    look = {"ls": dash, "label": cut(word, MOST_NAME)}
                ax.plot(course.time * factor, values, color=colour, **look)
            if data is not None and name in data.values:
                dots = per * (data.values[name] - zero)
                look = {"ms": 5, "zorder": 1, "label": f"{cut(word, MOST_NAME - 6)}, data"}
                ax.plot(data.time * factor, dots, ".", color=colour, **look)
        ax.set_ylabel(with_mu(f"{label} ({shown})"))
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    axes[-1].set(xlabel=with_mu(f"time ({time_unit})"), xlim=(0.0, scene.end_time * factor))
    said = [f"1D: {cut(r.model, 60)}" for r in results if r is not outcome.fem3d and r.model != PAPER]
    if data is not None:
        said.append(f"data: {cut(data.name, 60)}")
    said.append("shaded: the estimated error of 3D, where it is known")
    figure.text(0.5, 0.12 / height, "; ".join(said), ha="center", fontsize=9)
    return figure


def profile(outcome: Outcome[Sink]) -> Figure:
    """Figure 5: the 3D profile with eq 9's parabola through its own end and peak, and the 1D model's; below, the
    distance from the parabola within its numerical error."""
    sink, fem3d, reduced1d = outcome.scene, outcome.solved, outcome.reduced1d
    y, rise, fitted = sampled(outcome)
    checks = [check for check in outcome.checks if check.id == "fig5"]
    figure = new_figure(9.5, 5.4, f"Figure 5: steady rise along the beam, {sink_text(sink)}", checks, left=0.95)
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1.2))
    um = y * 1e6
    above.plot(um, rise, color=INK, label="3D, along the axis")
    above.plot(um, fitted, color=LINES["mean_K"], ls=(0, (5, 3)), label="eq 9's parabola through the 3D end and peak")
    # The errors of the profile and of the parabola through two of its points.
    error = 2 * max(fem3d.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    off = rise - fitted
    band(below, um, off, error, LINES["mean_K"])
    below.plot(um, off, color=LINES["mean_K"])
    if reduced1d is not None and {"end_rise_K", "peak_rise_K"} <= reduced1d.steady.keys():
        end, peak = reduced1d.steady["end_rise_K"].value, reduced1d.steady["peak_rise_K"].value
        places, values, look, name = um[[0, len(um) // 2, -1]], np.array([end, peak, end]), "o", reduced1d.model
        if reduced1d.model == PAPER:
            places, values, look = um, parabola(y, peak - end, end, sink.length), ":"
            name = "1D, eqs 9, 17 and 18"
        above.plot(places, values, look, color=LINES["end_K"], label=name)
    below.axhline(0.0, color=INK, lw=0.8)
    below.set(ylabel="3D less its\nparabola (K)", xlabel="place along the beam y (µm)")
    below.set_title(with_mu(f"shaded: its numerical error, ±{quantity(error, 'K', 2)}"), fontsize=9, loc="right", pad=3)
    above.set(ylabel="rise above room (K)", ylim=(0.0, None), xlim=(um[0], um[-1]))
    above.legend(loc="lower center")
    return figure
