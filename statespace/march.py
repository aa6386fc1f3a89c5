"""The closed loop from sample to sample, for several resolutions of one device at a time.

All resolutions share the Python loop, one after the other in its vectors, so that estimating the error costs little
more than the run itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from scenes.device import Device
from statespace.circuit import powers as powers_of
from statespace.controller import law, timetable
from statespace.modal import Modal, interval
from statespace.result import QUANTITIES, TOP
from statespace.stability import state_of

CEILING = 2000.0  # K, beyond any metal: a run in which a film's rise gets there is stopped.
SMALL = 8000
"""Tables with fewer entries than this are joined into one dense block, as one product is then faster than several."""
PICARD, NEWTON = 8, 30  # Iterations within a sample: the most simple ones, then the most by Newton's method.


@dataclass(frozen=True, eq=False)
class Resolution:
    """A model of the device, and the number of unknown heats per response and interval in time."""

    modal: Modal
    nodes: int


@dataclass(frozen=True)
class Tables:
    """Tables of one interval length: in each list one matrix per resolution, or a single block diagonal one.

    A single one takes fewer calls, as long as it is small enough for the library behind it to stay on one core.

    A resolution's amplitudes are those of its modes (in the first followed by the energies in J generated in sink and
    sensor). Its places are the responses at the start, those at the nodes, and the heat flows, which have no power.
    ``readings`` maps amplitudes to the rises (K) at the places and those flows (W), with no power acting; ``kernel``
    adds the effect of the powers at the places; ``decay`` and ``gain`` take amplitudes and powers to the interval's
    end. ``modal`` and ``places`` are the parts of amplitudes and places that the matrices act on.
    """

    readings: list[np.ndarray]
    kernel: list[np.ndarray]
    gain: list[np.ndarray]
    decay: np.ndarray
    modal: list[slice]
    places: list[slice]


@dataclass(frozen=True)
class March:
    """What the controllers see and do, as rises (K), ``voltages`` (V) and ``powers`` (W), each (samples, resolutions,
    2), and the heat ``flows`` (W) as (samples, resolutions, k), those just before each sample.

    ``limited`` (samples, 2): the limiter held the voltage of (sink, sensor); ``stopped``: the run ended early at a
    rise above CEILING. Of the first resolution: the ``change`` of its amplitudes over the run and the part
    ``stepped`` of it that outer steps made, ``energy`` (2,) in J generated in (sink, sensor), and
    ``outer_time`` and ``outer``, integral (K s) and change (K) of the outer rise.
    """

    rises: np.ndarray
    voltages: np.ndarray
    powers: np.ndarray
    flows: np.ndarray
    limited: np.ndarray
    stopped: bool
    change: np.ndarray
    stepped: np.ndarray
    energy: np.ndarray
    outer_time: float
    outer: float

    @cached_property
    def traces(self) -> np.ndarray:
        """(samples, resolutions, 7 or 8) in the order of QUANTITIES and TOP, temperatures as rises."""
        return np.concatenate([self.rises, self.voltages, self.powers, self.flows], axis=2)

    def apart(self, one: int, other: int) -> dict[str, float]:
        """The largest difference over time between two resolutions, of each quantity.

        Raises ArithmeticError where a trace is beyond the range of numbers.
        """
        worst = np.abs(self.traces[:, one] - self.traces[:, other]).max(axis=0)
        if not np.isfinite(worst).all():
            raise ArithmeticError("the simulated device has left the range of numbers")
        return dict(zip((*QUANTITIES, TOP), worst.tolist(), strict=False))


class _Places:
    """Where in the vectors of all resolutions their responses and flows are.

    Of each place: ``film``, 0 for the sink and 1 for the sensor; ``mean``, the place that holds the film's mean rise at
    the same time; ``conductance`` and ``change``, 1/R at no rise and its relative change per kelvin, both zero for a
    flow; ``unit``, what a unit of the outer rise adds, and ``still``, what is added besides; ``both`` (2, places), the
    places that hold the mean rises of sink and sensor at the same time. ``ground`` (ohm) is the lead that both currents
    share. ``departs`` are the places of local departures; ``feed`` (flows, places) is what the heats just before a
    sample add to its flows.
    """

    def __init__(self, resolutions: Sequence[Resolution], ground: float) -> None:
        counts = [r.modal.responses for r in resolutions]
        flows = [len(r.modal.flux) for r in resolutions]
        sizes = [m * (r.nodes + 1) + k for m, k, r in zip(counts, flows, resolutions, strict=True)]
        self.slices = _slices(sizes)
        self.starts = np.array([[at.start, at.start + 1] for at in self.slices])
        self.flows = np.array([np.arange(at.stop - k, at.stop) for at, k in zip(self.slices, flows, strict=True)])
        film, mean, departs, conductance, change, unit, still, feed = [], [], [], [], [], [], [], []
        both: list[list[int]] = [[], []]
        for at, m, k, r in zip(self.slices, counts, flows, resolutions, strict=True):
            modal, q = r.modal, r.nodes
            response = np.r_[np.arange(m), np.repeat(np.arange(m), q), np.zeros(k, int)]
            node = np.r_[np.zeros(m, int), np.tile(np.arange(1, q + 1), m)]
            films = modal.film[response]
            film.append(films)
            of_mean = np.where(node, m + films[: len(node)] * q + node - 1, films[: len(node)])
            mean.append(at.start + np.r_[of_mean, np.arange(len(node), len(films))])
            for e in (0, 1):
                of_film = np.where(node, m + e * q + node - 1, e)
                both[e] += (at.start + np.r_[of_film, np.full(len(films) - len(node), e)]).tolist()
            is_flow = np.arange(len(films)) >= len(node)
            departs.append((response > 1) & ~is_flow)
            conductance.append(np.where(is_flow, 0.0, 1 / modal.resistance[films]))
            change.append(np.where(is_flow, 0.0, modal.coefficient[films]))
            unit.append(np.r_[modal.external[response[: len(node)]], modal.flux_external])
            still.append(
                np.r_[np.broadcast_to(modal.offset, m)[response[: len(node)]], np.broadcast_to(modal.flux_offset, k)]
            )
            fed = np.zeros((k, len(films)))
            fed[:, m + np.arange(m) * q + q - 1] = modal.feed
            feed.append(fed)
        self.film, self.mean, self.departs = np.concatenate(film), np.concatenate(mean), np.concatenate(departs)
        self.conductance, self.change = np.concatenate(conductance), np.concatenate(change)
        self.unit, self.still, self.feed = np.concatenate(unit), np.concatenate(still), block_diag(*feed)
        self.voltage = self.film + 2 * np.repeat(np.arange(len(sizes)), sizes)
        self.both = np.array(both)
        self.ground = ground
        self.local = bool(self.departs.any())
        self.fed = bool(self.feed.any())

    def driven(self, voltages: np.ndarray, ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """(places,): V^2/R at no rise of the voltage across each place's film, from the sources' ``voltages`` (two of
        each resolution) and the resistances' ratio to those at no rise; and by what part of the power's own change a
        film's power follows its conductance 1/R, the drop across the lead following as well.

        The drop is R_ground sum(V/R)/(1 + R_ground sum(1/R)).
        """
        voltage = voltages[self.voltage]
        if not self.ground:
            return voltage * voltage * self.conductance, 1.0
        sink, sensor = self.both
        one, other = (self.conductance[at] / ratio[at] for at in (sink, sensor))
        lead = 1 + self.ground * (one + other)
        voltage = voltage - self.ground * (one * voltage[sink] + other * voltage[sensor]) / lead
        conductance = self.conductance / ratio[self.mean]
        return voltage * voltage * self.conductance, 1 - 2 * self.ground * conductance / lead

    def heats(self, heating: np.ndarray, ratio: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """(places,): the heat at each, from V^2/R at no rise, the resistance's ratio to that, and the rises."""
        power = heating / ratio
        return np.where(self.departs, power * self.change * rise / ratio, power) if self.local else power


