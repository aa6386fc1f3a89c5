"""Checks of the paper's Figures 4 to 7: what the two models' curves say, against each other; each with the
sentence that says why they differ.

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
from compare.verdict import FIRST_TIME, PAPERS, Comparison, Models, of_formula, spread
from reduced1d.equations import parabola
from reduced1d.sink import anchor_series_resistance
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Traces

SETTLED = 0.9
"""The part of the largest difference from which on the steady one is taken to explain it."""


def fig4(models: Models) -> Comparison:
    """The steady peak rise of the two models."""
    p, m = models.reduction().steady, models.fem3d.steady

    def because(_: float) -> str:
        """The gap in two parts: that of the ends, and that above the ends."""
        if not _papers(models):
            return _of_another(models, "peak_rise_K", "K")
        gap = {key: p[key].value - m[key].value for key in ("peak_rise_K", "end_rise_K", "power_W")}
        above = gap["peak_rise_K"] - gap["end_rise_K"]
        return (
            f"the 1D peak is {signed(gap['peak_rise_K'], 'K')} off: {signed(gap['end_rise_K'], 'K')} of that are the "
            f"ends' (eqs 14 and 18), {signed(above, 'K')} the rise from end to peak (eqs 9 and 17; the power is "
            f"{percent(gap['power_W'] / m['power_W'].value, sign=True)} off)"
        )

    inputs = {"peak": p["peak_rise_K"]}
    return of_formula("steady peak, of 3D's", "K", lambda peak: peak, inputs, m["peak_rise_K"], because)


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
    i = int(np.argmax(np.abs(rise - fitted)))

    def because() -> str:
        return (
            f"the profile is up to {signed(float(rise[i] - fitted[i]), 'K')} from the parabola, at y = "
            f"{quantity(float(y[i]) * 1e6, 'um', 3)}: {not_parabolic(models)}"
        )

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


def over_time(
    models: Models, key: str, final: Estimate, title: str, relative_to: str,
    because: Callable[[Models, str, Largest, float], str],
) -> Comparison:  # fmt: skip
    """The largest distance of the traces of a quantity over a ``final`` value (with its error), which ``relative_to``
    names; ``because`` is asked why, given the quantity, the distance and the final value."""
    reduction, solution = models.traces()
    at = largest_distance(reduction, solution, key)
    error = solution.errors[key] + reduction.errors[key] + at.beyond

    def part(distance: float, final: float) -> float:
        return distance / abs(final) if final else float("inf")

    u_num = spread(part, {"distance": Estimate(at.distance, error), "final": final})
    unit, room = ("A", 0.0) if key == "current_A" else ("K", models.sink.room_temperature)
    return Comparison(
        title, at.predicted - room, at.measured - room, unit, part(at.distance, final.value), u_num,
        lambda: because(models, key, at, final.value), at.time, relative_to=relative_to,
    )  # fmt: skip


def _on_the_way(models: Models, key: str, at: Largest, final: float) -> str:
    """The time of the largest difference, how much of it is the steady state's, and what the reduction leaves out."""
    unit, whole = "K", "rise"
    if key == "current_A":
        unit, whole = "A", "change" if models.sink.silicon.temperature_coefficient else "value"
    p, m = models.reduction(), models.fem3d
    name = {"peak_K": "peak_rise_K", "end_K": "end_rise_K", "current_A": "current_A"}[key]
    steady = p.steady[name].value - m.steady[name].value
    when, of = quantity(at.time, "s", 3), f"a final {whole} of {quantity(final, unit)}"
    where = f"largest at {when}, {signed(at.distance, unit)} of {of}"
    if not _papers(models):
        return f"{where}: {_of_another(models, name, unit)}"
    if at.distance * steady > 0 and abs(steady) >= SETTLED * abs(at.distance):
        cause = {
            "peak_K": "the steady state's gap (see fig4)",
            "end_K": f"the steady state's gap; {_resistances(models)}",
            "current_A": "the steady state's gap, from the mean rise that sets the resistance",
        }[key]
        if key == "current_A" and models.sink.electrodes == "pad-edge":
            cause = "the pads are part of the circuit, and the 1D model has none"
        return f"{where}: {cause}{_before(models, key)}"
    return f"{where}, {signed(steady, unit)} in the steady state: {_while_heating(models, key, at)}"


def _papers(models: Models) -> bool:
    """Whether the reduction is the paper's own."""
    return models.reduction().model in PAPERS


def _of_another(models: Models, name: str, unit: str) -> str:
    """What can be said of any reduction: its steady gap, and where to look for the rest."""
    p = models.reduction()
    gap = p.steady[name].value - models.fem3d.steady[name].value
    remarks = "; ".join(p.details.get("warnings", ()))
    return f"{p.model} is {signed(gap, unit)} off in the steady state; " + (remarks or "--why splits it by assumption")


def _before(models: Models, key: str) -> str:
    """How far off the 1D peak is at the first time compared, relative to the rise it has by then."""
    if key != "peak_K":
        return ""
    rise, first = _rises_at(models, FIRST_TIME), quantity(FIRST_TIME, "s", 2)
    off = rise["1D", key] / rise["3D", key] - 1
    return (
        f"; at {first} it is {percent(off, sign=True)} of the rise by then, as eq 9's parabola is there from the start"
    )


def _rises_at(models: Models, time: float) -> dict[tuple[str, str], float]:
    """Peak and mean rise (K) of both models at a time (s)."""
    return {
        (model, name): float(np.interp(time, traces.time, traces.values[name])) - models.sink.room_temperature
        for model, traces in zip(("1D", "3D"), models.traces(), strict=True)
        for name in ("peak_K", "mean_K")
    }


def _while_heating(models: Models, key: str, at: Largest) -> str:
    """What the reduction gets wrong on the way to the steady state."""
    sink = models.sink
    rise = _rises_at(models, at.time)
    if key == "peak_K":
        ratio = {model: rise[model, "peak_K"] / rise[model, "mean_K"] for model in ("1D", "3D")}
        diffusion = sink.length**2 * sink.silicon.heat_capacity / (math.pi**2 * sink.silicon.thermal_conductivity)
        return (
            f"eq 9's fixed parabola puts the peak at {ratio['1D']:.2f} of the mean from the start, in 3D it is at "
            f"{ratio['3D']:.2f} then, as heat takes L^2/(pi^2 D) = {quantity(diffusion, 's', 3)} along the beam"
        )
    pads = 2 * sink.pad_length * sink.pad_width * sink.thickness / (sink.length * sink.cross_section)
    if key == "end_K" and at.distance < 0:
        heated = ", and the current heats the pads too" if sink.electrodes == "pad-edge" else ""
        return f"the 3D ends are hotter then; {_resistances(models)}{heated}"
    if key == "end_K":
        return (
            f"the 1D ends follow the mean at once; in 3D the heat must first reach them and warm the pads, which hold "
            f"{percent(pads)} of the beam's heat capacity and are left out in 1D"
        )
    return (
        f"the mean rise that sets the resistance is {quantity(rise['1D', 'mean_K'], 'K')} in 1D and "
        f"{quantity(rise['3D', 'mean_K'], 'K')} in 3D then; the pads' heat capacity, {percent(pads)} of the beam's, is "
        "left out in 1D"
    )


def _resistances(models: Models) -> str:
    printed, found = anchor_series_resistance(models.sink), models.steady("anchor_resistance_K_per_W")
    return f"eq 14's anchor has {quantity(printed, 'K/W')}, 3D's {quantity(found, 'K/W')}"
