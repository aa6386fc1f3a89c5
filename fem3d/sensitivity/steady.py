"""Logarithmic derivatives of the steady quantities by the keys of a scene, from one dual solution for each quantity.

The derivative of a quantity is the explicit one of J - R_T(z) - R_E(w) (`fem3d.sensitivity.adjoint`) while the
coefficients of all fields stay: every integral over a brick is a product of its sides and coefficients
(`fem3d.sensitivity.motion`), so that per cell a few integrals of the fields tell the derivative by every key at once.
Their errors come from the same in the space of degrees lower by one, as those of the quantities do.

Problems beside this one, as `fem3d.sensitivity.over_time` solves them, would tell the steady derivatives too, but one
is made for each key: without their errors they take twice to three times as long in scenes of a few probes, and flows
and tops are off by up to some percent, for their dual solutions with the current are not among the fields.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from fem3d.adaptivity.estimator import left
from fem3d.problems.following import Conduction
from fem3d.problems.paths import crossings
from fem3d.problems.terminals import Terminal
from fem3d.results.outputs import of_steady
from fem3d.results.study import Study
from fem3d.sensitivity.adjoint import FILMS, Goal, Linearized
from fem3d.sensitivity.goals import Goals
from fem3d.sensitivity.motion import STEP, Motion, motion
from fem3d.solution.steady import SteadyState, solve_steady
from fem3d.spaces.domain import Domain, Joint
from fem3d.spaces.split import Interface
from meshes import grading
from scenes import faces, physics
from scenes.errors import SceneError
from scenes.model import Scene, bends
from scenes.result import Estimate

COMPLEX = 1e-30  # the step of a derivative by a complex number: its square is nothing beside 1
K, RHO = "thermal_conductivity", "resistivity"
ROUNDING = 1e-8  # relative error that the dual solutions leave in a derivative

Table = dict[str, dict[str, Estimate]]
"""By key, by quantity: d ln quantity / d ln key."""


@dataclass(frozen=True, eq=False)
class _Parts:
    """For one goal, integrals over cells and facets that all keys share."""

    conduction: np.ndarray  # (3, cells)
    heating: np.ndarray  # (3, rows): of live cells, and of contacts that current crosses
    resisted: np.ndarray  # (2, rows): by the cold and by the warm part of the resistivity
    sources: list[np.ndarray]  # (cells of each,)
    films: dict[str, tuple[np.ndarray, np.ndarray]]  # (facets,): of the test, of the test times the rise
    jumps: list[np.ndarray]  # (facets,) of each contact: of what its resistance lets through
    # What is no number is told at points, where the integrand is this over what a key changes.
    conducted: list[np.ndarray]  # (3, cells, points) of each part of a conductivity by a law
    pressed: np.ndarray  # (live cells, points): of a resistivity by a law
    faces: dict[str, np.ndarray]  # (facets, points): of a film that is no straight line of the temperature
    of_rise: np.ndarray  # (functions,)
    of_potential: np.ndarray
    of_terminals: np.ndarray  # of the current into each


@dataclass(frozen=True, eq=False)
class _ByLaw:
    """Some ``cells`` with a conductivity by a law, at the points (cells, points) that integrals are ``on``: the
    conductivity there, and the ``slopes`` (3, cells, points) of the rise times the weights."""

    on: Any
    cells: np.ndarray
    conductivity: np.ndarray
    slopes: np.ndarray


@dataclass(frozen=True, eq=False)
class _Bent:
    """What a key changes at points: of the ``conductivity`` of each `_ByLaw`, of the ``resistivity``; nothing where no
    law changes."""

    conductivity: list[np.ndarray]
    resistivity: np.ndarray | None


class Tangent:
    """The derivatives at one steady state."""

    def __init__(self, study: Study, state: SteadyState, rows: Mapping[str, np.ndarray] | None = None) -> None:
        self.study, self.state, self.rows = study, state, rows or {}
        self.domain = state.heat.domain
        self.linearized = Linearized(state)
        self.out = of_steady(state, study.part)
        self.without: dict[str, str] = {}

    def goals(self, names: Iterable[str]) -> dict[str, Goal]:
        """The goals of quantities: sums of those of outputs, weighted by how each follows them. Those without one are
        in ``without``, with the reason."""
        output_goals, goals = (
            Goals(self.linearized, self.study.part),
            {name: self.linearized.nothing() for name in names},
        )
        for output in self.out:
            beside = self.out | {output: self.out[output] + COMPLEX * 1j}
            weights = {n: float(np.imag(v)) / COMPLEX for n, v in self.study.steady(beside).items()}
            used = {n: w for n, w in weights.items() if w and n in goals}
            if used:
                try:
                    one = output_goals.of(output)
                except SceneError as error:
                    self.without |= dict.fromkeys(used, str(error))
                    continue
                for name, weight in used.items():
                    goals[name] = goals[name].plus(weight, one)
        goals |= {name: replace(self.linearized.nothing(), row=row) for name, row in self.rows.items()}
        return {name: goal for name, goal in goals.items() if name not in self.without}

    def parts(self, goal: Goal) -> _Parts:
        """The integrals of a goal."""
        heat, conductor, domain, lin = self.state.heat, self.state.conductor, self.domain, self.linearized
        z, w = lin.solve(goal)
        of_rise, of_potential = lin.gradient(goal, z, w)
        whole = np.zeros(domain.space.size)
        whole[heat.order] = of_rise
        k = domain.per_cell(K)
        conduction = k * (self._everywhere.weights * self._slopes * self._everywhere.gradient(z)).sum(axis=-1)
        conducted = [law.slopes * law.on.gradient(z) for law in self._by_law]
        for law, each in zip(self._by_law, conducted, strict=True):
            conduction[:, law.cells] = (law.conductivity * each).sum(axis=-1)
        heating, resisted, pressed = np.zeros((3, 0)), np.zeros((2, 0)), np.zeros((0, 0))
        of_terminals = np.zeros(0)
        if conductor is not None:
            of_terminals = np.array([(w + goal.charge)[t.at] for t in conductor.terminals])
            on, rho = conductor.on, lin.rho
            each = lin.slope * (lin.slope * lin.tested(z, goal.boxes) - on.gradient(w)) * on.weights / rho
            pressed = each.sum(axis=0) / rho
            heating = each.sum(axis=-1)
            resisted = np.array([pressed.sum(axis=-1), (pressed * on.value(lin.rise)).sum(axis=-1)])
        sources = []
        for _, cells in domain.sources:
            on_source = domain.space.on(cells)
            sources.append((on_source.value(z) * on_source.weights).sum(axis=-1))
        films, at_points = {}, {}
        for boundary in domain.scene.boundaries:
            if boundary.name in self._films:
                face = self._films[boundary.name]
                tested = (face.value(z) + _each(goal.films.get(boundary.name))) * face.areas
                if bends(boundary):
                    at_points[boundary.name] = tested
                else:
                    films[boundary.name] = tested.sum(axis=-1), (tested * face.value(lin.rise)).sum(axis=-1)
        jumps = [
            (face.jump(z) * face.jump(lin.rise) * face.one.areas).sum(axis=-1) / joint.contact.thermal_resistance
            for joint, face in self._jumps
        ]
        return _Parts(
            conduction, heating, resisted, sources, films, jumps, conducted, pressed, at_points, whole, of_potential,
            of_terminals,
        )  # fmt: skip

    @cached_property
    def _films(self) -> dict[str, Any]:
        """The facets of each film."""
        kinds = (*FILMS, "heat_flux")
        return {b.name: self.linearized.face(b) for b in self.domain.scene.boundaries if b.kind in kinds}

    @cached_property
    def _jumps(self) -> list[tuple[Joint, Interface]]:
        """The contacts that heat crosses, and their facets."""
        space, contacts = self.domain.space, self.domain.contacts
        return [(c, Interface.inside(space, c.facets)) for c in contacts if c.contact.thermal_resistance]

    def _crossed(self, by: Motion) -> tuple[np.ndarray, np.ndarray]:
        """(rows,) twice: of the contacts that current crosses, how their areas and their resistances grow."""
        on = [np.zeros(0)], [np.zeros(0)]
        for crossing in crossings(self.domain):
            face = crossing.potential.one
            on[0].append(face.along(by.stretch) if by.moves else np.zeros(len(face.areas)))
            on[1].append(np.full(len(face.areas), by.contacts[crossing.name][1]))
        return np.concatenate(on[0]), np.concatenate(on[1])

    @cached_property
    def _by_law(self) -> list[_ByLaw]:
        """Where the conductivity is one by a law."""
        exact, parts = self.state.heat.exact, []
        for term in exact.terms if exact else ():
            for on, law, _, cells in term.parts if isinstance(term, Conduction) else ():
                slopes = on.weights * on.gradient(self.linearized.rise)
                parts.append(_ByLaw(on, cells, law.value(on.value(self.linearized.rise)), slopes))
        return parts

    def _bent(self, by: Motion) -> _Bent:
        """What a motion changes of properties by laws."""
        domain, conductor = self.domain, self.state.conductor
        conductivity, resistivity, u = [], None, self.linearized.rise

        def change(key: str, on: Any, cells: np.ndarray) -> np.ndarray:
            return by.of_law(domain, key, cells, on.value(u))

        if self._by_law and by.bends(domain, K):
            conductivity = [change(K, law.on, law.cells) for law in self._by_law]
        if conductor is not None and conductor.following is not None and by.bends(domain, RHO):
            warmed, copies = conductor.warmed, conductor.stands_for[: len(conductor.cells)]
            resistivity = copies * change(RHO, warmed, conductor.cells)
        return _Bent(conductivity, resistivity)

    @cached_property
    def _everywhere(self) -> Any:
        return self.domain.space.on(np.arange(len(self.domain.body)))

    @cached_property
    def _slopes(self) -> np.ndarray:
        slopes: np.ndarray = self._everywhere.gradient(self.linearized.rise)
        return slopes

    def table(self, names: Iterable[str], motions: Mapping[str, Motion]) -> dict[str, dict[str, float]]:
        """d quantity / d ln key, by key and quantity."""
        table: dict[str, dict[str, float]] = {key: {} for key in motions}
        bent = {key: self._bent(by) for key, by in motions.items()}
        for name, goal in self.goals(names).items():
            parts = self.parts(goal)
            for key, by in motions.items():
                table[key][name] = self.derivative(goal, parts, by, bent[key])
        return table

    def derivative(self, goal: Goal, parts: _Parts, by: Motion, bent: _Bent) -> float:
        """dJ / d ln key."""
        domain, conductor = self.domain, self.state.conductor
        grown = by.volume - 2 * by.stretch
        k = domain.per_cell(K)
        derivative = -float((parts.conduction * (grown + by.conductivity / k)).sum())
        for moved, tested in zip(bent.conductivity, parts.conducted, strict=False):
            derivative -= float((tested * moved).sum())
        derivative += float(parts.of_rise @ by.rises + parts.of_potential @ by.voltages)
        if conductor is not None:
            derivative += float(parts.of_terminals @ [self._driven(t, by) for t in conductor.terminals])
            live, (areas, resistances) = conductor.cells, self._crossed(by)
            grown = grown[:, live] - by.ratios[:, live]
            derivative += float((parts.heating * np.hstack([grown, np.tile(areas, (3, 1))])).sum())
            n = len(live)
            derivative -= float(parts.resisted[0, n:] @ (conductor.cold[n:, 0] * resistances))
            if conductor.following is None:
                derivative -= float(parts.resisted[0, :n] @ by.cold[live] + parts.resisted[1, :n] @ by.warm[live])
            elif bent.resistivity is not None:
                derivative -= float((parts.pressed[:n] * bent.resistivity).sum())
        for (q, cells), change, tested in zip(domain.sources, by.sources, parts.sources, strict=True):
            derivative += float(tested @ (change + q * by.volume[cells]))
        for (joint, face), passing in zip(self._jumps, parts.jumps, strict=True):
            grows = face.one.along(by.stretch) if by.moves else 0.0
            derivative -= float((passing * (grows - by.contacts[joint.contact.name][0])).sum())
        for boundary in domain.scene.boundaries:
            if boundary.name in parts.films:
                derivative += self._film(boundary, *parts.films[boundary.name], by)
            elif boundary.name in parts.faces:
                derivative -= self._face(boundary, parts.faces[boundary.name], by)
        return derivative + sum(weight * term(by) for weight, term in goal.explicit)

    def _driven(self, terminal: Terminal, by: Motion) -> float:
        """What enters more (A) at an electrode of given current, or behind a resistance, while its potential stays."""
        given, conductance = by.terminals[terminal.name]
        if np.isinf(terminal.resistance):
            return given
        conductor = self.state.conductor
        assert conductor is not None
        across = float(conductor.voltages[0, terminal.at] - self.state.hot_potential[terminal.at])
        return given * terminal.conductance + across * conductance

    def _film(self, boundary: Any, tested: np.ndarray, warmed: np.ndarray, by: Motion) -> float:
        flux, h, air = by.films[boundary.name]
        grown = self._films[boundary.name].along(by.stretch) if by.moves else 0.0
        if boundary.kind == "heat_flux":
            return float((tested * (flux + boundary.value * grown)).sum())
        loss = warmed - (boundary.ambient - self.domain.scene.initial_temperature) * tested
        return float(boundary.value * air * tested.sum() - (loss * (h + boundary.value * grown)).sum())

    def _face(self, boundary: Any, tested: np.ndarray, by: Motion) -> float:
        """What leaves more by a film that is no straight line of the temperature, as it is tested at points."""
        face = self._films[boundary.name]
        temperature = self.linearized.temperature(face)
        change = by.of_face(self.domain.scene, boundary, temperature)
        if by.moves:
            change = change + faces.flux(boundary, temperature) * face.along(by.stretch)[:, None]
        return float((tested * change).sum())


def _each(weights: np.ndarray | None) -> np.ndarray | float:
    """Weights of facets (facets,) at their points."""
    return 0.0 if weights is None else weights[:, None]


def motions(
    study: Study, domain: Domain, others: Mapping[str, Callable[[], Study]]
) -> tuple[dict[str, Motion], dict[str, str]]:
    """The motions of a domain by key to scenes whose key is larger by `STEP`, and why there is none by others."""
    motions, left_out = {}, {}
    for key, other in others.items():
        try:
            motions[key] = motion(domain, study.part, other().part, STEP)
        except SceneError as error:
            left_out[key] = str(error)
    return motions, left_out


@dataclass(frozen=True, eq=False)
class Known:
    """What sensitivities are told of quantities: their values with errors, by name, and how these values move with a
    key beside what is read (the zero that a rise is above), by key and name; ``rows`` (functions,) of some that are
    sums of rises at places that go along with the mesh."""

    values: Mapping[str, Estimate]
    zero: Mapping[str, Mapping[str, float]]
    rows: Mapping[str, np.ndarray] = field(default_factory=dict)


def steady_table(
    study: Study, state: SteadyState, known: Known, by: Mapping[str, Motion]
) -> tuple[Table, dict[str, str]]:
    """d ln quantity / d ln key of the ``known`` quantities at the state of the last level, and why there is none of
    others.

    Their errors: what the last degree changed, times what all further ones would at the sharpest edge (`estimate.left`;
    the integrals converge like the energy); and as much as the quantity's own relative error, where that difference is
    small by chance. Raises ConvergenceError where a dual solution is not found.
    """
    tangent = Tangent(study, state, known.rows)
    fine = tangent.table(known.values, by)
    scene, level = study.part.scene, len(state.heat.domain.space.nested) - 2
    lower = state.heat.lower(level)
    conductor = state.conductor and state.conductor.lower(level, lower.exact or lower)
    start = lower.take(state.heat.field(state.rise))
    below = solve_steady(lower, conductor, study.voltage, study.accuracy, start, physics.heat(scene))
    low = Tangent(study, below, known.rows).table(known.values, by)
    rest = 1.0
    if isinstance(scene, Scene):
        sharpest = grading.features(scene).sharpest
        rest = max(1.0, float(left(np.array([grading.LEAST_AT_EDGE]), np.array([4 * sharpest]))[0]))
    table: Table = {}
    for key, changes in fine.items():
        table[key] = {}
        for name, change in changes.items():
            value, off = known.values[name], rest * abs(change - low[key][name])
            slope = (change - known.zero.get(key, {}).get(name, 0.0)) / value.value
            least = value.error / abs(value.value) + ROUNDING
            table[key][name] = Estimate(slope, off / abs(value.value) + least)
    return table, tangent.without
