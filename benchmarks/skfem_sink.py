"""The sink in scikit-fem: hexahedra of degree 2, scipy's splu with an ordering for symmetric matrices."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex1, ElementHex2, LinearForm, MeshHex
from skfem.helpers import dot, grad

from benchmarks import sink_programs
from scenes.sink import Sink

conduction = BilinearForm(lambda u, v, w: w.k * dot(grad(u), grad(v)))
capacity = BilinearForm(lambda u, v, w: w.c * u * v)
integral = LinearForm(lambda v, w: v)


class Program(sink_programs.Program):
    """Matrices of the free nodes."""

    def __init__(self, sink: Sink, cells: MeshHex, order: int) -> None:
        basis = Basis(cells, (ElementHex1, ElementHex2)[order - 1](), intorder=2 * order + 1)
        beam, silicon, oxide = basis.with_elements("beam"), sink.silicon, sink.oxide
        k, c = np.ones((2, *basis.dx.shape))
        k *= silicon.thermal_conductivity
        c *= silicon.heat_capacity
        k[cells.subdomains["oxide"]], c[cells.subdomains["oxide"]] = oxide.thermal_conductivity, oxide.heat_capacity
        free = basis.complement_dofs(basis.get_dofs("substrate"))
        matrices = (
            capacity.assemble(basis, c=c), conduction.assemble(basis, k=k),
            capacity.assemble(beam, c=np.ones(beam.dx.shape)),
        )  # fmt: skip
        middle = np.array([[0.0], [sink.length / 2], [sink.thickness / 2]])
        rows = [np.asarray(basis.probes(middle).todense())[0]]
        rows += [(load := integral.assemble(part)) / load.sum() for part in (basis.boundary("end"), beam)]
        super().__init__(sink, [row[free] for row in rows], *(matrix[free][:, free].tocsc() for matrix in matrices))

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize a combination of the matrices."""
        matrix = (mass * self.mass + stiffness * self.stiffness).tocsc()
        factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        return factors.solve  # type: ignore[no-any-return]


prepare = partial(sink_programs.prepare, Program)
