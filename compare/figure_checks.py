"""Checks of the paper's Figures 4 to 7: what the two models' curves say, against each other.

Where a largest difference over time is asked for it is sought at the times of the 3D traces from 10 us on (and at
10 us itself). Its error has four parts, added: that of the 3D trace, that of the 1D trace (rounding), that of the final
change that it is relative to, and what a maximum between two times may exceed the one found by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compare import reasons
from compare.comparison import Comparison, Models, of_formula
from compare.scope import FIRST_TIME
from compare.verdict import spread
from reduced1d.equations import parabola
from scenes.result import Estimate, Traces


def fig4(models: Models) -> Comparison:
    """The steady peak rise of the two models."""
    predicted = models.reduction().steady["peak_rise_K"]
    measured = models.fem3d.steady["peak_rise_K"]
    return of_formula(
        "steady peak, of 3D's", "K", lambda peak: peak, {"peak": predicted}, measured, lambda _: reasons.fig4(models)
    )


def fig5(models: Models) -> Comparison:
    """Root mean square distance (K) of the 3D axis profile from eq 9's parabola through its own end and peak, against
    none, relative to its dT0.

    The error is that of a profile anywhere off by the largest error of the steady rises, and so its parabola too.
    """
    y, rise, fitted = profile(models)
    dT0 = float(fitted.max() - fitted.min())
    square = np.trapezoid((rise - fitted) ** 2, y) / models.sink.length
    distance = float(np.sqrt(square))
    error = max(models.fem3d.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    u_num = spread(
        lambda distance, dT0: distance / dT0,
        {"distance": Estimate(distance, 2 * error), "dT0": Estimate(dT0, 2 * error)},
    )
    return Comparison(
        "parabola's misfit, of dT0", 0.0, distance, "K", distance / dT0, u_num,
        lambda: reasons.fig5(models, y, rise - fitted), relative_to="dT0, the 3D peak less the end rise",
    )  # fmt: skip


def profile(models: Models) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places along the beam's axis (m), the steady 3D rise there and eq 9's parabola through its end and middle (K)."""
    found = models.fem3d.details["profile"]
    y, rise = np.asarray(found["y_m"], float), np.asarray(found["rise_K"], float)
    L = models.sink.length
    dT_end, middle = float(rise[0]), float(np.interp(L / 2, y, rise))
    return y, rise, parabola(y, middle - dT_end, dT_end, L)


def fig6_peak(models: Models) -> Comparison:
    """Largest distance of the peak's traces over the final 3D peak rise."""
    return _over_time(
        "peak trace, of final rise", "the final 3D rise", models, "peak_K", models.fem3d.steady["peak_rise_K"]
    )


def fig6_end(models: Models) -> Comparison:
    """Largest distance of the ends' traces over the final 3D end rise."""
    return _over_time(
        "end trace, of final rise", "the final 3D rise", models, "end_K", models.fem3d.steady["end_rise_K"]
    )


def fig7_current(models: Models) -> Comparison:
    """Largest distance of the current's traces over the change of the 3D current from the start to the steady state.

    Without a temperature coefficient the current does not change, and the distance is relative to the current itself.
    """
    steady = models.fem3d.steady["current_A"]
    if models.sink.silicon.temperature_coefficient == 0:
        return _over_time("current trace, of itself", "the 3D current", models, "current_A", steady)
    traces = models.fem3d.traces
    assert traces is not None
    change = Estimate(steady.value - float(traces.values["current_A"][0]), 2 * steady.error)
    return _over_time("current trace, of change", "the change of the 3D current", models, "current_A", change)


@dataclass(frozen=True)
class Largest:
    """The largest distance |1D - 3D| of two traces, with its sign, both values, its time (s) and the bound of what a
    maximum between the times may be larger by."""

    distance: float
    predicted: float
    measured: float
    time: float
    beyond: float


def largest_distance(predicted: Traces, measured: Traces, key: str) -> Largest:
    """The largest distance of a quantity from 10 us on, at the times of ``measured``, which ``predicted`` shares.

    ValueError where the times differ.
    """
    time = measured.time
    if not np.array_equal(predicted.time, time):
        raise ValueError("the two models' traces must be at the same times")
    late = np.concatenate([[FIRST_TIME], time[time > FIRST_TIME]])
    p, m = (np.interp(late, time, traces.values[key]) for traces in (predicted, measured))
    off = p - m
    i = int(np.argmax(np.abs(off)))
    return Largest(float(off[i]), float(p[i]), float(m[i]), float(late[i]), _beyond(late, np.abs(off), i))


def _beyond(time: np.ndarray, off: np.ndarray, i: int) -> float:
    """How far the parabola through the largest value and its two neighbours rises above it; 0 at either end."""
    if not 0 < i < len(off) - 1:
        return 0.0
    left, right = time[i] - time[i - 1], time[i + 1] - time[i]
    before, after = (off[i] - off[i - 1]) / left, (off[i + 1] - off[i]) / right
    curvature = (after - before) / (left + right)
    slope = (before * right + after * left) / (left + right)
    return float(-(slope**2) / (4 * curvature)) if curvature < 0 else 0.0


def _over_time(title: str, relative_to: str, models: Models, key: str, final: Estimate) -> Comparison:
    reduction, solution = models.reduction().traces, models.fem3d.traces
    assert reduction is not None
    assert solution is not None
    at = largest_distance(reduction, solution, key)
    error = solution.errors[key] + reduction.errors[key] + at.beyond
    u_num = spread(
        lambda distance, final: distance / abs(final) if final else float("inf"),
        {"distance": Estimate(at.distance, error), "final": final},
    )
    room = 0.0 if key == "current_A" else models.sink.room_temperature
    difference = at.distance / abs(final.value) if final.value else float("inf")
    return Comparison(
        title, at.predicted - room, at.measured - room, "A" if key == "current_A" else "K", difference, u_num,
        lambda: reasons.over_time(models, key, at, final.value), at.time, relative_to=relative_to,
    )  # fmt: skip
