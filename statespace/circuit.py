"""The circuit of sink and sensor: each film behind a voltage of its own, both in series with one lead to ground.

    V_e = R_e I_e + R_ground (I_sink + I_sensor),      measured R_e = V_e/I_e = R_e + R_ground (1 + I_other/I_e)

A film's power is what it takes itself, I_e^2 R_e. Without the lead each film is alone, V_e = R_e I_e.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

Pair = tuple[float, float]
FIRST_PART, LEAST_PART = 1.0, 1e-3
"""A lead grows in steps, as parts of the whole: the first is all of it; where the steady state can't be followed, steps
shrink down to the second, to which the end is then known."""
NEWTON, CLOSE = 20, 1e-9
"""The most Newton steps, and the relative change that ends them: the error squares at each."""


def currents(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the currents (A) of (sink, sensor) for voltages (V) and resistances (ohm) of the same shape."""
    if not ground:
        return np.asarray(voltage / resistance)
    total = (voltage / resistance).sum(axis=-1, keepdims=True)
    drop = ground * total / (1 + ground * (1 / resistance).sum(axis=-1, keepdims=True))
    return np.asarray((voltage - drop) / resistance)


def powers(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): what (sink, sensor) take themselves, in W."""
    if not ground:
        return np.asarray(voltage**2 / resistance)
    return currents(voltage, resistance, ground) ** 2 * resistance


def measured(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the resistances (ohm) that the controllers see, V/I.

    A film whose voltage drives no current forward, as before the first sample, is seen by a test current of its own,
    with the lead in series: R + R_ground.
    """
    if not ground:
        return resistance
    current = currents(voltage, resistance, ground)
    forward = voltage * current > 0
    ratio = current[..., ::-1] / np.where(forward, current, 1.0)
    return np.asarray(resistance + ground * np.where(forward, 1 + ratio, 1.0))


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives (2, 2) of each film's resistance and voltage by powers (W) and by measured resistances (ohm)."""

    power_by_resistance: np.ndarray
    power_by_voltage: np.ndarray
    measured_by_resistance: np.ndarray
    measured_by_voltage: np.ndarray


