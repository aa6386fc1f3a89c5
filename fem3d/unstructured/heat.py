"""The discrete heat problem on a mesh with groups: M d(rise)/dt + K rise = source.

As in `fem3d.operators` the unknown is the rise above the initial temperature, nodes are numbered with the free ones
first, and sources and given rises come as channels; Krylov fields and the reduced problem need no more than this.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.inputs import Inputs
from fem3d.unstructured.factor import dissection, factorize
from fem3d.unstructured.space import FaceSpace, Space
from meshes.grouped.check_parts import touched
from meshes.grouped.place import Placed
from scenes.free.parts import is_exit
from scenes.model import Schedule, Value


@dataclass(frozen=True, eq=False)
class Heat:
    """Matrices (all nodes) in W/K and J/K; per channel ``loads`` (channels, all nodes) in W, ``given`` (channels,
    fixed nodes) in K and ``generated`` in W. ``fixed_sets``: the nodes of boundaries of given temperature; ``films``:
    those of given flux or convection: the heat that enters per channel, and per kelvin at all nodes."""

    placed: Placed
    space: Space
    inputs: Inputs
    free: int
    stiffness: csc_array
    mass: csc_array
    loads: np.ndarray
    given: np.ndarray
    generated: np.ndarray
    fixed_sets: dict[str, np.ndarray]
    films: dict[str, tuple[np.ndarray, np.ndarray]]
    anchored: bool

    @property
    def size(self) -> int:
        """Free and fixed nodes together."""
        return self.space.size

    @cached_property
    def memo(self) -> dict[str, Any]:
        """What probes have been worked out to, by name."""
        return {}

    @cached_property
    def inner_stiffness(self) -> csc_array:
        """The stiffness matrix of the free nodes."""
        return self.stiffness[: self.free, : self.free]

    @cached_property
    def inner_mass(self) -> csc_array:
        """The mass matrix of the free nodes."""
        return self.mass[: self.free, : self.free]

    @cached_property
    def solve_steady(self) -> Any:
        """Solves K u = b on the free nodes; without an exit for heat, with the capacity over the whole run in place of
        one."""
        own = self.inner_stiffness
        return factorize(own if self.anchored else own + self.inner_mass / self.placed.scene.end_time)

    def solve_shifted(self, shift: float) -> Any:
        """Solves (M + shift K) u = b on the free nodes."""
        return factorize(self.inner_mass + shift * self.inner_stiffness)

    @cached_property
    def lifts(self) -> np.ndarray:
        """(channels, all nodes): for each channel the rise that its given temperatures alone keep up."""
        n = self.free
        found = np.zeros((self.inputs.count, self.size))
        found[:, n:] = self.given
        for lift in found:
            if lift.any():
                lift[:n] = self.solve_steady(-(self.stiffness @ lift)[:n])
        return found

    def norm(self, u: np.ndarray) -> float:
        """Root of the integral of rho c u^2 of a field at the free nodes."""
        return float(np.sqrt(u @ (self.inner_mass @ u)))

    def whole(self, field: np.ndarray) -> np.ndarray:
        """(..., all nodes): fields at the free nodes with zeros at the fixed ones."""
        return np.concatenate([field, np.zeros((*field.shape[:-1], self.size - field.shape[-1]))], axis=-1)

    def row(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """(all nodes,) twice: the heat flow through a boundary of given temperature, per rise and per rate."""
        chosen = np.zeros(self.size)
        chosen[self.fixed_sets[name]] = 1.0
        return self.stiffness @ chosen, self.mass @ chosen


def inputs_of(placed: Placed) -> Inputs:
    """The channels of a scene on a mesh."""
    scene = placed.scene
    values = [v for b in scene.boundaries for v in (b.value, b.ambient)] + [s.heat_source for s in scene.sources]
    return Inputs(tuple(dict.fromkeys(v for v in values if isinstance(v, Schedule))))


def assemble(placed: Placed, degree: int) -> Heat:
    """The heat problem with elements of a degree."""
    scene, mesh = placed.scene, placed.mesh
    space, inputs = Space(mesh, degree), inputs_of(placed)
    given, taken = np.zeros((inputs.count, space.size)), np.full(space.size, -1)
    held = [b for b in scene.boundaries if b.kind == "temperature"]
    # Where two boundaries meet the later one gives the temperature, and takes the reaction.
    for number, b in enumerate(held):
        nodes = FaceSpace(space, placed.faces(b)).nodes()
        given[:, nodes], taken[nodes] = _above(inputs, b.value, scene.initial_temperature)[:, None], number
    stiffness = space.stiffness(placed.per_cell("thermal_conductivity")[:, None])
    order = dissection(space.nodes, stiffness)
    order = np.concatenate([order[taken[order] < 0], order[taken[order] >= 0]])
    space.renumber(order)
    given, taken, stiffness = given[:, order], taken[order], stiffness[order][:, order]
    free = int((taken < 0).sum())
    capacity = placed.per_cell("density") * placed.per_cell("specific_heat")
    loads, generated = np.zeros((inputs.count, space.size)), np.zeros(inputs.count)
    for s in scene.sources:
        channels, load = inputs.split(s.heat_source), space.load(np.ones(1), mesh.volumes[s.group])
        loads += np.outer(channels, load)
        generated += channels * load.sum()
    films = {}
    for b in scene.boundaries:
        if b.kind not in ("heat_flux", "convection"):
            continue
        face = FaceSpace(space, placed.faces(b))
        area, coefficient = face.load(), 0.0
        if b.kind == "convection":
            coefficient = _constant(b.value)
            stiffness = stiffness + coefficient * face.mass()
            flux = coefficient * _above(inputs, b.ambient, scene.initial_temperature)
        else:
            flux = inputs.split(b.value)
        loads += np.outer(flux, area)
        films[b.name] = flux * float(area.sum()), -coefficient * area
    parts = mesh.parts(np.ones(len(mesh.cells), bool))
    anchored = len(touched(placed, parts, [b for b in scene.boundaries if is_exit(b)])) == parts.max()
    return Heat(
        placed, space, inputs, free, csc_array(stiffness), space.mass(capacity[:, None]), loads, given[:, free:],
        generated, {b.name: np.flatnonzero(taken == number) for number, b in enumerate(held)}, films, anchored,
    )  # fmt: skip


def _above(inputs: Inputs, temperature: Value, initial: float) -> np.ndarray:
    """(channels,): a temperature (K) as a rise."""
    found = inputs.split(temperature)
    found[0] -= initial
    return found


def _constant(value: Value) -> float:
    """A convection coefficient, which files cannot make vary."""
    if isinstance(value, Schedule):
        raise ValueError("a convection coefficient may not vary in time")
    return value
