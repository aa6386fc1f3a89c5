"""Checks of a sink against 3D, by the paper's equations and Figures 4 to 7, each with the reason of a difference.

An equation is checked on the steady 3D solution: 3D quantities enter the right-hand side, and the result is compared
with the 3D quantity on the left. dT_end is the 3D end rise, the mean over the beam's end cross section; dT0 is the 3D
peak rise less dT_end. ``power_W`` is the power of the electrodes; with electrodes at the pads' outer faces it includes
the heat of the pads, for which eqs 10 and 12 have no term. A figure is checked by the difference of both models'
curves, over time by the largest distance (`compare.against.largest_distance`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from compare.against import Largest, over_time, part
from compare.verdict import Comparison, Models, of_formula, spread, unit_of
from reduced1d import equations
from reduced1d.sink import anchor_series_resistance
from scenes import laws
from scenes.checks import FIRST_TIME
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Result
from scenes.sink import Sink

NOTABLE = 0.005
"""The heating is called uneven where it changes along the beam by more than this part."""
_RISES = {"peak": "peak_rise_K", "end": "end_rise_K"}
PROFILE_STEP = 1e-5
"""Step of a rise along a profile, over the profile's span; the error of a central difference is its square."""
SETTLED = 0.9
"""The steady difference explains that over time where it is at least this part of the largest one."""


def eq12(models: Models) -> Comparison:
    """Power from the 3D current and rises, I^2 R (1 + a [2/3 dT0 + dT_end]), against the 3D power."""
    sink, measured = models.sink, models.steady("power_W")
    rho, a = equations.room_resistivity(sink.silicon, sink.room_temperature)

    def formula(current: float, peak: float, end: float) -> float:
        return equations.power(current, peak - end, end, rho, a, sink.length, sink.cross_section)

    def because(predicted: float) -> str:
        if sink.electrodes == "pad-edge":
            return (
                f"the current also heats the pads, with {quantity(measured - _beam_power(models), 'W')} of the "
                f"{quantity(measured, 'W')} in all; eq 12 knows the beam only, {quantity(predicted, 'W')}"
            )
        peak, end = models.steady("peak_rise_K"), models.steady("end_rise_K")
        mean = equations.equivalent_rise(peak - end, end)
        return (
            f"eq 12 takes the power from the parabola's mean, {quantity(mean, 'K')}, where the 3D mean is "
            f"{quantity(models.steady('mean_rise_K'), 'K')}: {quantity(predicted, 'W')} against "
            f"{quantity(measured, 'W')}"
        )

    title = "power from I, peak, end"
    return of_formula(models, "power_W", title, formula, because, current="current_A", **_RISES)


def eq13(models: Models) -> Comparison:
    """Equivalent rise 2/3 dT0 + dT_end against the 3D mean rise of the beam."""

    def formula(peak: float, end: float) -> float:
        return equations.equivalent_rise(peak - end, end)

    def because(predicted: float) -> str:
        return (
            f"a parabola through the 3D peak and end has the mean {quantity(predicted, 'K')}, the 3D profile "
            f"{quantity(models.steady('mean_rise_K'), 'K')}: {not_parabolic(models)}"
        )

    return of_formula(models, "mean_rise_K", "mean rise from peak, end", formula, because, **_RISES)


def eq14(models: Models) -> Comparison:
    """The printed series resistance of an anchor against the 3D one, end rise over heat through that end."""
    sink, R_3d = models.sink, models.steady("anchor_resistance_K_per_W")

    def because(predicted: float) -> str:
        both = f"eq 14 gives {quantity(predicted, 'K/W')}, 3D {quantity(R_3d, 'K/W')}"
        if sink.electrodes == "pad-edge":
            return (
                f"{both}: eq 14's two prisms leave out the constriction from beam to pad and down into the oxide, and "
                "that the current heats the pads too"
            )
        if R_3d > predicted:
            missing = f"{quantity(R_3d - predicted, 'K/W')} or {percent((R_3d - predicted) / R_3d)} of the whole"
            missing += _with_what_eq14_lacks(models)
            return (
                f"{both}: eq 14's two prisms leave out the constriction where the heat turns from beam to pad and down "
                f"into the oxide, {missing}"
            )
        air = " and the air cools the pads" if sink.convection_coefficient or sink.gap_gas_conductivity else ""
        return (
            f"{both}: part of the heat takes a shorter way than the {quantity(sink.anchor_distance * 1e6, 'um')} to "
            f"the oxide's near side and through its whole area that eq 14 assumes{air}"
        )

    printed = anchor_series_resistance(sink)
    return of_formula(models, "anchor_resistance_K_per_W", "anchor resistance by size", lambda: printed, because)


