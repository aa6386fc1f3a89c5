"""The closed loop from sample to sample, for several resolutions of one device at a time.

All resolutions share the Python loop, block by block in one vector, so that estimating the error costs little more
than the run itself.
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
PICARD, NEWTON = 8, 30


@dataclass(frozen=True)
class Resolution:
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


@dataclass(frozen=True)
class Tables:
    """Tables of one interval length for all resolutions, block by block in dense matrices.

    Their arguments: amplitudes ``b``, one resolution's modes after the other, then the energies (J) generated in sink
    and sensor of the first resolution; and ``powers`` (W), at the start (sink, sensor of each resolution), then at the
    nodes. ``readings`` maps b to the heat flow into the polymer (W) of each resolution, then to the rises (K) at the
    places of the powers, with no power acting; ``kernel`` adds the powers' effect on those; ``decay`` and ``gain`` take
    b and powers to the interval's end.
    """

    readings: np.ndarray
    kernel: np.ndarray
    decay: np.ndarray
    gain: np.ndarray


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
    count, n = len(spectra), spectra[0].count
    jump = np.concatenate([*(m.jump for m in spectra), np.zeros(2)])
    at_nodes = (2 * i + np.repeat([0, 1], r.nodes) for i, r in enumerate(resolutions))
    owner = np.concatenate([np.arange(2 * count), *at_nodes])
    conductance, change = (1 / lumped.resistance)[owner % 2], lumped.coefficient[owner % 2]
    unit = np.concatenate([np.full(count, spectra[0].flux_external), spectra[0].external[owner % 2]])
    static = np.zeros(len(unit))
    rises = np.empty((table.samples, count, 2))
    voltages, fluxes = np.empty((table.samples, count, 2)), np.empty((table.samples, count))
    lengths: dict[float, Tables] = {}
    b, voltage, ratio = np.zeros(len(jump)), np.zeros((count, 2)), np.ones(len(owner))
    stepped, outer, outer_time, stopped = np.zeros(n), 0.0, 0.0, False

    if start is not None:
        b = np.concatenate([*(start.power @ m.shape / m.rates for m in spectra), np.zeros(2)])
        voltage, outer, static = np.tile(start.voltage, (count, 1)), start.outer, start.outer * unit
    initial, first = b[:n], outer

    for k, measure, step, length in table.pieces():
        if step is not None:
            b = b - (step - outer) * jump
            stepped -= (step - outer) * jump[:n]
            outer, static = step, step * unit
        key = length or table.sample_time
        if key not in lengths:
            lengths[key] = _tables(spectra, resolutions, key)
        t = lengths[key]
        readings = t.readings @ b + static
        free = readings[count:]
        if measure:
            rises[k] = now = free[: 2 * count].reshape(count, 2)
            fluxes[k] = readings[:count]
            voltages[k] = voltage = law.next_voltage(voltage, now)
            heating = (voltage * voltage).ravel()[owner] * conductance
            stopped = bool(free[0] > CEILING or free[1] > CEILING)
            if stopped or not length:
                break
        powers, ratio = _powers(free, t.kernel, heating, change, ratio, tolerance)
        b = t.decay * b + t.gain @ powers
        outer_time += outer * length
    rows = slice(0, k + 1)
    traces = np.concatenate(
        [rises[rows], voltages[rows], lumped.power(voltages[rows], rises[rows]), fluxes[rows, :, None]], axis=2
    )
    limited = (voltages[rows, 0] == law.lowest) & (law.gain > 0)
    return March(traces, limited, stopped, spectra[0], b[:n] - initial, stepped, b[-2:], outer_time, outer - first)


def _powers(
    free: np.ndarray, kernel: np.ndarray, heating: np.ndarray, change: np.ndarray, ratio: np.ndarray, tolerance: float
) -> tuple[np.ndarray, np.ndarray]:
    """Powers P = heating/ratio, ratio = 1 + change T, T = free + kernel P; by Picard's iteration, else by Newton's.

    ``ratio`` is a guess; returns the powers and the ratio that they belong to. Newton's iteration starts without any
    power: 1/ratio is convex, so that it then climbs to the solution from below.
    """
    rise = free + kernel @ (heating / ratio)
    for attempt in range(PICARD + NEWTON):
        if attempt == PICARD:
            rise = free
        ratio = 1 + change * rise
        powers = heating / ratio
        residual = free + kernel @ powers - rise
        if attempt >= PICARD:
            residual = np.linalg.solve(np.eye(len(free)) + kernel * (powers * change / ratio), residual)
            tolerance = max(tolerance, 1e-12 * float(np.abs(rise).max()))
        rise = rise + residual
        if np.abs(residual).max() < tolerance:
            return powers, ratio
    raise ArithmeticError("the iteration for the electrical powers between two samples did not converge")


def _tables(spectra: list[Modes], resolutions: tuple[Resolution, ...], length: float) -> Tables:
    parts = [interval(m, length, r.nodes, 2) for m, r in zip(spectra, resolutions, strict=True)]
    first, later = block_diag(*(p.first for p in parts)), block_diag(*(p.later for p in parts))
    rows = ([m.flux for m in spectra], [m.shape for m in spectra], [p.free for p in parts])
    readings = np.vstack([block_diag(*blocks) for blocks in rows])
    gain = np.hstack([block_diag(*(p.gain_first for p in parts)), block_diag(*(p.gain_later for p in parts))])
    energy, q, starts = np.zeros((2, gain.shape[1])), resolutions[0].nodes, 2 * len(spectra)
    for e in (0, 1):
        energy[e, np.r_[e, starts + e * q + np.arange(q)]] = parts[0].weights
    return Tables(
        np.pad(readings, ((0, 0), (0, 2))), np.vstack([np.zeros((starts, gain.shape[1])), np.hstack([first, later])]),
        np.concatenate([*(p.decay for p in parts), np.ones(2)]), np.vstack([gain, energy]),
    )  # fmt: skip
