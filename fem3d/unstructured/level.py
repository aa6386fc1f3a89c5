"""One discretization of a scene on its mesh: elements of some degree, on the mesh as it is or refined once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem3d.unstructured import conductor, heat
from fem3d.unstructured.conductor import Conductor
from fem3d.unstructured.heat import Heat
from meshes.grouped.place import Placed
from meshes.grouped.refine import inherited, refine

LARGEST_REFINED = 60_000  # unknowns of a refined mesh; above, the mesh is taken as it is


@dataclass(frozen=True, eq=False)
class Level:
    """The heat problem and the conductors of a scene. ``given`` is the scene on the file's own mesh."""

    given: Placed
    degree: int
    refined: bool = False

    @cached_property
    def heat(self) -> Heat:
        """The heat problem."""
        own = Placed(self.given.scene, refine(self.given.mesh)) if self.refined else self.given
        return heat.assemble(own, self.degree)

    @cached_property
    def conductor(self) -> Conductor | None:
        """The conductors."""
        return conductor.find(self.heat)

    @property
    def words(self) -> str:
        """What the level is, for a person."""
        return f"degree {self.degree}{' on a mesh refined once' if self.refined else ''}"

    def at_file_nodes(self, order: int) -> np.ndarray:
        """(cells, nodes): the unknown at each node of the file's cells of an order; a level of degree 1 on the mesh as
        it is knows corners only (ValueError)."""
        mesh, dofs = self.given.mesh, self.heat.space.dofs
        if self.refined:
            child, node = inherited(mesh.kind, order)
            return dofs.reshape(len(mesh.cells), 8, -1)[:, child, node]
        if order > self.degree:
            raise ValueError("elements of degree 1 have no nodes on edges")
        return dofs[:, : mesh.corners.shape[1]] if order == 1 else dofs


def finest(given: Placed) -> list[Level]:
    """The levels that are worth their time, from coarse to fine: degrees 1 and 2, and of a small mesh a refined one."""
    # A refined mesh has eight times the cells, and close to eight times the nodes.
    unknowns = 8 * len(np.unique(given.mesh.corners)) * (8 if given.mesh.kind == "hexahedron" else 7)
    levels = [Level(given, 1), Level(given, 2)]
    return [*levels, Level(given, 2, refined=True)] if unknowns <= LARGEST_REFINED else levels
