"""Checks of the paper's equations on the steady 3D solution: 3D quantities into the right-hand side, against the
3D quantity on the left; each with the sentence that says why the two differ.

The equations are those of ``reduced1d.equations``; dT_end is the 3D end rise (mean over the beam's end cross section),
dT0 the 3D peak rise less that. ``power_W`` is what the electrodes supply. With electrodes at the pads' outer faces it
includes the pads' share, which eqs 10 and 12 have no term for; eq 12 is compared with it all the same, because the
power is what a user of the equation wants from it, and the reason says what the pads take.
"""

from __future__ import annotations

from collections.abc import Callable

from compare.verdict import Comparison, Models, of_formula
from reduced1d import equations
from reduced1d.sink import anchor_series_resistance
from scenes.formats import percent, quantity
from scenes.result import Estimate

NOTABLE = 0.005
"""The change of the heating along the beam from which on it is worth a mention."""
_RISES = {"peak": "peak_rise_K", "end": "end_rise_K"}


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
    sink, found = models.sink, models.steady("anchor_resistance_K_per_W")

    def because(predicted: float) -> str:
        both = f"eq 14 gives {quantity(predicted, 'K/W')}, 3D {quantity(found, 'K/W')}"
        if sink.electrodes == "pad-edge":
            return (
                f"{both}: eq 14's two prisms leave out the constriction from beam to pad and down into the oxide, and "
                "that the current heats the pads too"
            )
        if found > predicted:
            missing = f"{quantity(found - predicted, 'K/W')} or {percent((found - predicted) / found)} of the whole"
            return (
                f"{both}: eq 14's two prisms leave out the constriction where the heat turns from beam to pad and down "
                f"into the oxide, {missing}"
            )
        air = " and the air cools the pads" if sink.convection_coefficient else ""
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
        found, mean = models.steady("anchor_resistance_K_per_W"), models.steady("mean_rise_K")
        return (
            f"with eq 14's {quantity(printed, 'K/W')} the mean rise of {quantity(mean, 'K')} gives an end rise of "
            f"{quantity(predicted, 'K')}, 3D has {quantity(models.steady('end_rise_K'), 'K')}; with the 3D resistance, "
            f"{quantity(found, 'K/W')}, the same equation gives {quantity(eq18_measured(models).predicted, 'K')}"
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


def not_parabolic(models: Models) -> str:
    """What bends the profile away from a parabola: heating or cooling that varies along the beam."""
    sink = models.sink
    a = sink.silicon.temperature_coefficient
    reference = 1 + a * (sink.room_temperature - sink.silicon.reference_temperature)
    hot, cold = (reference + a * models.steady(key) for key in ("peak_rise_K", "end_rise_K"))
    causes = []
    if abs(hot / cold - 1) > NOTABLE:
        causes.append(f"the heating at the peak is {percent(hot / cold)} of that at the ends")
    if sink.convection_coefficient:
        causes.append(f"the air takes {percent(_air_from_beam(models) / _beam_power(models))} of the beam's heat")
    if sink.electrodes == "pad-edge":
        causes.append("the current crowds where it enters the beam")
    return " and ".join(causes) or "the heat flow is not one-dimensional near the ends"


def _air_from_beam(models: Models) -> float:
    """Heat (W) that the air takes from the beam's top face, at the mean rise of the beam's volume."""
    sink = models.sink
    return sink.convection_coefficient * sink.length * sink.width * models.steady("mean_rise_K")


def _beam_power(models: Models) -> float:
    """Heat (W) generated in the beam: what leaves it through its two (equal) ends and to the air."""
    return 2 * models.steady("end_flow_W") + _air_from_beam(models)
