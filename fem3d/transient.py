"""The transient after a step of the drive, in a space of shift-invert Krylov fields.

The fields (M + g K)^-1 F, ((M + g K)^-1 M)^j (M + g K)^-1 F ... together with those of the steady state hold the whole
response from some g/10 on to a few digits per handful of fields; the reduced problem is diagonal and is stepped with
its linear part exact. Source: Saad, SIAM J. Numer. Anal. 29, 1992; Druskin and Knizhnerman, J. Comput. Phys. 1989.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.exponential import Trajectory, integrate
from fem3d.reduced import Reduced
from fem3d.steady import SteadyState, joule_load

EARLIEST = 1e-5  # s: from here on the traces hold their accuracy


@dataclass(frozen=True, eq=False)
class Transient:
    """A trajectory of the diagonalised reduced problem of one mesh."""

    state: SteadyState
    reduced: Reduced
    trajectory: Trajectory

    def rises(self, times: np.ndarray) -> np.ndarray:
        """(times, free nodes): the temperature rise (K)."""
        return self.trajectory(times)[0] @ self.reduced.basis.T


class Krylov:
    """The growing space of one mesh; each field costs one solve with a factorization made once."""

    def __init__(self, state: SteadyState, shift: float) -> None:
        self._state = state
        heat, n = state.heat, state.heat.free
        self._mass = heat.inner_mass
        self._solve: Any = heat.solve_shifted(shift)
        cold = state.conductor
        load = heat.constant_source.copy()
        if cold is not None:
            load += joule_load(cold, state.patterns[0].density, np.zeros(n))
        self._next = self._solve(load[:n])
        self._made, self._weighted = np.empty((n, 0)), np.empty((n, 0))

    def fields(self, count: int) -> np.ndarray:
        """(free nodes, steady fields + count): the steady state's fields first."""
        while self._made.shape[1] < count:
            # Orthogonal well enough for the recurrence; the projection makes it exact.
            v = self._next - self._made @ (self._next @ self._weighted)
            weighted = self._mass @ v
            size = np.sqrt(v @ weighted)
            self._made = np.column_stack([self._made, v / size])
            self._weighted = np.column_stack([self._weighted, weighted / size])
            self._next = self._solve(weighted / size)
        return np.column_stack([self._state.fields, self._made[:, :count]])


def time_constant(state: SteadyState) -> float:
    """Stored heat over the power that keeps it (s): the scale of the slowest response."""
    heat, n = state.heat, state.heat.free
    stored = float((heat.mass @ np.ones(heat.size))[:n] @ state.rise)
    supplied = float(np.abs(state.source).sum())
    return abs(stored) / supplied if supplied > 0 else 1.0


def shift(state: SteadyState) -> float:
    """The shift g (s): between the earliest time of interest and the slowest response."""
    return float(np.sqrt(EARLIEST * max(time_constant(state), EARLIEST)))


def march(state: SteadyState, reduced: Reduced, end: float, accuracy: float, drop: int = 0) -> Transient:
    """The response of a reduced problem, without its last ``drop`` fields."""
    modal, rates = diagonal(truncate(reduced, reduced.states - drop))
    size = float(np.linalg.norm(modal.basis.T @ (state.heat.inner_mass @ state.rise)))

    def source(a: np.ndarray) -> np.ndarray:
        return (
            modal.source + modal.joule(a, modal.currents(a))
            if len(modal.supply)
            else np.tile(modal.source, (len(a), 1))
        )

    return Transient(state, modal, integrate(rates, source, end, accuracy, size))


def truncate(reduced: Reduced, states: int) -> Reduced:
    """The reduced problem on its first fields only."""
    keep = slice(0, states)
    return replace(
        reduced, basis=reduced.basis[:, keep], stiffness=reduced.stiffness[keep, keep], source=reduced.source[keep],
        warm=reduced.warm[..., keep], cold_load=reduced.cold_load[..., keep],
        warm_load=reduced.warm_load[..., keep, keep],
        in_box={name: (cold, warm[..., keep]) for name, (cold, warm) in reduced.in_box.items()},
    )  # fmt: skip


def diagonal(reduced: Reduced) -> tuple[Reduced, np.ndarray]:
    """The same problem in its own modes, and their decay rates (1/s)."""
    rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
    warm_load = np.einsum("ijlk,la,kb->ijab", reduced.warm_load, modes, modes, optimize=True)
    modal = replace(
        reduced, basis=reduced.basis @ modes, stiffness=np.diag(rates), source=reduced.source @ modes,
        warm=reduced.warm @ modes, cold_load=reduced.cold_load @ modes, warm_load=warm_load,
        in_box={name: (cold, warm @ modes) for name, (cold, warm) in reduced.in_box.items()},
    )  # fmt: skip
    return modal, rates
