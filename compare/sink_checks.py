"""Checks of a sink against 3D: the paper's equations and Figures 4 to 7, and the equivalence of several spans.

An equation is checked on the steady 3D solution: 3D quantities enter the right-hand side, and the result is compared
with the 3D quantity on the left. dT_end is the 3D end rise, the mean over the beam's end cross section; dT0 is the 3D
peak rise less dT_end. ``power_W`` is the power of the electrodes; with electrodes at the pads' outer faces it includes
the heat of the pads, for which eqs 10 and 12 have no term. A figure is checked by the difference of both models'
curves, over time by the largest distance from 10 us on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from inspect import signature
from itertools import combinations

import numpy as np

from compare.course import Course, overshoot
from compare.outcome import Outcome
from compare.verdict import PAPERS, Check, Definitions, against_3d, part, share, spread, unit_of
from reduced1d import equations
from reduced1d.equations import anchor_series_resistance
from scenes.checks import FIRST_TIME
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Result
from scenes.sink import Sink, different

NO_PARABOLA = "heating, cooling or conductivity vary along the beam, or the flow near its ends is not one-dimensional"
"""Reasons why the profile is no parabola."""
INPUTS = {
    "current": "current_A", "peak": "peak_rise_K", "end": "end_rise_K", "mean": "mean_rise_K", "flow": "end_flow_W",
    "resistance": "anchor_resistance_K_per_W",
}  # fmt: skip
"""The steady 3D quantities by their names as arguments of equations."""
EQUATION = "3D", "one conductivity"
FIGURE = *EQUATION, "1D"
COURSE = *EQUATION, "transient", "10 us", "1D"
"""What the checks need (`compare.kinds.sink.SinkKind.absent`)."""


CHECKS: Definitions[Outcome[Sink]] = Definitions()
ROW = {
    "peak_inner": ("inner peak", "span{inner}_peak_rise_K"), "peak_outer": ("outer peak", "span1_peak_rise_K"),
    "mean": ("mean", "mean_rise_K"), "current": ("current", "current_A"),
}  # fmt: skip
"""Words and steady quantities of a row of spans, by the ends of its checks' ids; the highest span is an innermost."""


def _of_paper(outcome: Outcome[Sink]) -> bool:
    """Whether the equations are of the 1D model, or there is none."""
    return outcome.reduced1d is None or outcome.reduced1d.model in PAPERS


def equation(name: str, title: str, key: str, note: str) -> Callable[[Callable[..., float]], Callable[..., float]]:
    """Register a formula f(sink, *quantities of 3D) as the check of the steady 3D quantity ``key``.

    The arguments' names choose the quantities (`INPUTS`), whose errors count. ``note`` says why both differ.
    """

    def register(formula: Callable[..., float]) -> Callable[..., float]:
        arguments = list(signature(formula).parameters)[1:]

        @CHECKS.check(name, *EQUATION)
        def make(outcome: Outcome[Sink]) -> Check:
            steady, sink, unit = outcome.solved.steady, outcome.scene.plain, unit_of(key)
            inputs = {argument: steady[INPUTS[argument]] for argument in arguments}

            def off(measured: float, **values: float) -> float:
                return part(formula(sink, **values) - measured, measured)

            predicted = formula(sink, **{argument: estimate.value for argument, estimate in inputs.items()})
            measured, error = steady[key].value, spread(off, {**inputs, "measured": steady[key]})
            reason = f"{quantity(predicted, unit)} against {quantity(measured, unit)} in 3D: {note}"
            difference = part(predicted - measured, measured)
            shown = predicted, measured, unit, difference, error, reason
            return Check(title, *shown, relative_to="the 3D value", own=_of_paper(outcome))

        return formula

    return register


@equation("eq12", "power from I, peak, end", "power_W", "eq 12 takes the parabola's mean, and no heat of the pads")
def eq12(sink: Sink, current: float, peak: float, end: float) -> float:
    """I^2 R (1 + a [2/3 dT0 + dT_end])."""
    rho, a = equations.room_resistivity(sink.silicon, sink.room_temperature)
    return equations.power(current, peak - end, end, rho, a, sink.length, sink.cross_section)


@equation("eq13", "mean rise from peak, end", "mean_rise_K", NO_PARABOLA)
def eq13(sink: Sink, peak: float, end: float) -> float:
    """2/3 dT0 + dT_end."""
    return equations.equivalent_rise(peak - end, end)


