"""Scenes on tetrahedra that are halved once, and the exponents of the edges that their cells touch."""

import numpy as np

from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import Boxes, Domain, box_cells
from meshes.columns import Columns
from scenes.model import Scene


def halved(scene: Scene) -> Boxes:
    """A scene on tetrahedra that are halved along each axis, as if no edge were sharp."""
    columns = Columns.of(scene)
    mesh = columns.mesh
    nowhere = np.zeros((3, mesh.nvertices), bool)
    return box_cells(scene, columns.refined(np.ones((3, mesh.t.shape[1]), bool), nowhere).mesh)


def exponents(domain: Domain) -> np.ndarray:
    """(2, cells): for the temperature and the potential."""
    return edge_exponents.of_cells(domain.space.mesh, edge_exponents.at_vertices(domain))
