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
from fem3d.problems.assembly import assemble
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
        found = patterns(heat, conductor) if conductor else []
        self.own = Projected(heat, conductor, found, on_basis(heat, conductor, basis, found), self._mass(heat))

    def projected(self, domain: Domain, conductor: Conductor | None = None) -> Projected:
        """The problem of a domain that is this one's, moved; perhaps with the ``conductor`` of other functions on it
        (`Domain`)."""
        own, heat = self.own, self._heat_of(domain)
        mass = own.mass if heat.mass is own.heat.mass else self._mass(heat)
        stiffness = own.reduced.stiffness if heat.stiffness is own.heat.stiffness else None
        alike = self._conducts_alike(heat)
        found = self._conductor_of(heat, own.conductor if alike else conductor or conductors.find(heat))
        patterns = own.patterns if alike else self._patterns(heat, found) if found else []
        reduced = on_basis(heat, found, self._basis, patterns, own.reduced if alike else None, stiffness)
        return Projected(heat, found, patterns, reduced, mass)

    def _mass(self, heat: HeatProblem) -> np.ndarray:
        found: np.ndarray = self._basis.T @ (heat.inner_mass @ self._basis)
        return found

    def _heat_of(self, domain: Domain) -> HeatProblem:
        near, n = self._heat, self._heat.free
        if isinstance(domain, Boxes):
            found = assemble(domain, near.order, partial(self._matrices, domain))
        else:
            found = assemble(domain)
            found = found if found.size == near.size else found.lower(self._level)
        same_stiffness = found.stiffness is near.stiffness
        if found.mass is near.mass:
            found.kept.tell(inner_mass=near.inner_mass)
        if same_stiffness:
            found.kept.tell(inner_stiffness=near.inner_stiffness)
        same_factors = same_stiffness and found.anchored
        solve = near.solve_steady if same_factors else _refined(found.steady_matrix, near.solve_steady)
        found.kept.tell(solve_steady=solve)
        if same_factors and np.array_equal(found.given, near.given):
            found.kept.tell(lifts=near.lifts)
        elif found.anchored:
            lifts = near.lifts.copy()
            lifts[:, n:] = found.given
            for lift in lifts:
                for _ in range(ROUNDS if lift.any() else 0):
                    lift[:n] -= near.solve_steady((found.stiffness @ lift)[:n])
            found.kept.tell(lifts=lifts)
        return found

    @property
    def _level(self) -> int:
        return [int(own.sum()) for own in self._heat.domain.space.nested].index(self._heat.size)

    def _matrices(self, domain: Boxes, cooling: csc_array) -> list[csc_array]:
        """Stiffness, with what films (functions, functions) add to it, and mass."""
        near, space = self._heat, domain.space
        pattern = self._pattern
        before: Any = near.domain.space
        both = [(d.per_cell("thermal_conductivity"), d.per_cell("heat_capacity")) for d in (near.domain, domain)]
        (k, c), (other_k, other_c) = both
        changes = space.changes(before, (k, other_k), (c, other_c))
        found = []
        for matrix, change in zip((near.stiffness, near.mass), changes, strict=True):
            own = change[pattern.data] if change.any() else change
            if not own.any():
                found.append(matrix)
            elif matrix.nnz == pattern.nnz and (matrix.indices == pattern.indices).all():
                found.append(csc_array((matrix.data + own, matrix.indices, matrix.indptr), matrix.shape))
            else:
                found.append(csc_array(matrix + csc_array((own, pattern.indices, pattern.indptr), pattern.shape)))
        if cooling.nnz + self._cooling.nnz and (warmer := csc_array(cooling - self._cooling)).nnz:
            found[0] = csc_array(found[0] + part(warmer, near.order))
        return found

    @cached_property
    def _pattern(self) -> csc_array:
        space: Any = self._heat.domain.space
        found = part(space.pattern[0], self._heat.order)
        for matrix in (found, self._heat.stiffness, self._heat.mass):
            matrix.sort_indices()
        return found

    @cached_property
    def _cooling(self) -> csc_array:
        """What films add to the stiffness, by functions."""
        domain = self._heat.domain
        cooled = [b for b in domain.scene.boundaries if b.kind == "convection" and b.value]
        none = csc_array((domain.space.size,) * 2)
        return csc_array(sum((float(b.value) * domain.faces(b).mass() for b in cooled), none))

    def _conducts_alike(self, heat: HeatProblem) -> bool:
        """Whether neither conductor nor what its currents meet changes."""
        here, there, own = self._heat.domain, heat.domain, self._conductor
        if own is None or own.influences or not np.array_equal(heat.lifts, self._heat.lifts):
            return False
        if any(not np.array_equal(held, heat.held[name]) for name, held in self._heat.held.items()):
            return False
        sides = [d.space.h[:, here.live] if isinstance(d, Boxes) else np.ones(1) for d in (here, there)]
        both = [(_laws(d), [b.value for b in d.scene.boundaries if b.kind == "voltage"]) for d in (here, there)]
        return (
            both[0] == both[1] and np.array_equal(here.live, there.live) and np.allclose(sides[0], sides[1], SAME, 0.0)
        )

    def _conductor_of(self, heat: HeatProblem, found: Conductor | None) -> Conductor | None:
        own = self._conductor
        if found is None or own is None or len(found.cells) != len(own.cells):
            return found and found.lower(self._level, heat)
        found = replace(found, heat=heat, free=own.free, solved=own.solved)
        alike = found.matrix is own.matrix
        solve = own.solve_cold if alike else _refined(part(found.matrix, found.free), own.solve_cold)
        found.kept.tell(solve_cold=solve, preconditioner=own.solve_cold)
        return found


def _laws(domain: Domain) -> list[tuple[float, float] | None]:
    start = domain.scene.initial_temperature
    return [law(m, start) if m.resistivity else None for m in domain.materials]


def _refined(matrix: csc_array, near: Solve) -> Solve:
    """What solves with a matrix by what solves with one next to it."""

    def solve(b: np.ndarray) -> np.ndarray:
        x = near(b)
        for _ in range(ROUNDS):
            x = x + near(b - matrix @ x)
        return x

    return solve
