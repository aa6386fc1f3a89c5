"""The steady state of a network: Newton's method on rises and potentials at once.

Where heating may run away, the state is followed from no voltage up to the scene's in steps that are halved down to
`SHORTEST`; the last voltage with a state is the largest one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from reduced1d.network.circuit import factor, weighted
from reduced1d.network.model import Model
from scenes.errors import NumericsError, RunawayError

MOST = 40  # The most Newton steps.
SETTLED = 1e-13
"""Relative change that ends Newton's method: the rounding of sums of a few thousand terms."""
SHORTEST = 1e-8
"""The last step of the factor on the voltages: the relative error of the largest voltage with a state."""


@dataclass(frozen=True, eq=False)
class State:
    """Rises (n,) in K and potentials (n,) in V at inputs ``x``."""

    rise: np.ndarray
    potential: np.ndarray
    x: np.ndarray


def steady(model: Model, x: np.ndarray, voltage: float) -> State:
    """The state at constant inputs; ``voltage`` (V), the largest difference of the electrodes, or the current (A) where
    one is given, names it in messages.

    Raises RunawayError where there is none, NumericsError where Newton's method fails or heat has no way out.
    """
    n = model.elements.size
    if model.heat is not None and (model.heat.components() < 0).any():
        raise NumericsError("a part of the network has no exit for heat: it has no steady state")
    if model.heat is None:
        rise = np.zeros(n)
        return State(rise, _potential(model, rise, x), x)
    if not model.couples:
        potential = _potential(model, np.zeros(n), x)
        load = model.entering @ x
        if model.current is not None:
            halves, resistance = model.resistances(np.zeros(n))
            load = load + model.joule(halves, model.currents(resistance, potential, x))
        return State(model.solved(model.heat, model.stiffness, x, load), potential, x)
    return _Coupled(model, x).state(voltage)


def _potential(model: Model, rise: np.ndarray, x: np.ndarray) -> np.ndarray:
    if model.current is None:
        return np.zeros(model.elements.size)
    return model.potentials(rise[:, None], x[:, None])[:, 0]


