"""Checks of the paper's Figures 4 to 7: what the two models' curves say, against each other; each with the
sentence that says why the two differ.

Where a largest difference over time is asked for it is sought at the times of the 3D traces from 10 us on (and at
10 us itself). Its error has four parts, added: that of the 3D trace, that of the 1D trace (rounding), that of the final
change that it is relative to, and what a maximum between two times may exceed the one found by.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compare.equation_checks import not_parabolic
from compare.verdict import FIRST_TIME, Comparison, Models, of_formula, spread, unit_of
from reduced1d.equations import parabola
from reduced1d.sink import anchor_series_resistance
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Traces
from scenes.sink import Sink

SETTLED = 0.9
"""The part of the largest difference from which on the steady one is taken to explain it."""


def fig4(models: Models) -> Comparison:

    def because(_: float) -> str:
        """The gap in two parts: that of the ends, and that above the ends."""
        if not models.papers():
            return _of_another(models, "peak_rise_K")
        peak, end = gap(models, "peak_rise_K"), gap(models, "end_rise_K")
        power = gap(models, "power_W") / models.steady("power_W")
        return (
            f"the 1D peak is {signed(peak, 'K')} off: {signed(end, 'K')} of that are the ends' (eqs 14 and 18), "
            f"{signed(peak - end, 'K')} the rise from end to peak (eqs 9 and 17; the power is "
            f"{percent(power, sign=True)} off)"
        )

    return at_rest(models, "peak_rise_K", "steady peak, of 3D's", because)


def fig5(models: Models) -> Comparison:
    """Root mean square distance (K) of the 3D axis profile from eq 9's parabola through its own end and peak, against
    none, relative to its dT0.

    The error is that of a profile anywhere off by the largest error of the steady rises, and so its parabola too.
    """
    y, rise, fitted = profile(models)
    dT0 = float(fitted.max() - fitted.min())
    distance = float(np.sqrt(np.trapezoid((rise - fitted) ** 2, y) / models.sink.length))
    error = max(models.fem3d.steady[key].error for key in ("peak_rise_K", "end_rise_K", "mean_rise_K"))
    i = int(np.argmax(np.abs(rise - fitted)))

    def because() -> str:
        return (
            f"the profile is up to {signed(float(rise[i] - fitted[i]), 'K')} from the parabola, at y = "
            f"{quantity(float(y[i]) * 1e6, 'um', 3)}: {not_parabolic(models)}"
        )

    u_num = spread(_part, {"distance": Estimate(distance, 2 * error), "final": Estimate(dT0, 2 * error)})
    return Comparison(
        "parabola's misfit, of dT0", 0.0, distance, "K", distance / dT0, u_num, because,
        relative_to="dT0, the 3D peak less the end rise",
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
    final = models.fem3d.steady["peak_rise_K"]
    return over_time(models, "peak_K", final, "peak trace, of final rise", "the final 3D rise", _on_the_way)


def fig6_end(models: Models) -> Comparison:
    """Largest distance of the ends' traces over the final 3D end rise."""
    final = models.fem3d.steady["end_rise_K"]
    return over_time(models, "end_K", final, "end trace, of final rise", "the final 3D rise", _on_the_way)


def fig7_current(models: Models) -> Comparison:
    """Largest distance of the current's traces over the change of the 3D current from the start to the steady state.

    Without a temperature coefficient the current does not change, and the distance is relative to the current itself.
    """
    final, title, of = models.fem3d.steady["current_A"], "current trace, of itself", "the 3D current"
    if models.sink.silicon.temperature_coefficient:
        _, solution = models.traces()
        final = Estimate(final.value - float(solution.values["current_A"][0]), 2 * final.error)
        title, of = "current trace, of change", "the change of the 3D current"
    return over_time(models, "current_A", final, title, of, _on_the_way)


def at_rest(models: Models, key: str, title: str, because: Callable[[float], str]) -> Comparison:
    """A steady quantity of the 1D model less that of 3D, over the latter."""
    return of_formula(models, key, title, lambda value: value, because, value=models.reduction().steady[key])


@dataclass(frozen=True)
class Largest:
    """The largest distance |1D - 3D| of two traces, with its sign, both values, its time (s) and the bound of what a
    maximum between the times may be larger by."""

    distance: float
    predicted: float
    measured: float
    time: float
    beyond: float


def from_first(time: np.ndarray) -> np.ndarray:
    """The times (s) from 10 us on, that one among them."""
    return np.concatenate([[FIRST_TIME], time[time > FIRST_TIME]])


def largest_distance(predicted: Traces, measured: Traces, key: str) -> Largest:
    """The largest distance of a quantity from 10 us on, at the times of ``measured``, which ``predicted`` shares.

    ValueError where the times differ.
    """
    if not np.array_equal(predicted.time, measured.time):
        raise ValueError("the two models' traces must be at the same times")
    late = from_first(measured.time)
    p, m = (np.interp(late, measured.time, traces.values[key]) for traces in (predicted, measured))
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


