"""Figures 5 to 7: the steady rise along the beam, and rises and current against time; of a sink of several spans the
rise along the whole row."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.polynomial import Chebyshev

from compare.against import Data
from compare.outcome import Outcome
from compare.report.checks import with_mu
from compare.sink_checks import profile as sampled
from compare.verdict import PAPERS
from reduced1d.equations import parabola, parabola_between, unequal_ends
from reduced1d.ladder.few_states import half_island
from scenes.formats import quantity, scale, sink_text
from scenes.result import Result
from scenes.sink import OF_A_SINK, Sink, start
from validate.report.figures import INK, LINES
from validate.report.figures.drawing import VISIBLE, band, legend, logarithmic, new_figure, smooth

Spans = list[tuple[float, int]]

_NAMES = {entry.trace: name for name, entry in OF_A_SINK.items()}
_MARKS = 25
"""Marks drawn of a user's trace."""
_MANY = 8
"""Spans from which on a second panel shows the outer ones."""
_TOO_MANY = 30
"""Spans from which on the whole row would be a texture."""
_OUTER = 4
"""Spans in the second panel."""


def profile(outcome: Outcome[Sink]) -> Figure:
    """Figure 5: the 3D profile with eq 9's parabola through its own end and peak, and the 1D model's; below, the
    distances, with the numerical error about them.

    A discrete solution has kinks between its cells, far smaller than its error but visible on the scale of the
    distance; the curve is smoothed by a twentieth of the error, and then nearer to a finer solution than before.
    """
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
    off = without_kinks(um, rise - fitted, error / 40)
    band(below, um, off, error, LINES["mean_K"])
    below.plot(um, off, color=LINES["mean_K"])
    if reduced1d is not None and {"end_rise_K", "peak_rise_K"} <= reduced1d.steady.keys():
        end, peak = reduced1d.steady["end_rise_K"].value, reduced1d.steady["peak_rise_K"].value
        if reduced1d.model in PAPERS:
            reduction = parabola(y, peak - end, end, sink.length)
            above.plot(um, reduction, color=LINES["end_K"], ls=":", lw=2.2, label="1D, eqs 9, 17 and 18")
        else:
            above.plot(
                um[[0, len(um) // 2, -1]], [end, peak, end], "o", color=LINES["end_K"], ms=5, label=reduced1d.model
            )
    below.axhline(0.0, color=INK, lw=0.8)
    below.set(ylabel="3D less its\nparabola (K)", xlabel="place along the beam y (µm)")
    below.set_title(with_mu(f"shaded: its numerical error, ±{quantity(error, 'K', 2)}"), fontsize=9, loc="right", pad=3)
    above.set(ylabel="rise above room (K)", ylim=(0.0, None), xlim=(um[0], um[-1]))
    above.legend(loc="lower center")
    return figure


def without_kinks(place: np.ndarray, values: np.ndarray, distance: float) -> np.ndarray:
    """The values as a smooth curve, the polynomial of the least degree that is off them by ``within`` (RMS) at most; as
    they are where no degree up to half their number does."""
    for degree in range(4, len(place) // 2, 2):
        fitted = Chebyshev.fit(place, values, degree)(place)
        if np.sqrt(np.mean((fitted - values) ** 2)) <= distance:
            return fitted
    return values


def rises(outcome: Outcome[Sink]) -> Figure:
    """Figure 6: the rises of peak, mean (the paper's equivalent temperature) and end."""
    keys, room = ("peak_K", "mean_K", "end_K"), outcome.scene.room_temperature
    return _against_time(outcome, 6, "rise", keys, "rise above room (K)", "K", 1.0, room)


def current(outcome: Outcome[Sink]) -> Figure:
    """Figure 7: the current."""
    model = outcome.fem3d or outcome.reduced1d
    assert model is not None
    factor, unit = scale(model.steady["current_A"].value, "A")
    return _against_time(outcome, 7, "current", ("current_A",), f"current ({unit})", "A", factor, 0.0)


def _against_time(
    outcome: Outcome[Sink], number: int, what: str, keys: tuple[str, ...], label: str, unit: str, factor: float,
    zero: float,
) -> Figure:  # fmt: skip
    """Traces less ``zero``, times ``factor``, on a logarithmic and on a linear axis of time; the 3D error as a band
    where it is wider than a line, and in words in any case."""
    end, three, data = outcome.scene.end_time, outcome.fem3d, outcome.options.against
    ids = {f"against_{_NAMES[key]}" for key in keys}
    checks = [check for check in outcome.checks if check.id.startswith(f"fig{number}") or check.id in ids]
    # A third row of the legend, under a third kind of curve.
    more = 0.2 if ids & {check.id for check in checks} else 0.0
    text = f"Figure {number}: {what} against time, {sink_text(outcome.scene)}"
    figure = new_figure(9.5, 4.8, text, checks, bottom=1.25 + more)
    axes = figure.subplots(1, 2, sharey=True, gridspec_kw={"wspace": 0.07})
    # Before a microsecond nothing has happened yet that could be seen.
    first = min(1e-6, end / 1e4)
    dense = (np.geomspace(first, end, 300), np.linspace(0.0, end, 300))

    def shown(result: Result, key: str, times: np.ndarray) -> np.ndarray:
        """Between its times without overshoot: straight pieces would show as bends on a logarithmic axis."""
        return factor * (smooth(result.over_time.time, result.over_time.values[key], times) - zero)

    models = [r for r in (three, outcome.reduced1d) if r is not None and r.traces is not None]
    for ax, times in zip(axes, dense, strict=True):
        for key in keys:
            for model in models:
                if key not in model.over_time.values:
                    continue
                name = "3D" if model is three else "1D" if model.model in PAPERS else model.model
                look: dict[str, Any] = {"lw": 2.0} if model is three else {"ls": (0, (5, 2.5)), "lw": 1.6}
                values = shown(model, key, times)
                ax.plot(times * 1e3, values, color=LINES[key], label=f"{_NAMES[key]}, {name}", **look)
            if data is not None and key in data.values:
                _marks(ax, data, key, times, factor, zero)
        ax.set_xlabel("time (ms)")
    axes[0].set_ylabel(label)
    logarithmic(axes[0], "x")
    axes[0].set_xlim(first * 1e3, end * 1e3)
    axes[1].set_xlim(0.0, end * 1e3)
    axes[1].xaxis.set_major_locator(MaxNLocator(5))
    low, high = axes[0].get_ylim()
    if zero:
        axes[0].set_ylim(bottom=0.0)
    elif high - low < 1e-4 * abs(high):
        # A current that hardly changes is shown as an offset and its change.
        axes[0].ticklabel_format(axis="y", useOffset=True)
    legend(figure, axes[0], columns=len(keys) if len(keys) > 1 else 0)
    if three is None or three.traces is None:
        return figure
    low, high = axes[0].get_ylim()
    halves = {key: factor * three.traces.errors[key] for key in keys}
    visible = {key: half for key, half in halves.items() if half > VISIBLE * (high - low)}
    for key, half in visible.items():
        for ax, times in zip(axes, dense, strict=True):
            band(ax, times * 1e3, shown(three, key, times), half, LINES[key])
    most = quantity(max(three.traces.errors[key] for key in keys), unit, 2)
    where = "shaded where wider than a line" if visible else "narrower than the lines"
    note = f"estimated error of the 3D traces at most ±{most}, {where}"
    figure.text(0.5, (0.62 + more) / 4.8, with_mu(note), ha="center", va="center", fontsize=9.5)
    return figure


def _marks(ax: Any, data: Data, key: str, times: np.ndarray, factor: float, zero: float) -> None:
    """Draw a user's own trace as a few marks at its own times."""
    wanted = times[:: len(times) // _MARKS]
    inside = np.flatnonzero((data.time >= times[0]) & (data.time <= times[-1]))
    if not len(inside):
        return
    shown = inside[np.unique(np.abs(data.time[inside, None] - wanted).argmin(axis=0))]
    ax.plot(
        data.time[shown] * 1e3, factor * (data.values[key][shown] - zero), color=LINES[key], marker="o", ms=4.5,
        mfc="white", ls="none", zorder=3, label=f"{_NAMES[key]}, {data.name[:24]}",
    )  # fmt: skip


def row(outcome: Outcome[Sink]) -> Figure:
    """The steady rise along the row in 3D and 1D, with the islands shaded; of a long row its outer spans below, and of
    one whose curves would run into each other the spans' tops alone above."""
    # A user's own model may have numbers of some spans alone.
    sink, fem3d, reduced1d = outcome.scene, outcome.solved, None if outcome.own_model is not None else outcome.reduced1d
    checks = [check for check in outcome.checks if check.id in ("islands_peak_inner", "islands_equivalent")]
    text = f"Steady rise along {sink.spans} spans, {sink_text(sink)}"
    ends = [sink.row_length, *[start(sink, _OUTER) + sink.length] * (sink.spans > _MANY)]
    figure = new_figure(9.5, 3.4 * len(ends) + 1.0, text, checks, bottom=0.95, left=0.95)
    axes = np.atleast_1d(figure.subplots(len(ends), 1, gridspec_kw={"hspace": 0.3}))
    y, rise = (fem3d.details["profile"][key] for key in ("y_m", "rise_K"))
    # Where each span begins (m), and the number that its quantities have.
    numbered = [(start(sink, n), min(n, sink.spans + 1 - n)) for n in range(1, sink.spans + 1)]
    for ax, end in zip(axes, ends, strict=True):
        spans = [(first, span) for first, span in numbered if first < end]
        ax.set(xlim=(0.0, end * 1e6), ylabel="rise above room (K)")
        if end == sink.row_length and sink.spans > _TOO_MANY:
            _dots(ax, sink, fem3d, spans, "peak", color=INK, marker="o", ms=3)
            if reduced1d is not None:
                _dots(ax, sink, reduced1d, spans, "peak", color=LINES["end_K"], marker="x", ms=3)
            ax.set_ylabel("top of each span (K)")
            continue
        for first, span in spans:
            if first > 0:
                ax.axvspan((first - sink.island) * 1e6, first * 1e6, color="#cccccc", lw=0)
            if sink.spans <= _MANY or end < sink.row_length:
                middle = (first + sink.length / 2) * 1e6
                ax.text(middle, 0.3, f"span {span}", ha="center", va="bottom", fontsize=9, color="#555555")
        ax.plot(y[y <= end] * 1e6, rise[y <= end], color=INK, label="3D, along the axis")
        if reduced1d is not None and reduced1d.model in PAPERS:
            _parabolas(ax, sink, reduced1d, spans)
        elif reduced1d is not None:
            _dots(ax, sink, reduced1d, spans, "middle", color=LINES["end_K"], marker="o", ms=5, label=reduced1d.model)
        ax.set_ylim(bottom=0.0)
    axes[-1].set_xlabel("place along the row y (µm); islands shaded")
    legend(figure, axes[-1], columns=2)
    return figure


def _dots(ax: Any, sink: Sink, model: Result, spans: Spans, of_each: str, **look: Any) -> None:
    """A rise of each span, in its middle."""
    middles = [(first + sink.length / 2) * 1e6 for first, _ in spans]
    ax.plot(middles, [model.steady[f"span{span}_{of_each}_rise_K"].value for _, span in spans], ls="none", **look)


def _parabolas(ax: Any, sink: Sink, reduced1d: Result, spans: Spans) -> None:
    """The paper's model as its parabola in each span."""
    sink = sink.plain
    k, y, places, rises = sink.silicon.thermal_conductivity, np.linspace(0.0, sink.length, 101), [], []
    for number, (first, span) in enumerate(spans, 1):
        R1 = reduced1d.steady["anchor_resistance_K_per_W"].value if span == 1 else half_island(sink)
        mean = reduced1d.steady[f"span{span}_mean_rise_K"].value
        ends = unequal_ends(mean, R1, half_island(sink), k, sink.cross_section, sink.length)
        rise = parabola_between(y, *ends, sink.length)
        places.append(np.append(first + y, np.nan))
        rises.append(np.append(rise if number == span else rise[::-1], np.nan))
    x, values, label = np.concatenate(places) * 1e6, np.concatenate(rises), "1D, eqs 13 to 19 with unequal ends"
    ax.plot(x, values, color=LINES["end_K"], label=label, ls=(0, (5, 3)))
