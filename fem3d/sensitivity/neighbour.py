"""Problems next to one that is there, of scenes with a key a little larger, on its cells, moved.

They take over the order of its unknowns and all that doesn't change of its matrices, currents and projection, and are
solved by its factors.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems import conductors
from fem3d.problems.assembly import assemble, jumping
from fem3d.problems.cholesky import part
from fem3d.problems.conductors import law
from fem3d.problems.current import Conductor, Pattern
from fem3d.problems.heat import HeatProblem
from fem3d.solution.reduced import Reduced, on_basis
from fem3d.spaces.domain import Boxes, Domain

ROUNDS = 2  # rounds of iterative refinement: each leaves as small a fraction of the error as the two problems differ by
SAME = 1e-12  # sides of cells that differ by less than this, relatively, are the same

Solve = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, eq=False)
class Projected:
    """A problem, its current fields, and both projected on some fields, with the ``mass`` (r, r) of these."""

    heat: HeatProblem
    conductor: Conductor | None
    patterns: Sequence[Pattern]
    reduced: Reduced
    mass: np.ndarray


class Beside:
    """What problems take over from one of heat, and of the current if there is one. All are projected on one ``basis``
    (free nodes, r), and on what ``patterns`` finds of the currents."""

    def __init__(
        self,
        heat: HeatProblem,
        conductor: Conductor | None,
        basis: np.ndarray,
        patterns: Callable[[HeatProblem, Conductor], Sequence[Pattern]],
    ) -> None:
        self._heat, self._conductor, self._basis, self._patterns = heat, conductor, basis, patterns
        currents = patterns(heat, conductor) if conductor else []
        reduced = on_basis(heat, conductor, basis, currents)
        self.original = Projected(heat, conductor, currents, reduced, self._mass(heat))

    def projected(self, domain: Domain, conductor: Conductor | None = None) -> Projected:
        """The problem of a domain that is this one's, moved; perhaps with the ``conductor`` of other functions on it
        (`Domain`)."""
        original, heat = self.original, self._heat_of(domain)
        mass = original.mass if heat.mass is original.heat.mass else self._mass(heat)
        stiffness = original.reduced.stiffness if heat.stiffness is original.heat.stiffness else None
        alike = self._conducts_alike(heat)
        moved_conductor = self._conductor_of(heat, original.conductor if alike else conductor or conductors.find(heat))
        patterns = original.patterns if alike else self._patterns(heat, moved_conductor) if moved_conductor else []
        reduced = on_basis(heat, moved_conductor, self._basis, patterns, original.reduced if alike else None, stiffness)
        return Projected(heat, moved_conductor, patterns, reduced, mass)

    def _mass(self, heat: HeatProblem) -> np.ndarray:
        mass: np.ndarray = self._basis.T @ (heat.inner_mass @ self._basis)
        return mass

    def _heat_of(self, domain: Domain) -> HeatProblem:
        near, n = self._heat, self._heat.free
        if isinstance(domain, Boxes):
            heat = assemble(domain, near.order, partial(self._matrices, domain))
        else:
            heat = assemble(domain)
            heat = heat if heat.size == near.size else heat.lower(self._level)
        same_stiffness = heat.stiffness is near.stiffness
        if heat.mass is near.mass:
            heat.kept.tell(inner_mass=near.inner_mass)
        if same_stiffness:
            heat.kept.tell(inner_stiffness=near.inner_stiffness)
        same_factors = same_stiffness and heat.anchored
        solve = near.solve_steady if same_factors else _refined(heat.steady_matrix, near.solve_steady)
        heat.kept.tell(solve_steady=solve)
        if same_factors and np.array_equal(heat.given, near.given):
            heat.kept.tell(lifts=near.lifts)
        elif heat.anchored:
            lifts = near.lifts.copy()
            lifts[:, n:] = heat.given
            for lift in lifts:
                for _ in range(ROUNDS if lift.any() else 0):
                    lift[:n] -= near.solve_steady((heat.stiffness @ lift)[:n])
            heat.kept.tell(lifts=lifts)
        return heat

    @property
    def _level(self) -> int:
        return [int(mask.sum()) for mask in self._heat.domain.space.nested].index(self._heat.size)

    def _matrices(self, domain: Boxes, cooling: csc_array) -> list[csc_array]:
        """Stiffness, with what films and contacts (functions, functions) add to it, and mass."""
        near, space = self._heat, domain.space
        pattern = self._pattern
        before: Any = near.domain.space
        both = [(d.per_cell("thermal_conductivity"), d.per_cell("heat_capacity")) for d in (near.domain, domain)]
        (k, c), (other_k, other_c) = both
        changes = space.changes(before, (k, other_k), (c, other_c))
        matrices = []
        for matrix, change in zip((near.stiffness, near.mass), changes, strict=True):
            entries = change[pattern.data] if change.any() else change
            if not entries.any():
                matrices.append(matrix)
            elif matrix.nnz == pattern.nnz and (matrix.indices == pattern.indices).all():
                matrices.append(csc_array((matrix.data + entries, matrix.indices, matrix.indptr), matrix.shape))
            else:
                matrices.append(
                    csc_array(matrix + csc_array((entries, pattern.indices, pattern.indptr), pattern.shape))
                )
        if cooling.nnz + self._cooling.nnz and (warmer := csc_array(cooling - self._cooling)).nnz:
            matrices[0] = csc_array(matrices[0] + part(warmer, near.order))
        return matrices

    @cached_property
    def _pattern(self) -> csc_array:
        space: Any = self._heat.domain.space
        pattern = part(space.pattern[0], self._heat.order)
        for matrix in (pattern, self._heat.stiffness, self._heat.mass):
            matrix.sort_indices()
        return pattern

    @cached_property
    def _cooling(self) -> csc_array:
        """What films and contacts add to the stiffness, by functions."""
        domain = self._heat.domain
        cooled = [b for b in domain.scene.boundaries if b.kind == "convection" and b.value]
        return csc_array(sum((float(b.value) * domain.faces(b).mass() for b in cooled), jumping(domain)))

    def _conducts_alike(self, heat: HeatProblem) -> bool:
        """Whether neither conductor nor what its currents meet changes."""
        near, other, conductor = self._heat.domain, heat.domain, self._conductor
        if conductor is None or conductor.influences or not np.array_equal(heat.lifts, self._heat.lifts):
            return False
        if any(not np.array_equal(held, heat.held[name]) for name, held in self._heat.held.items()):
            return False
        sides = [d.space.h[:, near.live] if isinstance(d, Boxes) else np.ones(1) for d in (near, other)]
        both = [(_laws(d), _electrodes(d), _resistances(d)) for d in (near, other)]
        return (
            both[0] == both[1] and np.array_equal(near.live, other.live) and np.allclose(sides[0], sides[1], SAME, 0.0)
        )

    def _conductor_of(self, heat: HeatProblem, other: Conductor | None) -> Conductor | None:
        near = self._conductor
        if other is None or near is None or len(other.cells) != len(near.cells):
            return other and other.lower(self._level, heat)
        other = replace(other, heat=heat, free=near.free, solved=near.solved)
        alike = other.matrix is near.matrix
        solve = near.solve_cold if alike else _refined(part(other.matrix, other.free), near.solve_cold)
        other.kept.tell(solve_cold=solve, preconditioner=near.solve_cold)
        return other


def _electrodes(domain: Domain) -> list[Any]:
    electrodes = [b for b in domain.scene.boundaries if b.kind == "voltage"]
    return [(b.value, b.contact_resistance, b.series_resistance) for b in electrodes]


def _resistances(domain: Domain) -> list[float]:
    return [joint.contact.electrical_resistance for joint in domain.contacts]


def _laws(domain: Domain) -> list[tuple[float, ...] | None]:
    start = domain.scene.initial_temperature
    return [(*law(m, start), *m.resistivity_ratios) if m.resistivity else None for m in domain.materials]


def _refined(matrix: csc_array, near: Solve) -> Solve:
    """What solves with a matrix by what solves with one next to it."""

    def solve(b: np.ndarray) -> np.ndarray:
        x = near(b)
        for _ in range(ROUNDS):
            x = x + near(b - matrix @ x)
        return x

    return solve
