"""A nonlinear heat problem linearized about a state: the matrices of the tangent.

The tangent is K + R. K is the stiffness at the state's conductivity, symmetric and factorized; R is the rest: the
change by a rise of the conductivity under the present gradient, and of the Joule heat. The latter assumes a
current whose pattern stays while its size follows the resistance: rho' |J|^2 w, less twice the heat's load times the
relative change of the resistance in the circuit, a matrix of rank one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import part
from fem3d.problems.current import Conductor
from fem3d.problems.faces import Surface
from fem3d.problems.heat import Film, HeatProblem
from fem3d.problems.rest import Rest


def at_films(heat: HeatProblem, u: np.ndarray) -> HeatProblem:
    """The problem whose films are tangents at a field u, where a boundary's heat is no straight line."""
    films = dict(heat.films)
    for term in (heat.exact or heat).terms:
        if isinstance(term, Surface):
            for b in term.boundaries:
                still, per_kelvin = term.entering(u, heat.domain.faces(b))
                entering = np.zeros(heat.inputs.count)
                entering[0] = still
                films[b.name] = Film(entering, heat.take(per_kelvin))
    return replace(heat, films=films)


def linearized(heat: HeatProblem, conductor: Conductor | None, rise: np.ndarray, density: np.ndarray) -> HeatProblem:
    """The problem of a nonlinear one about a ``rise`` (all nodes), with a current of a ``density`` (A/m2) there: K for
    its stiffness, and R for its `rest`."""
    u = heat.field(rise)
    stiffness, matrix = heat.stiffness, csc_array((heat.size,) * 2)
    for term in heat.terms:
        symmetric, rest = term.tangent(u)
        stiffness = csc_array(stiffness + part(symmetric, heat.order))
        if rest is not None:
            matrix = csc_array(matrix + part(rest, heat.order))
    columns = rows = np.empty((0, heat.size))
    if conductor is not None and conductor.warms and len(density):
        heating, steepness = conductor.heating(density, density, rise), conductor.steepness(rise)
        matrix = csc_array(matrix - part(conductor.on.mass_of(steepness * heating), heat.order))
        dissipated = float((conductor.on.weights * heating).sum())
        falls = 2 * conductor.taken(density, dissipated) / (dissipated or 1.0)
        columns = falls * heat.take(conductor.on.load(heating))[None]
        rows = heat.take(conductor.on.load(steepness * heating))[None]
    stiffness.sort_indices()
    return replace(heat, stiffness=stiffness, rest=Rest(matrix, columns, rows), about=u, exact=heat)
