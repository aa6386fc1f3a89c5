"""Figures of the optional analyses: the budget of the differences, sensitivities, and data with all
uncertainties."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullLocator

from compare import quantities
from compare.kinds import kind_of
from compare.outcome import Outcome
from compare.report.checks import with_mu
from scenes.formats import cut, scale, sink_text
from validate.report.figures import INK, LINES, PARTS
from validate.report.figures.drawing import band, kept, legend, logarithmic, new_figure

if TYPE_CHECKING:
    from compare.analyses.against import Validated
    from compare.blame import Budget
    from compare.outcome import Outcome

_VISIBLE = 0.005
"""Parts smaller than this share of an axis can't be seen."""
_MODELS = {"3D": LINES["end_K"], "1D": LINES["mean_K"]}
_ROW, _BAR = 0.3, 0.38
"""Inches of a key's row in a tornado, and the part of it that a bar takes."""
_SEEN = 0.005
"""Errors smaller than this part of a panel's longest bar are no wider than a line."""
_MARKS = 40
"""Data points that have error bars."""
_LEAST = 0.1
"""Percent below which the axis is linear."""
_COLOURS = LINES["peak_K"], LINES["end_K"], INK
_THICK = 0.26  # Height of a bar, of a row of 1.


def why(outcome: Outcome[Any]) -> Figure | None:
    """A panel for each quantity: the part of each assumption in reduction less 3D, stacked away from zero in percent
    of the final rise (or the current's change), against time; the bar beside it is the steady state, with its
    numerical error. The black line is the whole difference. None for scenes other than a sink."""
    if outcome.scene.kind != "sink":
        return None
    from compare.analyses.why import named

    budget, sink = outcome.analyses["why"], outcome.scene
    assert budget is not None
    width, height = 11.0, 4.9
    text = f"Why {named(budget.start)} differs from 3D, {sink_text(sink)}"
    figure = new_figure(width, height, text, [], bottom=1.2, left=1.1)
    wrapped = textwrap.wrap(kept(f"{budget.sentence[0].upper()}{budget.sentence[1:]}."), 150)
    for i, line in enumerate(wrapped):
        figure.text(0.12 / width, 1 - (0.32 + 0.19 * i) / height, line, ha="left", va="top", fontsize=9, color=INK)
    figure.subplots_adjust(top=1 - (0.62 + 0.19 * len(wrapped)) / height)
    over_time = budget.times is not None
    ratios = [4.0, 0.55, 0.9] if over_time else [0.0, 1.0, 0.5]
    grid = figure.add_gridspec(1, 8, width_ratios=(ratios * 3)[:8], wspace=0.12)
    for i, split in enumerate(budget.steady):
        if not split.scale:
            continue
        first = bar = figure.add_subplot(grid[0, 3 * i + 1])
        total, error = 100 * split.total / split.scale, 100 * split.error / abs(split.scale)
        bar.errorbar(0, total, error, fmt="D", color=INK, ms=4, capsize=3)
        _stacked(bar, np.array([0.0]), np.array([[part.value] for part in split.parts]) / split.scale)
        bar.set_xticks([0], ["steady"])
        bar.set_xlim(-0.7, 0.7)
        if budget.times is not None:
            first = figure.add_subplot(grid[0, 3 * i], sharey=bar)
            _stacked(first, budget.times * 1e3, budget.over_time[split.quantity] / split.scale)
            logarithmic(first, "x")
            first.set(xlim=1e3 * budget.times[[0, -1]], xlabel="time (ms)")
            bar.tick_params(labelleft=False)
        first.set_title(f"{split.quantity}", fontsize=10)
        if i == 0:
            first.set_ylabel(f"reduction less 3D (% of the final\nrise, or of the {budget.steady[-1].whole})")
    seen, names = seen_parts(budget), [part.blame for part in budget.steady[0].parts]
    handles: list[Any] = [Patch(color=PARTS[n % len(PARTS)], label=names[n]) for n in seen]
    handles += [Line2D([], [], color=INK, lw=1.4, label="in all")] * over_time
    name = "in all, steady, with its numerical error"
    handles.append(Line2D([], [], color=INK, marker="D", ms=4, ls="none", label=name))
    figure.legend(handles=handles, loc="lower center", ncols=4, fontsize=9, bbox_to_anchor=(0.5, 0.2 / height))
    if small := ", ".join(name for n, name in enumerate(names) if n not in seen):
        figure.text(0.5, 0.1 / height, f"too small to be seen: {small}", ha="center", fontsize=9, color=INK)
    return figure


