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
    """The steady state of a model of a device at an outer temperature (K; by default the final one): films that have a
    gain at the set temperature or, where they would need a negative power for that, without any.

    Heat of local departures and rises depend on each other; the former is a hundredth of the rest, and a few rounds
    settle both. Raises ArithmeticError where they don't.
    """
    room = device.sink.room_temperature
    outer = (device.external.final_temperature if external is None else external) - room
    per_heat = (modal.shape / modal.rates) @ modal.shape.T
    unheated = modal.external * outer + modal.offset
    rise, films = np.zeros(modal.responses), np.eye(2)[modal.film]
    first, moved = 0, np.inf
    for _ in range(100):
        per_power = per_heat @ (modal.heat(np.ones(2), rise)[:, None] * films)
        conductance = np.linalg.inv(per_power[:2])
        load = conductance @ modal.external[:2] * outer + conductance @ np.broadcast_to(modal.offset, rise.shape)[:2]
        state = controlled(conductance, load, modal.resistance, modal.coefficient, device, first)
        # A film that cannot be held stays so: at the end of the range rounds would take turns.
        first = CHOICES.index((bool(state.held[0]), bool(state.held[1]))) if device.control.ground_resistance else 0
        before, rise, last = rise, per_power @ state.power + unheated, moved
        moved = float(np.abs(rise - before).max() / max(abs(device.set_rise), np.abs(rise).max()))
        # Small changes that no longer halve are rounding: an iteration that still gains leaves a hundredth of them.
        if modal.responses == 2 or moved <= 1e-13 or last / 2 < moved < 1e-11:
            break
    else:
        raise ArithmeticError("the steady state of the device does not converge")
    heat = modal.heat(state.power, rise)
    flow = (modal.flux / modal.rates) @ (heat @ modal.shape) + modal.flux_external * outer + modal.feed @ heat
    flow = flow + modal.flux_offset
    return replace(state, rise=rise, flow=flow)


def steady(modal: Modal, device: Device, external: float | None = None) -> Steady:
    """The same by name, with temperatures in K."""
    state = state_of(modal, device, external)
    saturated = (gains(device) > 0) & ~state.held
    numbers = device.sink.room_temperature + state.rise[:2], state.voltage, state.power, state.flow[:1]
    values = [*np.concatenate(numbers).tolist(), *saturated.tolist(), state.cycles]
    return Steady(*values)


NARROW = 2e-3
"""The end of the range is bisected to this part of the set temperature's rise."""


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


def controlled(
    conductance: np.ndarray, load: np.ndarray, resistance: np.ndarray, coefficient: np.ndarray, device: Device,
    first: int = 0,
) -> State:  # fmt: skip
    """The steady state that the controllers of a device bring both films to, without flows, from their heat balances
    ``conductance`` (2, 2) in W/K times the rises = ``load`` (2,) in W + powers; ``resistance`` (ohm) is that at no rise
    and changes by ``coefficient`` (1/K).

    Through a lead that both share a film is held at less than the set temperature, as it is seen with the lead in
    series; and where its current gets small beside the other's, not at all. ``first`` is the first of the CHOICES of
    films to hold that is tried there.
    """
    target, ground, driven = device.set_rise, device.control.ground_resistance, gains(device) > 0
    rise, power, hot = complementary(conductance, load, target, driven)
    warm = resistance * (1 + coefficient * rise)
    if not ground:
        return State(rise, power, np.sqrt(power * warm), held=hot)
    guess, seen = np.sqrt(power / warm), resistance * (1 + coefficient * target)
    per_power = np.linalg.inv(conductance)
    cycling = []
    for choice in CHOICES[first:]:
        on = np.array(choice) & driven
        solution = circuit.held(per_power, per_power @ load, resistance, coefficient, target, ground, on, guess)
        if solution is None:
            continue
        rise, current = solution
        warm = resistance * (1 + coefficient * rise)
        voltage = np.where(on, current * warm + ground * current.sum(), 0.0)
        rests = bool((warm + ground >= seen * (1 - 1e-12))[driven & ~on].all())
        state = State(rise, current**2 * warm, voltage, held=on, cycles=not rests)
        if rests:
            return state
        cycling.append(state)
    return cycling[0]


def complementary(
    K: np.ndarray, load: np.ndarray, target: float, controlled: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rises and powers of both elements with K rise = load + power, where a controlled one has either the target rise
    and a power of at least 0, or no power and more than the target; and whether each is held at the target."""
    for choice in CHOICES:
        held = np.array(choice) & controlled
        rise = np.where(held, target, 0.0)
        free = ~held
        if free.any():
            rise[free] = np.linalg.solve(K[np.ix_(free, free)], (load - K @ rise)[free])
        power = np.where(held, K @ rise - load, 0.0)
        tolerance = 1e-12 * np.abs(K).max() * max(abs(target), np.abs(rise).max())
        if (power >= -tolerance).all() and (rise[controlled & free] >= target * (1 - 1e-12)).all():
            return rise, np.maximum(power, 0.0), held
    raise ArithmeticError("no steady state found: the conductances of the device are not positive")


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

    # A step of 1e-100 i in a real function leaves the derivative in its imaginary part, exact to rounding.
    about = np.concatenate([state.rise, state.voltage])
    slopes = np.column_stack([answer(about + step).imag for step in 1e-100j * np.eye(m + 2)]) * 1e100
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
