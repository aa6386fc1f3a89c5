"""The sink in NGSolve (https://ngsolve.org), an optional extra: hexahedra of any order and sparse Cholesky factors.

Lengths are in micrometres, everything else in SI units.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from ngsolve import dx, grad
from skfem import MeshHex

from benchmarks import sdirk, sink_programs
from benchmarks.sink_programs import COPIES
from scenes.sink import OF_A_SINK, Sink

MICRO = 1e-6
CORNERS = [0, 3, 6, 2, 1, 5, 7, 4]  # of a hexahedron of scikit-fem, in the order of Netgen


class Operator:
    """A matrix of NGSolve that multiplies arrays by @."""

    def __init__(self, matrix: Any) -> None:
        self.matrix, self.right, self.left = matrix, matrix.CreateRowVector(), matrix.CreateColVector()

    def __matmul__(self, values: np.ndarray) -> np.ndarray:
        self.right.FV().NumPy()[:] = values
        self.left.data = self.matrix * self.right
        return np.array(self.left.FV().NumPy())


class Program(sink_programs.Program):
    """Matrices of an order on the mesh; nodes on the substrate stay at zero."""

    def __init__(self, sink: Sink, cells: MeshHex, order: int) -> None:
        mesh = mesh_of(cells)
        self.space = ng.H1(mesh, order=order, dirichlet="substrate")
        u, v = self.space.TnT()
        of_name = {"beam": sink.silicon, "pad": sink.silicon, "oxide": sink.oxide}
        k = mesh.MaterialCF({name: m.thermal_conductivity * MICRO for name, m in of_name.items()})
        c = mesh.MaterialCF({name: m.heat_capacity * MICRO**3 for name, m in of_name.items()})
        forms = (c * u * v * dx, k * grad(u) * grad(v) * dx, MICRO**3 * u * v * dx("beam"))
        matrices = [Operator(ng.BilinearForm(form, symmetric=True).Assemble().mat) for form in forms]
        peak = ng.LinearForm(self.space)
        peak += v(0.0, sink.length / 2 / MICRO, sink.thickness / 2 / MICRO)
        area, volume = sink.cross_section / 2, sink.length * sink.cross_section / COPIES
        means = (MICRO**2 / area * v * ng.ds("end"), MICRO**3 / volume * v * dx("beam"))
        rows = [peak, *(ng.LinearForm(form) for form in means)]
        super().__init__(sink, [np.array(row.Assemble().vec.FV().NumPy()) for row in rows], *matrices)

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize a combination of the matrices."""
        capacity, conduction = self.mass.matrix, self.stiffness.matrix
        matrix = capacity.CreateMatrix()
        matrix.AsVector().data = mass * capacity.AsVector() + stiffness * conduction.AsVector()
        return Operator(matrix.Inverse(self.space.FreeDofs(), inverse="sparsecholesky")).__matmul__


def mesh_of(cells: MeshHex) -> ng.Mesh:
    """Return NGSolve's mesh, with the names of the subdomains and boundaries."""
    mesh = netgen.Mesh(dim=3)
    points = [mesh.Add(netgen.MeshPoint(netgen.Pnt(*point))) for point in (cells.p.T / MICRO).tolist()]
    for number, (name, inside) in enumerate(cells.subdomains.items(), 1):
        mesh.SetMaterial(number, name)
        for cell in cells.t[CORNERS][:, inside].T:
            mesh.Add(netgen.Element3D(number, [points[i] for i in cell]))
    for number, (name, facets) in enumerate(cells.boundaries.items(), 1):
        mesh.Add(netgen.FaceDescriptor(surfnr=number, domin=1, domout=0, bc=number))
        mesh.SetBCName(number - 1, name)
        for face in cells.facets[:, facets].T:
            mesh.Add(netgen.Element2D(number, [points[i] for i in face]))
    return ng.Mesh(mesh)


prepare = partial(sink_programs.prepare, Program)


def steady_quantities(sink: Sink, order: int, first: float, ratio: float) -> dict[str, float]:
    """Return the steady quantities of a sink, with the names of summary.json."""
    program = Program(sink, sink_programs.mesh(sink, first, ratio), order)
    peak, end, mean, current = program.quantities(sdirk.solve_steady(program, 1e-11))
    # All heat leaves through the substrate: this follows from the equations in any space that contains the constants.
    power = current * float(sink.voltage)
    values = (peak, end, mean, current, power, power, 2 * end / power)
    return dict(zip((entry.steady for entry in OF_A_SINK.values()), values, strict=True))
