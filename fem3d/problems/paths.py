"""Paths of the current through cells and across contacts, and current fields.

Where the resistivity along y and z is some r times that along x, the gradient along these is divided by sqrt(r) and the
current density multiplied by sqrt(r). Ohm's law is then J = -gradient/rho, its heat rho |J|^2 and the current that
enters the integral of J . gradient, each with rho along x.

Across a contact the potential jumps by the resistance per area times the current density. The contact acts as a cell of
zero volume with unit length across it, with this resistivity: its gradient is the jump, its current density has one
component. Its heat enters the temperature's functions on both sides alike, or on the only side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csc_array

from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import CellIntegrals, FaceIntegrals
from fem3d.spaces.mapped import Interface
from scenes.model import AnyProbe

Conductivity = Callable[[FaceIntegrals], np.ndarray]
"""The conductivity at facets on the side of their cells: (facets, 1 or points), or with axes in front."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """A contact, or an electrode behind one, that the current crosses.

    Attributes
    ----------
    name, resistance : of the contact or the electrode, and ohm m2
    potential : the facets in the functions of the potential
    warmed, cells : the facets in the functions of the temperature on one or both sides, and (sides, facets) the cells
    """

    name: str
    resistance: float
    potential: Interface
    warmed: tuple[FaceIntegrals, ...]
    cells: np.ndarray


def crossings(domain: Domain) -> list[Crossing]:
    """The contacts of a domain that a current crosses, including electrodes."""
    electric, crossings = domain.electric, []
    for joint in domain.contacts:
        alive = joint.facets[domain.live[domain.space.mesh.f2t[:, joint.facets]].all(axis=0)]
        if joint.contact.electrical_resistance and len(alive):
            warmed = Interface.inside(domain.space, alive)
            crossings.append(Crossing(
                joint.contact.name, joint.contact.electrical_resistance, Interface.inside(electric.space, alive),
                (warmed.one, warmed.other), domain.space.mesh.f2t[:, alive],
            ))  # fmt: skip
    for b in domain.scene.boundaries:
        if b.name in electric.space.beyond:
            warmed_by = domain.seen(domain.facets(b), domain.live)
            potential = Interface(electric.faces(b), electric.seen(domain.facets(b), domain.live))
            crossings.append(Crossing(b.name, b.contact_resistance, potential, (warmed_by,), warmed_by.cells[None]))
    return crossings


class Section:
    """The facets of a flat probe that some cells have on both sides, for the flow along the probe's direction: the mean
    of both sides, and at ``contacts``, facets with a resistance, the jump over it.

    Attributes
    ----------
    jumps : (functions,), the flow of each function through the contacts
    """

    def __init__(
        self, domain: Domain, probe: AnyProbe, inside: np.ndarray, contacts: Sequence[tuple[np.ndarray, float]]
    ) -> None:
        region, self.jumps = domain.locate(probe), np.zeros(domain.space.size)
        facets, along = region.numbers, region.signs[:, None]
        cells = domain.space.mesh.f2t[:, facets]
        both = (cells >= 0).all(axis=0) & inside[cells].all(axis=0)
        for torn, resistance in contacts:
            on = np.isin(facets, torn)
            self.jumps += Interface.inside(domain.space, facets[on]).load(along[on] / resistance)
            both &= ~on
        self._sides = [
            (FaceIntegrals(domain.space, facets[both], side), half * along[both])
            for side, half in zip(cells[:, both], (0.5, -0.5), strict=True)
        ]

    def row(self, conductivity: Conductivity) -> np.ndarray:
        """(functions,): the flow of each function."""
        return sum((faces.flux(along * conductivity(faces)) for faces, along in self._sides), self.jumps)


class RowIntegrals:
    """Integrals like `CellIntegrals` over rows: the cells, then the facets of each crossing, with points of no weight
    where there are fewer. `value` and `load` use the temperature's functions, `gradient` and `flow`
    the potential's. ``roots`` (3, cells, 1): the square roots of the resistivity along x, y and z over that along x."""

    def __init__(
        self, warmed: CellIntegrals, electric: CellIntegrals, crossings: Sequence[Crossing], roots: np.ndarray
    ) -> None:
        self.warmed, self._electric, self._crossings = warmed, electric, crossings
        self.roots = roots
        self.weights = self._rows([warmed.weights, *(c.warmed[0].areas for c in crossings)])

    def finer(self, warmed: CellIntegrals, electric: CellIntegrals) -> RowIntegrals:
        """The same with other points in the cells."""
        return RowIntegrals(warmed, electric, self._crossings, self.roots)

    def conductivity(self, resistivity: np.ndarray) -> np.ndarray:
        """(3, cells): along the axes (S/m), for a resistivity (rows, 1) along x."""
        return 1 / (resistivity[: len(self.warmed.weights)] * self.roots**2)[..., 0]

    def _rows(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """(..., rows, points): values on cells and on each crossing, each (..., its rows, its points)."""
        if not self._crossings:
            return parts[0]
        points = max(x.shape[-1] for x in parts)
        padded = [np.pad(x, [(0, 0)] * (x.ndim - 1) + [(0, points - x.shape[-1])]) for x in parts]
        return np.concatenate(padded, axis=-2)

    def _parts(self, rows: np.ndarray) -> list[np.ndarray]:
        """The inverse: of the cells and of each crossing."""
        full, parts, start = np.broadcast_to(rows, (*rows.shape[:-2], *self.weights.shape)), [], 0
        for like in (self.warmed.weights, *(c.warmed[0].areas for c in self._crossings)):
            parts.append(full[..., start : start + like.shape[0], : like.shape[1]])
            start += like.shape[0]
        return parts

    def value(self, u: np.ndarray) -> np.ndarray:
        """(rows, points): a function of the temperature's, between both sides of a contact their mean."""
        at_contacts = [np.mean([face.value(u) for face in c.warmed], axis=0) for c in self._crossings]
        return self._rows([self.warmed.value(u), *at_contacts])

    def load(self, density: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a density (rows, 1 or points) times each of the temperature's."""
        in_cells, *others = self._parts(density)
        load = self.warmed.load(in_cells)
        for crossing, part in zip(self._crossings, others, strict=True):
            for face in crossing.warmed:
                load += face.load(part / len(crossing.warmed))
        return load

    def mass_of(self, density: np.ndarray) -> csc_array:
        """(functions, functions) of the temperature's: the integral of a density (rows, 1 or points) times u v, of
        cells alone: nothing follows the temperature at a contact."""
        return self.warmed.mass_of(self._parts(density)[0])

    def gradient(self, u: np.ndarray) -> np.ndarray:
        """(3, rows, points): the gradient of a function of the potential's, of contacts the jump."""
        jumps = [np.multiply.outer([1.0, 0.0, 0.0], c.potential.jump(u)) for c in self._crossings]
        return self._rows([self._electric.gradient(u) / self.roots, *jumps])

    def flow(self, flux: np.ndarray) -> np.ndarray:
        """(functions,): the integral of a flux (3, rows, points) times the gradient of each of the potential's."""
        in_cells, *others = self._parts(flux)
        flow = self._electric.flow(in_cells / self.roots)
        for crossing, part in zip(self._crossings, others, strict=True):
            flow += crossing.potential.load(part[0])
        return flow


@dataclass(frozen=True, eq=False)
class Terminal:
    """An electrode of unknown potential, with its ``unit`` function (functions,), a function ``at`` which the
    coefficient of the latter is 1, and its ``resistance`` (ohm), infinite for a given current."""

    name: str
    unit: np.ndarray
    at: int
    resistance: float

    @property
    def conductance(self) -> float:
        """The inverse of the resistance (S)."""
        return 1 / self.resistance


@dataclass(frozen=True, eq=False)
class Label:
    """The ``body`` of some rows, a box, a contact or an electrode, and by probe of power the share of their Joule heat
    that it reads: 1/2 where one side of a contact is in the probe. Rows with one label share the object."""

    body: str
    shares: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class CurrentField:
    """A ``potential`` (functions,) in V with its current ``density`` (3, rows, points) in A/m2, the power (channels,)
    that electrodes ``supply`` at their voltages (W), and the ``currents`` (A) that enter at electrodes or pass probes.
    The latter three are linear in the density."""

    potential: np.ndarray
    density: np.ndarray
    supply: np.ndarray
    currents: dict[str, float]

    def plus(self, factor: float, other: CurrentField, scale: float) -> CurrentField:
        """(self + factor * other) * scale."""
        return CurrentField(
            (self.potential + factor * other.potential) * scale,
            (self.density + factor * other.density) * scale,
            (self.supply + factor * other.supply) * scale,
            {name: (i + factor * other.currents[name]) * scale for name, i in self.currents.items()},
        )
