"""The circuit of sink and sensor: each film behind a voltage of its own, both in series with one lead to ground.

    V_e = R_e I_e + R_ground (I_sink + I_sensor),      measured R_e = V_e/I_e = R_e + R_ground (1 + I_other/I_e)

A film's power is what it takes itself, I_e^2 R_e. Without the lead each film is alone, V_e = R_e I_e.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

FIRST_PART, LEAST_PART = 1.0, 1e-3
"""The parts of a lead that are added at a time on the way to the whole: at first all of it; where the steady state
can't be followed that far less, and at a thousandth it has come to an end, which is known to that."""
NEWTON, CLOSE = 20, 1e-9
"""Newton's method squares what is missing: a change that small was the last but for rounding."""


def currents(voltage: np.ndarray, resistance: np.ndarray, ground: float) -> np.ndarray:
    """(..., 2): the currents (A) of (sink, sensor) for voltages (V) and resistances (ohm) of the same shape."""
    if not ground:
        return np.asarray(voltage / resistance)
    through = (voltage / resistance).sum(axis=-1, keepdims=True)
    drop = ground * through / (1 + ground * (1 / resistance).sum(axis=-1, keepdims=True))
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
    """What each film's resistance (ohm) and voltage (V), along a row, change of powers (W) and measured resistances
    (ohm) of both: (2, 2) each."""

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
    seen = np.where(choice, resistance * (1 + coefficient * target), 0.0)
    warm = resistance * coefficient

    def equations(current: np.ndarray, lead: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        feedback = np.eye(2) - per_power * (current**2 * warm)
        rise = np.linalg.solve(feedback, per_power @ (current**2 * resistance) + unheated)
        hot = resistance + warm * rise
        per_current = np.linalg.solve(feedback, per_power * (2 * current * hot))
        slope = np.diag(hot - seen) + (current * warm)[:, None] * per_current + lead
        return current * (hot - seen) + lead * current.sum(), slope, rise

    def solved(current: np.ndarray, lead: float, sign: float) -> tuple[np.ndarray, np.ndarray] | None:
        for _ in range(NEWTON):
            off, slope, rise = equations(current, lead)
            if not np.isfinite(slope).all() or np.sign(np.linalg.det(slope)) != sign:
                return None
            change = np.linalg.solve(slope, off)
            current = current - change
            if np.abs(change).max() <= CLOSE * np.abs(current).max():
                break
        else:
            return None
        off, slope, rise = equations(current, lead)
        kept = np.sign(np.linalg.det(slope)) == sign and (current[choice] > 0).all()
        return (rise, current) if kept else None

    current = np.where(choice, guess, 0.0)
    if (current[choice] <= 0).any():
        return None
    sign = float(np.sign(np.linalg.det(equations(current, 0.0)[1])))
    reached, part, state = 0.0, FIRST_PART, None
    while reached < 1.0:
        following = min(reached + part, 1.0)
        state = solved(current, ground * following, sign)
        if state is None:
            part /= 4
            if part < LEAST_PART:
                return None
        else:
            reached, current = following, state[1]
    return state
