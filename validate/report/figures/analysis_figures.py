"""Figures of analyses: the budget of the differences, and data with all uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from compare import quantities
from compare.kinds import kind_of
from compare.outcome import Outcome
from compare.report.checks import with_mu
from scenes.formats import cut, scale, sink_text
from validate.report.figures import INK, LINES, PARTS
from validate.report.figures.drawing import band, legend, logarithmic, new_figure

if TYPE_CHECKING:
    from compare.blame import Budget

_MODELS = {"3D": LINES["end_K"], "1D": LINES["mean_K"]}
_MARKS = 40
"""Data points that have error bars."""


def why(outcome: Outcome[Any]) -> Figure | None:
    """A panel for each quantity: the part of each assumption in reduction less 3D, stacked away from zero in percent
    of the final rise (or the current's change), against time and in the steady state, there with the numerical error.
    The black line is the whole difference. None for scenes other than a sink."""
    if outcome.scene.kind != "sink":
        return None
    from compare.analyses.why import named

    budget: Budget = outcome.analyses["why"]
    text = f"Why {named(budget.start)} differs from 3D, {sink_text(outcome.scene)}"
    said = f"{budget.sentence[0].upper()}{budget.sentence[1:]}."
    figure = new_figure(11.0, 4.9, text, [said], bottom=1.3, left=1.1)
    ratios = [1.0] if budget.times is None else [4.0, 0.8]
    space = {"width_ratios": ratios * len(budget.steady), "wspace": 0.4}
    axes = figure.subplots(1, len(ratios) * len(budget.steady), squeeze=False, gridspec_kw=space)
    axes = axes.reshape(len(budget.steady), -1)
    for split, pair in zip(budget.steady, axes, strict=True):
        pair[0].set_title(split.quantity, fontsize=10)
        if not split.scale:
            continue
        parts = np.array([[part.value] * 2 for part in split.parts])
        _stacked(pair[-1], np.array([-0.4, 0.4]), parts / split.scale, [part.blame for part in split.parts])
        total, error = 100 * split.total / split.scale, 100 * split.error / abs(split.scale)
        pair[-1].errorbar(0, total, error, fmt="D", color=INK, ms=4, capsize=3, label="in all, with its error")
        pair[-1].set_xticks([0], ["steady"])
        if budget.times is not None:
            _stacked(pair[0], budget.times * 1e3, budget.over_time[split.quantity] / split.scale)
            logarithmic(pair[0], "x")
            pair[0].set(xlim=1e3 * budget.times[[0, -1]], xlabel="time (ms)")
    axes[0, 0].set_ylabel(f"reduction less 3D (% of the final\nrise, or of the {budget.steady[-1].whole})")
    legend(figure, axes[0, len(ratios) - 1], columns=4, fontsize=9)
    return figure


def _stacked(ax: Any, x: np.ndarray, parts: np.ndarray, names: Sequence[str] = ()) -> None:
    """Parts (n, places) of 1 in percent as areas on either side of zero, and their sum."""
    ends = np.zeros((2, len(x)))
    for n, part in enumerate(100 * parts):
        more = np.array([np.maximum(part, 0.0), np.minimum(part, 0.0)])
        for start, size in zip(ends, more, strict=True):
            ax.fill_between(x, start, start + size, color=PARTS[n % len(PARTS)], lw=0)
        ends = ends + more
    for n, name in enumerate(names):
        ax.fill_between([], [], color=PARTS[n % len(PARTS)], label=name)
    ax.plot(x, 100 * parts.sum(axis=0), color=INK, lw=1.4)
    ax.axhline(0.0, color=INK, lw=0.8)


def validation(outcome: Outcome[Any]) -> Figure | None:
    """A column for each quantity of the data over time, none in the steady state. Above, values with
    bands of 2 sqrt(u_num^2 + u_input^2), data as dots, some with bars of 2 u_D; below, E = S - D within 2 u_val and its
    means over windows with intervals."""
    from compare.analyses.against import finding
    from compare.verdict import COVERS

    results = outcome.analyses["validation"]
    assert results is not None
    keys = list(dict.fromkeys(course.quantity for course in results.courses))
    name = "" if outcome.options.against is None else f" against {outcome.options.against.name[:40]}"
    whose, names = kind_of(outcome.scene).title(outcome.scene), list(dict.fromkeys(c.model for c in results.courses))
    colours = dict(zip(names, _MODELS.values(), strict=False))
    if np.isinf(results.courses[0].times[-1]):
        return None
    said = (
        f"{whose}{name}, {len(results.courses[0].times):,} rows; bands of 2 u: of S by numerics and "
        "inputs, of E by u_val; diamonds: the worst and the last window with their 95 %"
    )
    figure = new_figure(max(2.0 + 4.2 * len(keys), 8.0), 6.2, finding(results), [said], bottom=0.9, left=0.85)
    axes = figure.subplots(2, len(keys), sharex=True, squeeze=False, gridspec_kw={"wspace": 0.3, "hspace": 0.12})
    for key, above, below in zip(keys, *axes, strict=True):
        courses = [course for course in results.courses if course.quantity == key]
        called, unit = courses[0].called, courses[0].unit
        room = quantities.of(outcome.scene).base(key)
        factor, shown = scale(float(np.abs(courses[0].measured - room).max()), unit)
        off, shown_off = scale(max(float(np.abs(course.error).max()) for course in courses), unit)
        for course in courses:
            ms, colour = course.times * 1e3, colours[course.model]
            u = np.hypot(course.u_num, np.nan_to_num(course.u_input))
            for ax, values, half in (
                (above, factor * (course.simulated - room), factor * u),
                (below, off * course.error, off * np.nan_to_num(course.u_val)),
            ):  # fmt: skip
                ax.plot(ms, values, color=colour, label=course.model, lw=1.8 if len(ms) <= 200 or ax is above else 0.5)
                band(ax, ms, values, COVERS * half, colour)
            for s in course.statements():
                place, half_ = 5e2 * (s.start + s.end), np.nan_to_num(off * s.k * s.u_val)
                below.errorbar(
                    place, off * s.E, half_, fmt="D", color=colour, mec=INK, ecolor=INK, ms=5, capsize=3, zorder=5
                )
        measured = factor * (course.measured - room)
        above.plot(ms, measured, ".", color=INK, ms=2 if len(ms) > _MARKS else 6, label="data", zorder=1)
        few = np.unique(np.linspace(0, len(ms) - 1, _MARKS).astype(int))
        above.errorbar(ms[few], measured[few], factor * COVERS * course.u_data[few], fmt="none", color=INK, lw=0.8)
        below.axhline(0.0, color=INK, lw=0.8)
        above.set_ylabel(with_mu(f"{cut(called, 24)}{' rise' if unit == 'K' else ''} ({shown})"))
        below.set(ylabel=with_mu(f"E = S - D ({shown_off})"), xlabel="time (ms)")
    legend(figure, axes[0, 0])
    return figure