def eq16(models: Models) -> Comparison:
    """Heat through one end from the parabola's slope, 4 k A_c dT0 / L, against the 3D flow through that end."""
    sink = models.sink

    def formula(peak: float, end: float) -> float:
        return equations.end_flow(peak - end, sink.silicon.thermal_conductivity, sink.cross_section, sink.length)

    def because(predicted: float) -> str:
        return (
            f"the parabola's slope gives {quantity(predicted, 'W')} through an end, 3D "
            f"{quantity(models.steady('end_flow_W'), 'W')}: {not_parabolic(models)}"
        )

    return of_formula(models, "end_flow_W", "end's heat from peak, end", formula, because, **_RISES)


def eq18(models: Models) -> Comparison:
    """End rise from the 3D mean rise with eq 14's printed resistance, against the 3D end rise."""
    printed = anchor_series_resistance(models.sink)

    def because(predicted: float) -> str:
        R_3d, mean = models.steady("anchor_resistance_K_per_W"), models.steady("mean_rise_K")
        return (
            f"with eq 14's {quantity(printed, 'K/W')} the mean rise of {quantity(mean, 'K')} gives an end rise of "
            f"{quantity(predicted, 'K')}, 3D has {quantity(models.steady('end_rise_K'), 'K')}; with the 3D resistance, "
            f"{quantity(R_3d, 'K/W')}, the same equation gives {quantity(eq18_measured(models).predicted, 'K')}"
        )

    return _eq18(models, "end from mean, eq 14's R", because, Estimate(printed, 0.0))


def eq18_measured(models: Models) -> Comparison:
    """End rise from the 3D mean rise with the 3D anchor resistance, against the 3D end rise."""

    def because(predicted: float) -> str:
        return (
            f"even with the 3D anchor resistance the end rise comes out as {quantity(predicted, 'K')} against "
            f"{quantity(models.steady('end_rise_K'), 'K')}: {not_parabolic(models)}"
        )

    return _eq18(models, "end from mean, 3D's R", because, "anchor_resistance_K_per_W")


def _eq18(models: Models, title: str, because: Callable[[float], str], resistance: str | Estimate) -> Comparison:
    sink, k = models.sink, models.sink.silicon.thermal_conductivity

    def formula(mean: float, R: float) -> float:
        return equations.end_rise_from_equivalent(mean, R, k, sink.cross_section, sink.length)

    return of_formula(models, "end_rise_K", title, formula, because, mean="mean_rise_K", R=resistance)


def energy(models: Models) -> Comparison:
    """The steady 3D energy imbalance over the power, against none. It is a residual, which has no error of its own."""
    imbalance = float(models.fem3d.details["energy_imbalance"])
    said = f"the heat that leaves the 3D solution misses its power by {percent(imbalance)}: don't trust this run"
    return Comparison("imbalance, of the power", 0.0, imbalance, "1", imbalance, 0.0, said, relative_to="the 3D power")


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
    """Compare the 3D profile along the axis with eq 9's parabola through its own end and peak: the rms distance over
    dT0.

    The error assumes a profile that is anywhere off by the largest error of the steady rises.
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

    u_num = spread(part, {"distance": Estimate(distance, 2 * error), "final": Estimate(dT0, 2 * error)})
    return Comparison(
        "parabola's misfit, of dT0", 0.0, distance, "K", distance / dT0, u_num, because,
        relative_to="dT0, the 3D peak less the end rise",
    )  # fmt: skip


def profile(models: Models) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places along the beam's axis (m), the steady 3D rise there and eq 9's parabola through its end and middle (K)."""
    samples = models.fem3d.details["profile"]
    y, rise = np.asarray(samples["y_m"], float), np.asarray(samples["rise_K"], float)
    L = models.sink.length
    dT_end, middle = float(rise[0]), float(np.interp(L / 2, y, rise))
    return y, rise, equations.parabola(y, middle - dT_end, dT_end, L)


def misfit_weights(sink: Sink, fem3d: Result) -> np.ndarray:
    """(places,): d fig5 / d rise at each place of the 3D profile (1/K), by central differences."""
    samples = fem3d.details["profile"]
    rise = np.asarray(samples["rise_K"], float)

    def at(changed: np.ndarray) -> float:
        return fig5(Models(sink, replace(fem3d, details={"profile": samples | {"rise_K": changed}}), None)).difference

    step = PROFILE_STEP * float(np.ptp(rise))
    return np.array([at(rise + shift) - at(rise - shift) for shift in step * np.eye(len(rise))]) / (2 * step)


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
    final, title, relative_to = models.fem3d.steady["current_A"], "current trace, of itself", "the 3D current"
    if models.sink.silicon.temperature_coefficient:
        _, solution = models.traces()
        final = Estimate(final.value - float(solution.values["current_A"][0]), 2 * final.error)
        title, relative_to = "current trace, of change", "the change of the 3D current"
    return over_time(models, "current_A", final, title, relative_to, _on_the_way)


