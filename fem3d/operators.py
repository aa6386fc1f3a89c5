"""The discrete heat problem on a mesh: M d(rise)/dt + K rise = source, with the fixed nodes kept for their reactions.

The unknown is the rise above the scene's initial temperature. Nodes are numbered with the free ones first and the
fixed ones (a given temperature) last, so that the reactions, the heat that enters at the fixed nodes, are the last rows
of the same equations.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from fem3d import tensor
from fem3d.ordering import nested_dissection
from meshes.bricks import Block, BrickMesh
from scenes.model import Probe, Scene

BALANCED = 2e-11  # of the heat: an imbalance above it is worth a residual in extended precision


def factorize(matrix: csc_array) -> Any:
    """Sparse LU of a symmetric positive definite matrix whose rows are in elimination order already; no pivoting."""
    return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


@dataclass(frozen=True, eq=False)
class HeatProblem:
    """Matrices of one mesh. ``number`` maps grid nodes to unknowns (-1: void), ``free`` is the count of free ones."""

    scene: Scene
    mesh: BrickMesh
    number: np.ndarray
    free: int
    stiffness: csc_array
    mass: csc_array
    constant_source: np.ndarray
    order: np.ndarray  # grid nodes in elimination order
    films: dict[str, tuple[float, np.ndarray]]  # per cooled boundary: heat that enters at no rise (W), and per kelvin

    @property
    def size(self) -> int:
        """Free and fixed nodes together."""
        return int(self.stiffness.shape[0])

    @cached_property
    def inner_stiffness(self) -> csc_array:
        """The stiffness matrix of the free nodes."""
        return self.stiffness[: self.free, : self.free]

    @cached_property
    def _solve(self) -> Any:
        return factorize(self.inner_stiffness).solve

    def solve_steady(self, load: np.ndarray) -> np.ndarray:
        """The rise at the free nodes with K rise = load, from one factorization."""
        found: np.ndarray = self._solve(load)
        return found

    def improve(self, rise: np.ndarray, load: np.ndarray) -> np.ndarray:
        """Iterative refinement: brings the residual, and so the heat balance, to rounding.

        Steps with the residual in extended precision follow where needles of cells have left an imbalance.
        """
        k = self.inner_stiffness
        rise = rise + self.solve_steady(load - k @ rise)
        for _ in range(3):
            left = abs(float(np.sum(load) - self._outflow @ rise))
            if left <= BALANCED * float(np.abs(load).sum()):
                break
            # The matrix is symmetric: its columns serve as rows.
            products = k.data.astype(np.longdouble) * rise[k.indices]
            residual = load - np.add.reduceat(products, k.indptr[:-1])
            rise = rise + self.solve_steady(residual.astype(float))
        return rise

    @cached_property
    def _outflow(self) -> np.ndarray:
        """(free nodes,): heat that leaves at the fixed nodes and to the air, per rise."""
        fixed = np.zeros(self.size)
        fixed[self.free :] = 1.0
        leaving = -(self.stiffness @ fixed)[: self.free]
        for _, per_kelvin in self.films.values():
            leaving -= per_kelvin[: self.free]
        return leaving

    def solve_shifted(self, shift: float) -> Any:
        """Solves (M + shift K) u = b on the free nodes."""
        return factorize(_combined(self.inner_mass, shift, self.inner_stiffness)).solve

    @cached_property
    def inner_mass(self) -> csc_array:
        """The mass matrix of the free nodes."""
        return self.mass[: self.free, : self.free]

    def norm(self, u: np.ndarray) -> float:
        """Root of the integral of rho c u^2 of a field at the free nodes."""
        return float(np.sqrt(u @ (self.inner_mass @ u)))

    def on_block(self, block: Block, u: np.ndarray) -> np.ndarray:
        """The nodal values of a vector (free or all nodes) on a block, zero at fixed nodes of a free vector."""
        whole = np.zeros(self.size)
        whole[: len(u)] = u
        return whole[self.number[self.mesh.numbers(block)]]

    def scatter(self, block: Block, nodal: np.ndarray, into: np.ndarray) -> None:
        """Add a block's nodal values to a vector of all nodes."""
        into[self.number[self.mesh.numbers(block)].ravel()] += nodal.ravel()

    @cached_property
    def fixed_sets(self) -> dict[str, np.ndarray]:
        """For each boundary of given temperature, its unknowns (their reactions are its heat flow)."""
        return {
            b.name: self.number[condition_nodes(self.mesh, b.lower, b.upper)]
            for b in self.scene.boundaries
            if b.kind == "temperature"
        }

    def reaction(self, rise: np.ndarray, rate: np.ndarray, source: np.ndarray) -> np.ndarray:
        """(fixed nodes,): heat that enters at each fixed node (W), from the rise and its rate at the free nodes."""
        n, none = self.free, np.zeros(self.size - self.free)
        flow = self.stiffness @ np.concatenate([rise, none]) + self.mass @ np.concatenate([rate, none])
        found: np.ndarray = flow[n:] - source[n:]
        return found

    @cached_property
    def fixed_rows(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """For each boundary of given temperature the rows (free nodes,) of its heat flow per rise and per rate."""
        found = {}
        for name, nodes in self.fixed_sets.items():
            chosen = np.zeros(self.size)
            chosen[nodes] = 1.0
            found[name] = (self.stiffness @ chosen)[: self.free], (self.mass @ chosen)[: self.free]
        return found

    def sample(self, rise: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(x, y, z): the rise (K) on a grid of coordinates inside the solved part, from values at the free nodes."""
        grid = np.append(rise, np.zeros(self.size - len(rise) + 1))[self.number].reshape(self.mesh.shape)
        a, b, c = (axis.interpolation(at) for axis, at in zip(self.mesh.axes, (x, y, z), strict=True))
        return tensor.along(a, b, c, grid)

    @cached_property
    def probes(self) -> dict[str, np.ndarray]:
        """For each probe the weights (free nodes,) whose product with the rise is its mean rise."""
        return {p.name: self.probe(p) for p in self.scene.probes}

    def probe(self, probe: Probe) -> np.ndarray:
        """(free nodes,): the weights whose product with the rise is the probe's mean rise."""
        nodes, weights = [], []
        for axis, low, high in zip(self.mesh.axes, probe.lower, probe.upper, strict=True):
            if low == high:
                row = axis.interpolation(np.array([low]))[0]
                found = np.flatnonzero(row)
                weight = row[found]
            else:
                part = axis.part(*axis.span(low, high))
                found = np.arange(part.node_slice.start, part.node_slice.stop)
                weight = part.integral / (high - low)
            nodes.append(found)
            weights.append(weight)
        x, y, z = nodes
        grid = (x[:, None, None] * self.mesh.shape[1] + y[:, None]) * self.mesh.shape[2] + z
        weight = weights[0][:, None, None] * weights[1][:, None] * weights[2]
        keep = weight != 0
        functional = np.zeros(self.size)
        np.add.at(functional, self.number[grid[keep]], weight[keep])
        return functional[: self.free]


def _conserve(stiffness: csc_array, to_the_air: np.ndarray) -> None:
    """Set the diagonal such that a uniform rise drives no heat but to the air (W/K per node), to the last digit.

    Sums of large entries leave rounding there, which on thin layers would show in the heat balance.
    """
    columns = np.repeat(np.arange(stiffness.shape[1]), np.diff(stiffness.indptr))
    on = stiffness.indices == columns
    sums = np.add.reduceat(stiffness.data.astype(np.longdouble), stiffness.indptr[:-1])
    stiffness.data[on] = (stiffness.data[on] - (sums - to_the_air)).astype(float)


def _combined(a: csc_array, factor: float, b: csc_array) -> csc_array:
    """a + factor * b of two matrices on one pattern."""
    return csc_array((a.data + factor * b.data, a.indices, a.indptr), shape=a.shape)


def condition_nodes(mesh: BrickMesh, lower: Any, upper: Any, boxes: set[int] | None = None) -> np.ndarray:
    """Grid numbers of the nodes of a flat box where it touches the solid (or some boxes of it)."""
    found = [mesh.numbers(face).ravel() for face in mesh.faces(lower, upper, boxes)]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=int)


def assemble(scene: Scene, mesh: BrickMesh, balanced: bool = True) -> HeatProblem:
    """The heat problem of a scene (or of its symmetric part) on a mesh.

    ``balanced`` takes the trouble to conserve heat to the last digit, where the heat balance will be reported.
    """
    solid = mesh.solid
    fixed = np.zeros(solid.size, dtype=bool)
    for b in scene.boundaries:
        if b.kind == "temperature":
            fixed[condition_nodes(mesh, b.lower, b.upper)] = True
    number = np.full(solid.size, -1, dtype=np.int32)
    order = np.argsort(nested_dissection(mesh))
    free_nodes, fixed_nodes = order[(solid & ~fixed)[order]], order[(solid & fixed)[order]]
    number[free_nodes] = np.arange(len(free_nodes))
    number[fixed_nodes] = len(free_nodes) + np.arange(len(fixed_nodes))
    size = len(free_nodes) + len(fixed_nodes)

    rows, columns, entries = [], [], []
    source = np.zeros(size)
    films: dict[str, tuple[float, np.ndarray]] = {}

    def add(block: Block, data: np.ndarray) -> None:
        r, c = tensor.pattern(mesh.parts(block), number[mesh.numbers(block)])
        rows.append(r)
        columns.append(c)
        entries.append(data)

    for block in mesh.blocks:
        parts, box = mesh.parts(block), mesh.boxes[block.box]
        k, c = box.material.thermal_conductivity, box.material.heat_capacity
        # Both matrices share one pattern, so both travel through one conversion as a complex number.
        add(block, k * tensor.stiffness(parts) + 1j * c * tensor.mass(parts))
        if box.heat_source:
            source[number[mesh.numbers(block)].ravel()] += box.heat_source * tensor.integral(parts).ravel()
    for b in scene.boundaries:
        if b.kind not in ("convection", "heat_flux"):
            continue
        area = np.zeros(size)
        for face in mesh.faces(b.lower, b.upper):
            parts = mesh.parts(face)
            area[number[mesh.numbers(face)].ravel()] += tensor.integral(parts).ravel()
            if b.kind == "convection":
                add(face, b.value * tensor.mass(parts) + 0j)
        flux = b.value if b.kind == "heat_flux" else b.value * (b.ambient - scene.initial_temperature)
        source += flux * area
        films[b.name] = (flux * float(area.sum()), -b.value * area if b.kind == "convection" else np.zeros(size))
    joined = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    both = coo_array(joined, shape=(size, size)).tocsc()
    stiffness = csc_array((both.data.real.copy(), both.indices, both.indptr), shape=both.shape)
    if balanced:
        _conserve(stiffness, -sum((per_kelvin for _, per_kelvin in films.values()), np.zeros(size)))
    mass = csc_array((both.data.imag.copy(), both.indices, both.indptr), shape=both.shape)
    return HeatProblem(scene, mesh, number, len(free_nodes), stiffness, mass, source, order, films)