def march(
    resolutions: Sequence[Resolution], device: Device, tolerance: float, meter: tuple[float, float] = (0.0, 0.0),
    start: Literal["cold", "settled"] = "cold", watched: int | None = None,
) -> March:  # fmt: skip
    """Run the closed loop of a device; ``tolerance`` (K) ends the iteration for the powers.

    ``meter`` is the resolution in ohm to which the resistances of (sink, sensor) are measured, 0 for an ideal meter.
    ``start`` "settled" begins in the steady state at the initial outer temperature, "cold" at room temperature without
    voltage. The run also ends where the limiter holds the voltage of a ``watched`` film (0 sink, 1 sensor).

    Raises ArithmeticError where that iteration fails.
    """
    first, table = resolutions[0].modal, timetable(device)
    control = law(device, first.resistance, first.coefficient, meter)
    n, at = first.count, _Places(resolutions, device.control.ground_resistance)
    modal = _slices([n + 2, *(r.modal.count for r in resolutions[1:])])
    jump = np.concatenate([first.jump, np.zeros(2), *(r.modal.jump for r in resolutions[1:])])
    history = np.empty((table.samples, len(at.film)))
    voltages = np.empty((table.samples, len(resolutions), 2))
    lengths: dict[float, Tables] = {}
    b, voltage, ratio = np.zeros(len(jump)), np.zeros((len(resolutions), 2)), np.ones(len(at.film))
    powers = np.zeros(len(at.film))
    stepped, outer, outer_time, stopped = np.zeros(n), 0.0, 0.0, False
    if start == "settled":
        settled = [state_of(r.modal, device, device.external.initial_temperature) for r in resolutions]
        for r, part, state, places in zip(resolutions, modal, settled, at.slices, strict=True):
            heat, m = r.modal.heat(state.power, state.rise), r.modal.responses
            b[part.start : part.start + r.modal.count] = heat @ r.modal.shape / r.modal.rates
            powers[places.start + m : places.start + m * (r.nodes + 1)] = np.repeat(heat, r.nodes)
        voltage = np.tile(settled[0].voltage, (len(resolutions), 1))
        outer = device.external.initial_temperature - device.sink.room_temperature
    static, initial, before = outer * at.unit + at.still, b[:n], outer

    for k, measure, step, length in table.stretches():
        key = length or table.sample_time
        if key not in lengths:
            lengths[key] = _tables(resolutions, key)
        t = lengths[key]
        free = _apply(t.readings, b, t.modal, t.places)
        free += static
        if measure:
            history[k] = free
            if at.fed:
                history[k, at.flows.ravel()] += at.feed @ powers
            voltages[k] = voltage = control.next_voltage(voltage, free[at.starts])
            stopped = bool(free[0] > CEILING or free[1] > CEILING)
            held = watched is not None and voltage[0, watched] == control.lowest and control.gain[watched] > 0
            if stopped or held or not length:
                break
        if step is not None:
            # Just after the sample at its time.
            b = b - (step - outer) * jump
            stepped -= (step - outer) * jump[:n]
            outer, static = step, step * at.unit + at.still
            free = _apply(t.readings, b, t.modal, t.places) + static
        powers, ratio = _powers(free, t.kernel, t.places, at, voltage.ravel(), ratio, tolerance)
        b = t.decay * b
        b += _apply(t.gain, powers, t.places, t.modal)
        outer_time += outer * length
    history, voltages = history[: k + 1], voltages[: k + 1]
    rises = history[:, at.starts]
    power = np.stack([
        powers_of(voltages[:, i], r.modal.resistance * (1 + r.modal.coefficient * rises[:, i]), at.ground)
        for i, r in enumerate(resolutions)
    ], axis=1)  # fmt: skip
    limited = (voltages[:, 0] == control.lowest) & (control.gain > 0)
    return March(
        rises, voltages, power, history[:, at.flows], limited, stopped, b[:n] - initial, stepped, b[n : n + 2],
        outer_time, outer - before,
    )  # fmt: skip


