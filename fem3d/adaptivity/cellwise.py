"""What a change of a field does to another one cell by cell, in the energy product of the heat or the current problem.

On bricks parts are told function by function, as those of one interval are nearly orthogonal. On flat tetrahedra they
are not, and cancel: there the difference of two spaces' fields times a dual solution is integrated over each cell,
which no choice of functions changes.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.faces import film
from fem3d.problems.heat import HeatProblem
from scenes.model import bends

Tested = Callable[[np.ndarray], np.ndarray]
"""From a dual solution (functions,) to the absolute product of each cell (cells,)."""


def heat(problem: HeatProblem, change: np.ndarray, time: float | None) -> Tested:
    """For a ``change`` (functions,) of the rise: k grad u . grad v with what films add, and, of a step of ``time`` (s),
    rho c u v over it."""
    domain = problem.domain
    on = domain.space.on(np.arange(len(domain.body)))
    flux = domain.per_cell("thermal_conductivity")[..., None] * on.weights * on.gradient(change)
    stored = 0.0
    if time is not None:
        stored = domain.per_cell("heat_capacity")[:, None] * on.weights * on.value(change) / time
    films = []
    for b in domain.scene.boundaries:
        h = film(domain, b)[0] if bends(b) else b.value if b.kind == "convection" else 0.0
        if h:
            facets = domain.on(b)
            faces = domain.faces(b)
            films.append((faces, domain.space.mesh.f2t[0, facets], h * faces.areas * faces.value(change)))

    def tested(dual: np.ndarray) -> np.ndarray:
        products = (flux * on.gradient(dual)).sum(axis=(0, 2))
        if time is not None:
            products += (stored * on.value(dual)).sum(axis=1)
        for faces, cells, passing in films:
            products += np.bincount(cells, (passing * faces.value(dual)).sum(axis=1), len(products))
        return np.abs(products)

    return tested


def current(conductor: Conductor, change: np.ndarray) -> Tested:
    """For a ``change`` (functions,) of the potential: sigma grad u . grad v of the cold conductor."""
    on: Any = conductor.on
    count = len(conductor.heat.domain.body)
    flux = on.weights * on.gradient(change) / (conductor.cold * conductor.stands_for)

    def tested(dual: np.ndarray) -> np.ndarray:
        products = np.zeros(count)
        products[conductor.cells] = np.abs((flux * on.gradient(dual)).sum(axis=(0, 2)))
        return products

    return tested
