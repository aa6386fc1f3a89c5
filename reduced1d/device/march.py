"""The closed loop from sample to sample, for several resolutions of one device at a time.

All resolutions share the Python loop, one after the other in its vectors, so that estimating the error costs little
more than the run itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from reduced1d.device.controller import Law
from reduced1d.device.interval import interval
from reduced1d.device.lumped import Lumped
from reduced1d.device.modes import Modes, modes
from reduced1d.device.timetable import Timetable

INSULATOR_GRID = np.array([0.0, 1.0])
POLYMER_GRID = np.array([0.0, 0.1, 0.5, 1.0])
GRIDS = (INSULATOR_GRID, POLYMER_GRID)
CEILING = 2000.0
SMALL = 8000
PICARD, NEWTON = 8, 30


@dataclass(frozen=True)
class Resolution:
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


@dataclass(frozen=True)
class Tables:
    """Tables of one interval length: in each list one matrix per resolution, or a single block diagonal one.

    A single one takes fewer calls, as long as it is small enough for the library behind it to stay on one core.

    A resolution's amplitudes are those of its modes (in the first followed by the energies in J generated in sink and
    sensor). Its places are the start (sink, sensor), the nodes, and the heat flow into the polymer, which has no power.
    ``readings`` maps amplitudes to the rises (K) at the places and that flow (W), with no power acting; ``kernel`` adds
    the effect of the powers at the places; ``decay`` and ``gain`` take amplitudes and powers to the interval's end.
    ``modal`` and ``places`` are the parts of amplitudes and places that the matrices act on.
    """

    readings: list[np.ndarray]
    kernel: list[np.ndarray]
    gain: list[np.ndarray]
    decay: np.ndarray
    modal: list[slice]
    places: list[slice]


@dataclass(frozen=True)
class Start:
    """A steady start: powers in W and voltages in V of (sink, sensor), the outer rise in K."""

    power: np.ndarray
    voltage: np.ndarray
    outer: float


@dataclass(frozen=True)
class March:
    """Traces (samples, resolutions, 7) in the order of QUANTITIES, as rises.

    ``limited`` (samples, 2): the limiter held the voltage of (sink, sensor); ``stopped``: the run ended early at a
    rise above CEILING. Of the first resolution: ``modes``, the ``change`` of their amplitudes over the run and the part
    ``stepped`` of it that outer steps made, ``energy`` (2,) in J generated in (sink, sensor), and
    ``outer_time`` and ``outer``, integral (K s) and change (K) of the outer rise.
    """

    traces: np.ndarray
    limited: np.ndarray
    stopped: bool
    modes: Modes
    change: np.ndarray
    stepped: np.ndarray
    energy: np.ndarray
    outer_time: float
    outer: float


def march(
    lumped: Lumped, law: Law, table: Timetable, resolutions: tuple[Resolution, ...], tolerance: float,
    start: Start | None = None,
) -> March:  # fmt: skip
    """Run the closed loop from a steady start, by default cold; ``tolerance`` (K) ends the iteration for the powers.

    Raises ArithmeticError where that iteration fails.
    """
    spectra = [modes(lumped, r.degree, GRIDS) for r in resolutions]
    n = spectra[0].count
    modal = _slices([n + 2, *(m.count for m in spectra[1:])])
    places = _slices([3 + 2 * r.nodes for r in resolutions])
    starts = np.array([[at.start, at.start + 1] for at in places])
    flows = np.array([at.stop - 1 for at in places])
    owner = np.concatenate([np.r_[0, 1, np.repeat([0, 1], r.nodes), 0] + 2 * i for i, r in enumerate(resolutions)])
    conductance, change, unit = (
        values[owner % 2] for values in (1 / lumped.resistance, lumped.coefficient, spectra[0].external)
    )
    conductance[flows], change[flows], unit[flows] = 0.0, 0.0, spectra[0].flux_external
    jump = np.concatenate([spectra[0].jump, np.zeros(2), *(m.jump for m in spectra[1:])])
    history, voltages = np.empty((table.samples, len(owner))), np.empty((table.samples, len(spectra), 2))
    lengths: dict[float, Tables] = {}
    b, voltage, ratio = np.zeros(len(jump)), np.zeros((len(spectra), 2)), np.ones(len(owner))
    stepped, outer, outer_time, stopped = np.zeros(n), 0.0, 0.0, False
    if start is not None:
        for m, at in zip(spectra, modal, strict=True):
            b[at.start : at.start + m.count] = start.power @ m.shape / m.rates
        voltage, outer = np.tile(start.voltage, (len(spectra), 1)), start.outer
    static, initial, first = outer * unit, b[:n], outer

    for k, measure, step, length in table.pieces():
        if step is not None:
            b = b - (step - outer) * jump
            stepped -= (step - outer) * jump[:n]
            outer, static = step, step * unit
        key = length or table.sample_time
        if key not in lengths:
            lengths[key] = _tables(spectra, resolutions, key)
        t = lengths[key]
        free = _apply(t.readings, b, t.modal, t.places)
        free += static
        if measure:
            history[k] = free
            voltages[k] = voltage = law.next_voltage(voltage, free[starts])
            heating = (voltage * voltage).ravel()[owner] * conductance
            stopped = bool(free[0] > CEILING or free[1] > CEILING)
            if stopped or not length:
                break
        powers, ratio = _powers(free, t.kernel, t.places, heating, change, ratio, tolerance)
        b = t.decay * b
        b += _apply(t.gain, powers, t.places, t.modal)
        outer_time += outer * length
    history, voltages = history[: k + 1], voltages[: k + 1]
    rises, fluxes = history[:, starts], history[:, flows, None]
    traces = np.concatenate([rises, voltages, lumped.power(voltages, rises), fluxes], axis=2)
    limited = (voltages[:, 0] == law.lowest) & (law.gain > 0)
    return March(
        traces, limited, stopped, spectra[0], b[:n] - initial, stepped, b[n : n + 2], outer_time, outer - first
    )


def _slices(sizes: list[int]) -> list[slice]:
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]


def _apply(blocks: list[np.ndarray], vector: np.ndarray, columns: list[slice], rows: list[slice]) -> np.ndarray:
    """The product of a block diagonal matrix with a vector."""
    product = np.empty(rows[-1].stop)
    for block, column, row in zip(blocks, columns, rows, strict=True):
        np.dot(block, vector[column], out=product[row])
    return product


def _powers(
    free: np.ndarray, kernel: list[np.ndarray], places: list[slice], heating: np.ndarray, change: np.ndarray,
    ratio: np.ndarray, tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Powers P = heating/ratio, ratio = 1 + change T, T = free + kernel P; by Picard's iteration, else by Newton's.

    ``ratio`` is a guess; returns the powers and the ratio that they belong to. Newton's iteration starts without any
    power: 1/ratio is convex, so that it then climbs to the solution from below.
    """
    rise = free + _apply(kernel, heating / ratio, places, places)
    for attempt in range(PICARD + NEWTON):
        if attempt == PICARD:
            rise = free
        ratio = 1 + change * rise
        powers = heating / ratio
        residual = free + _apply(kernel, powers, places, places) - rise
        if attempt >= PICARD:
            slope = powers * change / ratio
            for block, at in zip(kernel, places, strict=True):
                residual[at] = np.linalg.solve(np.eye(len(block)) + block * slope[at], residual[at])
            tolerance = max(tolerance, 1e-12 * float(np.abs(rise).max()))
        rise = rise + residual
        if residual @ residual < tolerance * tolerance:
            return powers, ratio
    raise ArithmeticError("the iteration for the electrical powers between two samples did not converge")