@equation(
    "eq14", "anchor resistance by size", "anchor_resistance_K_per_W",
    "eq 14 adds two prisms, without the constriction from beam to pad and into the oxide, nor contacts or a substrate",
)  # fmt: skip
def eq14(sink: Sink) -> float:
    """The printed series resistance of an anchor; 3D's is the end rise over the heat through that end."""
    return anchor_series_resistance(sink)


@equation("eq16", "end's heat from peak, end", "end_flow_W", NO_PARABOLA)
def eq16(sink: Sink, peak: float, end: float) -> float:
    """4 k A_c dT0 / L, by the parabola's slope."""
    return equations.end_flow(peak - end, sink.silicon.thermal_conductivity, sink.cross_section, sink.length)


@equation("eq18", "end from mean, eq 14's R", "end_rise_K", "eq 14's resistance is off; see eq18_measured")
def eq18(sink: Sink, mean: float) -> float:
    """The end rise by the mean rise and eq 14's resistance."""
    return eq18_measured(sink, mean, anchor_series_resistance(sink))


@equation("eq18_measured", "end from mean, 3D's R", "end_rise_K", NO_PARABOLA)
def eq18_measured(sink: Sink, mean: float, resistance: float) -> float:
    """The same with the 3D anchor resistance."""
    k = sink.silicon.thermal_conductivity
    return equations.end_rise_from_equivalent(mean, resistance, k, sink.cross_section, sink.length)


def at_rest(key: str, title: str, outcome: Outcome[Sink]) -> Check | None:
    """Compare a steady quantity of the 1D model with 3D."""
    if key not in outcome.reduced.steady:
        return None
    one, three, details = outcome.reduced.steady[key], outcome.solved.steady[key], outcome.reduced.details
    note = "; ".join(details.get("warnings", ())) or "--why splits it by assumption" * ("silent" not in details)
    return against_3d(title, unit_of(key), one, three, note)


def from_first(time: np.ndarray) -> np.ndarray:
    """Return the times (s) from 10 us on, with that one."""
    return np.concatenate([[FIRST_TIME], time[time > FIRST_TIME]])


def over_time(
    trace: str, key: str, title: str, relative_to: str, outcome: Outcome[Sink], scale: Estimate | None = None
) -> Check | None:
    """Compare a trace of the 1D model with 3D at the largest distance, relative to the steady 3D ``key`` or a scale."""
    one, three = outcome.reduced.over_time, outcome.solved.over_time
    if trace not in one.values:
        return None
    scale, unit, time = scale or outcome.solved.steady[key], unit_of(trace), from_first(three.time)
    base = outcome.scene.plain.room_temperature if unit == "K" else 0.0
    m, p = (np.interp(time, traces.time, traces.values[trace]) - base for traces in (three, one))
    error, size = three.errors[trace] + one.errors[trace], Estimate(abs(scale.value), scale.error)
    course = Course(time, m, p, overshoot(time, np.abs(p - m)))
    end, largest = (signed(float(course.off[row]), unit) for row in (-1, course.worst))
    note = "" if end == largest else f"{end} at the end"
    return course.comparison(title, unit, error, size, relative_to, note)


CHECKS.check("fig4", *FIGURE)(partial(at_rest, "peak_rise_K", "steady peak, of 3D's"))


