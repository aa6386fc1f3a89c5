"""The steady state that the controllers bring a model of the device to, the range in which they hold it, and the
stability of the sampled loop about it: the map from sample to sample, linearised.

Over a common lead to ground each controller sees its film with the lead in series, R + R_ground (1 + I_other/I). Where
a film has little current, that of the other one hides its resistance: there its range ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from itertools import product
from sys import float_info

import numpy as np
import scipy.linalg

from scenes.device import Device
from statespace import circuit
from statespace.device_model import Modal
from statespace.result import Steady
from statespace.runtime import derivative

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output
CHOICES = tuple(product((True, False), repeat=2))
"""Which of (sink, sensor) are held at the set temperature, in the order in which that is tried."""


@dataclass(frozen=True)
class Plant:
    """The linearised device from sample to sample: b' = a b + inlet dV, measured rises = out b + across dV.

    a, inlet, out : (n, n), (n, 2), (2, n), of the amplitudes b and the voltages V of (sink, sensor)
    across : (2, 2), effect (K/V) of the present voltages on the measured rises, zero without a common lead
    active : (2,), whether (sink, sensor) can respond to its voltage
    set_rise, sample_time : in K and s
    """

    a: np.ndarray
    inlet: np.ndarray
    out: np.ndarray
    across: np.ndarray
    active: np.ndarray
    set_rise: float
    sample_time: float

    def eigenvalue(self, gain: np.ndarray) -> complex:
        """The eigenvalue of largest size of the closed loop with these gains (V) of (sink, sensor), per sample: stable
        below 1 in size; negative where the loop swings from sample to sample."""
        at = np.flatnonzero(self.active & (np.asarray(gain) > 0))
        per_rise = -np.asarray(gain)[at, None] / self.set_rise
        feedback, held = per_rise * self.out[at], np.eye(len(at)) + per_rise * self.across[np.ix_(at, at)]
        inlet = self.inlet[:, at]
        loop = np.block([[self.a + inlet @ feedback, inlet @ held], [feedback, held]])
        eigenvalues = np.linalg.eigvals(loop)
        largest = complex(eigenvalues[np.abs(eigenvalues).argmax()])
        return complex(largest.real, abs(largest.imag))


@dataclass(frozen=True)
class Stability:
    """The loop's eigenvalue of largest size per sample, its growth rate in 1/s (negative: it decays), and the largest
    stable gain (V) of each controller with the other at its own gain; infinite where no gain below 1e6 V is unstable.
    """

    eigenvalue: complex
    growth_rate: float
    sink_gain_limit: float
    sensor_gain_limit: float

    @property
    def stable(self) -> bool:
        return abs(self.eigenvalue) < 1


def assess(system: Plant, device: Device) -> Stability:
    """Compute the stability of a plant with a device's gains."""
    loop_gains = gains(device)
    largest = system.eigenvalue(loop_gains)
    rate = float(np.log(abs(largest)) / system.sample_time)
    return Stability(largest, rate, gain_limit(system, loop_gains, 0), gain_limit(system, loop_gains, 1))


def gain_limit(system: Plant, others: np.ndarray, element: int) -> float:
    """The largest gain (V) of one element (0 sink, 1 sensor) below which the loop is stable, the other gain as given.

    Zero where the other loop is unstable by itself, infinite where no gain up to 1e6 V is unstable.
    """
    from scipy.optimize import brentq

    def growth(gain: float) -> float:
        return math.log(max(abs(system.eigenvalue(np.where(np.arange(2) == element, gain, others))), float_info.min))

    if growth(0.0) >= 0:
        return 0.0
    if not system.active[element]:
        return math.inf
    low, high = 0.0, 1e-6
    while growth(high) < 0:
        low, high = high, 1.6 * high
        if high > 1e6:
            return math.inf
    return float(brentq(growth, low, high, xtol=1e-12 * high, rtol=1e-10))


@dataclass(frozen=True, eq=False)
class State:
    """A steady state: ``rise`` (m,) of the responses in K, ``power`` in W and ``voltage`` in V of (sink, sensor), heat
    ``flow`` (k,) in W, and whether a film is ``held`` at the set temperature (2,). Where it ``cycles`` there is no
    steady state; the controllers leave this one, without power in films that cannot be held, again and again."""

    rise: np.ndarray
    power: np.ndarray
    voltage: np.ndarray
    flow: np.ndarray = field(default_factory=lambda: np.zeros(0))
    held: np.ndarray = field(default_factory=lambda: np.ones(2, bool))
    cycles: bool = False


def gains(device: Device) -> np.ndarray:
    """(2,): the gains (V) of (sink, sensor)."""
    return np.array([device.control.sink_gain, device.control.sensor_gain])


