"""The paper's 1D reduction of the sink: one uniform rise after eq 20, its peak and ends after eqs 13, 17 and 18."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from reduced1d import equations
from reduced1d.lumped import Lump, rise_at, runaway_voltage, steady_rise, steady_rounding
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink


def anchor_series_resistance(sink: Sink) -> float:
    """Eq 14's resistance (K/W) of one anchor: u_o of silicon as wide as the pad, then the oxide block."""
    return equations.series_resistance(
        sink.anchor_distance, sink.silicon.thermal_conductivity, sink.pad_width * sink.thickness,
        sink.oxide_thickness, sink.oxide.thermal_conductivity, sink.oxide_length * sink.oxide_width,
    )  # fmt: skip


def air_conductance(sink: Sink) -> float:
    """Conductance (W/K) from the beam's top face to the room: coefficient times length times width.

    Our reading: the paper announces the loss to the air and leaves it out of eq 20; as a lumped term h A dT_c with the
    equivalent rise it is exact for the beam (dT_c is the mean rise). The pads' faces, which the 3D scene cools too,
    have no temperature in this model.
    """
    return sink.convection_coefficient * sink.length * sink.width


def gap_conductance(sink: Sink) -> float:
    """Conductance (W/K) of the gap's gas from the beam to a substrate at room temperature, lumped as the air's."""
    return sink.gap_coefficient * sink.length * sink.width


def lump(sink: Sink) -> Lump:
    """The constants of eq 20 for a sink: the beam's heat capacity and resistance, and the conductance of eq 19 through
    both anchors plus the conductances of the air and of the gas below.

    The model has no pads: they hold no heat, and have no electrical resistance whichever the sink's electrodes are,
    so that with electrodes at the pads' outer faces it leaves out part of the circuit.

    Raises ValueError where the silicon does not conduct (``room_resistivity``).
    """
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    resistivity, a = equations.room_resistivity(sink.silicon, sink.room_temperature)
    return Lump(
        capacity=sink.silicon.heat_capacity * L * A_c,
        conductance=equations.anchor_flow(1.0, anchor_series_resistance(sink), k, A_c, L)
        + air_conductance(sink)
        + gap_conductance(sink),
        voltage=sink.voltage,
        resistance=equations.resistance(0.0, resistivity, a, L, A_c),
        coefficient=a,
    )


def solve(sink: Sink, *, steady_only: bool = False, times: np.ndarray | None = None) -> Result:
    """The steady state and, unless ``steady_only``, the traces of the paper's reduction of a sink.

    The traces are eq 20's exact solution, so ``error`` is rounding alone. They are at ``times`` (s, 1D) where given;
    else at times up to the sink's end time, so dense that linear interpolation stays within the sink's accuracy:
    temperatures relative to the final rise, current and power to themselves.
    Temperatures in the traces are absolute; "mean" is the equivalent uniform temperature. "heat_out_W" leaves through
    both anchors and the gas below; the loss to the air is ``details["air_loss_W"]``.

    Raises RunawayError where there is no steady state, ValueError for negative times or silicon that does not conduct.
    """
    model = lump(sink)
    rounding = steady_rounding(model)
    steady = _quantities(sink, model, np.array(steady_rise(model)))
    R_series = anchor_series_resistance(sink)
    values = {
        "peak_rise_K": steady["peak_K"],
        "end_rise_K": steady["end_K"],
        "mean_rise_K": steady["mean_K"],
        "current_A": steady["current_A"],
        "power_W": steady["power_W"],
        "heat_out_W": 2 * steady["end_K"] / R_series + gap_conductance(sink) * steady["mean_K"],
        "anchor_resistance_K_per_W": np.array(R_series),
    }
    limit = runaway_voltage(model)
    return Result(
        model="reduced1d",
        steady={key: Estimate(float(value), rounding * abs(float(value))) for key, value in values.items()},
        traces=None if steady_only else _traces(sink, model, times, rounding),
        details={
            "time_constant_s": model.time_constant,
            "air_loss_W": air_conductance(sink) * float(steady["mean_K"]),
            "runaway_voltage_V": limit if math.isfinite(limit) else None,
        },
    )


def _quantities(sink: Sink, model: Lump, rise: np.ndarray) -> dict[str, np.ndarray]:
    """The trace quantities at an equivalent rise, with rises in place of temperatures."""
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    R_series = anchor_series_resistance(sink)
    dT_end = equations.end_rise_from_equivalent(rise, R_series, k, A_c, L)
    current = model.voltage / (model.resistance * (1 + model.coefficient * rise))
    return {
        "peak_K": dT_end + equations.peak_above_end(dT_end, R_series, k, A_c, L),
        "end_K": dT_end,
        "mean_K": rise,
        "current_A": current,
        "power_W": model.voltage * current,
    }


def _traces(sink: Sink, model: Lump, times: np.ndarray | None, rounding: float) -> Traces:
    if times is None:
        times = time_grid(lambda at: _quantities(sink, model, rise_at(model, at)), sink.end_time, sink.accuracy)
    time = np.asarray(times, float)
    values = _quantities(sink, model, rise_at(model, time))
    errors = {key: rounding * float(np.max(np.abs(value), initial=0.0)) for key, value in values.items()}
    for key in ("peak_K", "end_K", "mean_K"):
        values[key] = sink.room_temperature + values[key]
        errors[key] += float(np.finfo(float).eps) * sink.room_temperature
    return Traces(time, values, errors)


def time_grid(
    traces: Callable[[np.ndarray], dict[str, np.ndarray]], end_time: float, accuracy: float
) -> np.ndarray:  # fmt: skip
    """Times (s) from 0 to ``end_time`` between which straight lines stay within an accuracy (not below 1e-8) of
    ``traces`` at any times: rises relative to the final one, current and power to themselves.

    Intervals are halved where their middle is off the chord by a third of it: curves without a bend in an interval are
    nowhere farther off than twice that. Raises ArithmeticError where too many times would be needed.
    """
    accuracy, most = max(accuracy, 1e-8), 100_000
    times = np.concatenate([[0.0], end_time * np.geomspace(1e-4, 1.0, 13)])
    while len(times) < most:
        middle = (times[1:] + times[:-1]) / 2
        values = traces(np.sort(np.concatenate([times, middle])))
        off = np.zeros(len(middle))
        for key, value in values.items():
            scale = np.abs(value[1::2]) if key in ("current_A", "power_W") else abs(value[-1])
            chord = (value[2::2] + value[:-1:2]) / 2
            off = np.maximum(off, np.abs(value[1::2] - chord) / np.maximum(scale, np.finfo(float).tiny))
        wrong = off > accuracy / 3
        if not wrong.any():
            return times
        times = np.sort(np.concatenate([times, middle[wrong]]))
    raise ArithmeticError(f"more than {most} times are needed for linear interpolation within {accuracy:g}")
