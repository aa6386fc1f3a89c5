"""Checks of a sink against 3D: the paper's equations and Figures 4 to 7, and the equivalence of several spans.

An equation is checked on the steady 3D solution: 3D quantities enter the right-hand side, and the result is compared
with the 3D quantity on the left. dT_end is the 3D end rise, the mean over the beam's end cross section; dT0 is the 3D
peak rise less dT_end. ``power_W`` is the power of the electrodes; with electrodes at the pads' outer faces it includes
the heat of the pads, for which eqs 10 and 12 have no term. A figure is checked by the difference of both models'
curves, over time by the largest distance from 10 us on.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from itertools import combinations
from typing import Any

import numpy as np

from compare.course import compare_courses
from compare.outcome import Outcome
from compare.verdict import PAPER, Check, Definition, compared, part, share, spread, unit_of
from reduced1d import equations
from scenes.checks import FIRST_TIME
from scenes.formats import percent
from scenes.model import OVER_TIME
from scenes.result import Estimate, Result
from scenes.sink import Sink, different

NO_PARABOLA = "heating, cooling or conductivity vary along the beam, or the flow near its ends is not one-dimensional"
"""Reasons why the profile is no parabola."""
EQUATION = "3D", "one conductivity"
FIGURE = *EQUATION, "1D"
COURSE = *FIGURE, "traces", "10 us"
"""What the checks need (`compare.kinds.sink.SinkKind.absent`)."""
FINAL = "the final 3D value"

EQUATIONS = {
    "eq12": ("power from I, peak, end", "power_W", "eq 12 takes the parabola's mean, and no heat of the pads"),
    "eq13": ("mean rise from peak, end", "mean_rise_K", NO_PARABOLA),
    "eq14": (
        "anchor resistance by size", "anchor_resistance_K_per_W",
        "eq 14 adds two prisms, without the constriction in pad and oxide, nor contacts or a substrate",
    ),
    "eq16": ("end's heat from peak, end", "end_flow_W", NO_PARABOLA),
    "eq18": ("end from mean, eq 14's R", "end_rise_K", "eq 14's resistance is off; see eq18_measured"),
    "eq18_measured": ("end from mean, 3D's R", "end_rise_K", NO_PARABOLA),
}  # fmt: skip
"""Title, the steady 3D quantity on the left-hand side, and why both sides differ."""


def right_hand_sides(sink: Sink, of: Mapping[str, float]) -> dict[str, float]:
    """Return the right-hand sides of the equations by the steady 3D quantities ``of``."""
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    dT_end, dT0, mean = of["end_rise_K"], of["peak_rise_K"] - of["end_rise_K"], of["mean_rise_K"]
    rho, a = equations.room_resistivity(sink.silicon, sink.room_temperature)
    R_series, R_3d = equations.anchor_series_resistance(sink), of["anchor_resistance_K_per_W"]
    return {
        "eq12": equations.power(of["current_A"], dT0, dT_end, rho, a, L, A_c),
        "eq13": equations.equivalent_rise(dT0, dT_end),
        "eq14": R_series,
        "eq16": equations.end_flow(dT0, k, A_c, L),
        "eq18": equations.end_rise_from_equivalent(mean, R_series, k, A_c, L),
        "eq18_measured": equations.end_rise_from_equivalent(mean, R_3d, k, A_c, L),
    }


def equation(name: str, outcome: Outcome[Sink]) -> Check:
    """Compare both sides of an equation; the errors of all quantities in it count."""
    (title, key, note), steady, sink = EQUATIONS[name], outcome.solved.steady, outcome.scene.plain

    def off(**of: float) -> float:
        return part(right_hand_sides(sink, of)[name] - of[key], of[key])

    predicted = right_hand_sides(sink, {quantity: each.value for quantity, each in steady.items()})[name]
    sides = Estimate(predicted, 0.0), steady[key]
    check = compared(title, unit_of(key), *sides, note, own=_of_paper(outcome))
    return replace(check, u_num=spread(off, steady))


def _of_paper(outcome: Outcome[Sink]) -> bool:
    """Whether the equations are of the 1D model, or there is none."""
    return outcome.reduced1d is None or outcome.reduced1d.model == PAPER


def at_rest(key: str, title: str, outcome: Outcome[Sink]) -> Check | None:
    """Compare a steady quantity of the 1D model with 3D; of a row, {inner} in its name is the innermost span."""
    key = key.format(inner=different(outcome.scene.spans))
    if key not in outcome.reduced.steady:
        return None
    return compared(title, unit_of(key), outcome.reduced.steady[key], outcome.solved.steady[key])


def courses(
    title: str, one: tuple[Result, str], three: tuple[Result, str], scale: Estimate, relative_to: str, sink: Sink,
    **more: Any,
) -> Check:  # fmt: skip
    """Compare traces, each by result and name, at their largest distance from 10 us on."""
    unit, a, b = unit_of(three[1]), (one[0].over_time, one[1]), (three[0].over_time, three[1])
    times = np.unique(np.maximum(np.concatenate([a[0].time, b[0].time]), FIRST_TIME))
    base, scale = sink.plain.room_temperature * (unit == "K"), Estimate(abs(scale.value), scale.error)
    return compare_courses(title, unit, a, b, times, scale, relative_to, base, **more)


def over_time(
    trace: str, key: str, title: str, relative_to: str, outcome: Outcome[Sink], scale: Estimate | None = None
) -> Check | None:
    """Compare a trace of the 1D model with 3D, relative to the steady 3D ``key`` or a scale."""
    one, three = outcome.reduced, outcome.solved
    trace, key = (name.format(inner=different(outcome.scene.spans)) for name in (trace, key))
    if trace not in one.over_time.values:
        return None
    return courses(title, (one, trace), (three, trace), scale or three.steady[key], relative_to, outcome.scene)


def fig5(outcome: Outcome[Sink]) -> Check:
    """Compare the 3D profile along the axis with eq 9's parabola through its own end and peak: rms distance over dT0.

    The error assumes a profile that is anywhere off by the largest error of the steady rises.
    """
    y, rise, fitted = profile(outcome)
    distance = float(np.sqrt(np.trapezoid((rise - fitted) ** 2, y) / outcome.scene.plain.length))
    error = 2 * max(outcome.solved.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    off = share(Estimate(distance, error), Estimate(float(np.ptp(fitted)), error))
    return Check(
        "parabola's misfit, of dT0", 0.0, distance, "K", off.value, off.error, NO_PARABOLA,
        relative_to="dT0, the 3D peak less the end rise", own=_of_paper(outcome),
    )  # fmt: skip


def profile(outcome: Outcome[Sink]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places along the axis (m), the steady 3D rise there and eq 9's parabola by its end and middle (K)."""
    samples, L = outcome.solved.details["profile"], outcome.scene.plain.length
    y, rise = np.asarray(samples["y_m"], float), np.asarray(samples["rise_K"], float)
    y = y * (L / y[-1])  # The places move along with the length.
    dT_end, middle = float(rise[0]), float(np.interp(L / 2, y, rise))
    return y, rise, equations.parabola(y, middle - dT_end, dT_end, L)


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


