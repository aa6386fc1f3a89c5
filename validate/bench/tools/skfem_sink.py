"""The sink in scikit-fem, as one who knows it would write it: hexahedra of degree 1 or 2 on the graded quarter, every
matrix assembled once, scipy's splu with an ordering for symmetric matrices, and a current density that doesn't vary.

``options``: ``degree``, ``grading``, ``cuts`` (the cells), ``transient``, ``steps`` in each interval of
time, ``method`` (its order, 2 to 4), ``tolerance`` of the iterations.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu
from skfem import Basis, ElementHex1, ElementHex2, FacetBasis, MeshHex

from fem3d import forms
from scenes.loading import load
from scenes.model import Box
from scenes.sink import Sink
from validate.bench.problem import graded, numbers, quarter, solved
from validate.verify import reference
from validate.verify.methods import Uniform

SMALL = 1e-9  # of the extent: closer coordinates are the same
ELEMENTS = {1: (ElementHex1, 3), 2: (ElementHex2, 5)}  # with the order of integration that is exact on bricks
Answer = tuple[int, list[list[float]]]


class Matrices:
    """The space, its nodes that are not held at room temperature, and stiffness (W/K) and mass (J/K) between them."""

    def __init__(self, mesh: MeshHex, owner: np.ndarray, boxes: tuple[Box, ...], degree: int) -> None:
        element, order = ELEMENTS[degree]
        self.basis = basis = Basis(mesh, element(), intorder=order)

        def per_element(name: str) -> np.ndarray:
            return np.array([getattr(box.material, name) for box in boxes])[owner][:, None] * np.ones(basis.dx.shape)

        floor, small = mesh.p[2].min(), SMALL * np.ptp(mesh.p)
        self.free = basis.complement_dofs(basis.get_dofs(lambda x: np.abs(x[2] - floor) < small))
        conductivity = per_element("thermal_conductivity")
        self.stiffness = self.inner(forms.conduction.assemble(basis, conductivity=conductivity))
        self.mass = self.inner(forms.capacity.assemble(basis, heat_capacity=per_element("heat_capacity")))

    def inner(self, matrix: Any) -> csc_array:
        return csc_array(matrix[self.free][:, self.free])

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Solves with a symmetric positive definite matrix."""
        matrix = mass * self.mass + stiffness * self.stiffness if mass else self.stiffness
        options = {"SymmetricMode": True}
        solve: Any = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve
        return solve  # type: ignore[no-any-return]


class Problem(Matrices, Uniform):
    """The matrices of the free nodes, the Joule load of a state, and the quantities."""

    def __init__(self, sink: Sink, mesh: MeshHex, owner: np.ndarray, boxes: tuple[Box, ...], degree: int) -> None:
        Matrices.__init__(self, mesh, owner, boxes, degree)
        in_beam = np.flatnonzero(owner == next(i for i, box in enumerate(boxes) if box.name == "beam"))
        beam = self.basis.with_elements(in_beam)
        at_end = mesh.facets_satisfying(lambda x: np.abs(x[1]) < SMALL * np.ptp(mesh.p))
        facets = np.intersect1d(at_end, mesh.t2f[:, in_beam])
        end = FacetBasis(mesh, self.basis.elem, facets=facets, intorder=ELEMENTS[degree][1])
        centre = np.array([[0.0], [sink.length / 2], [sink.thickness / 2]])
        peak = np.asarray(self.basis.probes(centre).todense())[0]
        ends, mean = (reference.integral.assemble(part, density=1.0)[self.free] for part in (end, beam))
        mass = self.inner(forms.capacity.assemble(beam, heat_capacity=np.ones(beam.dx.shape)))
        Uniform.__init__(self, sink, peak[self.free], ends, mean, mass)


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Assemble and solve the quarter on its mesh; read the numbers."""
    sink = load("sink", [])
    brick = graded(quarter(sink), options["grading"], options["cuts"], 1)
    mesh, owner = reference.hexahedra(brick)

    def solve() -> Answer:
        problem = Problem(sink, mesh, owner, brick.boxes, options["degree"])
        return len(problem.free), solved(options, problem, len(problem.free))

    return solve, lambda answer: numbers(options, *answer)
