"""The steady state of a scene beside another one, to the first order in the change of the equations.

With the equations F(x, s) = 0 and a state x at s = 0, the state at s is x - F'(x)^-1 (F(x, s) - F(x, 0)) and terms of
the second order in s. One linearization serves all neighbours, so a derivative costs a linear solve, and errors of the
iteration that found x cancel in F(x, s) - F(x, 0).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.problems.assembly import refine_quadratures
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.solution.steady import INNER, Linearization, Newton, SteadyState, read_state

TIGHT = 1e-2  # part of the accuracy to which changes of states are solved


class Tangent:
    """The linearized equations at a steady state, with changes solved to a part of an ``accuracy``."""

    def __init__(self, state: SteadyState, accuracy: float) -> None:
        heat = state.heat.exact or state.heat
        # Each solution for the residual of the one before reduces it by the tolerance of GMRES.
        self._solutions = math.ceil(math.log(TIGHT * accuracy) / math.log(INNER))
        self._state, self._newton = state, Newton(heat, state.conductor, state.heat.solve_steady)
        self._point = self._newton.at_rise(state.rise, 1.0)
        self._derivative = Linearization(self._newton, self._point)

    def state(self, heat: HeatProblem, conductor: Conductor | None) -> SteadyState:
        """Return the state of a scene beside, from its heat problem and its conductor on the same cells, moved."""
        newton, change = self._beside(heat, conductor), np.zeros(len(self._point.x))
        residual = newton.at(self._point.x).residual - self._point.residual
        for _ in range(self._solutions if residual.any() else 0):
            change += self._derivative.solve(residual - self._derivative(change), newton.along_mu)
            change[-1] = 0.0
        tangent = None
        if newton.nonlinear:
            tangent = replace(newton.heat, stiffness=self._state.heat.stiffness, rest=self._state.heat.rest)
            tangent.kept.tell(solve_steady=newton.factors)
        return read_state(newton, newton.at(self._point.x + change), 0.0, tangent)

    def _beside(self, heat: HeatProblem, conductor: Conductor | None) -> Newton:
        """The equations of a scene beside, by the quadratures of laws and with the factors of this one."""
        mine, factors = self._newton, self._newton.factors
        pairs: Any = zip((*mine.heat.terms, mine.conductor), (*heat.terms, conductor), strict=True)
        if points := max((a.more - b.more for a, b in pairs if a is not None), default=0):
            heat, conductor = refine_quadratures(heat, conductor, points)
        return Newton(heat, conductor, factors)