def energy(outcome: Outcome[Sink]) -> Check:
    """Compare the steady 3D energy imbalance over the power with none. It is a residual, without an error."""
    imbalance = float(outcome.solved.details["energy_imbalance"])
    reason = f"the heat that leaves the 3D solution misses its power by {percent(imbalance)}: do not trust this run"
    return Check("imbalance, of the power", 0.0, imbalance, "1", imbalance, 0.0, reason, relative_to="the 3D power")


def equivalent(late: bool, outcome: Outcome[Sink]) -> Check | None:
    """The largest difference in 3D between two spans, or a span and one sink alone: steady, or over time."""
    if (single := outcome.results.get("single")) is None:
        return None
    made, sink, title = [], outcome.scene, "spans apart, or from one"
    for what in ("peak", "mean"):
        spans = {f"span {n}": (outcome.solved, f"span{n}_{what}") for n in range(1, different(sink.spans) + 1)}
        for (first, one), (second, other) in combinations(({"one sink alone": (single, what)} | spans).items(), 2):
            note = f"the {what}: {first} against {second}"
            a, b = (result.steady[f"{name}_rise_K"] for result, name in (one, other))
            if not late:
                made.append(compared(title, "K", a, b, note, relative_to="the second one"))
                continue
            one, other = ((result, f"{name}_K") for result, name in (one, other))
            error = sink.accuracy * (abs(a.value) + abs(b.value))  # of straight lines between each one's own times
            whole = "the second one's final value"
            made.append(courses(f"{title}, trace", one, other, b, whole, sink, note=note, error=error))
    return max(made, key=lambda check: abs(check.difference))


CHECKS: dict[str, Definition[Outcome[Sink]]] = {
    **{name: (partial(equation, name), EQUATION) for name in EQUATIONS},
    "fig4": (partial(at_rest, "peak_rise_K", "steady peak, of 3D's"), FIGURE),
    "fig5": (fig5, EQUATION),
    "fig6_peak": (partial(over_time, "peak_K", "peak_rise_K", "peak trace, of final rise", FINAL), COURSE),
    "fig6_end": (partial(over_time, "end_K", "end_rise_K", "end trace, of final rise", FINAL), COURSE),
    "fig7_current": (fig7_current, (*COURSE, "current follows")),
    "energy": (energy, ("3D",)),
    "islands_equivalent": (partial(equivalent, False), EQUATION),
    f"islands_equivalent{OVER_TIME}": (partial(equivalent, True), (*EQUATION, "traces", "10 us")),
}  # fmt: skip
for _end, _word, _trace, _key in (
    ("peak_inner", "inner peak", "span{inner}_peak_K", "span{inner}_peak_rise_K"),
    ("peak_outer", "outer peak", "span1_peak_K", "span1_peak_rise_K"),
    ("mean", "mean", "mean_K", "mean_rise_K"), ("current", "current", "current_A", "current_A"),
):  # fmt: skip
    CHECKS[f"islands_{_end}"] = partial(at_rest, _key, f"{_word}, of 3D's"), FIGURE
    _title = f"{_word} trace, of final value"
    CHECKS[f"islands_{_end}{OVER_TIME}"] = partial(over_time, _trace, _key, _title, FINAL), COURSE
