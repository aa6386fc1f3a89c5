"""Dual solutions of the coupled steady state: how an output follows the residuals of heat and of current.

With rise u, potential phi, conductivity k(u) and resistivity rho(u), the state solves, for all tests z, w that vanish
at given values,

    R_T(z) = int k(u) grad u . grad z + films - int q z - int |grad phi|^2 / (n rho(u)) z = 0
    R_E(w) = int grad phi . grad w / rho(u) = 0

(with what enters at electrodes of given current, or behind a resistance, as `fem3d.problems.terminals` has it)
and an output is J = row @ u + charges @ phi + R_T(e) + R_E(d) + int_boxes |grad phi|^2 / (n rho(u)) + films: heat
flows and currents are residuals of tests e, d that live at given nodes; of cells that stand for n in series rho counts
all, the heat one. The dual solutions z and w make J - R_T(z) - R_E(w) stationary in u and phi, so that its change with
anything else is that of J (Becker and Rannacher, Acta Numerica 10, 2001; Giles and Pierce, Flow, Turbulence and
Combustion 65, 2000).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import LinearOperator, gmres

from fem3d.problems.current import Conductor
from fem3d.problems.faces import Surface
from fem3d.problems.linearized import linearized
from fem3d.problems.rest import Rest
from fem3d.problems.terminals import packed, unpacked
from fem3d.sensitivity.motion import Motion
from fem3d.solution.steady import SteadyState
from fem3d.spaces.integrals import Faces
from scenes import faces, physics
from scenes.errors import ConvergenceError
from scenes.model import bends

SOLVED = 1e-8  # relative residual of dual solutions; derivatives are asked for to some 1e-4
FILMS = ("convection", "radiation")
MOST = 200  # steps of the dual iteration, at most: as many as a state next to runaway takes


Explicit = Callable[[Motion], float]
"""How a reading changes with a motion while rise and potential stay."""


@dataclass(frozen=True, eq=False)
class Goal:
    """An output J as above: ``row`` (functions,) and ``charges`` (functions,), the tests ``heat`` (e) and ``charge``
    (d) (functions,), the weight of the Joule heat of each of the conductor's rows ``boxes`` (rows, 1), and of the flow
    through each facet of a film ``films`` (facets,), by boundary; ``explicit``: the derivatives of the rows themselves
    by a motion, with weights."""

    row: np.ndarray
    charges: np.ndarray
    heat: np.ndarray
    charge: np.ndarray
    boxes: np.ndarray
    films: dict[str, np.ndarray] = field(default_factory=dict)
    explicit: tuple[tuple[float, Explicit], ...] = ()

    def plus(self, weight: float, other: Goal) -> Goal:
        """self + weight * other."""
        films = {**self.films, **{name: weight * v for name, v in other.films.items()}}
        films |= {name: v + films[name] for name, v in self.films.items() if name in other.films}
        return Goal(
            self.row + weight * other.row, self.charges + weight * other.charges, self.heat + weight * other.heat,
            self.charge + weight * other.charge, self.boxes + weight * other.boxes, films,
            (*self.explicit, *((weight * w, term) for w, term in other.explicit)),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Linearized:
    """The problem linearized at a steady state."""

    state: SteadyState

    @cached_property
    def rise(self) -> np.ndarray:
        """(functions,)."""
        return self.state.heat.field(self.state.rise)

    @cached_property
    def slope(self) -> np.ndarray:
        """(3, live cells, points): the gradient of the potential at the state."""
        slope: np.ndarray = self._conductor.on.gradient(self.state.hot_potential)
        return slope

    @cached_property
    def tangent(self) -> tuple[csc_array, Rest | None]:
        """The derivative of what leaves by conduction and films by the rise (all nodes), transposed: a symmetric matrix
        and the rest, where a term is nonlinear."""
        heat = self.state.heat
        if heat.exact is None:
            return heat.stiffness, None
        problem = linearized(heat.exact, None, self.state.rise, np.empty(0))
        assert problem.rest is not None
        return problem.stiffness, problem.rest.transposed()

    def face(self, boundary: Any) -> Faces:
        """That of a film, with the points of its quadrature."""
        terms = (self.state.heat.exact or self.state.heat).terms
        facets = self.state.heat.domain.faces(boundary)
        more = [t.more for t in terms if isinstance(t, Surface) and boundary in t.boundaries]
        return facets.finer(more[0]) if more else facets

    def temperature(self, face: Faces) -> np.ndarray:
        """(facets, points) in K."""
        return self.state.heat.domain.scene.initial_temperature + face.value(self.rise)

    @cached_property
    def rho(self) -> np.ndarray:
        """(live cells, points)."""
        return self._conductor.resistivity(self.state.rise)

    @cached_property
    def _steepness(self) -> np.ndarray:
        """(live cells, points): the derivative of the resistivity's logarithm (1/K)."""
        return self._conductor.steepness(self.state.rise)

    @property
    def _conductor(self) -> Conductor:
        assert self.state.conductor is not None
        return self.state.conductor

    def nothing(self) -> Goal:
        """The goal that is always zero."""
        domain, conductor = self.state.heat.domain, self.state.conductor
        rows = 0 if conductor is None else len(conductor.cold)
        rises, potentials = (np.zeros(each.space.size) for each in (domain, domain.electric))
        return Goal(rises, potentials, rises, potentials, np.zeros((rows, 1)))

    def tested(self, z: np.ndarray, boxes: np.ndarray | float) -> np.ndarray:
        """(live cells, points): (z + boxes) / n, what |grad phi|^2 / rho is multiplied by."""
        tested: np.ndarray = (self._conductor.on.value(z) + boxes) / self._conductor.stands_for
        return tested

    def pressed(self, z: np.ndarray, w: np.ndarray, boxes: np.ndarray | float) -> np.ndarray:
        """(live cells, points): |grad phi|^2 s - grad phi . grad w with s = `tested`, what 1/rho is multiplied by."""
        on = self._conductor.on
        pressed: np.ndarray = (self.slope * (self.slope * self.tested(z, boxes) - on.gradient(w))).sum(axis=0)
        return pressed

    def gradient(self, goal: Goal, z: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(all nodes,), (functions,): how J - R_T(z) - R_E(w) follows the rise and the potential; zero at free ones of
        the dual solutions. z and w (functions,) have the goal's tests in them, with a minus."""
        heat = self.state.heat
        stiffness, rest = self.tangent
        tested = heat.take(z)
        gradient = heat.take(goal.row) - stiffness @ tested - (0.0 if rest is None else rest(tested))
        for boundary in heat.domain.scene.boundaries:
            if boundary.kind in FILMS and boundary.name in goal.films:
                face = self.face(boundary)
                bent = bends(boundary)
                per_kelvin = faces.slope(boundary, self.temperature(face)) if bent else boundary.value
                gradient -= heat.take(face.load(per_kelvin * goal.films[boundary.name][:, None]))
        if self.state.conductor is None:
            return gradient, goal.charges.copy()
        of_phi = goal.charges + self._charge(z, w, goal.boxes)
        for t in self._conductor.terminals:
            of_phi[t.at] -= t.conductance * (w + goal.charge)[t.at]
        if self._conductor.warms:
            gradient -= heat.take(self._conductor.on.load(self._steepness / self.rho * self.pressed(z, w, goal.boxes)))
        return gradient, of_phi

    def _charge(self, z: np.ndarray, w: np.ndarray, boxes: np.ndarray | float) -> np.ndarray:
        on = self._conductor.on
        charge: np.ndarray = on.flow((2 * self.slope * self.tested(z, boxes) - on.gradient(w)) / self.rho)
        return charge

    def solve(self, goal: Goal) -> tuple[np.ndarray, np.ndarray]:
        """(functions,) twice: z and w with the goal's tests in them, with a minus. Raises ConvergenceError."""
        heat, conductor = self.state.heat, self.state.conductor
        # Where nothing thermal is asked for there is no equation of heat.
        n = heat.free if physics.heat(heat.domain.scene) else 0
        free, terminals = (np.empty(0, int), ()) if conductor is None else (conductor.free, conductor.terminals)
        z, w = -goal.heat, -goal.charge

        def unknowns(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            return heat.field(x[:n]), unpacked(terminals, free, x[n:], len(w))

        def residual(goal: Goal, z: np.ndarray, w: np.ndarray) -> np.ndarray:
            of_rise, of_phi = self.gradient(goal, z, w)
            return np.concatenate([of_rise[:n], packed(terminals, free, of_phi)])

        none = self.nothing()

        def applied(x: np.ndarray) -> np.ndarray:
            return -residual(none, *unknowns(x))

        def preconditioned(b: np.ndarray) -> np.ndarray:
            # Lower triangular: the heat as without a current, then the current that goes with it in the cold conductor.
            at_rise = heat.solve_steady(b[:n]) if n else b[:0]
            if conductor is None:
                return at_rise
            charge = self._charge(heat.field(at_rise), np.zeros(len(w)), 0.0)
            charge[free] += b[n : n + len(free)]
            for t, more in zip(terminals, b[n + len(free) :], strict=True):
                charge[t.at] += more
            potential = conductor.respond(charge)
            return np.concatenate([at_rise, potential[free], [potential[t.at] for t in terminals]])

        b = residual(goal, z, w)
        size = len(b)
        # In the norm of the preconditioned equations, whose parts of heat and of current are of like size.
        start = preconditioned(b)
        operator = LinearOperator((size, size), lambda x: preconditioned(applied(x)), dtype=float)
        x, failed = gmres(operator, start, rtol=SOLVED, atol=0.0, restart=MOST, maxiter=1)
        if failed:
            raise ConvergenceError("the dual solution of a derivative does not converge")
        more_z, more_w = unknowns(x)
        return z + more_z, w + more_w
