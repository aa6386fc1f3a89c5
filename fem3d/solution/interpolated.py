"""Properties that follow the temperature, in the reduced problem: interpolated between states that are known.

What a law adds to the linear problem, p = k(T) - k(T_0) of a conductivity, is taken for a sum of what it adds at a few
states T_s,

    p(T(x)) = sum_s f_s p(T_s(x)),   exact at as many points of the quadrature,

so that the f_s follow from the temperatures at these points, and any integral of p is the same sum of integrals. States
and points are chosen in turn, each time where most is left (empirical interpolation: Barrault, Maday, Nguyen and
Patera, C. R. Acad. Sci. Paris 339, 2004).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem3d.problems.following import Conduction


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
    """The conductivity: ``matrices`` (states, r, r + channels), the integrals of what it adds at each state times the
    gradients of two fields; the states as ``fields`` (states, functions) of the ``term``."""

    term: Conduction
    interpolation: Interpolation
    matrices: np.ndarray
    fields: np.ndarray

    def changed(self, to: np.ndarray) -> Conducted:
        """As of `Interpolation`."""
        matrices = _turned(np.einsum("skx,kl->slx", self.matrices, to), to)
        return replace(self, interpolation=self.interpolation.changed(to), matrices=matrices)


def _turned(rows: np.ndarray, to: np.ndarray) -> np.ndarray:
    r = len(to)
    return np.concatenate([rows[..., :r] @ to, rows[..., r:]], axis=-1)


@dataclass(frozen=True, eq=False)
class Laws:
    """What follows the temperature in a reduced problem: the conductivity, and the resistivity, whose f_s are channels
    of the Joule heat beside the inputs."""

    conduction: Conducted | None
    resistivity: Interpolation | None

    def changed(self, to: np.ndarray) -> Laws:
        """As of `Interpolation`."""
        conduction = None if self.conduction is None else self.conduction.changed(to)
        return Laws(conduction, None if self.resistivity is None else self.resistivity.changed(to))

    @property
    def states(self) -> int:
        """Between how many states it is interpolated."""
        conduction = None if self.conduction is None else self.conduction.interpolation
        return max(len(each.rows) for each in (conduction, self.resistivity) if each is not None)

    def wide(self, a: np.ndarray, g: np.ndarray) -> np.ndarray:
        """(..., channels of the Joule heat): the inputs g (..., channels) and the f_s of the resistivity at states a
        (..., r)."""
        if self.resistivity is None:
            return g
        return np.concatenate([g, self.resistivity(together(a, g))], axis=-1)

    def outflow(self, a: np.ndarray, g: np.ndarray) -> np.ndarray | float:
        """(..., r): what the law of the conductivity adds to the outflow (W), tested with each temperature field."""
        if self.conduction is None:
            return 0.0
        x, own = together(a, g), self.conduction
        states, r, width = own.matrices.shape
        each = (x @ own.matrices.reshape(-1, width).T).reshape(*x.shape[:-1], states, r)
        found: np.ndarray = (own.interpolation(x)[..., None, :] @ each)[..., 0, :]
        return found


def together(a: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(..., r + channels): states and inputs side by side."""
    return np.concatenate([a, np.broadcast_to(g, (*a.shape[:-1], g.shape[-1]))], axis=-1)
