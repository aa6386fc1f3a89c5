"""Which vertex, edge, facet or cell of a mesh each basis function is of."""

from __future__ import annotations

from typing import Any

import numpy as np


def entities(mesh: Any, dofs: Any, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(functions,): a number for each vertex, edge, facet and cell of scikit-fem's numbering that has functions; and
    where each is (entities, 3), the mean of its ``vertices`` (3, vertices)."""
    numbers, places = np.empty(int(dofs.N), int), [np.empty((0, 3))]
    kinds = (
        (dofs.nodal_dofs, lambda: np.arange(vertices.shape[1])[None]), (dofs.edge_dofs, lambda: mesh.edges),
        (dofs.facet_dofs, lambda: mesh.facets), (dofs.interior_dofs, lambda: mesh.t),
    )  # fmt: skip
    for part, corners in kinds:
        if part is not None and part.size:
            numbers[part] = sum(map(len, places)) + np.arange(part.shape[1])
            places.append(vertices[:, corners()].mean(axis=1).T)
    return numbers, np.concatenate(places)
