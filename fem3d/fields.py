"""Temperature fields of the whole structure: as linear hexahedra for pictures, as quadratic ones for files."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fem3d.operators import HeatProblem
from fem3d.steady import SteadyState
from fem3d.transient import Transient
from meshes.symmetry import Symmetry
from meshes.unstructured import hexahedra

if TYPE_CHECKING:
    from fem3d.quadratic import Quadratic


class Fields:
    """Points (n, 3) in m, hexahedra (m, 8) between neighbouring nodes, materials (m,), temperatures (n,) in K.

    The solved part stands once for each of its mirror images; images share no points.
    """

    def __init__(
        self, heat: HeatProblem, state: SteadyState | None, symmetry: Symmetry, transient: Transient | None
    ) -> None:
        self._heat, self._state, self._symmetry, self._transient = heat, state, symmetry, transient

    @cached_property
    def _part(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Points, hexahedra, the box of each hexahedron, and the unknown at each point."""
        mesh, number = self._heat.mesh, self._heat.number
        points, hexes, boxes, nodes = hexahedra(mesh)
        return points, hexes, boxes, number[nodes]

    @cached_property
    def points(self) -> np.ndarray:
        """(n, 3) in m."""
        found = [self._part[0]]
        for axis, middle, _ in self._symmetry.planes:
            images = []
            for points in found:
                image = points.copy()
                image[:, axis] = 2 * middle - image[:, axis]
                images.append(image)
            found += images
        return np.concatenate(found)

    @cached_property
    def hexes(self) -> np.ndarray:
        """(m, 8) point numbers, in VTK's order."""
        found = [self._part[1]]
        for _ in self._symmetry.planes:
            count = len(found) * len(self._part[0])
            # A mirror image turns a brick inside out; exchanging its two faces turns it back.
            found += [np.roll(h, 4, axis=1) + count for h in found]
        return np.concatenate(found)

    @cached_property
    def material_names(self) -> list[str]:
        """Names of the materials, in the order of ``material``."""
        return list(dict.fromkeys(b.material.name for b in self._heat.mesh.boxes))

    @cached_property
    def material(self) -> np.ndarray:
        """(m,): the material of each hexahedron."""
        boxes = self._heat.mesh.boxes
        of_box = np.array([self.material_names.index(b.material.name) for b in boxes])
        return np.tile(of_box[self._part[2]], self._symmetry.copies)

    @cached_property
    def steady(self) -> np.ndarray:
        """(n,) in K; ValueError where the run has no steady state."""
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._whole(self._state.rise[None])[0]

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, n) in K; ValueError where the run has no transient."""
        if self._transient is None:
            raise ValueError("the run has no transient")
        return self._whole(self._transient.rises(np.asarray(times, dtype=float)))

    @property
    def has_steady(self) -> bool:
        """Whether the run has a steady state."""
        return self._state is not None

    def quadratic(self, times: np.ndarray, accuracy: float) -> Quadratic:
        """Quadratic cells fine enough for the steady state, if there is one, and for some times (s), in this order;
        ValueError for times where the run has no transient."""
        from fem3d.hex27 import State
        from fem3d.quadratic import Quadratic

        state, inputs = self._state, self._heat.inputs
        # A run at another voltage keeps the first one's scene, and says how much more it drives it by.
        drive = 1.0 if state is None else state.drive
        states = [] if state is None else [State(state.rise, drive * inputs.at(np.zeros(1))[0])]
        if len(times):
            if self._transient is None:
                raise ValueError("the run has no transient")
            at = np.asarray(times, dtype=float)
            pairs = zip(self._transient.rises(at), drive * inputs.at(at), strict=True)
            states += [State(rise, given) for rise, given in pairs]
        conductor = state.conductor if state is not None else None
        if conductor is None and self._transient is not None:
            conductor = self._transient.base.conductor
        return Quadratic(self._heat, conductor, self._symmetry, states, accuracy)

    def _whole(self, rises: np.ndarray) -> np.ndarray:
        heat = self._heat
        nodal = heat.whole(rises)
        return heat.scene.initial_temperature + np.tile(nodal[:, self._part[3]], (1, self._symmetry.copies))