def at_rest(models: Models, key: str, title: str, because: Callable[[float], str]) -> Comparison:
    """Compare a steady quantity of the 1D model with 3D."""
    return of_formula(models, key, title, lambda value: value, because, value=models.reduction().steady[key])


def gap(models: Models, key: str) -> float:
    """Return the steady value of the 1D model less the 3D value."""
    return models.reduction().steady[key].value - models.steady(key)


def _on_the_way(models: Models, key: str, at: Largest, final: float) -> str:
    sink, unit, whole = models.sink, unit_of(key), "rise"
    if key == "current_A":
        whole = "change" if sink.silicon.temperature_coefficient else "value"
    name = key.replace("_K", "_rise_K")
    steady = gap(models, name) if name in models.reduction().steady else 0.0
    when, reference = quantity(at.time, "s", 3), f"a final {whole} of {quantity(final, unit)}"
    where = f"largest at {when}, {signed(at.distance, unit)} of {reference}"
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
            in_1d, in_3d = rises_at(models, FIRST_TIME, key)
            cause += (
                f"; at {quantity(FIRST_TIME, 's', 2)} it is {percent(in_1d / in_3d - 1, sign=True)} of the rise by "
                "then, as eq 9's parabola is there from the start"
            )
        return f"{where}: {cause}"
    return f"{where}, {signed(steady, unit)} in the steady state: {_while_heating(models, key, at)}"


def _of_another(models: Models, name: str) -> str:
    p = models.reduction()
    if name not in p.steady:
        return f"{p.model} says nothing of its steady state"
    remarks = "; ".join(p.details.get("warnings", ()))
    remarks = remarks or ("" if "silent" in p.details else "--why splits it by assumption")
    said = f"{p.model} is {signed(gap(models, name), unit_of(name))} off in the steady state"
    return f"{said}; {remarks}" if remarks else said


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
    sink, mean = models.sink, rises_at(models, at.time, "mean_K")
    if key == "peak_K":
        in_1d, in_3d = (peak / m for peak, m in zip(rises_at(models, at.time, key), mean, strict=True))
        return (
            f"eq 9's fixed parabola puts the peak at {in_1d:.2f} of the mean from the start, in 3D it is at "
            f"{in_3d:.2f} then, as heat takes L^2/(pi^2 D) = {crossing_time(sink)} along the beam"
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
    """Name the resistance (K/W) of an anchor by eq 14 and in 3D."""
    printed, R_3d = anchor_series_resistance(models.sink), models.steady("anchor_resistance_K_per_W")
    return f"eq 14's anchor has {quantity(printed, 'K/W')}, 3D's {quantity(R_3d, 'K/W')}{_with_what_eq14_lacks(models)}"


def _with_what_eq14_lacks(models: Models) -> str:
    sink = models.sink
    has = [
        part
        for part, size in (("contacts", sink.contact_resistance), ("a substrate", sink.substrate_thickness))
        if size
    ]
    return f", with {' and '.join(has)} that the 1D model does not have" if has else ""


def not_parabolic(models: Models) -> str:
    """Name the heating or cooling that varies along the beam, and so bends the profile away from a parabola."""
    sink = models.sink
    a = sink.silicon.temperature_coefficient
    reference = 1 + a * (sink.room_temperature - sink.silicon.reference_temperature)
    hot, cold = (reference + a * models.steady(key) for key in ("peak_rise_K", "end_rise_K"))
    causes = []
    if abs(hot / cold - 1) > NOTABLE:
        causes.append(f"the heating at the peak is {percent(hot / cold)} of that at the ends")
    for name, taken in _from_beam(models).items():
        if taken:
            causes.append(f"the {name} takes {percent(taken / _beam_power(models))} of the beam's heat")
    if sink.electrodes == "pad-edge":
        causes.append("the current crowds where it enters the beam")
    if laws.varies(conducts := models.given.silicon.thermal_conductivity):
        hot, cold = (laws.at(conducts, sink.room_temperature + rise) for rise in (models.steady("peak_rise_K"), 0.0))
        causes.append(f"the beam conducts at its peak {percent(hot / cold)} of what it does at room temperature")
    return " and ".join(causes) or "the heat flow is not one-dimensional near the ends"


def _from_beam(models: Models) -> dict[str, float]:
    sink = models.sink
    area_rise = sink.length * sink.width * models.steady("mean_rise_K")
    return {"air": sink.convection_coefficient * area_rise, "gas below": sink.gap_coefficient * area_rise}


def _beam_power(models: Models) -> float:
    return 2 * models.steady("end_flow_W") + sum(_from_beam(models).values())
