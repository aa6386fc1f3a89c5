"""Properties that follow the temperature, in the reduced problem: interpolated between states that are known.

What a law adds to the linear problem, p = k(T) - k(T_0) of a conductivity, is taken for a sum of what it adds at a few
states T_s,

    p(T(x)) = sum_s f_s p(T_s(x)),   exact at as many points of the quadrature,

so that the f_s follow from the temperatures at these points, and any integral of p is the same sum of integrals. States
and points are chosen in turn, each time where most is left (empirical interpolation: Barrault, Maday, Nguyen and
Patera, C. R. Acad. Sci. Paris 339, 2004).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from fem3d.problems.faces import Surface
from fem3d.problems.following import Conduction, Storage
from fem3d.problems.kept import Kept


@dataclass(frozen=True, eq=False)
class Interpolation:
    """The f_s: ``rows`` (points, r + channels) are the rises (K) at the points per coefficient of a state, ``excess``
    what the law adds there at rises (points, times), ``inverse`` (points, states) that of what it adds at the states.
    """

    rows: np.ndarray
    excess: Callable[[np.ndarray], np.ndarray]
    inverse: np.ndarray

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(..., states) at coefficients (..., r + channels)."""
        flat = x.reshape(-1, x.shape[-1])
        return (self.excess(self.rows @ flat.T).T @ self.inverse).reshape(*x.shape[:-1], -1)

    def changed(self, to: np.ndarray) -> Interpolation:
        """The same in other temperature fields, sums of these: ``to`` (r, new)."""
        return replace(self, rows=_turned(self.rows, to))


@dataclass(frozen=True, eq=False)
class Conducted:
    """The conductivity, the capacity, or what leaves by faces per rise: ``matrices`` (states, r, r + channels), the
    integrals of what it adds at each state times the gradients of two fields, or two fields; the states as ``fields``
    (states, functions) of the ``term``; ``through``: of each boundary the integrals (states, r + channels) with one
    field, what leaves there; ``kept``: rows (states, r + channels) of what else is read off it."""

    term: Conduction | Storage | Surface
    interpolation: Interpolation
    matrices: np.ndarray
    fields: np.ndarray
    through: Mapping[str, np.ndarray]
    kept: Kept = field(init=False, default_factory=Kept)

    def changed(self, to: np.ndarray) -> Conducted:
        """As of `Interpolation`."""
        matrices = _turned(np.einsum("skx,kl->slx", self.matrices, to), to)
        through = {name: _turned(rows, to) for name, rows in self.through.items()}
        return replace(self, interpolation=self.interpolation.changed(to), matrices=matrices, through=through)


def _turned(rows: np.ndarray, to: np.ndarray) -> np.ndarray:
    r = len(to)
    return np.concatenate([rows[..., :r] @ to, rows[..., r:]], axis=-1)


@dataclass(frozen=True, eq=False)
class Laws:
    """What follows the temperature in a reduced problem: the conductivity, and the resistivity, whose f_s are channels
    of the Joule heat beside the inputs; ``faces``, of boundaries whose heat is no straight line."""

    conduction: Conducted | None
    resistivity: Interpolation | None
    capacity: Conducted | None = None
    faces: tuple[Conducted, ...] = ()

    def changed(self, to: np.ndarray) -> Laws:
        """As of `Interpolation`."""
        conduction = None if self.conduction is None else self.conduction.changed(to)
        capacity = None if self.capacity is None else self.capacity.changed(to)
        resistivity = None if self.resistivity is None else self.resistivity.changed(to)
        return Laws(conduction, resistivity, capacity, tuple(face.changed(to) for face in self.faces))

    @property
    def leaving(self) -> list[Conducted]:
        """All that heat leaves by."""
        return [*([] if self.conduction is None else [self.conduction]), *self.faces]

    @property
    def states(self) -> int:
        """Between how many states it is interpolated."""
        capacity = None if self.capacity is None else self.capacity.interpolation
        every = (*(law.interpolation for law in self.leaving), self.resistivity, capacity)
        return max(len(each.rows) for each in every if each is not None)

    def wide(self, a: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(..., channels of the Joule heat): the inputs g (..., channels) and the f_s of the resistivity at states a
        (..., r)."""
        if self.resistivity is None:
            return g
        return np.concatenate([g, self.resistivity(together(a, g))], axis=-1)

    def slowed(
        self, a: np.ndarray, g: np.ndarray, changing: np.ndarray, source: np.ndarray, rates: np.ndarray
    ) -> np.ndarray:
        """(n, r): the source of da/dt = -rates a + source that states a (n, r) have with the capacity C of the law, at
        inputs g that change by ``changing`` (1/s): that of (1 + C) da/dt = -rates a + ``source`` - C_g dg/dt."""
        if self.capacity is None:
            return source
        f, r = self.capacity.interpolation(together(a, g)), a.shape[-1]
        matrices = np.tensordot(f, self.capacity.matrices, 1)
        of_states, of_inputs = matrices[..., :r] + np.eye(r), matrices[..., r:]
        right = source - rates * a - of_inputs @ changing
        sources: np.ndarray = np.linalg.solve(of_states, right[..., None])[..., 0] + rates * a
        return sources

    def outflow(self, a: np.ndarray, g: np.ndarray) -> np.ndarray | float:
        """(..., r): what laws of the conductivity and of faces add to the outflow (W), tested with each temperature
        field."""
        heat: np.ndarray | float = 0.0
        for law in self.leaving:
            x, (states, r, width) = together(a, g), law.matrices.shape
            each = (x @ law.matrices.reshape(-1, width).T).reshape(*x.shape[:-1], states, r)
            heat = heat + (law.interpolation(x)[..., None, :] @ each)[..., 0, :]
        return heat


def together(a: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(..., r + channels): states and inputs side by side."""
    return np.concatenate([a, np.broadcast_to(g, (*a.shape[:-1], g.shape[-1]))], axis=-1)
