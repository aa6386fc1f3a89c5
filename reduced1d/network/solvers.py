"""A network over time, by collocation at Radau's points on steps that grow, and its steady state by Newton's method.

Where heating may run away, the steady state is followed from no voltage up to the scene's in steps that are halved down
to 1e-8; the last voltage with a state is the largest one.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import scipy.sparse as sp

from reduced1d.network.circuit import factor, weighted
from reduced1d.network.model import Model
from reduced1d.numerics import Step, interpolate, march
from scenes.errors import NumericsError, RunawayError


class History:
    """A network from rest at the initial temperature up to an ``end`` (s), by ``steps`` of the free rises: a problem of
    `reduced1d.numerics`, whose inputs are linear between jumps and bends, and its solution.

    A step ends at ``growth`` times its start, since the last jump or bend of an input, and the ``first`` (s) after it.
    A change of ``settled`` times the largest rise in a step ends its sweeps. Raises RunawayError where the heating
    outruns every step.
    """

    def __init__(self, model: Model, end: float, first: float, growth: float, settled: float) -> None:
        self.model, self.steps, inputs = model, list[Step](), model.inputs
        if model.heat is None or not end > 0:
            return
        self.circuit, free = model.heat, model.heat.free
        self.capacity = (free.T @ model.capacity @ free).tocsc()
        self.stiffness = (free.T @ model.stiffness @ free).tocsc()
        self.lifted = free.T @ model.capacity @ self.circuit.fixed
        self.entering = free.T @ (model.entering - model.stiffness @ self.circuit.fixed)
        self.potentials: np.ndarray | None = None
        mass = factor(self.capacity)
        v, before = np.zeros(self.capacity.shape[0]), np.zeros(len(inputs.values))
        for start, stop in pairwise([0.0, *(t for t in inputs.breaks if 0 < t < end), end]):
            self.start, self.x = start, inputs.at(start)
            # Given temperatures take their nodes along at a jump, and no heat.
            v = v - mass.solve(self.lifted @ (self.x - before))
            # Inputs are linear in the interval, up to the values before a jump at its end.
            self.slope = 2 * (inputs.at((start + stop) / 2) - self.x) / (stop - start)
            v = march(self, v, start, stop, first, growth, settled, self.steps)
            before = self.x + self.slope * (stop - start)

    @property
    def middles(self) -> np.ndarray:
        """The middles of the steps (s)."""
        return np.array([(step.start + step.stop) / 2 for step in self.steps])

    def at(self, times: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rises (n, times), potentials (n, times) and inputs (inputs, times) at ascending times (s); at a jump inputs
        and held ends have the values after it."""
        model, x = self.model, self.model.inputs.at(times)
        rises = np.zeros((model.elements.size, len(times)))
        if model.heat is not None:
            rises = model.heat.fixed @ x
            if self.steps:
                rises = rises + model.heat.free @ interpolate(self.steps, times)
        # The iteration is short for rises that differ little, as at adjacent times; 8 to 64 at a time take as long.
        parts = np.array_split(np.arange(len(times)), len(times) // 32 + 1)
        return rises, np.hstack([model.potentials(rises[:, p], x[:, p]) for p in parts]), x

    def stored(self, v: np.ndarray) -> np.ndarray:
        return np.asarray(self.capacity @ v)

    def solver(self, shift: complex) -> Callable[[np.ndarray], np.ndarray]:
        solve: Callable[[np.ndarray], np.ndarray] = factor(self.capacity + shift * self.stiffness).solve
        return solve

    def heat(self, times: np.ndarray, stages: np.ndarray) -> np.ndarray:
        inputs = self.x[:, None] + self.slope[:, None] * (times - self.start)
        given = self.entering @ inputs - (self.lifted @ self.slope)[:, None]
        rises = self.circuit.free @ stages + self.circuit.fixed @ inputs
        if self.model.current is not None:
            self.potentials = self.model.potentials(rises, inputs, self.potentials)
            given = given + self.circuit.free.T @ self.model.joule(rises, self.potentials, inputs)
        return np.asarray(given)


State = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Rises (n, 1) in K and potentials (n, 1) in V at inputs (inputs, 1), as of `History.at`."""


def steady(model: Model) -> State:
    """Solve for the state at the last values of the inputs.

    Raises RunawayError where there is none, NumericsError where Newton's method fails or heat has no way out.
    """
    x, cold = model.inputs.at(np.inf)[:, None], np.zeros((model.elements.size, 1))
    if model.heat is not None and not model.layout.anchored:
        raise NumericsError("a part of the network has no exit for heat: it has no steady state")
    if model.couples:
        rise, potential, x = (each[:, None] for each in _Coupled(model, x[:, 0]).state())
        return rise, potential, x
    potential = model.potentials(cold, x)
    return cold if model.heat is None else model.solved(x, model.joule(cold, potential, x)), potential, x


class _Coupled:
    """The unknowns z: free rises and potentials in units of the cold state's, and a factor s on the voltages."""

    def __init__(self, model: Model, x: np.ndarray) -> None:
        assert model.heat is not None
        assert model.current is not None
        self.model, self.x, self.heat, self.current = model, x, model.heat, model.current
        self.driven = np.where(model.inputs.electric, x, 0.0)
        rise = np.zeros(model.elements.size)
        cold = model.potentials(rise[:, None], x[:, None])[:, 0]
        warm = model.solved(x, model.joule(rise, cold, x))
        self.f, count = self.heat.free.shape[1], self.current.free.shape[1]
        self.kelvin, self.volt = float(np.abs(warm).max()) or 1.0, float(np.abs(cold).max()) or 1.0
        self.unit = np.r_[np.full(self.f, self.kelvin), np.full(count, self.volt)]
        # On the free unknowns, and the parts that do not follow the state.
        self.summed, self.halves = self.current.summed, (self.current.halves @ self.heat.free).tocsr()
        self.across = self.current.free_across
        self.stiffness = self.heat.free.T @ model.stiffness @ self.heat.free
        self.resistance_by_rise = (self.summed @ weighted(self.halves, self.current.size * model.law[1])).tocsr()
        self.flow_by_s = self.current.across @ (self.current.fixed @ self.driven) - self.current.given @ self.driven
        self.entering_by_s = self.current.free.T @ (self.current.load @ self.driven)
        watt = self.kelvin * float(self.stiffness.diagonal().max())
        ampere = self.volt * float(self.current.matrix(1 / model.resistances(rise)[1]).diagonal().max())
        self.rows = 1 / np.r_[np.full(self.f, watt), np.full(count, ampere)]

    def state(self) -> State:
        return self._state(self._follow(), 1.0)

    def _state(self, z: np.ndarray, s: float) -> State:
        x = self.x + (s - 1) * self.driven
        rise = self.heat.free @ (z[: self.f] * self.kelvin) + self.heat.fixed @ x
        return rise, self.current.free @ (z[self.f :] * self.volt) + self.current.fixed @ x, x

    def _equations(self, z: np.ndarray, s: float) -> tuple[np.ndarray, sp.csc_matrix, np.ndarray]:
        """The residual of both equations, and its derivatives by z and by s, in units of the cold state."""
        m, heat, current, (rise, potential, x) = self.model, self.heat, self.current, self._state(z, s)
        halves, resistance = m.resistances(rise)
        flow = m.currents(resistance, potential, x)
        half_flow = flow[current.branch]
        joule = current.halves.T @ (half_flow**2 * halves)
        residual = np.r_[
            heat.free.T @ (m.stiffness @ rise - m.entering @ x - joule),
            current.free.T @ (current.across.T @ flow - current.load @ x),
        ]
        # How flows follow the rise, the heat follows the flows and the rise, and the flows follow the potential.
        flow_by_rise = weighted(self.resistance_by_rise, -flow / resistance)
        heat_by_flow = (self.summed @ weighted(self.halves, 2 * half_flow * halves)).T
        heat_by_rise = self.halves.T @ weighted(self.halves, half_flow**2 * current.size * m.law[1])
        flow_by_potential = weighted(self.across, 1 / resistance)
        matrix = sp.block_array(
            [
                [self.stiffness - heat_by_rise - heat_by_flow @ flow_by_rise, -(heat_by_flow @ flow_by_potential)],
                [self.across.T @ flow_by_rise, self.across.T @ flow_by_potential],
            ]
        )
        flow_by_s = self.flow_by_s / resistance
        by_s = np.r_[-(heat_by_flow @ flow_by_s), self.across.T @ flow_by_s - self.entering_by_s]
        scaled = sp.diags_array(self.rows) @ matrix @ sp.diags_array(self.unit)
        return residual * self.rows, scaled.tocsc(), by_s * self.rows

    def _newton(self, z: np.ndarray, s: float) -> np.ndarray | None:
        """Newton's method at a factor from a start; None where it does not settle."""
        before = np.inf
        for _ in range(40):
            try:
                residual, matrix, _ = self._equations(z, s)
                change = factor(matrix).solve(-residual)
            except (NumericsError, RuntimeError):  # no resistivity, or a singular matrix
                return None
            z = z + change
            size, largest = float(np.abs(change).max()), max(1.0, float(np.abs(z).max()))
            if not np.isfinite(size) or size > 1e6:
                return None
            # Sums of a few thousand terms are rounded by 1e-13.
            if size <= 1e-13 * largest or (size < 1e-9 * largest and size >= before / 2):
                return z
            before = size
        return None

    def _follow(self) -> np.ndarray:
        """The free unknowns at the scene's voltage, from none up; a step without a state is halved."""
        z = self._newton(np.zeros(len(self.unit)), 0.0)
        if z is None:
            raise NumericsError("the network has no state at the given temperatures and no voltage")
        s, step, tangent = 0.0, 1.0, self._tangent(z, 0.0)
        while s < 1:
            ahead = min(s + step, 1.0)
            new = self._newton(z + (ahead - s) * tangent, ahead)
            after = tangent if new is None else self._tangent(new, ahead)
            # Beyond the largest voltage, on the other branch, the state grows as the voltage falls.
            if new is not None and float(after[: self.f] @ new[: self.f]) >= 0:
                z, s, tangent, step = new, ahead, after, 2 * step
            else:
                step = (ahead - s) / 2
                if step < 1e-8:
                    raise self._runaway(s)
        return z

    def _tangent(self, z: np.ndarray, s: float) -> np.ndarray:
        """How the state follows the factor; no numbers where it does not."""
        _, matrix, by_s = self._equations(z, s)
        try:
            return np.asarray(factor(matrix).solve(-by_s))
        except RuntimeError:
            return np.full(len(z), np.nan)

    def _runaway(self, part: float) -> NumericsError:
        drive, slope = self.model.drive(self.x), self.model.law[1]
        what, unit, why = ("current", "A", "rises") if self.model.by_current else ("voltage", "V", "falls")
        if not ((slope < 0).any() or (self.model.by_current and (slope > 0).any())):
            return NumericsError(f"the network's steady state is not found at {drive:g} {unit}")
        return RunawayError(
            f"thermal runaway: at {drive:g} {unit} no steady state of the network exists, because the resistance "
            f"{why} as it heats", part * drive, f"the largest {what} with one", unit,
        )  # fmt: skip
