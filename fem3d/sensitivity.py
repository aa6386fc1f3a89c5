"""Logarithmic derivatives of the steady quantities by the keys of a scene, from one dual solution for each quantity.

The derivative of a quantity is the explicit one of J - R_T(z) - R_E(w) (`fem3d.adjoint`) while the coefficients of all
fields stay: every integral over a brick is a product of its sides and coefficients (`fem3d.motion`), so that per cell a
few integrals of the fields tell the derivative by every key at once. Their errors come from the same in the space of
degrees lower by one, as those of the quantities do.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fem3d import steady
from fem3d.adjoint import Goal, Linearized
from fem3d.estimate import left
from fem3d.motion import Given, Motion, motion
from fem3d.outputs import of_steady
from fem3d.probes import reading
from fem3d.steady import SteadyState
from fem3d.study import Study
from meshes import grading
from meshes.symmetry import Symmetry
from scenes.errors import SceneError
from scenes.result import Estimate

STEP = 2.0**-7  # of a key, between scenes that are affine in it: as large as keeps the scenes alike
MOVED = 1e-4  # the same where a row is not affine in the coordinates: central differences are off by its square
COMPLEX = 1e-30
ROUNDING = 1e-8  # that of dual solutions

Table = dict[str, dict[str, Estimate]]
"""By key, by quantity: d ln quantity / d ln key."""


@dataclass(frozen=True, eq=False)
class _Parts:
    """For one goal, integrals over cells and facets that all keys share."""

    conduction: np.ndarray  # (3, cells)
    heating: np.ndarray  # (3, live cells)
    resisted: np.ndarray  # (2, live cells): by the cold and by the warm part of the resistivity
    sources: list[np.ndarray]  # (cells of each,)
    films: dict[str, tuple[np.ndarray, np.ndarray]]  # (facets,): of the test, of the test times the rise
    of_rise: np.ndarray  # (functions,)
    of_potential: np.ndarray


class Tangent:
    """The derivatives at one steady state."""

    def __init__(self, study: Study, state: SteadyState, given: Given) -> None:
        self.study, self.state, self.given = study, state, given
        self.domain = state.heat.domain
        self.linearized = Linearized(state)
        self.out = of_steady(state, study.part)
        self.values = study.steady(self.out)

    def goals(self, names: Iterable[str]) -> dict[str, Goal]:
        """The goals of quantities: sums of those of outputs, weighted by how each follows them."""
        found = {name: self.linearized.nothing() for name in names}
        for output in self.out:
            beside = self.out | {output: self.out[output] + COMPLEX * 1j}
            weights = {n: float(np.imag(v)) / COMPLEX for n, v in self.study.steady(beside).items()}
            used = {n: w for n, w in weights.items() if w and n in found}
            if used:
                one = self._goal(output)
                for name, weight in used.items():
                    found[name] = found[name].plus(weight, one)
        return found

    def _goal(self, output: str) -> Goal:
        part, conductor = self.study.part, self.state.conductor
        kind, _, name = output.partition(":")
        none = self.linearized.nothing()
        if kind == "probe":
            own = self._probe(name)
            return none.plus(part.probes[name][0], own)
        if kind == "flow":
            flow = part.flows[name]
            return none.plus(flow.heat, self._flow(flow.boundary))
        if kind == "current" and conductor is not None:
            flow = part.flows[name]
            electrode = conductor.electrodes[flow.boundary]
            return none.plus(flow.current, replace(none, charge=electrode))
        if kind == "joule" and conductor is not None:
            bodies = np.array(self.domain.names)[self.domain.body[conductor.cells]]
            return none.plus(part.box_copies[name], replace(none, boxes=(bodies == name)[:, None].astype(float)))
        if output in ("power", "dissipated"):
            return replace(none, boxes=np.full(none.boxes.shape, float(part.copies)))
        raise SceneError(f"there is no derivative of {output}")

    def _flow(self, boundary: str) -> Goal:
        heat, none = self.state.heat, self.linearized.nothing()
        if boundary in heat.held_fields:
            return replace(none, heat=heat.field(heat.held_fields[boundary]))
        return replace(none, films={boundary: 1.0})

    def _probe(self, name: str) -> Goal:
        heat, none, probe = self.state.heat, self.linearized.nothing(), self._probes[name]
        if probe.quantity == "temperature" and probe.reduce == "mean":
            return replace(none, row=self.domain.mean(probe), probes={name: 1.0})
        conductor, sums = self.state.conductor, none
        how = None if probe.quantity == "potential" else reading(heat, probe)
        if how is not None and how.extreme is not None:
            # At a top the rise is level: where it goes adds nothing.
            rise = self.linearized.rise
            return replace(none, row=how.extreme.where(rise).row(self.domain.space))
        if how is not None and how.boundaries and not how.row.any():
            for boundary in how.boundaries:
                if probe.quantity == "heat_flow":
                    sums = sums.plus(1.0, self._flow(boundary))
                elif conductor is not None:
                    sums = sums.plus(how.sign, replace(none, charge=conductor.electrodes[boundary]))
            return sums
        raise SceneError(f"there is no derivative of what probe {name} reads")

    def parts(self, goal: Goal) -> _Parts:
        """The integrals of a goal."""
        heat, conductor, domain, lin = self.state.heat, self.state.conductor, self.domain, self.linearized
        z, w = lin.solve(goal)
        of_rise, of_potential = lin.gradient(goal, z, w)
        whole = np.zeros(domain.space.size)
        whole[heat.order] = of_rise
        k = domain.per_cell("thermal_conductivity")
        conduction = k * (self._everywhere.weights * self._slopes * self._everywhere.gradient(z)).sum(axis=-1)
        heating, resisted = np.zeros((3, 0)), np.zeros((2, 0))
        if conductor is not None:
            on, rho = conductor.on, lin.rho
            each = lin.slope * (lin.slope * lin.tested(z, goal.boxes) - on.gradient(w)) * on.weights / rho
            per_rho = each.sum(axis=0) / rho
            heating = each.sum(axis=-1)
            resisted = np.array([per_rho.sum(axis=-1), (per_rho * on.value(lin.rise)).sum(axis=-1)])
        sources = []
        for _, cells in domain.sources:
            on_source = domain.space.on(cells)
            sources.append((on_source.value(z) * on_source.weights).sum(axis=-1))
        films = {}
        for boundary in domain.scene.boundaries:
            if boundary.kind in ("convection", "heat_flux"):
                faces = domain.faces(boundary)
                tested = (faces.value(z) + goal.films.get(boundary.name, 0.0)) * faces.areas
                films[boundary.name] = tested.sum(axis=-1), (tested * faces.value(lin.rise)).sum(axis=-1)
        return _Parts(conduction, heating, resisted, sources, films, whole, of_potential)

    @cached_property
    def _everywhere(self) -> Any:
        return self.domain.space.on(np.arange(len(self.domain.body)))

    @cached_property
    def _slopes(self) -> np.ndarray:
        found: np.ndarray = self._everywhere.gradient(self.linearized.rise)
        return found

    def table(self, names: Iterable[str], motions: Mapping[str, Motion]) -> dict[str, dict[str, float]]:
        """d ln quantity / d ln key, by key and quantity."""
        found: dict[str, dict[str, float]] = {key: {} for key in motions}
        for name, goal in self.goals(names).items():
            parts = self.parts(goal)
            for key, by in motions.items():
                found[key][name] = self.derivative(goal, parts, by) / float(self.values[name])
        return found

    def derivative(self, goal: Goal, parts: _Parts, by: Motion) -> float:
        """dJ / d ln key without what symmetry adds."""
        domain, conductor = self.domain, self.state.conductor
        grown = by.volume - 2 * by.stretch
        k = domain.per_cell("thermal_conductivity")
        found = -float((parts.conduction * (grown + by.conductivity / k)).sum())
        found += float(parts.of_rise @ by.rises + parts.of_potential @ by.voltages)
        if conductor is not None:
            live = conductor.cells
            found += float((parts.heating * grown[:, live]).sum())
            found -= float(parts.resisted[0] @ by.cold[live] + parts.resisted[1] @ by.warm[live])
        for (q, cells), change, tested in zip(domain.sources, by.sources, parts.sources, strict=True):
            found += float(tested @ (change + q * by.volume[cells]))
        for boundary in domain.scene.boundaries:
            if boundary.name in parts.films:
                found += self._film(boundary, *parts.films[boundary.name], by)
        return found + sum(weight * self._read(name, by) for name, weight in goal.probes.items())

    def _film(self, boundary: Any, tested: np.ndarray, warmed: np.ndarray, by: Motion) -> float:
        flux, h, air = by.films[boundary.name]
        faces: Any = self.domain.faces(boundary)
        grown = faces.along(by.stretch)
        if boundary.kind == "heat_flux":
            return float((tested * (flux + boundary.value * grown)).sum())
        lost = warmed - (boundary.ambient - self.domain.scene.initial_temperature) * tested
        return float(boundary.value * air * tested.sum() - (lost * (h + boundary.value * grown)).sum())

    def _read(self, name: str, by: Motion) -> float:
        return float(moved_mean(self.domain, self._probes[name], by, self.linearized.rise))

    @cached_property
    def _probes(self) -> dict[str, Any]:
        return {p.name: p for p in self.domain.scene.probes}


def moved_mean(domain: Any, probe: Any, by: Motion, fields: np.ndarray) -> np.ndarray:
    """(...,): what the motion of the mesh and of a probe does to the mean of fields (..., functions) over it."""
    lower, upper = by.probes[probe.name]
    if not any(v.any() for v in (*by.breaks, lower, upper)):
        return np.zeros(fields.shape[:-1])
    rows, space = [], domain.space
    for step in (MOVED, -MOVED):
        moved = copy.copy(space)
        breaks = [b + step * v for b, v in zip(space.grid.breaks, by.breaks, strict=True)]
        moved.grid = space.grid.with_axes(breaks, space.grid.degrees)
        rows.append(moved.mean(tuple(probe.lower + step * lower), tuple(probe.upper + step * upper)))
    found: np.ndarray = fields @ ((rows[0] - rows[1]) / (2 * MOVED))
    return found


def motions(
    study: Study, given: Given, others: Mapping[str, Callable[[], Symmetry]]
) -> tuple[dict[str, Motion], dict[str, str]]:
    """The motions by key to the parts of scenes whose key is larger by `STEP`, and why there is none by others."""
    found, left_out = {}, {}
    for key, other in others.items():
        try:
            found[key] = motion(given, study.part, other(), STEP)
        except SceneError as error:
            left_out[key] = str(error)
    return found, left_out


def steady_table(
    study: Study, state: SteadyState, known: Mapping[str, Estimate], given: Given, by: Mapping[str, Motion]
) -> Table:
    """d ln quantity / d ln key of the ``known`` quantities at the state of the last level.

    Their errors: what the last degree changed, times what all further ones would at the sharpest edge (`estimate.left`;
    the integrals converge like the energy); and as much as the quantity's own relative error, where that difference is
    small by chance. Raises SceneError for a quantity that has no derivative, ConvergenceError
    where a dual solution is not found.
    """
    fine = Tangent(study, state, given).table(known, by)
    level = len(state.heat.domain.space.nested) - 2
    heat = state.heat.lower(level)
    conductor = state.conductor and state.conductor.lower(level, heat)
    below = steady.coupled(heat, conductor, True, study.voltage, study.accuracy, state.follows_pattern)
    low = Tangent(study, below, given).table(known, by)
    sharpest = grading.features(study.part.scene).sharpest
    rest = max(1.0, float(left(np.array([grading.LEAST_AT_EDGE]), np.array([4 * sharpest]))[0]))
    least = {name: e.error / abs(e.value) + ROUNDING for name, e in known.items()}
    return {
        key: {n: Estimate(v, rest * abs(v - low[key][n]) + least[n]) for n, v in found.items()}
        for key, found in fine.items()
    }
