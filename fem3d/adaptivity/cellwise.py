"""Energy products of a field's change with a dual solution, cell by cell, for the heat and the current problem.

On bricks contributions are separated by function, because the functions of one interval are nearly orthogonal. On flat
tetrahedra they are not, and contributions cancel. There the energy product of the difference of two spaces' fields with
a dual solution is integrated over each cell, which is independent of the basis.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fem3d.problems.current import Conductor
from fem3d.problems.faces import film
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Paths
from fem3d.spaces.split import Interface
from scenes.model import bends

Tested = Callable[[np.ndarray], np.ndarray]
"""From a dual solution (functions,) to the product of each cell, in parts of its sign for the three axes (3, cells)."""


def _parts(products: np.ndarray, besides: np.ndarray | float = 0.0) -> np.ndarray:
    """Split the sum of the products (3, cells) of slopes and of other products ``besides`` into (3, cells) parts, in
    proportion to the absolute products of slopes."""
    sizes = np.abs(products)
    total = np.maximum(sizes.sum(axis=0), 1e-300)
    parts: np.ndarray = (products.sum(axis=0) + besides) * np.where(total > 1e-300, sizes / total, 1 / 3)
    return parts


def heat(problem: HeatProblem, change: np.ndarray, time: float | None) -> Tested:
    """Integrate k grad u . grad v over each cell for a ``change`` u (functions,) of the rise, with films and, half on
    each side, contacts; for a step of ``time`` (s) plus rho c u v / time."""
    domain = problem.domain
    on = domain.space.on(np.arange(len(domain.body)))
    flux = domain.per_cell("thermal_conductivity")[..., None] * on.weights * on.gradient(change)
    stored = 0.0
    if time is not None:
        stored = domain.per_cell("heat_capacity")[:, None] * on.weights * on.value(change) / time
    passing = []
    for b in domain.scene.boundaries:
        h = film(domain, b)[0] if bends(b) else b.value if b.kind == "convection" else 0.0
        if h:
            faces = domain.faces(b)
            passing.append((faces.value, h * faces.areas * faces.value(change), faces.cells[None]))
    for joint in domain.contacts:
        if joint.contact.thermal_resistance:
            face, pairs = Interface.inside(domain.space, joint.facets), domain.space.mesh.f2t[:, joint.facets]
            crossing = face.one.areas * face.jump(change) / joint.contact.thermal_resistance
            passing.append((face.jump, crossing, pairs))

    def tested(dual: np.ndarray) -> np.ndarray:
        besides = np.zeros(len(domain.body))
        if time is not None:
            besides += (stored * on.value(dual)).sum(axis=1)
        for value, heat, sides in passing:
            for cells in sides:
                besides += np.bincount(cells, (heat * value(dual)).sum(axis=1) / len(sides), len(besides))
        return _parts((flux * on.gradient(dual)).sum(axis=2), besides)

    return tested


def current(conductor: Conductor, change: np.ndarray) -> Tested:
    """Integrate sigma grad u . grad v over each cell of the cold conductor for a ``change`` u (functions,) of the
    potential, with contacts, half on each side."""
    on: Any = conductor.on
    count = len(conductor.heat.domain.body)
    flux = on.weights * on.gradient(change) / conductor.cold

    def tested(dual: np.ndarray) -> np.ndarray:
        products, rows = np.zeros((3, count)), (flux * on.gradient(dual)).sum(axis=2)
        products[:, conductor.cells] = rows[:, : len(conductor.cells)]
        return _parts(products, on.beside(rows[0], count) if isinstance(on, Paths) else 0.0)

    return tested
