"""Fields of the whole structure for pictures and files.

A file for other programs holds quadratic cells at most. So a brick of degree p is cut along each axis into ceil(p/2)
quadratic pieces, which have at least p + 1 nodes along it; cells of mesh files and tetrahedra are kept whole. A field
is interpolated at the nodes of second order, and the distance of this interpolant from the solution is measured between
the nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from skfem import ElementHex2, ElementTetP2

from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Response
from fem3d.solution.steady import SteadyState
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.element import cube_rule
from fem3d.spaces.integrals import Space
from meshes.symmetry import Symmetry
from scenes.model import ROUNDING


@dataclass(frozen=True)
class Snapshot:
    """The fields of one state.

    Attributes
    ----------
    temperature : (points,) array in K
    potential : (points,) array in V, not a number where no current flows
    current_density : (cells, 3) array in A/m2, means over the cells
    heat_source : (cells,) array in W/m3, means over the cells
    distance : largest distance (K) of the quadratic cells from the finite-element temperature
    """

    temperature: np.ndarray
    potential: np.ndarray
    current_density: np.ndarray
    heat_source: np.ndarray
    distance: float


class Fields:
    """Temperatures of a run on the nodes of second order of its cells, mirrored to the whole structure.

    Attributes
    ----------
    cell_type : meshio's name of the cells
    points : (n, 3) array in m
    cells : (m, 27) or (m, 10) array, the points of the quadratic cells, in VTK's order
    material : (m,) array, the material of each cell
    material_names : names of the materials, by their numbers
    """

    def __init__(
        self, heat: HeatProblem, symmetry: Symmetry, state: SteadyState | None, transient: Response | None
    ) -> None:
        self._heat, self._state, self._transient = heat, state, transient
        conductors = (each.conductor for each in (state, transient) if each is not None)
        self._conductor = next((conductor for conductor in conductors if conductor is not None), None)
        self._domain, self._space, self._planes = heat.domain, heat.domain.space, symmetry.planes
        simplex = len(self._space.mesh.t) == 4
        self.cell_type, self._element = ("tetra10", ElementTetP2()) if simplex else ("hexahedron27", ElementHex2())
        self._places = np.asarray(self._element.doflocs)
        self.material_names = list(dict.fromkeys(m.name for m in self._domain.materials))
        self._levels = [  # the potentials of the mirror planes
            next((b.value for b in symmetry.scene.boundaries if b.name == f"symmetry-{'xyz'[axis]}"), 0.0)
            for axis, _, _ in self._planes
        ]

    @cached_property
    def _cut(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Cells (n,) that are cut alike, with the lower corners (pieces, 3) and the sides (3,) of their pieces."""
        if not isinstance(self._space, BrickSpace):
            return [(np.arange(self._space.mesh.t.shape[1]), np.zeros((1, 3)), np.ones(3))]
        each = zip(self._space.grid.degrees, self._space.ijk, strict=True)
        kinds, kind = np.unique([((p + 1) // 2)[i] for p, i in each], axis=1, return_inverse=True)
        return [
            (np.flatnonzero(kind.ravel() == k), np.array(list(np.ndindex(*n))) / n, 1 / n)
            for k, n in enumerate(kinds.T)
        ]

    @cached_property
    def _cell(self) -> np.ndarray:
        """(pieces,): the cell of each piece of the part that is solved."""
        return np.concatenate([np.repeat(cells, len(low)) for cells, low, _ in self._cut])

    def _at(self, space: Space, functions: np.ndarray, places: np.ndarray | None = None) -> np.ndarray:
        """(..., pieces, places): functions (..., functions) at reference places (places, 3), by default the nodes."""
        values, places = list[np.ndarray](), self._places if places is None else places
        for cells, low, sides in self._cut:
            table = space.at((low[:, None] + sides * places).reshape(-1, 3).T)
            each = functions[..., space.dofs[:, cells].T] @ table.T
            values.append(each.reshape(*functions.shape[:-1], -1, len(places)))
        return np.concatenate(values, axis=-2)

    @cached_property
    def _numbered(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Places (points, 3) in m, the node (points,) that each is, and the point (images, pieces, nodes) of each."""
        mapping, random = self._space.mesh.mapping(), np.random.default_rng(0)
        at = np.concatenate([
            mapping.F((low[:, None] + sides * self._places).reshape(-1, 3).T, tind=cells)
            .reshape(3, -1, len(self._places)) for cells, low, sides in self._cut
        ], axis=1)[:, None]  # fmt: skip
        for axis, middle, _ in self._planes:
            image = at.copy()
            image[axis] = 2 * middle - image[axis]
            at = np.concatenate([at, image], axis=1)
        # Nodes nearer than `ROUNDING` are one point unless a field jumps there: then a random function has two values.
        spaces = self._space, self._domain.electric.space
        values = [np.broadcast_to(self._at(s, random.normal(size=s.size)), at.shape[1:]) for s in spaces]
        size = ROUNDING * float(np.ptp(at, axis=(1, 2, 3)).max())
        # Round coordinates are not at the border of two intervals of this length.
        whole = np.floor(np.array([*(at / size), *(np.array(values) / ROUNDING)]) + 0.1234).astype(np.int64)
        key = np.tensordot(random.integers(1, 2**62, size=5) * 2 + 1, whole, 1)
        first, number = np.unique(key, return_index=True, return_inverse=True)[1:]
        return at.reshape(3, -1)[:, first].T, first, number.reshape(key.shape)

    @cached_property
    def orders(self) -> tuple[np.ndarray, np.ndarray]:
        """The order of the nodes of a cell in VTK, and the nodes of its mirror image."""
        places, mirrored, simplex = self._places, self._places.copy(), len(self._places) == 10
        mirrored[:, 0] = 1 - (places.sum(axis=1) if simplex else places[:, 0])
        return np.arange(10) if simplex else _hexahedron(places), _nodes(places, mirrored)

    @cached_property
    def cells(self) -> np.ndarray:
        """The points of the cells, in an order that turns none inside out."""
        number = self._numbered[2]
        middle = self._space.mesh.refdom.p.mean(axis=1, keepdims=True)
        inverted = self._space.mesh.mapping().detDF(middle)[self._cell, 0] < 0
        odd = np.array([image.bit_count() % 2 == 1 for image in range(len(number))])
        flipped = (odd[:, None] != inverted)[..., None]
        order, mirrored = self.orders
        turned = np.where(flipped, number[..., mirrored], number)
        return turned.reshape(-1, len(self._places))[:, order]

    @property
    def points(self) -> np.ndarray:
        return self._numbered[0]

    @property
    def material(self) -> np.ndarray:
        number = np.array([self.material_names.index(m.name) for m in self._domain.materials])
        return np.tile(number[self._domain.body[self._cell]], 2 ** len(self._planes))

    @property
    def has_steady(self) -> bool:
        """Whether the run has a steady state."""
        return self._state is not None

    @property
    def steady(self) -> np.ndarray:
        """(n,): temperatures (K) at the points; ValueError where the run has no steady state."""
        if self._state is None:
            raise ValueError("the run has no steady state")
        return self._kelvins(self._state.rise)

    def at(self, times: np.ndarray) -> np.ndarray:
        """(times, n): temperatures (K) at the points; ValueError where the run has no transient."""
        if self._transient is None:
            raise ValueError("the run has no transient")
        return self._kelvins(self._transient.rises(np.asarray(times, dtype=float)))

    def _kelvins(self, rises: np.ndarray) -> np.ndarray:
        nodal = self._at(self._space, self._heat.field(rises))
        nodal = nodal.reshape(*rises.shape[:-1], -1)[..., self._numbered[1] % self._numbered[2][0].size]
        return np.asarray(self._domain.scene.initial_temperature + nodal)

    def snapshot(self, time: float | None) -> Snapshot:
        """Return the fields at a time (s), or in the steady state; the potential is solved for at its temperature."""
        heat, inputs = self._heat, self._heat.inputs.at(time or 0.0)
        if time is None:
            assert self._state is not None
            rise = self._state.rise
        else:
            assert self._transient is not None
            rise = self._transient.rises(np.array([time]))[0]
        number = self._numbered[1:]
        potential, density = np.full(len(self.points), np.nan), None
        if self._conductor is not None:
            solved = self._conductor.solve(rise, inputs @ self._conductor.voltages)
            density, values = solved.density, self._at(self._domain.electric.space, solved.potential)[None]
            for (_, _, parity), level in zip(self._planes, self._levels, strict=True):
                image = values if parity == "even" else 2 * float(heat.inputs.split(level) @ inputs) - values
                values = np.concatenate([values, image])
            live = np.unique(number[1][:, self._domain.live[self._cell]])
            potential[live] = values.ravel()[number[0][live]]
        *along, heating = self._means(rise, density)
        currents = np.column_stack(along)
        for value, cells in self._domain.sources:
            heating[np.isin(self._cell, cells)] += float(heat.inputs.split(value) @ inputs)
        for axis, _, parity in self._planes:
            # A mirror turns the component along its axis where the potential is even, the others where it is odd.
            turned = np.where((np.arange(3) == axis) == (parity == "even"), -currents, currents)
            currents, heating = np.concatenate([currents, turned]), np.concatenate([heating, heating])
        return Snapshot(self._kelvins(rise), potential, currents, heating, self._distance(heat.field(rise)))

    def _means(self, rise: np.ndarray, density: np.ndarray | None) -> np.ndarray:
        """(4, pieces): current density and Joule heat of a current ``density`` at a rise, means over whole cells."""
        conductor, means = self._conductor, np.zeros((4, len(self._domain.body)))
        if conductor is not None and density is not None:
            rows = slice(len(conductor.cells))
            fields = [*(density[:, rows] / conductor.on.roots), conductor.heating(density, density, rise)[rows]]
            weights = conductor.on.weights[rows]
            means[:, conductor.cells] = (weights * np.array(fields)).sum(axis=-1) / weights.sum(axis=-1)
        return means[:, self._cell]

    def _distance(self, field: np.ndarray) -> float:
        """The distance (K) of the quadratic cells from a rise (functions,)."""
        simplex = self.cell_type == "tetra10"
        at = self._space.rule(np.zeros(1, int), 0).points.T if simplex else cube_rule(3, 3, 3)[0]
        shape = np.array([self._element.lbasis(at.T, i)[0] * np.ones(len(at)) for i in range(len(self._places))])
        off = np.abs(self._at(self._space, field) @ shape - self._at(self._space, field, at)).max()
        # The remainder s (s^2 - 1) of a parabola through -1, 0 and 1 over its value at Gauss's three points, at most.
        return float(off) * 2 / (3 * np.sqrt(3)) / (np.sqrt(0.6) * 0.4)


def _hexahedron(places: np.ndarray) -> np.ndarray:
    """The order (27,) in VTK of the nodes of the reference hexahedron."""
    from skfem.io.meshio import HEX_MAPPING  # takes meshio along

    return _nodes(places, 1 - places[HEX_MAPPING])  # scikit-fem's reference corner is VTK's opposite one


def _nodes(places: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The nodes (n,) whose places (n, 3) some points (n, 3) have."""
    return np.abs(at[:, None] - places).sum(axis=2).argmin(axis=1)
