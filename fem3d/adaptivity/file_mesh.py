"""A scene on the cells of a mesh file (`fem3d.adaptivity.cell_mesh`)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d.adaptivity.cell_mesh import CellMesh, fitting
from fem3d.spaces.domain import Domain, groups
from meshes.grouped.check import check, remarks
from meshes.grouped.place import Placed
from meshes.grouped.read import read
from meshes.grouped.refine import refine
from scenes.model import MeshScene
from scenes.plan import Step


def mesh_of(scene: MeshScene) -> CellMesh:
    """Return the scene on the mesh of its file.

    Raises SceneError where they do not fit together, TooLargeError where the cells take too much memory.
    """
    return fitting(FileLayout(check(scene, read(scene.path, scene.unit))), scene.accuracy)


@dataclass(frozen=True, eq=False)
class FileLayout:
    """A scene on the cells of its file, or on refined ones."""

    placed: Placed

    advice = "give a finer mesh, above all at edges, corners and the rims of electrodes and fixed temperatures"

    @property
    def scene(self) -> MeshScene:
        return self.placed.scene

    @property
    def name(self) -> str:
        mesh = self.placed.mesh
        return f"the {mesh.count:,} {'tetrahedra' if mesh.simplex else 'hexahedra'} of {self.scene.file}"

    @property
    def cells(self) -> Any:
        return self.placed.mesh.mesh

    def domain(self, degree: int) -> Domain:
        return groups(self.placed, degree)

    def refine(self, shorter: np.ndarray, sharp: np.ndarray) -> FileLayout:
        """Three bisections make one half as long, wherever edges are sharp; hexahedra are all cut into eight."""
        mesh, times = self.placed.mesh, np.where(shorter.any(axis=0), 3, 0)
        return FileLayout(replace(self.placed, mesh=refine(mesh, times if mesh.simplex else None)))

    def with_scene(self, scene: MeshScene) -> FileLayout:
        return FileLayout(replace(self.placed, scene=scene))

    def remarks(self) -> list[str]:
        return remarks(self.placed.mesh)

    def statistics(self) -> dict[str, Any]:
        mesh = self.placed.mesh
        named = {"volume_groups": sorted(mesh.volumes), "surface_groups": sorted(mesh.surfaces)}
        return {"file_cells": len(mesh.cells), "cell_type": mesh.file_type, **named}

    def steps(self, levels: int | None, degree: int) -> tuple[Step, Step]:
        mesh, accuracy = self.placed.mesh, f"an estimated error of {self.scene.accuracy:g}"
        cut = "halved where readings miss most" if mesh.simplex else "cut into eight"
        how = f"{cut}, until {accuracy} is reached or memory or time ends it"
        if levels is not None:
            how = f"{cut}, {levels} times, to {mesh.count} cells"
        degrees = ", ".join(str(p) for p in range(1, degree)) + f" and {degree}"
        why = f"degrees {degrees} estimate the errors on the cells of the file" if levels == 0 else how
        what = f"{len(mesh.cells)} {mesh.file_type} cells of {self.scene.file}, degree {degree}"
        return Step("mesh", "done", what), Step("refinement", "skipped" if levels == 0 else "done", why)