def state_of(modal: Modal, device: Device, external: float | None = None) -> State:
    """Find the steady state of a model of a device at an outer temperature (K; by default the final one): films that
    have a gain at the set temperature or, where they would need a negative power for that, without any.

    Through a lead that both share a film is held at less than the set temperature, as it is seen with the lead in
    series; and where its current gets small beside the other's, not at all. Raises ArithmeticError where no state is
    found.
    """
    room, ground, driven = device.sink.room_temperature, device.control.ground_resistance, gains(device) > 0
    outer = (device.external.final_temperature if external is None else external) - room
    unheated = np.broadcast_to(modal.external * outer + modal.offset, modal.film.shape)
    cycling = []
    for choice in CHOICES:
        held = np.array(choice) & driven
        found = _held(modal, unheated, device.set_rise, ground, held)
        if found is None:
            continue
        rise, current = found
        resistance = modal.resistance * (1 + modal.coefficient * rise[:2])
        seen = ((resistance + ground) / modal.resistance - 1) / modal.coefficient if ground else rise[:2]
        rests = bool((seen >= device.set_rise - 1e-12 * abs(device.set_rise))[driven & ~held].all())
        power, voltage = current**2 * resistance, np.where(held, current * resistance + ground * current.sum(), 0.0)
        heat = modal.heat(power, rise)
        flow = (modal.flux / modal.rates) @ (heat @ modal.shape) + modal.flux_external * outer + modal.feed @ heat
        state = State(rise, power, voltage, flow + modal.flux_offset, held, not rests)
        if rests:
            return state
        cycling.append(state)
    if not ground or not cycling:
        raise ArithmeticError("no steady state of the device is found")
    return cycling[0]


