"""Why a check differs: a sentence for each, with the numbers of the run at hand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from compare.comparison import Models
from compare.scope import FIRST_TIME, PAPERS
from compare.words import percent, quantity, signed
from reduced1d.sink import anchor_series_resistance

if TYPE_CHECKING:
    from compare.figure_checks import Largest

NOTABLE = 0.005
"""The change of the heating along the beam from which on it is worth a mention."""

SETTLED = 0.9
"""The part of the largest difference from which on the steady one is taken to explain it."""


def eq12(models: Models, predicted: float) -> str:
    """Pads in the circuit where there are any; else the mean that the parabola gives."""
    power = _steady(models, "power_W")
    if models.sink.electrodes == "pad-edge":
        pads = power - _beam_power(models)
        return (
            f"the current also heats the pads, with {quantity(pads, 'W')} of the {quantity(power, 'W')} in all; eq 12 "
            f"knows the beam only, {quantity(predicted, 'W')}"
        )
    return (
        f"eq 12 takes the power from the parabola's mean, {quantity(_equivalent(models), 'K')}, where the 3D mean is "
        f"{quantity(_steady(models, 'mean_rise_K'), 'K')}: {quantity(predicted, 'W')} against {quantity(power, 'W')}"
    )


def eq13(models: Models, predicted: float) -> str:
    """The shape's part in the mean."""
    return (
        f"a parabola through the 3D peak and end has the mean {quantity(predicted, 'K')}, the 3D profile "
        f"{quantity(_steady(models, 'mean_rise_K'), 'K')}: {_not_parabolic(models)}"
    )


def eq14(models: Models, printed: float) -> str:
    """What two prisms in series leave out."""
    sink, found = models.sink, _steady(models, "anchor_resistance_K_per_W")
    both = f"eq 14 gives {quantity(printed, 'K/W')}, 3D {quantity(found, 'K/W')}"
    if sink.electrodes == "pad-edge":
        return (
            f"{both}: eq 14's two prisms leave out the constriction from beam to pad and down into the oxide, and that "
            "the current heats the pads too"
        )
    if found > printed:
        return (
            f"{both}: eq 14's two prisms leave out the constriction where the heat turns from beam to pad and down "
            f"into the oxide, {quantity(found - printed, 'K/W')} or {percent((found - printed) / found)} of the whole"
        )
    air = " and the air cools the pads" if sink.convection_coefficient else ""
    return (
        f"{both}: part of the heat takes a shorter way than the {quantity(sink.anchor_distance * 1e6, 'um')} to the "
        f"oxide's near side and through its whole area that eq 14 assumes{air}"
    )


def eq16(models: Models, predicted: float) -> str:
    """The slope at the end that the shape has."""
    flow = _steady(models, "end_flow_W")
    return (
        f"the parabola's slope gives {quantity(predicted, 'W')} through an end, 3D {quantity(flow, 'W')}: "
        f"{_not_parabolic(models)}"
    )


def eq18(models: Models, predicted: float, with_measured: float) -> str:
    """The resistance it stands on."""
    printed, found = anchor_series_resistance(models.sink), _steady(models, "anchor_resistance_K_per_W")
    mean, end = _steady(models, "mean_rise_K"), _steady(models, "end_rise_K")
    return (
        f"with eq 14's {quantity(printed, 'K/W')} the mean rise of {quantity(mean, 'K')} gives an end rise of "
        f"{quantity(predicted, 'K')}, 3D has {quantity(end, 'K')}; with the 3D resistance, {quantity(found, 'K/W')}, "
        f"the same equation gives {quantity(with_measured, 'K')}"
    )


def eq18_measured(models: Models, predicted: float) -> str:
    """Only the shape is left to blame."""
    return (
        f"even with the 3D anchor resistance the end rise comes out as {quantity(predicted, 'K')} against "
        f"{quantity(_steady(models, 'end_rise_K'), 'K')}: {_not_parabolic(models)}"
    )


def energy(imbalance: float) -> str:
    """A fault of the 3D solution, not of the reduction."""
    return f"the heat that leaves the 3D solution misses its power by {percent(imbalance)}: don't trust this run"


def fig4(models: Models) -> str:
    """The gap in two parts: that of the ends, and that above the ends."""
    p, m = models.reduction().steady, models.fem3d.steady
    if not _papers(models):
        return _of_another(models, "peak_rise_K", "K")
    gap = {key: p[key].value - m[key].value for key in ("peak_rise_K", "end_rise_K", "power_W")}
    above = gap["peak_rise_K"] - gap["end_rise_K"]
    return (
        f"the 1D peak is {signed(gap['peak_rise_K'], 'K')} off: {signed(gap['end_rise_K'], 'K')} of that are the ends' "
        f"(eqs 14 and 18), {signed(above, 'K')} the rise from end to peak (eqs 9 and 17; the power is "
        f"{percent(gap['power_W'] / m['power_W'].value, sign=True)} off)"
    )


def fig5(models: Models, y: np.ndarray, residual: np.ndarray) -> str:
    """Where the profile is farthest from the parabola, and what bends it."""
    i = int(np.argmax(np.abs(residual)))
    return (
        f"the profile is up to {signed(float(residual[i]), 'K')} from the parabola, at y = "
        f"{quantity(float(y[i]) * 1e6, 'um', 3)}: {_not_parabolic(models)}"
    )


def over_time(models: Models, key: str, at: Largest, final: float) -> str:
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
    p, m = models.reduction().traces, models.fem3d.traces
    assert p is not None
    assert m is not None
    return {
        (model, name): float(np.interp(time, traces.time, traces.values[name])) - models.sink.room_temperature
        for model, traces in (("1D", p), ("3D", m))
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
    printed, found = anchor_series_resistance(models.sink), _steady(models, "anchor_resistance_K_per_W")
    return f"eq 14's anchor has {quantity(printed, 'K/W')}, 3D's {quantity(found, 'K/W')}"


def _not_parabolic(models: Models) -> str:
    """What bends the profile away from a parabola: heating or cooling that varies along the beam."""
    sink, found = models.sink, models.fem3d.steady
    a = sink.silicon.temperature_coefficient
    reference = 1 + a * (sink.room_temperature - sink.silicon.reference_temperature)
    hot, cold = (reference + a * found[key].value for key in ("peak_rise_K", "end_rise_K"))
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
    return sink.convection_coefficient * sink.length * sink.width * _steady(models, "mean_rise_K")


def _beam_power(models: Models) -> float:
    """Heat (W) generated in the beam: what leaves it through its two (equal) ends and to the air."""
    return 2 * _steady(models, "end_flow_W") + _air_from_beam(models)


def _equivalent(models: Models) -> float:
    peak, end = _steady(models, "peak_rise_K"), _steady(models, "end_rise_K")
    return 2 / 3 * (peak - end) + end


def _steady(models: Models, key: str) -> float:
    return models.fem3d.steady[key].value