@CHECKS.check("fig5", *EQUATION)
def fig5(outcome: Outcome[Sink]) -> Check:
    """Compare the 3D profile along the axis with eq 9's parabola through its own end and peak: rms distance over dT0.

    The error assumes a profile that is anywhere off by the largest error of the steady rises.
    """
    y, rise, fitted = profile(outcome)
    dT0 = float(fitted.max() - fitted.min())
    distance = float(np.sqrt(np.trapezoid((rise - fitted) ** 2, y) / outcome.scene.plain.length))
    error = 2 * max(outcome.solved.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    i, off = int(np.argmax(np.abs(rise - fitted))), share(Estimate(distance, error), Estimate(dT0, error))
    most = f"up to {signed(float(rise[i] - fitted[i]), 'K')} at y = {quantity(float(y[i]) * 1e6, 'um', 3)}"
    reason = f"{most}: {NO_PARABOLA}"
    return Check(
        "parabola's misfit, of dT0", 0.0, distance, "K", off.value, off.error, reason,
        relative_to="dT0, the 3D peak less the end rise", own=_of_paper(outcome),
    )  # fmt: skip


def profile(outcome: Outcome[Sink]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places along the axis (m), the steady 3D rise there and eq 9's parabola by its end and middle (K)."""
    samples, L = outcome.solved.details["profile"], outcome.scene.plain.length
    y, rise = np.asarray(samples["y_m"], float), np.asarray(samples["rise_K"], float)
    y = y * (L / y[-1])  # The places move along with the length.
    dT_end, middle = float(rise[0]), float(np.interp(L / 2, y, rise))
    return y, rise, equations.parabola(y, middle - dT_end, dT_end, L)


for _place in ("peak", "end"):
    CHECKS.check(f"fig6_{_place}", *COURSE)(
        partial(over_time, f"{_place}_K", f"{_place}_rise_K", f"{_place} trace, of final rise", "the final 3D rise")
    )


@CHECKS.check("fig7_current", *COURSE, "current follows")
def fig7_current(outcome: Outcome[Sink]) -> Check | None:
    """Compare the current's traces, relative to the change of the 3D current from the start to the steady state.

    Without a temperature coefficient the current does not change, and the distance is relative to the current itself.
    """
    check = partial(over_time, "current_A", "current_A")
    if not outcome.scene.plain.silicon.temperature_coefficient:
        return check("current trace, of itself", "the 3D current", outcome)
    first, final = float(outcome.solved.over_time.values["current_A"][0]), outcome.solved.steady["current_A"]
    change = Estimate(final.value - first, 2 * final.error)
    return check("current trace, of change", "the change of 3D's current", outcome, change)


@CHECKS.check("energy", "3D")
def energy(outcome: Outcome[Sink]) -> Check:
    """Compare the steady 3D energy imbalance over the power with none. It is a residual, without an error."""
    imbalance = float(outcome.solved.details["energy_imbalance"])
    reason = f"the heat that leaves the 3D solution misses its power by {percent(imbalance)}: do not trust this run"
    return Check("imbalance, of the power", 0.0, imbalance, "1", imbalance, 0.0, reason, relative_to="the 3D power")


def _of_row(end: str, late: bool, outcome: Outcome[Sink]) -> Check | None:
    """Compare a quantity of the row by the 1D model with 3D, steady or over time."""
    (word, key), whole = ROW[end], "itself" if end == "current" else "final rise"
    key = key.format(inner=different(outcome.scene.spans))
    if not late:
        return at_rest(key, f"{word}, of 3D's", outcome)
    return over_time(key.replace("_rise_K", "_K"), key, f"{word} trace, of {whole}", "the final 3D value", outcome)


def _equivalent(late: bool, outcome: Outcome[Sink]) -> Check | None:
    """The largest difference in 3D between two spans, or a span and one sink alone: steady, or over time."""
    if (single := outcome.results.get("single")) is None:
        return None
    made, spans = [], range(1, different(outcome.scene.spans) + 1)
    for what in ("peak", "mean"):
        sources = {"one sink alone": (single, what)}
        sources |= {f"span {n}": (outcome.solved, f"span{n}_{what}") for n in spans}
        for first, second in combinations(sources, 2):
            note = f"the {what} of {first} against that of {second}"
            made.append(_apart(note, outcome.scene, late, sources[first], sources[second]))
    return max(made, key=lambda comparison: abs(comparison.difference))


def _apart(note: str, sink: Sink, late: bool, *both: tuple[Result, str]) -> Check:
    """Compare the 3D rise of one span with another's, steady or over time."""
    title, (a, b) = "spans apart, or from one", (result.steady[f"{name}_rise_K"] for result, name in both)
    if not late:
        return against_3d(title, "K", a, b, note, "the second one")
    traces, time = [(result.over_time, f"{name}_K") for result, name in both], from_first(both[1][0].over_time.time)
    x, y = (np.interp(time, each.time, each.values[name]) - sink.room_temperature for each, name in traces)
    error = sum(each.errors[name] for each, name in traces) + sink.accuracy * (abs(a.value) + abs(b.value))
    scale = "the second one's final value"
    return Course(time, y, x, np.zeros(len(time))).comparison(f"{title}, trace", "K", error, b, scale, note)


for _late in (False, True):
    _suffix, _transient = ("_over_time", ("transient", "10 us")) if _late else ("", ())
    for _end in ROW:
        _needs = *(COURSE if _late else FIGURE), *["inner span"] * ("inner" in _end)
        CHECKS.check(f"islands_{_end}{_suffix}", *_needs)(partial(_of_row, _end, _late))
    CHECKS.check(f"islands_equivalent{_suffix}", *EQUATION, *_transient)(partial(_equivalent, _late))