def _held(
    modal: Modal, unheated: np.ndarray, target: float, ground: float, held: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Solve for the rises T (m,) in K and currents I (2,) in A with which some films are measured at the resistance of
    a target rise:

        T = per_heat u(I^2 R(T), T) + unheated,      I_e (R_e(T) - R_seen,e) + R_ground (I_sink + I_sensor) = 0,

    with the heats u of the model, and R_seen that of the target rise, or 0 for a film without voltage. Newton's method
    follows the state as the lead grows from nothing to ``ground``; where the determinant of the Jacobian changes its
    sign the state has met another one, and both end. Returns None where there is no such state.
    """
    m, per_heat = modal.responses, (modal.shape / modal.rates) @ modal.shape.T
    seen = np.where(held, modal.resistance * (1 + modal.coefficient * target), 0.0)
    power, films = np.zeros(2), per_heat[:2, :2]
    power[held] = np.linalg.solve(films[np.ix_(held, held)], (target - unheated[:2])[held])
    rounding = 1e-12 * max(abs(target), np.abs(unheated).max()) * np.abs(np.linalg.inv(films)).max()
    if (power < -rounding).any() or (ground and (power[held] <= 0).any()):
        return None
    power = np.maximum(power, 0.0)
    rise, idle = per_heat[:, :2] @ power + unheated, held & (power == 0)

    def residual(x: np.ndarray, lead: float) -> np.ndarray:
        rise, current = x[:m], x[m:]
        resistance = modal.resistance * (1 + modal.coefficient * rise[:2])
        heat = rise - per_heat @ modal.heat(current**2 * resistance, rise) - unheated
        loop = current * (resistance - seen) + lead * current.sum()
        return np.concatenate([heat, np.where(idle, current, loop)])

    def slopes(x: np.ndarray, lead: float) -> np.ndarray:
        return derivative(lambda x: residual(x, lead), x)

    def solve(x: np.ndarray, lead: float, sign: float) -> np.ndarray | None:
        for _ in range(20):
            jacobian = slopes(x, lead)
            if not np.linalg.det(jacobian) * sign > 0:
                return None
            change = np.linalg.solve(jacobian, residual(x, lead))
            x = x - change
            # The error squares at each step.
            if np.abs(change[m:]).max() <= 1e-9 * np.abs(x[m:]).max():
                kept = np.linalg.det(slopes(x, lead)) * sign > 0 and (x[m:][held & ~idle] > 0).all()
                return x if kept else None
        return None

    current = np.sqrt(power / (modal.resistance * (1 + modal.coefficient * rise[:2])))
    x = np.concatenate([rise, current])
    sign, reached, part = float(np.sign(np.linalg.det(slopes(x, 0.0)))), 0.0, 1.0
    while reached < 1.0:
        following = min(reached + part, 1.0)
        state = solve(x, ground * following, sign)
        if state is not None:
            reached, x = following, state
        else:
            part /= 4
            if part < 1e-3:  # to which the end of the range is known
                return None
    return x[:m], x[m:]


def steady(modal: Modal, device: Device, external: float | None = None) -> Steady:
    """The same by name, with temperatures in K."""
    state = state_of(modal, device, external)
    saturated = (gains(device) > 0) & ~state.held
    numbers = device.sink.room_temperature + state.rise[:2], state.voltage, state.power, state.flow[:1]
    values = [*np.concatenate(numbers).tolist(), *saturated.tolist(), state.cycles]
    return Steady(*values)


NARROW = 2e-3
"""The end of the range is bisected to this part of the set rise: a choice, 0.04 K in the paper's device."""


def held_range(modal: Modal, device: Device) -> tuple[float, float]:
    """The outer temperatures (K) between which both films are held, NaN if at none; without a lead from 0 K to the set
    temperature.

    With one the sensor's current gets too small beside the sink's above them, and the sink's beside the sensor's below.
    The search goes down from the set temperature in steps of its rise above room, at first smaller.
    """
    top, step = device.control.set_temperature, device.set_rise
    if not device.control.ground_resistance:
        return 0.0, top

    def held(outer: float) -> bool:
        state = steady(modal, device, outer)
        return not (state.sink_saturated or state.sensor_saturated or state.cycles)

    def end(inside: float, outside: float) -> float:
        while abs(inside - outside) > NARROW * step:
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if held(middle) else (inside, middle)
        return inside

    drops = [step / 4**n for n in (4, 3, 2, 1)] + [step * n for n in range(1, int(top / step) + 1)]
    tried = [top, *(top - drop for drop in drops), 0.0]
    inside = [n for n, outer in enumerate(tried) if n and held(outer)]
    if not inside:
        return float("nan"), float("nan")
    first, last = inside[0], inside[-1]
    lowest = 0.0 if last == len(tried) - 1 else end(tried[last], tried[last + 1])
    return lowest, end(tried[first], tried[first - 1])


@dataclass(frozen=True)
class Shielding:
    """Changes of power per kelvin of the substrate (W/K) about the steady state after the outer step; and with the
    sink off."""

    sensor_power_per_substrate_W_per_K: float
    sink_power_per_substrate_W_per_K: float
    sensor_power_per_substrate_sink_off_W_per_K: float


def shielding(modal: Modal, device: Device) -> Shielding:
    """Compute the shielding of the sensor from the substrate, which the paper claims is complete."""
    off = replace(device, control=replace(device.control, sink_gain=0.0))
    sensor, sink = _per_substrate(modal, device)
    return Shielding(sensor, sink, _per_substrate(modal, off)[0])


def _per_substrate(modal: Modal, device: Device) -> tuple[float, float]:
    """d power / d temperature of the substrate of (sensor, sink) in W/K, by steady states half a kelvin to either side.

    Resistances are linear and both loops closed, so that powers are linear but for local departures of the films'
    temperatures.
    """
    room, outer = device.sink.room_temperature, device.external.final_temperature - device.sink.room_temperature
    below = modal.above_substrate(outer)
    less, more = (steady(below, device, room + side / 2) for side in (-1, 1))
    return more.sensor_power_W - less.sensor_power_W, more.sink_power_W - less.sink_power_W


def plant(modal: Modal, device: Device, external: float | None = None) -> Plant:
    """The loop of a model of a device, linearised about its steady state at an outer temperature (K; by default the
    final one).

    Between samples the heats follow voltages and temperatures, exactly propagated. An element that has no power there
    does not respond to its voltage to first order, and its loop is left out.
    """
    state, m, ground = state_of(modal, device, external), modal.responses, device.control.ground_resistance
    warm = modal.resistance * modal.coefficient

    def answer(rises_and_volts: np.ndarray) -> np.ndarray:
        """The heats (m,) and the measured rises (2,) at some rises (m,) and voltages (2,)."""
        rise, voltage = rises_and_volts[:m], rises_and_volts[m:]
        resistance = modal.resistance + warm * rise[:2]
        heat = modal.heat(circuit.powers(voltage, resistance, ground), rise)
        return np.concatenate([heat, circuit.measured(voltage, resistance, ground) / warm])

    slopes = derivative(answer, np.concatenate([state.rise, state.voltage]))
    # The exponential of [[A, B], [0, 0]] h holds exp(A h) and the integral of exp(A t) B over the sample time h.
    n, h = modal.count, device.control.sample_time
    block = np.zeros((n + 2, n + 2))
    block[:n, :n] = (modal.shape.T @ slopes[:m, :m] @ modal.shape - np.diag(modal.rates)) * h
    block[:n, n:] = modal.shape.T @ slopes[:m, m:] * h
    exponential = scipy.linalg.expm(block)
    return Plant(
        exponential[:n, :n], exponential[:n, n:], slopes[m:, :m] @ modal.shape, slopes[m:, m:], state.voltage > 0,
        device.set_rise, h,
    )  # fmt: skip