def _stacked(ax: Any, x: np.ndarray, parts: np.ndarray) -> None:
    """Parts (n, places) of 1 in percent, on either side of zero: bars at one place, else areas and their sum."""
    up, down = np.zeros(len(x)), np.zeros(len(x))
    for n, part in enumerate(100 * parts):
        colour, more, less = PARTS[n % len(PARTS)], np.maximum(part, 0.0), np.minimum(part, 0.0)
        if len(x) == 1:
            ax.bar(0, part[0], bottom=(up if part[0] > 0 else down)[0], color=colour, width=0.8)
        else:
            ax.fill_between(x, up, up + more, color=colour, lw=0)
            ax.fill_between(x, down, down + less, color=colour, lw=0)
        up, down = up + more, down + less
    if len(x) > 1:
        ax.plot(x, 100 * parts.sum(axis=0), color=INK, lw=1.4)
    ax.axhline(0.0, color=INK, lw=0.8)


def seen_parts(budget: Budget) -> list[int]:
    """The parts that are somewhere wider than a hair, by their place."""
    numbers = set()
    for split in budget.steady:
        parts = np.array([[part.value] for part in split.parts])
        if budget.times is not None:
            parts = np.hstack([parts, budget.over_time[split.quantity]])
        height = np.maximum(parts, 0).sum(axis=0).max() - np.minimum(parts, 0).sum(axis=0).min()
        numbers |= {n for n, part in enumerate(parts) if np.abs(part).max() > _VISIBLE * height}
    return sorted(numbers)


def sensitivity(outcome: Outcome[Any]) -> Figure:
    """A tornado for each quantity, the headline's included: a pair of bars for each key, the largest on top, 3D's error
    across a bar's end where visible, keys that 1D misses beyond the tolerance in red."""
    from compare.analyses.sensitivities import PREFIX, followed_keys, sentence, shown_words, worst
    from compare.report.table import short_key

    slopes = outcome.slopes
    names, every = shown_words(outcome), shown_words(outcome, full=True)
    headline = worst(outcome.checks)
    names |= {name: called for name, called in every.items() if headline and headline.title.startswith(f"{called},")}
    keys = followed_keys(outcome.scene, slopes, names)
    models = {"fem3d": "3D"} if "fem3d" in slopes else {}
    if "reduced1d" in slopes:
        models["reduced1d"] = outcome.reduced1d.model if outcome.reduced1d else "1D"
    both = len(models) > 1
    whose = kind_of(outcome.scene).title(outcome.scene)
    who = "the models follow" if both else f"{next(iter(models.values()), '3D')} follows"
    text, said = f"How {who} each key, {whose}: % for each percent", sentence(outcome.checks)
    height, bottom = 1.5 + _ROW * max(len(keys), 3), 0.75 if both else 0.4
    figure = new_figure(11.0, height, text, [said] if said else [], bottom=bottom, left=2.75)
    axes = figure.subplots(1, len(names), sharey=True, squeeze=False, gridspec_kw={"wspace": 0.08})[0]
    places = np.arange(len(keys), dtype=float)
    apart, wide = (_BAR / 2, _BAR) if both else (0.0, 2 * _BAR)
    for ax, name in zip(axes, names, strict=True):
        rows = {model: [slopes[model].relative.get(key, {}).get(name) for key in keys] for model in models}
        if "fem3d" in models:
            value, error = np.array([(s.value, s.error) if s else [np.nan] * 2 for s in rows["fem3d"]]).T
            colour, label = _MODELS["3D"], models["fem3d"]
            ax.barh(places - apart, value, wide, color=colour, label=label)
            error[error < _SEEN * np.nanmax(np.abs(value), initial=0.0)] = np.nan
            ax.errorbar(value, places - apart, xerr=error, fmt="none", ecolor=INK, elinewidth=1.2, capsize=3)
        if "reduced1d" in models:
            value = [np.nan if s is None else s.value for s in rows["reduced1d"]]
            ax.barh(places + apart, value, wide, color=_MODELS["1D"], label=models["reduced1d"])
        ax.axvline(0.0, color=INK, lw=0.8)
        ax.set_title(cut(names[name], 34), fontsize=10)
        ax.grid(False, axis="y")
    axes[0].set_yticks(places, [cut(short_key(key), 36) for key in keys])
    differ = {check.id.removeprefix(PREFIX) for check in outcome.checks if check.verdict == "differs"}
    for label, key in zip(axes[0].get_yticklabels(), keys, strict=True):
        label.set_color("#8b1a1a" if key in differ else INK)
    axes[0].set_ylim(len(keys) - 0.4, -0.6)
    if both:
        legend(figure, axes[0])
    return figure