class _Coupled:
    """The unknowns z: free rises and potentials in units of the cold state's, and a factor s on the voltages."""

    def __init__(self, model: Model, x: np.ndarray) -> None:
        self.model, self.x = model, x
        self.driven = np.where(model.inputs.electric, x, 0.0)
        assert model.heat is not None
        assert model.current is not None
        self.heat, self.current = model.heat, model.current
        self.f = self.heat.free.shape[1]
        n = model.elements.size
        cold = _potential(model, np.zeros(n), x)
        halves, resistance = model.resistances(np.zeros(n))
        heating = model.joule(halves, model.currents(resistance, cold, x))
        warm = model.solved(self.heat, model.stiffness, x, model.entering @ x + heating)
        self.kelvin = float(np.abs(warm).max()) or 1.0
        self.volt = float(np.abs(cold).max()) or 1.0
        count = self.current.free.shape[1]
        self.unit = np.r_[np.full(self.f, self.kelvin), np.full(count, self.volt)]
        self.cold = np.r_[np.zeros(self.f), self.current.free.T @ cold / self.current.copies / self.volt]
        # On the free unknowns, and the parts that do not follow the state.
        self.summed, self.halves = self.current.summed, (self.current.halves @ self.heat.free).tocsr()
        self.across = self.current.free_across
        self.stiffness = self.heat.free.T @ model.stiffness @ self.heat.free
        self.resistance_by_rise = (self.summed @ weighted(self.halves, self.current.size * model.law[1])).tocsr()
        self.flow_by_s = self.current.across @ (self.current.fixed @ self.driven) - self.current.given @ self.driven
        self.entering_by_s = self.current.free.T @ (self.current.load @ self.driven)
        watt = self.kelvin * float(self.stiffness.diagonal().max())
        ampere = self.volt * float(self.current.matrix(1 / resistance).diagonal().max())
        self.rows = 1 / np.r_[np.full(self.f, watt), np.full(count, ampere)]

    def state(self, voltage: float) -> State:
        z, ok = self.cold, False
        if not self.model.may_run_away:
            z, ok = self._newton(z, 1.0)
        return self._state(z if ok else self._followed(voltage), 1.0)

    def _state(self, z: np.ndarray, s: float) -> State:
        x = self.x + (s - 1) * self.driven
        rise = self.heat.free @ (z[: self.f] * self.kelvin) + self.heat.fixed @ x
        return State(rise, self.current.free @ (z[self.f :] * self.volt) + self.current.fixed @ x, x)

    def _equations(self, z: np.ndarray, s: float) -> tuple[np.ndarray, sp.csc_matrix, np.ndarray]:
        """The residual of both equations, and its derivatives by z and by s, in units of the cold state."""
        m, heat, current = self.model, self.heat, self.current
        state = self._state(z, s)
        halves, resistance = m.resistances(state.rise)
        flow = m.currents(resistance, state.potential, state.x)
        half_flow = flow[current.branch]
        joule = m.joule(halves, flow)
        rest = np.r_[
            heat.free.T @ (m.stiffness @ state.rise - m.entering @ state.x - joule),
            current.free.T @ (current.across.T @ flow - current.load @ state.x),
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
        return rest * self.rows, scaled.tocsc(), by_s * self.rows

    def _newton(self, z: np.ndarray, s: float) -> tuple[np.ndarray, bool]:
        """Newton's method at a factor; whether it settles."""
        before = np.inf
        for _ in range(MOST):
            try:
                rest, matrix, _ = self._equations(z, s)
                change = factor(matrix).solve(-rest)
            except (NumericsError, RuntimeError):  # no resistivity, or a singular matrix
                return z, False
            z = z + change
            size, largest = float(np.abs(change).max()), max(1.0, float(np.abs(z).max()))
            if not np.isfinite(size) or size > 1e6:
                return z, False
            if size <= SETTLED * largest or (size < 1e-9 * largest and size >= before / 2):
                return z, True
            before = size
        return z, False

    def _followed(self, voltage: float) -> np.ndarray:
        """The free unknowns at the scene's voltage, from none up; a step without a state is halved."""
        z, ok = self._newton(np.zeros(len(self.unit)), 0.0)
        if not ok:
            raise NumericsError("the network has no state at the given temperatures and no voltage")
        s, step, tangent = 0.0, 1.0, np.zeros(len(z))
        while s < 1:
            ahead = min(s + step, 1.0)
            new, ok = self._newton(z + (ahead - s) * tangent, ahead)
            after = self._tangent(new, ahead) if ok else tangent
            # Beyond the largest voltage, on the other branch, the state grows as the voltage falls.
            if ok and float(after[: self.f] @ new[: self.f]) >= 0:
                z, s, tangent, step = new, ahead, after, 2 * step
            else:
                step = (ahead - s) / 2
                if step < SHORTEST:
                    raise self._runaway(voltage, s)
        return z

    def _tangent(self, z: np.ndarray, s: float) -> np.ndarray:
        """How the state follows the factor; no numbers where it does not."""
        _, matrix, by_s = self._equations(z, s)
        try:
            return np.asarray(factor(matrix).solve(-by_s))
        except RuntimeError:
            return np.full(len(z), np.nan)

    def _runaway(self, voltage: float, part: float) -> NumericsError:
        by_current = self.model.by_current
        what, unit, why = ("current", "A", "rises") if by_current else ("voltage", "V", "falls")
        if not self.model.may_run_away:
            return NumericsError(f"the network's steady state is not found at {voltage:g} {unit}")
        return RunawayError(
            f"thermal runaway: at {voltage:g} {unit} no steady state of the network exists, because the resistance "
            f"{why} as it heats", part * voltage,
            f"the largest {what} with one is {part * voltage:.4g} {unit}",
        )  # fmt: skip
