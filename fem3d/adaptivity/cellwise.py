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
from fem3d.problems.paths import Paths
from fem3d.spaces.split import Interface
from scenes.model import bends

Tested = Callable[[np.ndarray], np.ndarray]
"""From a dual solution (functions,) to the product of each cell, in parts of its sign for the three axes (3, cells)."""


def _parts(products: np.ndarray, besides: np.ndarray | float = 0.0) -> np.ndarray:
    """(3, cells): the sums of products (3, cells) of slopes along the axes, and of others, in parts that are to one
    another as the absolute values of those of the slopes."""
    sizes = np.abs(products)
    total = np.maximum(sizes.sum(axis=0), 1e-300)
    parts: np.ndarray = (products.sum(axis=0) + besides) * np.where(total > 1e-300, sizes / total, 1 / 3)
    return parts


def heat(problem: HeatProblem, change: np.ndarray, time: float | None) -> Tested:
    """For a ``change`` (functions,) of the rise: k grad u . grad v with what films add and, half on each side,
    contacts; and, of a step of ``time`` (s), rho c u v over it."""
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
    """For a ``change`` (functions,) of the potential: sigma grad u . grad v of the cold conductor, with what contacts
    add, half on each side."""
    on: Any = conductor.on
    count = len(conductor.heat.domain.body)
    flux = on.weights * on.gradient(change) / conductor.cold

    def tested(dual: np.ndarray) -> np.ndarray:
        products, rows = np.zeros((3, count)), (flux * on.gradient(dual)).sum(axis=2)
        products[:, conductor.cells] = rows[:, : len(conductor.cells)]
        return _parts(products, on.beside(rows[0], count) if isinstance(on, Paths) else 0.0)

    return tested
