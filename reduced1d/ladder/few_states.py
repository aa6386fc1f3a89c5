"""The form of every reduction of the ladder, a few states heated by a current; its answer; and the paper's lumps.

    C da/dt = -G a + I^2 (s + alpha S a),   R = r + alpha s . a,   I = V / R,   a(0) = 0.

``s`` is the heat of a current of 1 A in the cold sink, which the resistivity's linear rise with temperature weighs by
1 + alpha T: so the same s gives the resistance, and the heat is the power I^2 R to the last digit. In modes in which
conductance and feedback are both diagonal, G = 1 and S = diag(nu), the steady state at the squared current x is
a_k = x s_k / (1 - alpha x nu_k), and the voltage

    V(x) = sqrt(x) (r + alpha sum_k x s_k^2 / (1 - alpha x nu_k)).

For alpha > 0 it grows from 0 to infinity, at the pole or beyond all bounds. For alpha < 0 it has a maximum: thermal
runaway above it, and of two currents below it the smaller one grows out of rest. Over time steps grow with the time
since the switch was closed (`reduced1d.numerics`); scipy's Radau method, of order 5, takes ten times as long.

The lumps: each span of a row is a sink of its own after eq 20, all in one circuit; one span is the paper's model. A
span has an anchor at a pad, and at an island half of the island's block alone, t_o/(k_o A_o) with half the area (and
contacts at its faces); eqs 13 to 19 hold for unequal ends (`reduced1d.equations.unequal_ends`). The beam above an
island is left out, as the pads are: no capacity, no air on them, no part of the circuit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.linalg

from reduced1d.equations import (
    air_conductance,
    gap_conductance,
    resistance,
    room_resistivity,
    unequal_ends,
    unequal_peak,
)
from reduced1d.numerics import Step, interpolate, march
from scenes.checks import FIRST_TIME
from scenes.errors import RunawayError
from scenes.result import Estimate, Result, Traces
from scenes.sink import Drive, Sink, different

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix


GROWTH, COARSE_GROWTH = 2.0, 2.8
"""Factors from one time step to the next, in the run and in the coarser one that estimates its error: the sink's peak
by the fin is 5e-6 and 1.7e-4 K off a run with 1.3."""


@dataclass(frozen=True, eq=False)
class FewStates:
    """``capacity`` (n, n) in J/K and ``conductance`` (n, n) in W/K; ``source`` (n,) and ``feedback`` (n, n) of 1 A;
    ``resistance`` in ohm, ``coefficient`` in 1/K; the ``drive``. ``outputs`` are rows (n,) on the states: the rises
    peak, end, mean in K, and in W the heat to the air, and that from the beam alone, to the air and to a gas below it.
    ``source_beam`` and ``resistance_beam`` are the beam's part of the heat.

    The plate has this form too, with sparse matrices; states are solved ``in_modes``."""

    capacity: np.ndarray | csc_matrix
    conductance: np.ndarray | csc_matrix
    source: np.ndarray
    feedback: np.ndarray | csc_matrix
    resistance: float
    source_beam: np.ndarray
    resistance_beam: float
    outputs: dict[str, np.ndarray]
    coefficient: float
    drive: Drive

    @property
    def states(self) -> int:
        return len(self.source)

    @property
    def rates(self) -> np.ndarray:
        """(n,) in 1/s, of states that are modes."""
        return self.conductance.diagonal()

    def on(self, fields: np.ndarray) -> FewStates:
        """The same with states that are combinations of fields (n, states), by Galerkin's method."""
        square = (fields.T @ (matrix @ fields) for matrix in (self.capacity, self.conductance, self.feedback))
        capacity, conductance, feedback = square
        return replace(
            self, capacity=capacity, conductance=conductance, feedback=feedback, source=self.source @ fields,
            source_beam=self.source_beam @ fields, outputs={name: row @ fields for name, row in self.outputs.items()},
        )  # fmt: skip

    def in_modes(self) -> FewStates:
        """The same, of dense matrices, with states that decay each at its own rate."""
        rates, shapes = modes(self.capacity, self.conductance)
        return replace(self.on(shapes), capacity=np.eye(self.states), conductance=np.diag(rates))