def over_time(
    models: Models, key: str, final: Estimate, title: str, relative_to: str,
    because: Callable[[Models, str, Largest, float], str],
) -> Comparison:  # fmt: skip
    """The largest distance of the traces of a quantity over a ``final`` value (with its error), which ``relative_to``
    names; ``because`` is asked why, given the quantity, the distance and the final value."""
    reduction, solution = models.traces()
    at = largest_distance(reduction, solution, key)
    distance = Estimate(at.distance, solution.errors[key] + reduction.errors[key] + at.beyond)
    room = 0.0 if key == "current_A" else models.sink.room_temperature
    return Comparison(
        title, at.predicted - room, at.measured - room, unit_of(key), _part(at.distance, final.value),
        spread(_part, {"distance": distance, "final": final}), lambda: because(models, key, at, final.value), at.time,
        relative_to=relative_to,
    )  # fmt: skip


def _part(distance: float, final: float) -> float:
    return distance / abs(final) if final else float("inf")


def gap(models: Models, key: str) -> float:
    """The steady value of the 1D model less that of 3D."""
    return models.reduction().steady[key].value - models.steady(key)


def _on_the_way(models: Models, key: str, at: Largest, final: float) -> str:
    """The time of the largest difference, how much of it is the steady state's, and what the reduction leaves out."""
    sink, unit, whole = models.sink, unit_of(key), "rise"
    if key == "current_A":
        whole = "change" if sink.silicon.temperature_coefficient else "value"
    name = key.replace("_K", "_rise_K")
    steady = gap(models, name)
    when, of = quantity(at.time, "s", 3), f"a final {whole} of {quantity(final, unit)}"
    where = f"largest at {when}, {signed(at.distance, unit)} of {of}"
    if not models.papers():
        return f"{where}: {_of_another(models, name)}"
    if at.distance * steady > 0 and abs(steady) >= SETTLED * abs(at.distance):
        cause = {
            "peak_K": "the steady state's gap (see fig4)",
            "end_K": f"the steady state's gap; {resistances(models)}",
            "current_A": "the steady state's gap, from the mean rise that sets the resistance",
        }[key]
        if key == "current_A" and sink.electrodes == "pad-edge":
            cause = "the pads are part of the circuit, and the 1D model has none"
        if key == "peak_K":
            one, three = rises_at(models, FIRST_TIME, key)
            cause += (
                f"; at {quantity(FIRST_TIME, 's', 2)} it is {percent(one / three - 1, sign=True)} of the rise by then, "
                "as eq 9's parabola is there from the start"
            )
        return f"{where}: {cause}"
    return f"{where}, {signed(steady, unit)} in the steady state: {_while_heating(models, key, at)}"


def _of_another(models: Models, name: str) -> str:
    """What can be said of any reduction: its steady gap, and where to look for the rest."""
    p = models.reduction()
    remarks = "; ".join(p.details.get("warnings", ())) or "--why splits it by assumption"
    return f"{p.model} is {signed(gap(models, name), unit_of(name))} off in the steady state; {remarks}"


def rises_at(models: Models, time: float, key: str) -> list[float]:
    """A rise (K) at a time (s), in 1D and in 3D."""
    room = models.sink.room_temperature
    return [float(np.interp(time, traces.time, traces.values[key])) - room for traces in models.traces()]


def crossing_time(sink: Sink) -> str:
    """How long heat takes along a beam."""
    return quantity(
        sink.length**2 * sink.silicon.heat_capacity / (math.pi**2 * sink.silicon.thermal_conductivity), "s", 3
    )


def _while_heating(models: Models, key: str, at: Largest) -> str:
    """What the reduction gets wrong on the way to the steady state."""
    sink, mean = models.sink, rises_at(models, at.time, "mean_K")
    if key == "peak_K":
        one, three = (peak / m for peak, m in zip(rises_at(models, at.time, key), mean, strict=True))
        return (
            f"eq 9's fixed parabola puts the peak at {one:.2f} of the mean from the start, in 3D it is at "
            f"{three:.2f} then, as heat takes L^2/(pi^2 D) = {crossing_time(sink)} along the beam"
        )
    pads = percent(2 * sink.pad_length * sink.pad_width * sink.thickness / (sink.length * sink.cross_section))
    if key == "end_K" and at.distance < 0:
        heated = ", and the current heats the pads too" if sink.electrodes == "pad-edge" else ""
        return f"the 3D ends are hotter then; {resistances(models)}{heated}"
    if key == "end_K":
        return (
            "the 1D ends follow the mean at once; in 3D the heat must first reach them and warm the pads, which hold "
            f"{pads} of the beam's heat capacity and are left out in 1D"
        )
    return (
        f"the mean rise that sets the resistance is {quantity(mean[0], 'K')} in 1D and {quantity(mean[1], 'K')} in 3D "
        f"then; the pads' heat capacity, {pads} of the beam's, is left out in 1D"
    )


def resistances(models: Models) -> str:
    """Of an anchor, as printed and in 3D."""
    printed, found = anchor_series_resistance(models.sink), models.steady("anchor_resistance_K_per_W")
    return f"eq 14's anchor has {quantity(printed, 'K/W')}, 3D's {quantity(found, 'K/W')}"
