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

from fem3d import forms
from meshes.grid import Grid
from scenes.loading import load
from scenes.model import Scene
from scenes.sink import Sink
from validate.bench.problem import Answer, graded, quarter, stepped
from validate.verify import reference
from validate.verify.methods import Uniform

ELEMENTS = {1: (ElementHex1, 3), 2: (ElementHex2, 5)}  # with the order of integration that is exact on bricks


def matrices(scene: Scene, grid: Grid, degree: int) -> Callable[[], reference.Inner]:
    """What assembles a scene's matrices; the mesh is made before."""
    (mesh, owner), (element, order) = reference.hexahedra(grid), ELEMENTS[degree]
    return lambda: reference.Inner(reference.on_mesh(scene, mesh, owner, element(), order))


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    scene = quarter(sink)
    assemble = matrices(scene, graded(scene, options["grading"], options["cuts"], 1), options["degree"])
    return stepped(options, lambda: heated(sink, assemble()))


def heated(sink: Sink, problem: Any) -> Any:
    """With the Joule load of a state and the quantities."""
    basis, free = problem.full.basis, problem.free
    probes = {probe.name: probe for probe in problem.full.scene.probes}
    beam = reference.within(basis, probes["mean"])
    mass = problem.part(forms.capacity.assemble(beam, heat_capacity=np.ones(beam.dx.shape)))
    peak, end, mean = (reference.mean(basis, probes[name])[free] for name in ("peak", "end", "mean"))
    uniform = Uniform(sink, peak, end, mean, mass.__matmul__)
    problem.load, problem.quantities, problem.unknowns = uniform.load, uniform.quantities, problem.size
    return problem
