"""The goals of a steady state: each of its outputs (`fem3d.results.outputs`) as what `fem3d.sensitivity.adjoint` has
dual solutions of, with how its rows themselves follow a motion of the mesh and of probes."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from fem3d.problems.conductors import box_of, share
from fem3d.problems.following import OfCells, at_faces, following
from fem3d.results import probes
from fem3d.results.probes import reading
from fem3d.results.voltmeter import Voltmeter
from fem3d.sensitivity.adjoint import Goal, Linearized
from fem3d.sensitivity.motion import Motion
from fem3d.spaces.extreme import Place
from fem3d.spaces.integrals import Faces
from meshes.symmetry import Symmetry
from scenes.errors import SceneError

# Relative change of a key for central differences of rows that are not affine in the coordinates: their error is its
# square.
MOVED = 1e-4


class Goals:
    """The goals of one steady state of a symmetric part."""

    def __init__(self, linearized: Linearized, part: Symmetry) -> None:
        self._linearized, self._state, self._part = linearized, linearized.state, part
        self._domain = self._state.heat.domain
        self._probes = {p.name: p for p in self._domain.scene.probes}
        self._none = linearized.nothing()

    def of(self, output: str) -> Goal:
        """The goal of an output of the whole scene, without what symmetry adds to it; SceneError where there is
        none."""
        part, conductor, none = self._part, self._state.conductor, self._none
        kind, _, name = output.partition(":")
        if kind == "probe":
            return none.plus(part.probes[name][0], self._probe(name))
        if kind == "flow":
            flow = part.flows[name]
            return none.plus(flow.heat, self._flow(flow.boundary))
        if kind == "current" and conductor is not None:
            flow = part.flows[name]
            return none.plus(flow.current, replace(none, charge=conductor.electrodes[flow.boundary]))
        if kind == "joule" and conductor is not None:
            bodies = np.array([box_of(label) == name for label in conductor.names], float)
            return none.plus(part.box_copies[name], replace(none, boxes=bodies[:, None]))
        if output in ("power", "dissipated"):
            return replace(none, boxes=np.full(none.boxes.shape, float(part.copies)))
        raise SceneError(f"there is no derivative of {output}")

    def _flow(self, boundary: str, facets: np.ndarray | None = None) -> Goal:
        """The heat through a boundary, of a film perhaps through some of its ``facets`` (facets of it,)."""
        heat = self._state.heat
        if boundary in heat.held_fields:
            return replace(self._none, heat=heat.field(heat.held_fields[boundary]))
        if facets is None:
            condition = next(b for b in self._domain.scene.boundaries if b.name == boundary)
            facets = np.ones(len(self._domain.on(condition)))
        return replace(self._none, films={boundary: facets})

    def _probe(self, name: str) -> Goal:
        probe = self._probes[name]
        if probe.quantity == "potential":
            return self._potential(probe)
        if probe.quantity == "temperature":
            return self._temperature(probe)
        if probe.quantity == "power":
            conductor = self._state.conductor
            shares = [] if conductor is None else [share(label, name) for label in conductor.names]
            return replace(self._none, boxes=np.array(shares)[:, None])
        return self._current(probe) if probe.quantity == "current" else self._heat(probe)

    def _temperature(self, probe: Any) -> Goal:
        domain, rise = self._domain, self._linearized.rise
        if probe.reduce == "mean":
            row = domain.mean(probe)
            follows = (1.0, lambda by: float(moved_mean(domain, probe, by, rise)))
            return replace(self._none, row=row, explicit=(follows,))
        place = reading(self._state.heat, probe).extreme.where(rise)  # type: ignore[union-attr]
        return replace(
            self._none,
            row=place.row(domain.space),
            explicit=((1.0, lambda by: _moved_place(domain, probe, place, by, rise)),),
        )

    def _potential(self, probe: Any) -> Goal:
        domain, conductor = self._domain.electric, self._state.conductor
        meter, place = Voltmeter(domain, probe), None
        phi = meter.field(None if conductor is None else self._state.hot_potential, 0.0)
        if probe.reduce == "mean":
            row = domain.mean(probe, meter.inside)
        else:
            place = probes.extreme(domain, probe, meter.inside).where(phi)
            row = place.row(domain.space)

        def follows(by: Motion) -> float:
            if place is None:
                moved = float(moved_mean(domain, probe, by, phi, meter.inside))
            else:
                moved = _moved_place(domain, probe, place, by, phi)
            return moved + sum(float(row @ unit) * by.of_voltage(voltage) for unit, voltage in meter.still)

        still = np.zeros(len(row), bool)
        for unit, _ in meter.still:
            still |= unit > 0
        return replace(self._none, charges=np.where(still, 0.0, row), explicit=((1.0, follows),))

    def _heat(self, probe: Any) -> Goal:
        domain, how = self._domain, reading(self._state.heat, probe)
        if how.gradient:
            return self._gradient(probe)
        goal, facets = self._none, domain.facets(probe)
        for boundary in domain.scene.boundaries:
            if boundary.kind != "voltage":
                covered = np.isin(domain.on(boundary), facets)
                if covered.any():
                    goal = goal.plus(1.0, self._flow(boundary.name, covered.astype(float)))
        return goal

    def _gradient(self, probe: Any) -> Goal:
        """The heat that passes a section."""
        domain, rise, key = self._domain, self._linearized.rise, "thermal_conductivity"
        _off_contacts(domain, probe, 0)
        cold, bent = domain.per_cell(key), len(following(domain, key)) > 0

        def follows(by: Motion) -> float:
            shrinks = _shrinks(domain, probe, by)

            def by_law(face: Faces, cells: np.ndarray) -> np.ndarray:
                at = face.value(rise)
                moved = OfCells(domain, key, cells).value(at) * shrinks[cells, None]
                return moved + by.of_law(domain, key, cells, at)

            changed = by_law if bent else probes.cell_by_cell(cold * shrinks + by.conductivity)
            return float(probes.gradient(domain, probe, changed) @ rise)

        if bent:
            row = probes.gradient(domain, probe, partial(at_faces, domain, rise))
            row += probes.drift(domain, probe, rise)
        else:
            row = probes.gradient(domain, probe, probes.cell_by_cell(cold))
        return replace(self._none, row=row, explicit=((1.0, follows),))

    def _current(self, probe: Any) -> Goal:
        conductor, how, none = self._state.conductor, reading(self._state.heat, probe), self._none
        if conductor is None:
            return none
        if how.boundaries:
            charge: np.ndarray = sum((conductor.electrodes[b] for b in how.boundaries), np.zeros(len(none.charge)))
            return replace(none, charge=how.sign * charge)
        domain, rise, phi = self._domain.electric, self._linearized.rise, self._state.hot_potential
        _off_contacts(domain, probe, 1)
        row, charges, sides = np.zeros(len(rise)), np.zeros(len(phi)), []
        section, beside = conductor.sections[probe.name], domain.sides(probe, domain.live)
        by_law = conductor.following is not None
        ratios = np.array([m.resistivity_ratios for m in domain.materials]).T[:, domain.body, None]
        for (faces, warmed, sign, _, warm, resistivity), (_, _, cells) in zip(section, beside, strict=True):
            at = warmed.value(rise)
            rho = resistivity(at)
            times = ratios[:, cells] * domain.stands_for[domain.body[cells], None]
            if by_law:
                warm = times * OfCells(domain, "resistivity", cells).slope(at)
            charges += sign * faces.flux(1 / rho)
            row += sign * warmed.load(faces.slope(phi, warm / rho**2))
            sides.append((faces, sign, cells, at, rho, times))

        def follows(by: Motion) -> float:
            total, shrinks = 0.0, _shrinks(domain, probe, by)
            for faces, sign, cells, at, rho, times in sides:
                grown = (shrinks - by.ratios)[:, cells, None]
                if by_law:
                    resisted = times * by.of_law(domain, "resistivity", cells, at)
                else:
                    resisted = ratios[:, cells] * (by.cold[cells][:, None] + by.warm[cells][:, None] * at)
                total += sign * float(faces.flux(grown / rho - resisted / rho**2) @ phi)
            return total

        return replace(none, row=row, charges=charges, explicit=((1.0, follows),))


def _off_contacts(domain: Any, probe: Any, which: int) -> None:
    """SceneError for a flat probe of heat (0) or current (1) that lies on a contact."""
    torn = [c.facets for c in domain.contacts if (c.contact.thermal_resistance, c.contact.electrical_resistance)[which]]
    if np.isin(domain.facets(probe), np.concatenate([np.empty(0, int), *torn])).any():
        raise SceneError("it lies on a contact, and what passes there has no derivative yet: move the probe off it")


def _shrinks(domain: Any, probe: Any, by: Motion) -> np.ndarray:
    """(cells,): how the logarithm of a facet's area over the depth of its cell changes, for facets along a flat
    probe."""
    if not by.moves:
        return np.zeros(by.stretch.shape[1])
    change: np.ndarray = by.volume - 2 * by.stretch[domain.across(probe)]
    return change


def moved_mean(domain: Any, probe: Any, by: Motion, fields: np.ndarray, inside: np.ndarray | None = None) -> np.ndarray:
    """(...,): what the motion of the mesh and of a probe does to the mean of fields (..., functions) over it; of the
    cells ``inside`` alone."""
    lower, upper = by.probes.get(probe.name, (np.zeros(3), np.zeros(3)))
    if not by.moves and not lower.any() and not upper.any():
        return np.zeros(fields.shape[:-1])
    rows, space = [], domain.space
    for step in (MOVED, -MOVED):
        breaks = [b + step * v for b, v in zip(space.grid.breaks, by.breaks, strict=True)]
        moved = replace(domain, space=space.moved(replace(space.grid, breaks=tuple(breaks))))
        corners = {"lower": tuple(probe.lower + step * lower), "upper": tuple(probe.upper + step * upper)}
        rows.append(moved.mean(replace(probe, **corners), inside))
    row = (rows[0] - rows[1]) / (2 * MOVED)
    change: np.ndarray = fields @ row
    return change


def _moved_place(domain: Any, probe: Any, place: Place, by: Motion, field: np.ndarray) -> float:
    """What the motion does to the extreme of a field (functions,) over a probe: along its extent the extreme stays one,
    or lies in a plane of the mesh, which goes along."""
    if not by.moves:
        return 0.0
    space, change = domain.space, 0.0
    local = field[space.dofs[:, place.cell]]
    for d in range(3):
        if probe.lower[d] < probe.upper[d]:
            continue
        i, x, ahead = space.ijk[d, place.cell], place.point[d], MOVED * np.eye(3)[d]
        speed = by.probes[probe.name][0][d] - (1 - x) * by.breaks[d][i] - x * by.breaks[d][i + 1]
        above, below = (space.at((place.point + step)[:, None])[0] @ local for step in (ahead, -ahead))
        change += float(speed * (above - below) / (2 * MOVED * space.h[d, place.cell]))
    return change
