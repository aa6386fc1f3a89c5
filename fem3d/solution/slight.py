"""Faces whose heat is no straight line of their temperature, where that hardly matters: loads of the linear problem.

What leaves beyond the films, s(u), is some per cent of the heat that passes (`SLIGHT`). The linear problem's factors
then serve all along: K u = q + f - s(u). The reduced problem has s by its tangent about the last state, so that the
steps to the steady state (`fem3d.solution.steady`) are as many as without, and over time interpolated between states
(`fem3d.solution.between_states`). Dual solutions are those of the linear problem: what they leave out of the tangent
is four times that part at most, which changes an estimated error by as much of itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.faces import Surface
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import at_films
from fem3d.solution.reduced import Reduced
from scenes.errors import NumericsError

# Of the largest rise: what s may change of it, seen through the linear problem (`validate stress`: "constants").
SLIGHT = 0.02
QUADRATURE = 0.03  # of the accuracy: what a finer quadrature of s may change of the rise


def may(heat: HeatProblem, conductor: Conductor | None) -> bool:
    """Whether nothing but faces makes a problem nonlinear."""
    follows = conductor is not None and conductor.following is not None
    return bool(heat.terms) and not follows and all(isinstance(term, Surface) for term in heat.terms)


class Leaving:
    """s at the last state of an iteration, and about it; nothing where no face has any."""

    def __init__(self, heat: HeatProblem, rise: np.ndarray, check: bool) -> None:
        """About a ``rise`` (all nodes). Raises NumericsError where s is no slight part there, if that is to be
        checked."""
        self._heat, self._check, self.u = heat, check, rise
        self.load = np.zeros(heat.size)
        if not heat.terms:
            return
        seen = heat.solve_steady(self.at(rise)[: heat.free])
        if check and not _largest(seen) <= SLIGHT * _largest(rise):
            raise NumericsError("what leaves by faces beyond their films is no slight part of the heat")
        # Nearer to the state by what s takes away of it.
        self.at(rise - heat.whole(seen))

    def at(self, rise: np.ndarray) -> np.ndarray:
        """(all nodes,): s at a rise (all nodes), in W."""
        if self._heat.terms:
            self.u, self.load = rise, leaving(self._heat, rise)
        return self.load

    def beside(self, reduced: Reduced) -> Reduced:
        """A reduced problem of the linear one, with s by its tangent about the last state."""
        heat, stiffness, source = self._heat, reduced.stiffness, reduced.source.copy()
        if not heat.terms:
            return reduced
        fields, u = heat.field(heat.whole(reduced.basis.T)), heat.field(self.u)
        apart = heat.field(self.u - heat.lifts[0])
        source[0] -= self.load[: heat.free] @ reduced.basis
        for term in heat.terms:
            assert isinstance(term, Surface)
            slope, tested, at = term.steepness(u), term.on.value(fields), term.on.value(apart)
            weighted = (slope * tested).reshape(len(tested), -1)
            stiffness = stiffness + weighted @ tested.reshape(len(tested), -1).T
            source[0] += weighted @ at.ravel()
        return replace(reduced, stiffness=stiffness, source=source)

    def about(self, rise: np.ndarray, accuracy: float) -> tuple[HeatProblem, float]:
        """The problem that knows a steady rise (all nodes), with the films of that, and what a finer quadrature of s
        changes of it, relatively. Raises NumericsError where that is more than `QUADRATURE`."""
        heat = self._heat
        if not heat.terms:
            return heat, 0.0
        u, off = heat.field(rise), 0.0
        if self._check:
            off = self._by_quadrature(u, rise)
            if off > QUADRATURE * accuracy:
                raise NumericsError("what leaves by faces bends within their cells")
        known = at_films(replace(heat, about=u, exact=heat), u)
        known.kept.like(heat.kept)
        return known, off

    def _by_quadrature(self, u: np.ndarray, rise: np.ndarray) -> float:
        heat = self._heat
        change = sum((term.finer(u).outflow(u) - term.outflow(u) for term in heat.terms), np.zeros(len(u)))
        return _largest(heat.solve_steady(heat.take(change)[: heat.free])) / (_largest(rise) or 1.0)


def leaving(heat: HeatProblem, rise: np.ndarray) -> np.ndarray:
    """(all nodes,): what the terms of a problem add to its outflow at a rise (all nodes), in W."""
    u = heat.field(rise)
    return heat.take(sum((term.outflow(u) for term in heat.terms), np.zeros(len(u))))


def slight(heat: HeatProblem) -> bool:
    """Whether a problem that knows its state is the linear one."""
    return heat.exact is not None and heat.stiffness is heat.exact.stiffness


def _largest(field: np.ndarray) -> float:
    return float(np.abs(field).max(initial=0.0))
