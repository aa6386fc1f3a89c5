"""The sink in scikit-fem, as one who knows it would write it: hexahedra of degree 1 or 2 on the graded quarter, every
matrix assembled once, scipy's splu with an ordering for symmetric matrices, and a current density that doesn't vary.

``options``: ``degree``, ``grading``, ``cuts`` (the cells), ``transient``, ``steps`` in each interval of
time, ``method`` (its order, 2 to 4), ``tolerance`` of the iterations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from skfem import ElementHex1, ElementHex2

from fem3d.spaces import forms
from meshes.grid import Grid
from scenes.loading import load
from scenes.model import Scene
from scenes.sink import Sink
from validate.bench.problem import Answer, graded, quarter, stepped
from validate.verify import reference
from validate.verify.methods import Uniform

ELEMENTS = {1: (ElementHex1, 3), 2: (ElementHex2, 5)}  # with the order of integration that is exact on bricks


def assembly(scene: Scene, grid: Grid, degree: int) -> Callable[[], reference.FullOrder]:
    """What assembles a scene's matrices; the mesh is made before."""
    (mesh, owner), (element, order) = reference.hexahedra(grid), ELEMENTS[degree]
    return lambda: reference.on_mesh(scene, mesh, owner, element(), order)


class Problem(reference.Inner):
    """With the Joule load of a state and the quantities."""

    def __init__(self, sink: Sink, full: reference.FullOrder) -> None:
        super().__init__(full)
        probes = {probe.name: probe for probe in full.scene.probes}
        beam = reference.within(full.basis, probes["mean"])
        mass = self.part(forms.capacity.assemble(beam, heat_capacity=np.ones(beam.dx.shape)))
        peak, end, mean = (reference.mean(full.basis, probes[name])[self.free] for name in ("peak", "end", "mean"))
        self.uniform, self.unknowns = Uniform(sink, peak, end, mean, mass.__matmul__), self.size
        self.quantities = self.uniform.quantities

    def load(self, rise: np.ndarray) -> np.ndarray:
        return self.uniform.load(rise)


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    scene = quarter(sink)
    full = assembly(scene, graded(scene, options["grading"], options["cuts"], 1), options["degree"])
    return stepped(options, lambda: Problem(sink, full()))
