"""Checks of the paper's equations on the steady 3D solution: 3D quantities into the right-hand side, against the
3D quantity on the left.

The equations are those of ``reduced1d.equations``; dT_end is the 3D end rise (mean over the beam's end cross section),
dT0 the 3D peak rise less that. ``power_W`` is what the electrodes supply. With electrodes at the pads' outer faces it
includes the pads' share, which eqs 10 and 12 have no term for; eq 12 is compared with it all the same, because the
power is what a user of the equation wants from it, and the reason says what the pads take.
"""

from __future__ import annotations

from compare import reasons
from compare.comparison import Comparison, Models, of_formula
from reduced1d import equations
from reduced1d.sink import anchor_series_resistance
from scenes.result import Estimate

_RISES = {"peak": "peak_rise_K", "end": "end_rise_K"}


def eq12(models: Models) -> Comparison:
    """Power from the 3D current and rises, I^2 R (1 + a [2/3 dT0 + dT_end]), against the 3D power."""
    sink = models.sink
    rho, a = equations.room_resistivity(sink.silicon, sink.room_temperature)

    def formula(current: float, peak: float, end: float) -> float:
        return equations.power(current, peak - end, end, rho, a, sink.length, sink.cross_section)

    inputs = models.estimates(current="current_A", **_RISES)
    measured = models.fem3d.steady["power_W"]
    return of_formula(
        "power from I, peak, end", "W", formula, inputs, measured, lambda value: reasons.eq12(models, value)
    )


def eq13(models: Models) -> Comparison:
    """Equivalent rise 2/3 dT0 + dT_end against the 3D mean rise of the beam."""
    measured = models.fem3d.steady["mean_rise_K"]
    inputs = models.estimates(**_RISES)
    return of_formula(
        "mean rise from peak, end", "K", lambda peak, end: equations.equivalent_rise(peak - end, end), inputs, measured,
        lambda value: reasons.eq13(models, value),
    )  # fmt: skip


def eq14(models: Models) -> Comparison:
    """The printed series resistance of an anchor against the 3D one, end rise over heat through that end."""
    printed = anchor_series_resistance(models.sink)
    measured = models.fem3d.steady["anchor_resistance_K_per_W"]
    return of_formula(
        "anchor resistance by size", "K/W", lambda: printed, {}, measured, lambda value: reasons.eq14(models, value)
    )


def eq16(models: Models) -> Comparison:
    """Heat through one end from the parabola's slope, 4 k A_c dT0 / L, against the 3D flow through that end."""
    sink = models.sink

    def formula(peak: float, end: float) -> float:
        return equations.end_flow(peak - end, sink.silicon.thermal_conductivity, sink.cross_section, sink.length)

    inputs, measured = models.estimates(**_RISES), models.fem3d.steady["end_flow_W"]
    return of_formula(
        "end's heat from peak, end", "W", formula, inputs, measured, lambda value: reasons.eq16(models, value)
    )


def eq18(models: Models) -> Comparison:
    """End rise from the 3D mean rise with eq 14's printed resistance, against the 3D end rise."""
    printed = Estimate(anchor_series_resistance(models.sink), 0.0)
    return _eq18("end from mean, eq 14's R", models, printed)


def eq18_measured(models: Models) -> Comparison:
    """End rise from the 3D mean rise with the 3D anchor resistance, against the 3D end rise."""
    return _eq18("end from mean, 3D's R", models, models.fem3d.steady["anchor_resistance_K_per_W"])


def _eq18(title: str, models: Models, resistance: Estimate) -> Comparison:
    sink = models.sink

    def formula(mean: float, R: float) -> float:
        k = sink.silicon.thermal_conductivity
        return equations.end_rise_from_equivalent(mean, R, k, sink.cross_section, sink.length)

    inputs = models.estimates(mean="mean_rise_K") | {"R": resistance}
    measured = models.fem3d.steady["end_rise_K"]

    def reason(value: float) -> str:
        if title.endswith("3D's R"):
            return reasons.eq18_measured(models, value)
        mean, R = models.fem3d.steady["mean_rise_K"], models.fem3d.steady["anchor_resistance_K_per_W"]
        return reasons.eq18(models, value, formula(mean.value, R.value))

    return of_formula(title, "K", formula, inputs, measured, reason)


def energy(models: Models) -> Comparison:
    """The steady 3D energy imbalance over the power, against none. It is a residual, which has no error of its own."""
    imbalance = float(models.fem3d.details["energy_imbalance"])
    return Comparison(
        "imbalance, of the power", 0.0, imbalance, "1", imbalance, 0.0, lambda: reasons.energy(imbalance),
        relative_to="the 3D power",
    )  # fmt: skip