def slopes(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> Slopes:
    """The derivatives at some voltages and resistances, (2,) each.

    Of M I = V with M = diag(R) + R_ground: dI = M^-1 (dV - I dR). What is measured without a current is R + R_ground.
    """
    current, inverse = currents(voltage, resistance, ground), np.linalg.inv(np.diag(resistance) + ground)
    by_resistance, heat = -inverse * current, (2 * current * resistance)[:, None]
    forward = voltage * current > 0
    divisor = np.where(forward, current, 1.0)
    other = current[::-1]

    def of_ratio(change: np.ndarray) -> np.ndarray:
        """R_ground times the change of I_other/I_own by that of the currents."""
        ratios = ground * (change[::-1] / divisor[:, None] - (other / divisor**2)[:, None] * change)
        return np.where(forward[:, None], ratios, 0.0)

    return Slopes(
        heat * by_resistance + np.diag(current**2), heat * inverse,
        np.eye(2) + of_ratio(by_resistance), of_ratio(inverse),
    )  # fmt: skip


def held(
    per_power: np.ndarray, unheated: np.ndarray, resistance: np.ndarray, coefficient: np.ndarray, target: float,
    ground: float, choice: np.ndarray, guess: np.ndarray,
) -> tuple[np.ndarray, np.ndarray] | None:  # fmt: skip
    """The steady rises (K) and currents (A) of (sink, sensor) at which films of a ``choice`` (2, of booleans) are seen
    at the resistance of the ``target`` rise (K) and the others have no voltage; ``None`` where there are none.

    ``per_power`` (2, 2) in K/W and ``unheated`` (2,) in K make rises of powers; ``resistance`` (ohm) is that at no rise
    and changes by ``coefficient`` (1/K); ``guess`` (2,) are the currents without a lead. With R(T) of the rises that
    the currents make, R_seen that of the target and 0 for a film without voltage, the equations are

        I_e (R_e - R_seen,e) + R_ground (I_sink + I_sensor) = 0,

    by Newton's method along a lead that grows from nothing. The state followed is the one that the determinant of the
    slopes keeps its sign on: where it changes, the state has met another one and both end.
    """
    # Plain numbers: with arrays of two the leads of a device took 1.6 s instead of 0.4 s.
    (sink_per_W, sink_per_sensor_W), (sensor_per_sink_W, sensor_per_W) = per_power.tolist()
    (cold_1, cold_2), (warm_1, warm_2) = resistance.tolist(), (resistance * coefficient).tolist()
    seen_1, seen_2 = np.where(choice, resistance * (1 + coefficient * target), 0.0).tolist()
    unheated_1, unheated_2 = unheated.tolist()

    def equations(current: Pair, lead: float) -> tuple[Pair, tuple[float, float, float, float], Pair]:
        """What is missing (V), its slopes by the currents (ohm, by rows) and the rises (K)."""
        i, j = current
        heat_1, heat_2 = i * i * cold_1, j * j * cold_2
        # (1 - P diag(I^2 R')) T = P I^2 R + what is unheated, and its derivatives by both currents.
        per_1, per_2 = i * i * warm_1, j * j * warm_2
        feedback = (
            1 - sink_per_W * per_1,
            -sink_per_sensor_W * per_2,
            -sensor_per_sink_W * per_1,
            1 - sensor_per_W * per_2,
        )
        heated_1, heated_2 = (
            sink_per_W * heat_1 + sink_per_sensor_W * heat_2,
            sensor_per_sink_W * heat_1 + sensor_per_W * heat_2,
        )
        rise = _solved(feedback, (heated_1 + unheated_1, heated_2 + unheated_2))
        hot_1, hot_2 = cold_1 + warm_1 * rise[0], cold_2 + warm_2 * rise[1]
        by_i = _solved(feedback, (sink_per_W * 2 * i * hot_1, sensor_per_sink_W * 2 * i * hot_1))
        by_j = _solved(feedback, (sink_per_sensor_W * 2 * j * hot_2, sensor_per_W * 2 * j * hot_2))
        slope = (
            hot_1 - seen_1 + i * warm_1 * by_i[0] + lead, i * warm_1 * by_j[0] + lead,
            j * warm_2 * by_i[1] + lead, hot_2 - seen_2 + j * warm_2 * by_j[1] + lead,
        )  # fmt: skip
        return (i * (hot_1 - seen_1) + lead * (i + j), j * (hot_2 - seen_2) + lead * (i + j)), slope, rise

    def solved(current: Pair, lead: float, sign: float) -> tuple[Pair, Pair] | None:
        for _ in range(NEWTON):
            missing, slope, _ = equations(current, lead)
            if not _determinant(slope) * sign > 0:
                return None
            change = _solved(slope, missing)
            current = current[0] - change[0], current[1] - change[1]
            if max(map(abs, change)) <= CLOSE * max(map(abs, current)):
                break
        else:
            return None
        _, slope, rise = equations(current, lead)
        kept = _determinant(slope) * sign > 0 and all(i > 0 for i, on in zip(current, choice, strict=True) if on)
        return (rise, current) if kept else None

    current = np.where(choice, guess, 0.0)
    if (current[choice] <= 0).any():
        return None
    followed: Pair = float(current[0]), float(current[1])
    sign = float(np.sign(_determinant(equations(followed, 0.0)[1])))
    reached, part, state = 0.0, FIRST_PART, None
    while reached < 1.0:
        following = min(reached + part, 1.0)
        state = solved(followed, ground * following, sign)
        if state is None:
            part /= 4
            if part < LEAST_PART:
                return None
        else:
            reached, followed = following, state[1]
    return None if state is None else (np.array(state[0]), np.array(state[1]))


def _determinant(matrix: tuple[float, float, float, float]) -> float:
    """That of a matrix (2, 2) by its rows."""
    a, b, c, d = matrix
    return a * d - b * c


def _solved(matrix: tuple[float, float, float, float], right: Pair) -> Pair:
    """What a matrix (2, 2), given by its rows, times is the right-hand side; NaN where that is nothing or much."""
    a, b, c, d = matrix
    determinant = _determinant(matrix) or math.nan
    return (d * right[0] - b * right[1]) / determinant, (a * right[1] - c * right[0]) / determinant
