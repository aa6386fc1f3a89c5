"""The sink in NGSolve (https://ngsolve.org), as one who knows it would write it: H1 hexahedra of any order on a graded
quarter, sparse Cholesky factors, and what `methods` asks for: a second, independent code, an optional extra."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
from ngsolve import dx, grad

from fem3d.runs.sink import solve
from meshes import grading, symmetry
from meshes.grid import Grid
from scenes.sink import OF_A_SINK, Sink
from validate.verify import reference
from validate.verify.methods import COPIES, Uniform, settle
from validate.verify.report import Row

MICRO = 1e-6
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
FACES = np.array([[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]])
NAMES = ("rest", "substrate", "end", "middle")
ORDERS = (3, 4)
ACCURACY, GRADING = 1e-4, 1e-6
SETTLED = 1e-11  # of the rise


class Operator:
    """One of NGSolve's matrices, which multiplies arrays by @."""

    def __init__(self, matrix: Any) -> None:
        self.matrix, self.given, self.result = matrix, matrix.CreateRowVector(), matrix.CreateColVector()
        self.arrays = self.given.FV().NumPy(), self.result.FV().NumPy()

    def __matmul__(self, values: np.ndarray) -> np.ndarray:
        given, result = self.arrays
        given[:] = values
        self.result.data = self.matrix * self.given
        return result.copy()


class Matrices:
    """Stiffness (W/K) and mass (J/K) on a mesh of `mesh_of`, the order across thin layers being that of ``layers``;
    ``condensed`` without the unknowns inside elements, as the steady state alone needs them."""

    def __init__(self, mesh: ng.Mesh, grid: Grid, order: int, layers: int, condensed: bool = False) -> None:
        self.mesh, self.condensed = mesh, condensed
        # With ``relorder`` alone (as many more than the mesh has) NGSolve takes each edge's and face's order from the
        # elements at it; the flag is none of those it documents.
        self.orders = {"order": order} if order == layers else {"relorder": 0}
        self.space = ng.H1(mesh, dirichlet="substrate", **self.orders)
        self.size, self.unknowns = self.space.ndof, sum(self.space.FreeDofs())
        u, v = self.space.TnT()
        materials = {box.name: box.material for box in grid.boxes}
        k = mesh.MaterialCF({n: m.thermal_conductivity * MICRO for n, m in materials.items()})
        c = mesh.MaterialCF({n: m.heat_capacity * MICRO**3 for n, m in materials.items()})
        form = k * grad(u) * grad(v) * dx
        self.conduction = ng.BilinearForm(form, symmetric=True, condense=condensed).Assemble()
        self.capacity = ng.BilinearForm(c * u * v * dx, symmetric=True).Assemble().mat
        self.stiffness, self.mass = Operator(self.conduction.mat), Operator(self.capacity)

    def factors(self, mass: float, stiffness: float) -> Callable[[np.ndarray], np.ndarray]:
        """By Cholesky factors."""
        form = self.conduction
        if not self.condensed:
            matrix = form.mat
            if mass:
                matrix = self.capacity.CreateMatrix()
                matrix.AsVector().data = mass * self.capacity.AsVector() + stiffness * form.mat.AsVector()
            return Operator(matrix.Inverse(self.space.FreeDofs(), inverse="sparsecholesky")).__matmul__
        inverse = form.mat.Inverse(self.space.FreeDofs(True), inverse="sparsecholesky")

        def solve(load: np.ndarray) -> np.ndarray:
            rhs, solution = ng.BaseVector(load), ng.BaseVector(len(load))
            inside = form.inner_solve * rhs
            rhs.data += form.harmonic_extension_trans * rhs
            solution.data = inverse * rhs
            solution.data += form.harmonic_extension * solution
            solution.data += inside
            return np.array(solution.FV().NumPy())

        return solve


