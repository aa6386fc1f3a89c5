"""Several devices on one plate: what each does to the others through the heat that enters the plate under it, of any
model in modes.

The others warm the plate under an element's feet by theta_k = sum_j g_kj q_j, with q the heat that leaves an element
into the plate and g what that does at another's place. To an element that is a warmer substrate. In the steady state,
with r, w, s what a kelvin outside adds to the heat into the plate, what one of substrate does, and what that adds to
the sensor's power, all about the closed loops' state,

    dP = s (1 - g w)^-1 g r dT_outer.

Over time all four are responses to steps, and their products Duhamel's sums over samples. g w is some 1e-4: of the
inverse g + g w g is taken, an element's answer to the first and what the others answer to that.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scenes.array import DeviceArray, driven, idle
from scenes.device import Device, External
from scenes.loop.march import Resolution, march
from scenes.loop.modal import Modal
from scenes.loop.shielding import BEFORE, CLOSELY, STEP
from scenes.loop.stability import state_of


@dataclass(frozen=True, eq=False)
class Slopes:
    """Of one kind of element: its heat into the plate and its sensor's power on a plate at room temperature (W), and
    what a kelvin outside, or of substrate, adds to them (W/K)."""

    heat: float
    power: float
    heat_per_outside: float
    heat_per_substrate: float
    power_per_substrate: float


@dataclass(frozen=True, eq=False)
class Rest:
    """The elements at work together, all outside at the initial temperature: how much warmer the plate is under each by
    the others, ``plate_rise`` (elements,) in K; what that changes in the power of each sensor at work, ``power_change``
    (elements,) in W; and ``per_outside`` (elements, elements) in W/K, what a kelvin outside of one (column) adds to the
    sensor's power of another (row), none for an idle one, nor to its own."""

    plate_rise: np.ndarray
    power_change: np.ndarray
    per_outside: np.ndarray


@dataclass(frozen=True, eq=False)
class Paths:
    """From element ``stepped`` to element ``read`` through the plate, at the samples since heat entered: the rise
    ``direct`` (samples,) in K/W, and ``back`` (2, samples) in K2/W2, the sums over idle elements and those at work
    of what the first does to each by what each does to the other."""

    stepped: int
    read: int
    direct: np.ndarray
    back: np.ndarray


@dataclass(frozen=True, eq=False)
class Course:
    """At the samples since a step outside of an element by 1 K: how much warmer the plate is under another (K/K), what
    has been added to the power of its sensor (W/K), and the ``rest`` that is left out, as a part."""

    plate_rise: np.ndarray
    sensor_power: np.ndarray
    rest: float


def at_work(array: DeviceArray) -> np.ndarray:
    """(elements,): which have their circuits."""
    return np.isin(np.arange(1, array.sink.count + 1), driven(array.sink))


def slopes(modal: Modal, device: Device) -> Slopes:
    """Those of an element about its steady state at the initial outer temperature."""
    room, outer = device.sink.room_temperature, device.external.initial_temperature
    below = modal.with_heat_below()

    def at(more: float, warmer: float) -> np.ndarray:
        """(2,): heat into the plate and sensor power, with both temperatures so much (K) higher."""
        state = state_of(below.above_substrate(outer - room + more), device, room + warmer)
        return np.array([state.flow[-1], state.power[1]])

    def per_kelvin(outside: float, substrate: float) -> np.ndarray:
        half = STEP / 2
        return (at(outside * half, substrate * half) - at(-outside * half, -substrate * half)) / STEP

    (heat, power), (by_outside, _), (by_substrate, shielded) = at(0, 0), per_kelvin(1, 0), per_kelvin(0, 1)
    return Slopes(float(heat), float(power), float(by_outside), float(by_substrate), float(shielded))


def at_rest(array: DeviceArray, modal: Modal, device: Device, plate: np.ndarray) -> Rest:
    """The elements of an array, those that are at work as a ``device`` (an element's, or that without its sink), on a
    ``plate`` (elements, elements) in K/W."""
    on = at_work(array)
    kinds = slopes(modal, device), slopes(modal, idle(device))

    def each(name: str) -> np.ndarray:
        return np.where(on, getattr(kinds[0], name), getattr(kinds[1], name))

    # What an element's own heat does in the middle of the plate is in its own model.
    solved = np.linalg.inv(np.eye(len(on)) - plate * each("heat_per_substrate")) @ plate
    rise, shielded = solved @ each("heat"), on * each("power_per_substrate")
    crosstalk = shielded[:, None] * solved * each("heat_per_outside")
    crosstalk[np.diag_indices(len(on))] = 0.0
    return Rest(rise, shielded * rise, crosstalk)


def course(array: DeviceArray, resolution: Resolution, device: Device, paths: Paths, plate: np.ndarray) -> Course:
    """What a step outside of an element does to another over time, those at work as a ``device``, at rest on ``plate``
    (elements, elements) in K/W. The resolution's substrate is the top of the plate."""
    sending = device if at_work(array)[paths.stepped] else idle(device)
    sent, _ = answers(resolution, sending, outside=True)
    given, shielded = answers(resolution, device, outside=False)
    given_idle = np.zeros_like(given)
    if not at_work(array).all():
        given_idle, _ = answers(resolution, idle(device), outside=False)
    spread = paths.direct + after(given_idle, paths.back[0]) + after(given, paths.back[1])
    rise = after(sent, spread)
    again = np.abs(plate).sum(axis=1).max() * max(np.abs(np.diff(g)).sum() for g in (given, given_idle))
    return Course(rise, after(rise, shielded), float(again**2))


def after(first: np.ndarray, then: np.ndarray) -> np.ndarray:
    """(..., samples): the response to a step of what responds so to the ``first``'s own response to one, both
    (..., samples) and nothing at the first one; between samples what changes is linear."""
    n = first.shape[-1]
    middles = (then + np.concatenate([then[..., 1:], then[..., -1:]], axis=-1)) / 2
    spectra = np.fft.rfft(np.diff(first, prepend=0.0), 2 * n), np.fft.rfft(middles, 2 * n)
    return np.asarray(np.fft.irfft(spectra[0] * spectra[1], 2 * n)[..., :n])


def times(device: Device) -> np.ndarray:
    """(samples,): the samples (s) from the step on."""
    after_step = device.end_time - (device.external.step_time if device.steps_outside else 0.0)
    h = device.control.sample_time
    return h * np.arange(int(np.floor(max(after_step, BEFORE * h) / h + 1e-9)))


def answers(resolution: Resolution, device: Device, outside: bool) -> tuple[np.ndarray, np.ndarray]:
    """(samples,) twice: what a step of 1 K outside, or of the substrate, adds to the heat into the plate and to the
    sensor's power (W/K), from the step on."""
    room, outer, h = device.sink.room_temperature, device.external.initial_temperature, device.control.sample_time
    below, samples = resolution.modal.with_heat_below(), len(times(device))
    modal, at = (below, outer) if outside else (below.above_substrate(outer - room), room)
    stepped = replace(device, external=External(at, at + STEP, BEFORE * h), end_time=(BEFORE + samples) * h)
    run = march([Resolution(modal, resolution.nodes)], stepped, CLOSELY, start="settled")
    heat, power = run.flows[:, 0, -1], run.powers[:, 0, 1]
    changes = [np.asarray((q[BEFORE:] - q[BEFORE - 1]) / STEP)[:samples] for q in (heat, power)]
    return changes[0], changes[1]
