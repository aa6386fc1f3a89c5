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
from benchmarks.sink_programs import COPIES, MATERIALS, UniformCurrent
from scenes.sink import OF_A_SINK, Sink

MICRO = 1e-6
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
FACES = np.array([[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]])
NAMES = ("rest", "substrate", "end")


class Operator:
    """A matrix of NGSolve that multiplies arrays by @."""

    def __init__(self, matrix: Any) -> None:
        self.matrix, self.right, self.left = matrix, matrix.CreateRowVector(), matrix.CreateColVector()

    def __matmul__(self, values: np.ndarray) -> np.ndarray:
        self.right.FV().NumPy()[:] = values
        self.left.data = self.matrix * self.right
        return np.array(self.left.FV().NumPy())


class Program(UniformCurrent):
    """Matrices of an order on the mesh; nodes on the substrate stay at zero."""

    def __init__(self, sink: Sink, cells: MeshHex, material: np.ndarray, order: int) -> None:
        mesh = mesh_of(cells, material)
        self.space = ng.H1(mesh, order=order, dirichlet="substrate")
        self.size = self.space.ndof
        u, v = self.space.TnT()
        of_name = {"beam": sink.silicon, "pad": sink.silicon, "oxide": sink.oxide}
        k = mesh.MaterialCF({name: m.thermal_conductivity * MICRO for name, m in of_name.items()})
        c = mesh.MaterialCF({name: m.heat_capacity * MICRO**3 for name, m in of_name.items()})
        forms = (k * grad(u) * grad(v) * dx, c * u * v * dx, MICRO**3 * u * v * dx("beam"))
        self._matrices = [ng.BilinearForm(form, symmetric=True).Assemble().mat for form in forms]
        self.stiffness, self.mass, pairs = map(Operator, self._matrices)
        peak = ng.LinearForm(self.space)
        peak += v(0.0, sink.length / 2 / MICRO, sink.thickness / 2 / MICRO)
        area, volume = sink.cross_section / 2, sink.length * sink.cross_section / COPIES
        means = (MICRO**2 / area * v * ng.ds("end"), MICRO**3 / volume * v * dx("beam"))
        rows = [peak, *(ng.LinearForm(form) for form in means)]
        super().__init__(sink, [np.array(row.Assemble().vec.FV().NumPy()) for row in rows], pairs.__matmul__)

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """Factorize a combination of the matrices."""
        conduction, capacity, _ = self._matrices
        matrix = capacity.CreateMatrix()
        matrix.AsVector().data = mass * capacity.AsVector() + stiffness * conduction.AsVector()
        return Operator(matrix.Inverse(self.space.FreeDofs(), inverse="sparsecholesky")).__matmul__


def mesh_of(cells: MeshHex, material: np.ndarray) -> ng.Mesh:
    """Return NGSolve's mesh, with "substrate" for the oxide's underside and "end" for the beam's end, inside."""
    mesh = netgen.Mesh(dim=3)
    at = cells.p.T / MICRO
    points = [mesh.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in at]
    for number, name in enumerate(MATERIALS):
        mesh.SetMaterial(number + 1, name)
    order = [int(np.flatnonzero((corner == MeshHex().p.T).all(axis=1))[0]) for corner in CORNERS]
    faces: dict[tuple[int, ...], tuple[np.ndarray, set[str]]] = {}
    for cell, number in zip(cells.t[order].T, material, strict=True):
        mesh.Add(netgen.Element3D(int(number) + 1, [points[i] for i in cell]))
        for face in cell[FACES]:
            faces.setdefault(tuple(sorted(face)), (face, set()))[1].add(MATERIALS[number])
    for number, name in enumerate(NAMES):
        mesh.Add(netgen.FaceDescriptor(surfnr=number + 1, domin=1, domout=0, bc=number + 1))
        mesh.SetBCName(number, name)
    for face, around in faces.values():
        if np.ptp(at[face, 2]) == 0 and np.isclose(at[face[0], 2], at[:, 2].min()):
            mesh.Add(netgen.Element2D(2, [points[i] for i in face]))
        elif around == {"beam", "pad"}:
            mesh.Add(netgen.Element2D(3, [points[i] for i in face]))
    return ng.Mesh(mesh)


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """Assemble and solve the quarter at the ``order``; read the numbers."""
    return sink_programs.prepare(options, partial(Program, order=options["order"]))


def steady_quantities(sink: Sink, order: int, first: float, ratio: float) -> dict[str, float]:
    """Return the steady quantities of a sink, with the names of summary.json."""
    program = Program(sink, *sink_programs.mesh(sink, first, ratio), order)
    peak, end, mean, current = program.quantities(sdirk.solve_steady(program, 1e-11))
    # All heat leaves through the substrate: this follows from the equations in any space that contains the constants.
    power = current * float(sink.voltage)
    values = (peak, end, mean, current, power, power, 2 * end / power)
    return dict(zip((entry.steady for entry in OF_A_SINK.values()), values, strict=True))