class Problem(Matrices):
    """With the Joule load of a state and the quantities; lengths in micrometres, the rest in SI. ``electric``
    "uniform" uses that with ideal electrodes at the beam's ends the current density hardly varies (by 4e-7 at 1 V): no
    electric problem is solved, and the Joule heat is affine in the temperature, the fastest that can be done. "full"
    solves the potential with the resistivity of each stage and assembles the Joule heat anew.
    """

    def __init__(
        self, sink: Sink, mesh: ng.Mesh, grid: Grid, order: int, layers: int, electric: str, steady: bool
    ) -> None:  # fmt: skip
        super().__init__(mesh, grid, order, layers, steady)
        u, v = self.space.TnT()
        self.voltage, self.full = sink.voltage, electric == "full"
        beam = ng.BilinearForm(MICRO**3 * u * v * dx("beam"), symmetric=True)
        peak = ng.LinearForm(self.space)
        peak += v(0.0, sink.length / 2 / MICRO, sink.thickness / 2 / MICRO)
        ends, part = sink.cross_section / 2, sink.length * sink.cross_section / COPIES
        rows = peak, ng.LinearForm(MICRO**2 / ends * v * ng.ds("end")), ng.LinearForm(MICRO**3 / part * v * dx("beam"))
        at, end, mean = (np.array(row.Assemble().vec.FV().NumPy()) for row in rows)
        weighed = Operator(beam.Assemble().mat).__matmul__ if not self.full else np.zeros_like
        self.uniform = Uniform(sink, at, end, mean, weighed)
        if self.full:
            self.rise = ng.GridFunction(self.space)
            space = ng.H1(mesh, definedon="beam", dirichlet="end|middle", **self.orders)
            u, v = space.TnT()
            rho = self.uniform.rho
            sigma = MICRO / (rho[0] + rho[1] * self.rise)
            self.phi = ng.GridFunction(space)
            self.phi.Set(mesh.BoundaryCF({"end": sink.voltage, "middle": sink.voltage / 2}), ng.BND)
            self.conductor = ng.BilinearForm(sigma * grad(u) * grad(v) * dx("beam"), symmetric=True)
            heat = sigma * grad(self.phi) * grad(self.phi)
            self.joule = ng.LinearForm(heat * self.space.TestFunction() * dx("beam"))
            self.power = heat * dx("beam")

    def load(self, rise: np.ndarray) -> np.ndarray:
        """The Joule load (W) at a rise, of the potential there where that is solved for."""
        if not self.full:
            return self.uniform.load(rise)
        self.rise.vec.FV().NumPy()[:] = rise
        self.conductor.Assemble()
        residual = self.phi.vec.CreateVector()
        residual.data = -self.conductor.mat * self.phi.vec
        inverse = self.conductor.mat.Inverse(self.phi.space.FreeDofs(), inverse="sparsecholesky")
        self.phi.vec.data += inverse * residual
        return np.asarray(self.joule.Assemble().vec.FV().NumPy())

    def quantities(self, rise: np.ndarray) -> list[float]:
        """The rises (K) of peak, end and mean, and the current (A)."""
        *rises, current = self.uniform.quantities(rise)
        if self.full:
            self.load(rise)
            current = float(COPIES * ng.Integrate(self.power, self.mesh) / self.voltage)
        return [*rises, current]


def mesh_of(grid: Grid) -> ng.Mesh:
    """The bricks of a quarter of a sink, in micrometres: boxes are its materials; "substrate" is the oxide's underside,
    "end" the beam's (inside the solid), "middle" the plane that cuts the beam in half. The grid's degrees are for
    orders that vary."""
    mesh = netgen.Mesh(dim=3)
    places, local, owner = reference.corners(grid, CORNERS)
    at = places.T / MICRO
    points = [mesh.Add(netgen.MeshPoint(netgen.Pnt(*map(float, point)))) for point in at]
    for number, box in enumerate(grid.boxes):
        mesh.SetMaterial(number + 1, box.name)
    faces: dict[tuple[int, ...], tuple[np.ndarray, list[str]]] = {}
    for cell, number in zip(local, owner, strict=True):
        mesh.Add(netgen.Element3D(int(number) + 1, [points[i] for i in cell]))
        for face in cell[FACES]:
            faces.setdefault(tuple(sorted(face)), (face, []))[1].append(grid.boxes[number].name)
    for number, name in enumerate(NAMES):
        mesh.Add(netgen.FaceDescriptor(surfnr=number + 1, domin=1, domout=0, bc=number + 1))
        mesh.SetBCName(number, name)
    low, high = at.min(axis=0), at.max(axis=0)
    for face, names in faces.values():
        _, y, z = at[face].mean(axis=0)
        if len(names) == 1:
            known = "substrate" if abs(z - low[2]) < 1e-9 else "middle" if abs(y - high[1]) < 1e-9 else "rest"
        elif "beam" in names and names[0] != names[1] and abs(y) < 1e-9:
            known = "end"
        else:
            continue
        mesh.Add(netgen.Element2D(NAMES.index(known) + 1, [points[i] for i in face]))
    made = ng.Mesh(mesh)
    for element, cell in zip(made.Elements(), np.argwhere(grid.solid), strict=True):
        made.SetElementOrders(ng.ElementId(element), tuple(int(d[i]) for d, i in zip(grid.degrees, cell, strict=True)))
    return made


def rows() -> Iterator[Row]:
    """This project's sink against NGSolve's at 1 V in the steady state, each with its estimated error: the electric
    problem in full, on bricks that are graded as this project's are, at two orders."""
    ours = solve(Sink(accuracy=ACCURACY), transient=False).steady
    lower, higher = (by_ngsolve(Sink(), order) for order in ORDERS)
    note = f"NGSolve {ng.__version__}, orders {ORDERS[0]} and {ORDERS[1]}"
    for key, _, unit, name in OF_A_SINK.values():
        value, theirs = higher[key], abs(higher[key] - lower[key])
        yield Row("second code", "the sink at 1 V, steady", name, unit, value, ours[key].value,
                  ours[key].error + theirs, 2 * ACCURACY * abs(value), note)  # fmt: skip


def by_ngsolve(sink: Sink, order: int) -> dict[str, float]:
    """The steady quantities of a whole sink with electrodes at the beam's ends and no air, in NGSolve at an order."""
    scene = symmetry.reduce(sink.scene()).scene
    first = grading.first_grid(scene, GRADING, grading.features(scene))
    grid = first.with_axes(first.breaks, [np.full(len(d), order) for d in first.degrees])
    problem = Problem(sink, mesh_of(grid), grid, order, order, "full", steady=True)
    peak, end, mean, current = problem.quantities(settle(problem, SETTLED))
    # All heat leaves through the substrate, and the equations say so for any space that has the constants.
    power = current * sink.voltage
    values = (peak, end, mean, current, power, power, 2 * end / power)
    return dict(zip((entry.steady for entry in OF_A_SINK.values()), values, strict=True))