def validation(outcome: Outcome[Any]) -> Figure:
    """A column for each quantity of the data. Steady: E of each model with its interval. Over time: above, values with
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
        return _at_rest(results, keys, f"{whose}{name}, steady state: E = S - D with its interval of 95 %", colours)
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


def _at_rest(results: Validated, keys: list[str], said: str, colours: dict[str, str]) -> Figure:
    """A column for each quantity: E of each model, with the interval that its own error lies in."""
    from compare.analyses.against import finding

    figure = new_figure(max(2.0 + 2.2 * len(keys), 8.0), 3.8, finding(results), [said], bottom=0.45, left=0.85)
    for key, ax in zip(keys, figure.subplots(1, len(keys), squeeze=False, gridspec_kw={"wspace": 0.5})[0], strict=True):
        statements = [s for s in results.statements if s.quantity == key]
        factor, unit = scale(max(abs(s.E) for s in statements), statements[0].unit)
        for place, s in enumerate(statements):
            half = np.nan_to_num(factor * s.k * s.u_val)
            ax.errorbar(place, factor * s.E, half, fmt="D", color=colours[s.model], mec=INK, ms=6, capsize=4)
        ax.axhline(0.0, color=INK, lw=0.8)
        ax.set_xticks(range(len(statements)), [cut(s.model, 16) for s in statements])
        ax.set(xlim=(-0.6, len(statements) - 0.4), ylabel=with_mu(f"E = S - D ({unit})"))
        ax.set_title(cut(statements[0].called, 24), fontsize=10)
    return figure


def left_out(outcome: Outcome[Any]) -> Figure:
    """A row of bars for each effect, the largest first, with the numerical error of each; all together at the foot."""
    left_out = outcome.analyses["left_out"]
    assert left_out is not None
    effects = left_out.every
    height = 2.4 + 0.62 * len(effects)
    kind = kind_of(outcome.scene)
    text = f"What both models leave out, {kind.title(outcome.scene)}"
    said = [left_out.sentence]
    figure = new_figure(8.5, height, text, said, bottom=1.0, left=1.5)
    ax = figure.subplots()
    for n, (key, colour) in enumerate(zip(kind.shown, _COLOURS, strict=True)):
        made = [(place, each.changes[key]) for place, each in enumerate(effects.values()) if each.changes]
        values = np.array([100 * change.value for _, change in made])
        errors = np.array([100 * change.error for _, change in made])
        places = np.array([place for place, _ in made]) + (n - 1) * _THICK
        ax.barh(places, values, 0.9 * _THICK, color=colour, label=kind.quantities(outcome.scene)[key][0])
        ax.errorbar(values, places, xerr=errors, fmt="none", ecolor="#777777", elinewidth=1.0, capsize=2)
    for place, each in enumerate(effects.values()):
        if not each.changes:
            ax.text(0.02 * _LEAST, place, "runs away", va="center", fontsize=9, color=INK)
    most = max((abs(100 * c.value) for each in effects.values() for c in each.changes.values()), default=1.0)
    ax.set_xscale("symlog", linthresh=_LEAST)
    tens = [10.0**n for n in range(-1, 6) if 10.0**n <= 3 * most]
    ax.set_xticks([-ten for ten in tens[::-1]] + [0.0] + tens)
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:+g}" if value else "0"))
    ax.xaxis.set_minor_locator(NullLocator())
    ax.axvline(0.0, color=INK, lw=0.8)
    ax.set_yticks(range(len(effects)), [name.replace("_", " ") for name in effects])
    ax.set(ylim=(len(effects) - 0.5, -0.5), xlabel="change of the 3D steady state (%)")
    ax.grid(visible=False, axis="y")
    legend(figure, ax)
    return figure
