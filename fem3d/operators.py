"""The discrete heat problem on a mesh: M d(rise)/dt + K rise = source, with the fixed nodes kept for their reactions.

The unknown is the rise above the scene's initial temperature. Nodes are numbered with the free ones first and the
fixed ones (a given temperature) last, so that the reactions, the heat that enters at the fixed nodes, are the last rows
of the same equations. A field that vanishes at the fixed nodes is a vector of the free ones, any other one of all.
Sources and given rises come as channels (`fem3d.inputs`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu

from fem3d import inputs, tensor
from fem3d.inputs import Inputs
from fem3d.ordering import nested_dissection
from meshes import connected
from meshes.bricks import Block, BrickMesh
from scenes.model import Boundary, Scene, Schedule, Value

BALANCED = 2e-11  # of the heat: an imbalance above it is worth a residual in extended precision


def factorize(matrix: csc_array) -> Any:
    """Sparse LU of a symmetric positive definite matrix whose rows are in elimination order already; no pivoting."""
    return splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, options={"SymmetricMode": True})


@dataclass(frozen=True, eq=False)
class Film:
    """A boundary of given flux or convection: the heat that enters at no rise (W, per channel), and per kelvin (W/K,
    all nodes)."""

    entering: np.ndarray
    per_kelvin: np.ndarray


@dataclass(frozen=True, eq=False)
class HeatProblem:
    """Matrices of one mesh. ``number`` maps grid nodes to unknowns (-1: void), ``free`` is the count of free ones.

    Per channel: ``loads`` (channels, all nodes), ``given`` (channels, fixed nodes), the given rises, and ``generated``,
    the heat of the sources in W.
    """

    scene: Scene
    mesh: BrickMesh
    inputs: Inputs
    number: np.ndarray
    free: int
    stiffness: csc_array
    mass: csc_array
    loads: np.ndarray
    given: np.ndarray
    order: np.ndarray  # grid nodes in elimination order
    films: dict[str, Film]
    generated: np.ndarray
    anchored: bool  # whether every part has an exit for heat: the stiffness matrix is regular

    @property
    def size(self) -> int:
        """Free and fixed nodes together."""
        return int(self.stiffness.shape[0])

    @cached_property
    def memo(self) -> dict[str, Any]:
        """What probes have been worked out to, by name."""
        return {}

    @cached_property
    def inner_stiffness(self) -> csc_array:
        """The stiffness matrix of the free nodes."""
        return self.stiffness[: self.free, : self.free]

    @cached_property
    def _solve(self) -> Any:
        if self.anchored:
            return factorize(self.inner_stiffness).solve
        # A part without an exit keeps its heat: its capacity over the whole run stands in for one.
        return factorize(_combined(self.inner_stiffness, 1.0 / self.scene.end_time, self.inner_mass)).solve

    def solve_steady(self, load: np.ndarray) -> np.ndarray:
        """The rise at the free nodes with K rise = load, from one factorization; without an exit for heat, the mean
        over the run's time with the capacity in its place."""
        found: np.ndarray = self._solve(load)
        return found

    @cached_property
    def lifts(self) -> np.ndarray:
        """(channels, all nodes): for each channel the rise that its given temperatures alone keep up."""
        n = self.free
        found = np.zeros((self.inputs.count, self.size))
        found[:, n:] = self.given
        for lift in found:
            if lift.any():
                lift[:n] = self.solve_steady(-(self.stiffness @ lift)[:n])
                if self.anchored:
                    lift[:] = self.improve(lift, np.zeros(self.size))
        return found

    def improve(self, rise: np.ndarray, source: np.ndarray) -> np.ndarray:
        """(all nodes,): a rise (all nodes) after iterative refinement for a source (W, all nodes), which brings the
        residual, and so the heat balance, to rounding.

        Steps with the residual in extended precision follow where needles of cells have left an imbalance.
        """
        k, n = self.inner_stiffness, self.free
        held = self.stiffness @ np.concatenate([np.zeros(n), rise[n:]])
        load = source[:n] - held[:n]
        inner = rise[:n] + self.solve_steady(load - k @ rise[:n])
        for _ in range(3):
            left = abs(float(np.sum(load) - self._outflow @ inner))
            if left <= BALANCED * float(np.abs(load).sum()):
                break
            # The matrix is symmetric: its columns serve as rows.
            products = k.data.astype(np.longdouble) * inner[k.indices]
            residual = load - np.add.reduceat(products, k.indptr[:-1])
            inner = inner + self.solve_steady(residual.astype(float))
        return np.concatenate([inner, rise[n:]])

    @cached_property
    def _outflow(self) -> np.ndarray:
        """(free nodes,): heat that leaves at the fixed nodes and to the air, per rise."""
        fixed = np.zeros(self.size)
        fixed[self.free :] = 1.0
        leaving = -(self.stiffness @ fixed)[: self.free]
        for film in self.films.values():
            leaving -= film.per_kelvin[: self.free]
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

    def whole(self, field: np.ndarray) -> np.ndarray:
        """(..., all nodes): fields at the free nodes with zeros at the fixed ones."""
        width = self.size - field.shape[-1]
        return np.concatenate([field, np.zeros((*field.shape[:-1], width))], axis=-1) if width else field

    def on_block(self, block: Block, u: np.ndarray) -> np.ndarray:
        """The nodal values of a field (free or all nodes) on a block."""
        return self.whole(u)[self.number[self.mesh.numbers(block)]]

    def scatter(self, block: Block, nodal: np.ndarray, into: np.ndarray) -> None:
        """Add a block's nodal values to a vector of all nodes."""
        into[self.number[self.mesh.numbers(block)].ravel()] += nodal.ravel()

    @cached_property
    def fixed_sets(self) -> dict[str, np.ndarray]:
        """For each boundary of given temperature, its unknowns (their reactions are its heat flow)."""
        taken = np.zeros(self.size, dtype=bool)
        found = {}
        # Where two boundaries meet the later one gives the temperature, and takes the reaction.
        for b in reversed(self.scene.boundaries):
            if b.kind == "temperature":
                nodes = self.number[condition_nodes(self.mesh, b.lower, b.upper)]
                found[b.name] = nodes[~taken[nodes]]
                taken[nodes] = True
        return found

    def reaction(self, rise: np.ndarray, rate: np.ndarray, source: np.ndarray) -> np.ndarray:
        """(fixed nodes,): heat that enters at each fixed node (W), from rise, its rate and the source."""
        flow = self.stiffness @ self.whole(rise) + self.mass @ self.whole(rate)
        found: np.ndarray = flow[self.free :] - source[self.free :]
        return found

    @cached_property
    def fixed_rows(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """For each boundary of given temperature the rows (all nodes,) of its heat flow per rise and per rate."""
        found = {}
        for name, nodes in self.fixed_sets.items():
            chosen = np.zeros(self.size)
            chosen[nodes] = 1.0
            found[name] = self.stiffness @ chosen, self.mass @ chosen
        return found

    def sample(self, rise: np.ndarray, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(x, y, z): the rise (K) on a grid of coordinates inside the solved part, from a field."""
        grid = np.append(self.whole(rise), 0.0)[self.number].reshape(self.mesh.shape)
        a, b, c = (axis.interpolation(at) for axis, at in zip(self.mesh.axes, (x, y, z), strict=True))
        return tensor.along(a, b, c, grid)


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
    solid, channels = mesh.solid, inputs.of(scene)
    fixed = np.zeros(solid.size, dtype=bool)
    given = np.zeros((channels.count, solid.size))
    for b in scene.boundaries:
        if b.kind == "temperature":
            nodes = condition_nodes(mesh, b.lower, b.upper)
            fixed[nodes] = True
            given[:, nodes] = _above(channels, b.value, scene)[:, None]
    number = np.full(solid.size, -1, dtype=np.int32)
    order = np.argsort(nested_dissection(mesh))
    free_nodes, fixed_nodes = order[(solid & ~fixed)[order]], order[(solid & fixed)[order]]
    number[free_nodes] = np.arange(len(free_nodes))
    number[fixed_nodes] = len(free_nodes) + np.arange(len(fixed_nodes))
    size = len(free_nodes) + len(fixed_nodes)

    rows, columns, entries = [], [], []
    loads = np.zeros((channels.count, size))
    generated = np.zeros(channels.count)
    films: dict[str, Film] = {}

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
            source, volume = channels.split(box.heat_source), tensor.integral(parts)
            loads[:, number[mesh.numbers(block)].ravel()] += np.outer(source, volume)
            generated += source * volume.sum()
    for b in scene.boundaries:
        if b.kind not in ("convection", "heat_flux"):
            continue
        area = np.zeros(size)
        coefficient = _coefficient(b) if b.kind == "convection" else 0.0
        for face in mesh.faces(b.lower, b.upper, exposed=True):
            parts = mesh.parts(face)
            area[number[mesh.numbers(face)].ravel()] += tensor.integral(parts).ravel()
            if coefficient:
                add(face, coefficient * tensor.mass(parts) + 0j)
        flux = channels.split(b.value) if b.kind == "heat_flux" else coefficient * _above(channels, b.ambient, scene)
        loads += np.outer(flux, area)
        films[b.name] = Film(flux * float(area.sum()), -coefficient * area)
    joined = (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns)))
    both = coo_array(joined, shape=(size, size)).tocsc()
    stiffness = csc_array((both.data.real.copy(), both.indices, both.indptr), shape=both.shape)
    if balanced:
        _conserve(stiffness, -sum((film.per_kelvin for film in films.values()), np.zeros(size)))
    mass = csc_array((both.data.imag.copy(), both.indices, both.indptr), shape=both.shape)
    return HeatProblem(
        scene, mesh, channels, number, len(free_nodes), stiffness, mass, loads, given[:, fixed_nodes], order, films,
        generated, connected.anchored(scene),
    )  # fmt: skip


def _above(channels: Inputs, temperature: Value, scene: Scene) -> np.ndarray:
    """(channels,): a temperature (K) as a rise."""
    found = channels.split(temperature)
    found[0] -= scene.initial_temperature
    return found


def _coefficient(boundary: Boundary) -> float:
    """A convection coefficient; ValueError for one that varies, which would change the matrices."""
    if isinstance(boundary.value, Schedule):
        raise ValueError(f"the convection coefficient of {boundary.name} varies in time")
    return boundary.value