def modes(capacity: np.ndarray, conductance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rates (n,) in 1/s, ascending, and modes (n, n) in which the capacity (J/K) is one and the conductance (W/K) the
    rates. The pencil is solved for time constants, so that the slow modes keep full precision."""
    times, vectors = scipy.linalg.eigh(capacity, conductance)
    rates = 1 / times[::-1]
    return rates, vectors[:, ::-1] * np.sqrt(rates)


def steady_state(model: FewStates) -> tuple[np.ndarray, float]:
    """The state (n,) and the current (A) at the model's drive.

    Raises RunawayError where no current matches it.
    """
    gains, sources, shapes = _diagonal(model)
    sign, drive, series = math.copysign(1.0, model.drive.value), abs(model.drive.value), model.drive.series
    limit, upper = _largest(model, gains, sources)
    if drive > limit or (drive == limit and series == math.inf):
        unit, how = model.drive.unit, "rising" if series == math.inf else "falling"
        raise RunawayError(
            f"the sink has no steady state at {model.drive.value:g} {unit}: above {limit:.6g} {unit} its {how} "
            "resistance makes more heat than its ends carry away (thermal runaway)", limit,
        )  # fmt: skip
    if series == math.inf:
        return shapes @ (drive**2 * sources / (1 - model.coefficient * drive**2 * gains)), model.drive.value
    cold = drive / (model.resistance + series)
    upper = min(upper, cold) if model.coefficient >= 0 else upper

    # Bisection, for the derivative of V/R has poles where the resistance has.
    low, high = 1e-3 * upper if model.coefficient >= 0 else cold * (1 - 1e-12), upper
    while high - low > 2 * np.finfo(float).eps * high:
        current = (low + high) / 2
        x = model.coefficient * current**2
        resistance = model.resistance + x * float((sources**2 / (1 - x * gains)).sum())
        low, high = (low, current) if current >= drive / (resistance + series) else (current, high)
    current = high
    amplitudes = current**2 * sources / (1 - model.coefficient * current**2 * gains)
    return shapes @ amplitudes, sign * current


def largest_drive(model: FewStates) -> float:
    """The largest voltage (V) with a steady state: infinite unless resistance falls with the rise; of a given current
    (A) unless it rises."""
    return _largest(model, *_diagonal(model)[:2])[0]


def _largest(model: FewStates, gains: np.ndarray, sources: np.ndarray) -> tuple[float, float]:
    """The largest drive, and an upper bound (A) of the current up to it."""
    pole = model.coefficient * float(gains.max())
    upper = 1 / math.sqrt(pole) if pole > 0 else math.inf
    if model.drive.series == math.inf:
        return upper, math.inf
    return (math.inf, upper) if model.coefficient >= 0 else _first_maximum(model, gains, sources)


def _diagonal(model: FewStates) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """nu (n,), the sources (n,) and the shapes (states, n) of the diagonal form."""
    root = np.sqrt(model.rates)
    gains, turned = scipy.linalg.eigh(model.feedback / np.outer(root, root))
    shapes = turned / root[:, None]
    return gains, model.source @ shapes, shapes


def _first_maximum(model: FewStates, gains: np.ndarray, sources: np.ndarray) -> tuple[float, float]:
    """The first maximum of V and the current there, by repeatedly sampling the interval around it; behind a resistance
    that is large enough there is none."""
    scale = 1 / math.sqrt(-model.coefficient * gains.max())
    low, high = 1e-4 * scale, 1e4 * scale
    for _ in range(8):
        current = np.geomspace(low, high, 200)
        x = model.coefficient * current**2
        voltage = current * (
            model.resistance + model.drive.series + x * (sources**2 / (1 - np.outer(x, gains))).sum(axis=1)
        )
        falls = np.flatnonzero(np.diff(voltage) < 0)
        if not falls.size and high == 1e4 * scale:
            return math.inf, high
        best = int(falls[0]) if falls.size else current.size - 1
        low, high = current[max(best - 1, 0)], current[min(best + 1, current.size - 1)]
    return float(voltage[best]), float(current[best])


class Trajectory:
    """A model in modes over time, from rest to an ``end`` (s): a problem of `reduced1d.numerics` and its solution.

    A step ends at ``growth`` times its start, so that its error is a fixed part of the change around that time.
    Raises RunawayError where the feedback outruns every step.
    """

    def __init__(self, model: FewStates, end: float, growth: float = GROWTH) -> None:
        self.model, self.steps = model, list[Step]()
        if not end > 0:
            return
        first = min(1e-4 * end, 0.1 * FIRST_TIME)
        march(self, np.zeros(model.states), 0.0, end, first, growth, 1e-11, self.steps)

    def stored(self, v: np.ndarray) -> np.ndarray:
        return v

    def solver(self, shift: complex) -> Callable[[np.ndarray], np.ndarray]:
        return lambda right: right / (1 + shift * self.model.rates)

    def heat(self, times: np.ndarray, stages: np.ndarray) -> np.ndarray | None:
        model, resistance = self.model, resistance_at(self.model, stages.T)
        if not resistance.min() > 0:
            return None
        unit = model.source[:, None] + model.coefficient * (model.feedback @ stages)
        return np.asarray(model.drive.through(resistance) ** 2 * unit)

    def states(self, times: np.ndarray) -> np.ndarray:
        """(times, n): the states at ascending times (s)."""
        return interpolate(self.steps, times).T if self.steps else np.zeros((len(times), self.model.states))

    def quantities(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """The quantities of traces.csv at ascending times (s), with rises in place of temperatures."""
        model, states = self.model, self.states(times)
        resistance = resistance_at(model, states)
        current = model.drive.through(resistance)
        return {**_read(model, states), "current_A": current, "power_W": current**2 * resistance}


def resistance_at(model: FewStates, states: np.ndarray) -> np.ndarray:
    """(...,): the resistance (ohm) at states (..., n)."""
    return model.resistance + model.coefficient * (states @ model.source)


def result(
    name: str, sink: Sink, fine: FewStates, coarse: FewStates, steady_only: bool, times: np.ndarray | None
) -> Result:
    """The answer of ``fine``; ``coarse`` is the same reduction less finely discretised, for the errors.

    ``times`` (s, ascending from 0) are the times of the traces; without them, times so dense that linear interpolation
    stays within the sink's accuracy. Raises RunawayError.
    """
    values = steady(fine)
    coarser = values if coarse is fine else steady(coarse)
    limit = largest_drive(fine)
    details: dict[str, Any] = {
        "states": fine.states,
        "time_constant_s": float(1 / fine.rates[0]),
        "air_loss_W": values["power_W"] - values["heat_out_W"],
        f"runaway_{fine.drive.called}": limit if math.isfinite(limit) else None,
    }
    traces = None if steady_only else _traces(sink, fine, coarse, times)
    # Of a model without a discretization rounding remains.
    estimates = {key: Estimate(v, abs(v - coarser[key]) + 8 * float(np.spacing(abs(v)))) for key, v in values.items()}
    return Result(name, estimates, traces, details)


def steady(model: FewStates) -> dict[str, float]:
    state, current = steady_state(model)
    readings = {name.replace("_K", "_rise_K"): float(value) for name, value in _read(model, state).items()}
    power = current**2 * float(resistance_at(model, state))
    end_flow = readings.get("anchor_heat_W", 0.0)
    if not end_flow:
        beam = current**2 * (model.resistance_beam + model.coefficient * float(model.source_beam @ state))
        end_flow = (beam - float((model.outputs["air_beam"] + model.outputs["gas_beam"]) @ state)) / 2
    readings |= {"current_A": current, "power_W": power, "heat_out_W": power - float(model.outputs["air"] @ state)}
    return readings | ({"anchor_resistance_K_per_W": readings["end_rise_K"] / end_flow} if end_flow else {})


def time_grid(trajectory: Trajectory, end_time: float, accuracy: float) -> np.ndarray:
    """Times (s) from 0 to ``end_time`` between which straight lines stay within an accuracy (not below 1e-8) of the
    quantities: rises relative to the final one, current and power to themselves.

    Intervals are halved where their middle is off the chord by a third of it: curves without a bend in an interval are
    nowhere farther off than twice that. Raises ArithmeticError where too many times would be needed.
    """
    accuracy, most = max(accuracy, 1e-8), 100_000
    times = np.concatenate([[0.0], end_time * np.geomspace(1e-4, 1.0, 13)])
    while len(times) < most:
        middle = (times[1:] + times[:-1]) / 2
        off = np.zeros(len(middle))
        for key, value in trajectory.quantities(np.sort(np.concatenate([times, middle]))).items():
            scale = np.abs(value[1::2]) if key in ("current_A", "power_W") else abs(value[-1])
            chord = (value[2::2] + value[:-1:2]) / 2
            off = np.maximum(off, np.abs(value[1::2] - chord) / np.maximum(scale, np.finfo(float).tiny))
        wrong = off > accuracy / 3
        if not wrong.any():
            return times
        times = np.sort(np.concatenate([times, middle[wrong]]))
    raise ArithmeticError(f"more than {most} times are needed for linear interpolation within {accuracy:g}")


def _read(model: FewStates, states: np.ndarray) -> dict[str, np.ndarray]:
    """The rises (K) and heats (W) at states (..., n); of a row of spans the peak is the largest of theirs."""
    readings = {}
    for name, row in model.outputs.items():
        if not name.startswith(("air", "gas")):
            readings[f"{name}_W" if name.endswith("_heat") else f"{name}_K"] = states @ row
    if "peak_K" not in readings:
        readings["peak_K"] = np.max([v for name, v in readings.items() if name.endswith("_peak_K")], axis=0)
    return readings


def _traces(sink: Sink, fine: FewStates, coarse: FewStates, times: np.ndarray | None) -> Traces:
    end = sink.end_time if times is None else float(times[-1]) if len(times) else 0.0
    run = Trajectory(fine, end)
    times = time_grid(run, end, sink.accuracy) if times is None else np.asarray(times, float)
    values, coarser = run.quantities(times), Trajectory(coarse, end, COARSE_GROWTH).quantities(times)
    late = times >= min(FIRST_TIME, end)
    errors = {key: float(np.max(np.abs(values[key] - coarser[key])[late], initial=0.0)) for key in values}
    values = {key: sink.room_temperature + v if key.endswith("_K") else v for key, v in values.items()}
    return Traces(times, values, errors)


def half_island(sink: Sink) -> float:
    """The resistance (K/W) of half of an island's block with its contacts, between a span's end and the substrate."""
    area = sink.island_width * sink.island / 2
    return (sink.oxide_thickness / sink.oxide.thermal_conductivity + sink.contacts) / area


def lumps(sink: Sink, anchor_resistance: float) -> FewStates:
    """The spans as lumps between an anchor of some resistance (K/W) and the islands' blocks, each state an equivalent
    rise.

    Raises ValueError where the silicon does not conduct.
    """
    k, A_c, L = sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    resistivity, a = room_resistivity(sink.silicon, sink.room_temperature)
    island = half_island(sink)
    # The outer and the inner resistance of each kind of span, and how many there are of it.
    kinds = [
        ((anchor_resistance, anchor_resistance if sink.spans == 1 else island), min(sink.spans, 2)),
        ((island, island), sink.spans - 2),
    ][: 1 + (sink.spans > 2)]
    # Of each kind: dT0, the rises of the outer and the inner end, per equivalent rise.
    shapes = [unequal_ends(1.0, *ends, k, A_c, L) for ends, _ in kinds]
    number = np.array([float(count) for _, count in kinds])
    flows = np.array([rises[1] / ends[0] + rises[2] / ends[1] for rises, (ends, _) in zip(shapes, kinds, strict=True)])
    states, cold = np.eye(len(kinds)), number * resistance(0.0, resistivity, a, L, A_c)
    air, gas = number * air_conductance(sink), number * gap_conductance(sink)
    outputs = {"peak": states[0] * unequal_peak(*shapes[0])} if sink.spans == 1 else {}
    outputs |= {"end": states[0] * shapes[0][1], "mean": number / sink.spans, "air": air}
    if sink.spans == 1:
        outputs |= {"air_beam": air, "gas_beam": gas}
    else:
        outputs["anchor_heat"] = outputs["end"] / anchor_resistance
        for span in range(1, different(sink.spans) + 1):
            kind = min(span, 2) - 1
            dT0, outer, inner = shapes[kind]
            outputs[f"span{span}_peak"] = states[kind] * unequal_peak(dT0, outer, inner)
            outputs[f"span{span}_middle"] = states[kind] * (dT0 + (outer + inner) / 2)
            outputs[f"span{span}_mean"] = states[kind]
        for isle in range(1, sink.spans // 2 + 1):
            # From the span before the island, and from the span after, whose outer end it is.
            before, after = min(isle, 2) - 1, min(isle + 1, sink.spans - isle, 2) - 1
            rises = states[before] * shapes[before][2] + states[after] * shapes[after][1 if after else 2]
            outputs[f"island{isle}_heat"] = rises / island
    return FewStates(
        np.diag(number * sink.silicon.heat_capacity * L * A_c), np.diag(number * flows + air + gas), cold,
        np.diag(cold), float(cold.sum()), cold, float(cold.sum()), outputs,
        a, sink.drive,
    ).in_modes()  # fmt: skip
