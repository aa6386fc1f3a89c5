"""The response over time where faces alone are nonlinear, and hardly are (`fem3d.solution.slight`): that of the linear
problem, with what leaves by them beyond their films, s(u), interpolated between a few states.

These are first those of the linear response, as large as the steady state in the end. What that and the fields lack of
s is seen at some instants, as the response at rest: K^-1 s(u), less what the reduced problem has for it. No mode
answers a load by more than it does at rest, so that this bounds what is missing at any time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem3d.problems.heat import HeatProblem
from fem3d.solution.between_states import with_laws
from fem3d.solution.reduced import Reduced
from fem3d.solution.slight import leaving
from fem3d.solution.transient import Base, Transient

INSTANTS = 8  # at which s is looked at
TOLERANCE = 1.0  # of the accuracy: of the interpolation, relative to the films' coefficients; what it leaves is seen
KEPT = 0.1  # of the largest that the fields lack: what joins them


@dataclass(frozen=True, eq=False)
class Between:
    """The ``states`` (k, all nodes) between which s is interpolated, the ``fields`` (free nodes, any number) that s
    needs beside those of the base, and the accuracy of the run."""

    states: np.ndarray
    fields: np.ndarray
    accuracy: float
    times: np.ndarray

    @staticmethod
    def guessed(base: Base, reduced: Reduced, end: float, earliest: float, accuracy: float) -> Between:
        """What is known beforehand, of a base whose steady state is known: the way of the linear reduced problem there,
        by what drives it in the end."""
        heat, steady = base.heat, base.steady
        assert steady is not None
        times, lift = np.geomspace(min(earliest, end / 2), end, INSTANTS), heat.lifts[0]
        rates, modes = np.linalg.eigh(reduced.stiffness)
        basis = heat.whole((reduced.basis @ modes).T)
        last = basis @ (heat.mass @ (steady.rise - lift))
        first = -reduced.inertia[0] @ modes
        states = (last + np.exp(-np.outer(times, rates)) * (first - last)) @ basis + lift
        return Between(np.vstack([states, steady.rise]), np.empty((heat.free, 0)), accuracy, times)

    def held(self, base: Base) -> Base:
        """The base, whose space holds the fields."""
        return replace(base, fields=np.column_stack([base.fields, self.fields])) if self.fields.size else base

    def beside(self, base: Base, reduced: Reduced) -> Reduced:
        """A reduced problem of the linear one, with s."""
        return with_laws(reduced, base.heat, base.conductor, base.patterns, self.states, TOLERANCE * self.accuracy)

    def lower(self, heat: HeatProblem, low: HeatProblem) -> Between:
        """The same in a lower space."""
        fields = low.take(heat.field(heat.whole(self.fields.T)))[:, : low.free].T
        return replace(self, states=low.take(heat.field(self.states)), fields=fields)

    def better(self, answer: Transient) -> tuple[Between, float]:
        """What does better than a response shows, and by how much that lacks of s, relative to the largest rise."""
        heat, reduced = answer.base.heat, answer.reduced
        assert reduced.laws is not None
        rises, a = answer.rises(self.times), answer.trajectory(self.times)[0]
        loads = np.array([leaving(heat, rise) for rise in rises])[:, : heat.free]
        told = np.asarray(reduced.laws.outflow(a, heat.inputs.at(self.times)))
        lack = heat.solve_steady(loads) - np.linalg.solve(reduced.stiffness, told.T).T @ reduced.basis.T
        sizes = np.abs(lack[:, heat.unit[: heat.free] == 1.0]).max(axis=1, initial=0.0)
        largest = float(np.abs(rises[:, heat.unit == 1.0]).max(initial=1e-300))
        _, values, right = np.linalg.svd(lack, full_matrices=False)
        fields = np.column_stack([self.fields, right[values > KEPT * max(values[0], 1e-300)].T])
        return replace(self, states=np.vstack([self.states, rises]), fields=fields), float(sizes.max()) / largest