def _tables(spectra: list[Modes], resolutions: tuple[Resolution, ...], length: float) -> Tables:
    readings: list[np.ndarray] = []
    kernels: list[np.ndarray] = []
    gains: list[np.ndarray] = []
    decays: list[np.ndarray] = []
    for i, (m, r) in enumerate(zip(spectra, resolutions, strict=True)):
        part, q = interval(m, length, r.nodes, 2), r.nodes
        kernel = np.zeros((3 + 2 * q, 3 + 2 * q))
        kernel[2:-1, :2], kernel[2:-1, 2:-1] = part.first, part.later
        reading, decay = np.vstack([m.shape, part.free, m.flux]), part.decay
        gain = np.pad(np.hstack([part.gain_first, part.gain_later]), ((0, 0), (0, 1)))
        if i == 0:
            energy = np.zeros((2, 3 + 2 * q))
            for e in (0, 1):
                energy[e, np.r_[e, 2 + e * q + np.arange(q)]] = part.weights
            reading, decay, gain = np.pad(reading, ((0, 0), (0, 2))), np.r_[decay, 1.0, 1.0], np.vstack([gain, energy])
        readings.append(reading)
        kernels.append(kernel)
        gains.append(gain)
        decays.append(decay)
    if sum(map(len, readings)) * sum(map(len, gains)) < SMALL:
        readings, kernels, gains = [block_diag(*readings)], [block_diag(*kernels)], [block_diag(*gains)]
    modal, places = _slices([len(g) for g in gains]), _slices([len(k) for k in kernels])
    return Tables(readings, kernels, gains, np.concatenate(decays), modal, places)