def _slices(sizes: list[int]) -> list[slice]:
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]


def _apply(blocks: list[np.ndarray], vector: np.ndarray, columns: list[slice], rows: list[slice]) -> np.ndarray:
    if len(blocks) == 1:
        return blocks[0] @ vector
    product = np.empty(rows[-1].stop)
    for block, column, row in zip(blocks, columns, rows, strict=True):
        np.dot(block, vector[column], out=product[row])
    return product


def _powers(
    free: np.ndarray, kernel: list[np.ndarray], slices: list[slice], at: _Places, voltages: np.ndarray,
    ratio: np.ndarray, tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Heats P = V^2/R with ratio = R/R_0 = 1 + change T, T = free + kernel P and V the voltage across the film; by
    Picard's iteration, else by Newton's.

    Where a film's temperature departs from its mean by T, the heat is P change T/ratio. ``ratio`` is a guess; returns
    the heats and the ratio that they belong to. Newton's iteration starts without any power: 1/ratio is convex, so that
    it then climbs to the solution from below; how a departure follows the mean, and a film through the lead to ground
    the other, is left out of it.
    """
    rise = free + _apply(kernel, at.heats(at.driven(voltages, ratio)[0], ratio, free), slices, slices)
    for attempt in range(PICARD + NEWTON):
        if attempt == PICARD:
            rise = free
        ratio = 1 + at.change * (rise[at.mean] if at.local else rise)
        heating, part = at.driven(voltages, ratio)
        powers = at.heats(heating, ratio, rise)
        residual = free + _apply(kernel, powers, slices, slices) - rise
        if attempt >= PICARD:
            slope = heating / ratio * np.where(at.departs, -1.0, part) * at.change / ratio
            for block, where in zip(kernel, slices, strict=True):
                residual[where] = np.linalg.solve(np.eye(len(block)) + block * slope[where], residual[where])
            tolerance = max(tolerance, 1e-12 * float(np.abs(rise).max()))
        rise = rise + residual
        if residual @ residual < tolerance * tolerance:
            return powers, ratio
    raise ArithmeticError("the iteration for the electrical powers between two samples did not converge")


def _tables(resolutions: Sequence[Resolution], length: float) -> Tables:
    readings: list[np.ndarray] = []
    kernels: list[np.ndarray] = []
    gains: list[np.ndarray] = []
    decays: list[np.ndarray] = []
    for i, r in enumerate(resolutions):
        model, q, m, flows = r.modal, r.nodes, r.modal.responses, len(r.modal.flux)
        part, size = interval(model, length, q, 2), m * (q + 1) + flows
        kernel = np.zeros((size, size))
        kernel[m : m + m * q, :m], kernel[m : m + m * q, m : m + m * q] = part.first, part.later
        reading, decay = np.vstack([model.shape, part.free, model.flux]), part.decay
        gain = np.pad(np.hstack([part.gain_first, part.gain_later]), ((0, 0), (0, flows)))
        if i == 0:
            energy = np.zeros((2, size))
            for e in (0, 1):
                energy[e, np.r_[e, m + e * q + np.arange(q)]] = part.weights
            reading, decay, gain = np.pad(reading, ((0, 0), (0, 2))), np.r_[decay, 1.0, 1.0], np.vstack([gain, energy])
        readings.append(reading)
        kernels.append(kernel)
        gains.append(gain)
        decays.append(decay)
    if sum(map(len, readings)) * sum(map(len, gains)) < SMALL:
        readings, kernels, gains = [block_diag(*readings)], [block_diag(*kernels)], [block_diag(*gains)]
    modal, places = _slices([len(g) for g in gains]), _slices([len(k) for k in kernels])
    return Tables(readings, kernels, gains, np.concatenate(decays), modal, places)
