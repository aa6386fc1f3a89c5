"""The sink in scikit-fem: hexahedra of degree 2, scipy's splu with an ordering for symmetric matrices."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex2, LinearForm, MeshHex
from skfem.helpers import dot, grad

from benchmarks import sink_programs
from benchmarks.sink_programs import MATERIALS, UniformCurrent
from scenes.sink import Sink

conduction = BilinearForm(lambda u, v, w: w.k * dot(grad(u), grad(v)))
capacity = BilinearForm(lambda u, v, w: w.c * u * v)
integral = LinearForm(lambda v, w: v)


class Program(UniformCurrent):
    """Matrices of the free nodes."""

    def __init__(self, sink: Sink, cells: MeshHex, material: np.ndarray) -> None:
        basis = Basis(cells, ElementHex2(), intorder=5)
        silicon, oxide = sink.silicon, sink.oxide
        points = np.ones(basis.dx.shape)
        is_oxide = (material == MATERIALS.index("oxide"))[:, None]
        k = points * np.where(is_oxide, oxide.thermal_conductivity, silicon.thermal_conductivity)
        c = points * np.where(is_oxide, oxide.heat_capacity, silicon.heat_capacity)
        beam = basis.with_elements(np.flatnonzero(material == MATERIALS.index("beam")))
        free = np.setdiff1d(np.arange(basis.N), basis.get_dofs(lambda x: np.isclose(x[2], -sink.oxide_thickness)))

        def inner(matrix: Any) -> Any:
            return matrix[free][:, free].tocsc()

        end = basis.boundary(cells.facets_satisfying(
            lambda x: np.isclose(x[1], 0.0) & (x[0] < sink.width / 2) & (x[2] > 0)
        ))  # fmt: skip
        middle = np.array([[0.0], [sink.length / 2], [sink.thickness / 2]])
        rows = [np.asarray(basis.probes(middle).todense())[0]]
        rows += [(load := integral.assemble(part)) / load.sum() for part in (end, beam)]
        pairs = inner(capacity.assemble(beam, c=np.ones(beam.dx.shape)))
        super().__init__(sink, [row[free] for row in rows], pairs.__matmul__)
        self.stiffness, self.mass = inner(conduction.assemble(basis, k=k)), inner(capacity.assemble(basis, c=c))
        self.size = len(free)

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize a combination of the matrices."""
        matrix = (mass * self.mass + stiffness * self.stiffness).tocsc()
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return factors.solve  # type: ignore[no-any-return]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """Assemble and solve the quarter; read the numbers."""
    return sink_programs.prepare(options, Program)
