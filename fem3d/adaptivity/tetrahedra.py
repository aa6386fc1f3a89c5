"""Tetrahedra as the search for an accuracy sees them (`fem3d.adaptivity.mesh.Mesh`): degree 3, with degrees 2 and 1
within, refined where these say that readings miss most.

What degrees 2 and 3 take away of an error tells on each cell what is left, as on bricks (`fem3d.adaptivity.estimator`);
what nobody knows of a mesh is where a solution is singular, so that no rate beyond the slowest is believed.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from fem3d.adaptivity import field_error, goal_errors, nested, reach, trace_errors
from fem3d.adaptivity.effectivity import Told
from fem3d.adaptivity.estimator import Estimator, Spread, worst_of
from fem3d.adaptivity.goal_errors import Level
from fem3d.adaptivity.nested import Problems, Solution
from fem3d.adaptivity.trace_errors import Response
from fem3d.problems.heat import HeatProblem
from fem3d.results.fields.mesh_fields import MeshFields
from fem3d.results.study import Study
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from fem3d.spaces import edge_exponents
from fem3d.spaces.domain import Domain
from fem3d.spaces.size import START_UP, Size, of_tetrahedra
from meshes import grading
from meshes.symmetry import Symmetry
from scenes.model import AnyScene
from scenes.plan import Step

AIM = 0.7  # of what is enough, at which a refinement aims (`validate stress`: "constants")
# Unknowns: a transient may have the fewer, and a steady state that needs more than the fewer has these first, as they
# take a fifth of the time and a third of the memory of the most. Half as many more than a mesh has are little use, but
# after the first one, as the second also tells how far estimates are too large (`fem3d.adaptivity.effectivity`): from
# twice as many on they fall by as much as that takes.
FEWER, MOST_UNKNOWNS, LEAST_GROWTH, SECOND_GROWTH, TELLS = 60_000, 150_000, 1.5, 1.25, 2.0
MOST_GROWTH = 3.0  # times the cells of a level that the next one may have
# A cell is halved along the longest, and others longer than half of that, of those axes for which what is missing along
# them times the cell's size is at least this fraction of the most. Across an edge both are larger than along it, where
# cells may stay long. At 45,000 unknowns a comb of ten boxes states 1.0 % so, 3.0 % with the square of the size and a
# fraction of 0.4; without the size a stack with ten vias stays at 17 %, which states 2.7 % so.
VARIES, SHORTER = 0.05, 0.5
# What must follow when cells are halved only the mesh tells: so many are tried, for at least this part of the growth
# that there is room for, each for a little less than that.
TRIALS, LEAST_ROOM, SURELY = 5, 0.5, 0.9
# The mesh grows three to twenty times as much as by the cells that are cut alone: so much of the room these take first.
FIRST = 0.25
# Of what is missing, what the cells hold that are refined: the others are many, and miss little each.
MARKED = 0.9


class Laid(Protocol):
    """A scene laid on a mesh of tetrahedra."""

    @property
    def scene(self) -> AnyScene:
        """The scene."""

    advice: str
    """What to do where the accuracy isn't reached, in words."""

    @property
    def cells(self) -> Any:
        """scikit-fem's mesh."""

    def domain(self) -> Domain:
        """Its cells and facets with what is on them."""

    def finer(self, shorter: np.ndarray, sharp: np.ndarray) -> Laid:
        """On the mesh with cells cut that are to be ``shorter`` along an axis (3, cells). Vertices are ``sharp`` (3,
        vertices) where an edge along an axis ends at which gradients are infinite."""

    def of(self, scene: Any) -> Laid:
        """Another scene, with the same parts, on the mesh."""

    def remarks(self) -> list[str]:
        """What may not be meant in it."""

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """The lines of a plan; after a run with the ``levels`` that it has."""

    def statistics(self) -> dict[str, Any]:
        """What a result says of it besides cells and degrees."""


@dataclass(frozen=True, eq=False)
class Tetrahedra:
    """A scene on tetrahedra, to be solved for an accuracy, refined ``levels`` times. They are refined no more where the
    errors of the levels ``before`` (unknowns, largest relative error) foretell that as many as are made don't leave
    less than an error that another mesh leaves: come ``below`` that."""

    laid: Laid
    accuracy: float
    levels: int = 0
    told: Told = field(default_factory=Told)
    below: float = np.inf
    before: tuple[tuple[int, float], ...] = ()

    whole = True

    @cached_property
    def domain(self) -> Domain:
        """The scene on the mesh."""
        return self.laid.domain()

    @cached_property
    def size(self) -> Size:
        """What it costs."""
        return of_tetrahedra(self.laid.cells, float(self.domain.live.mean()))

    @property
    def _limit(self) -> float:
        """The factor by which the cells may grow at most."""
        most = MOST_UNKNOWNS if self.laid.scene.steady else min(FEWER, MOST_UNKNOWNS)
        # What the process takes before it has a mesh doesn't grow with that.
        memory = (reach.MOST_MEMORY - START_UP) / (self.size.memory - START_UP)
        return float(min(most / self.size.unknowns, memory ** (3 / 4)))

    @property
    def _last(self) -> bool:
        """Whether a finer mesh would take too much time or memory."""
        return self._limit < (LEAST_GROWTH if self.levels else SECOND_GROWTH)

    def problems(self) -> Problems:
        """The problems of degrees 1, 2 and 3."""
        return nested.problems(self.domain, self.accuracy)

    @cached_property
    def _at_vertices(self) -> np.ndarray:
        """(2, 3, vertices): the exponents of edges, for heat and for current."""
        return edge_exponents.at_vertices(self.domain)

    @cached_property
    def _judge(self) -> Estimator:
        cells = self.laid.cells
        exponents = edge_exponents.of_cells(cells, self._at_vertices)
        return Estimator.of_cells(exponents, self.size.cells, self.domain.space.p)

    def examined(self, study: Study, given: Problems, fine: Solution) -> Level | None:
        level = goal_errors.examined(study, given, fine, self._judge)
        if level is None:
            return None
        level = self.told.corrected(level)
        return replace(level, errors=goal_errors.as_balanced(study, level.errors, fine, level.scales))

    def responded(
        self, study: Study, given: Problems, bases: Sequence[Base], shift: float, steady: Level | None, generations: int
    ) -> Response:
        return trace_errors.respond(study, given, bases, shift, self._judge, steady, generations, as_it_is=self._last)

    def refined(
        self, goals: Collection[Spread], falls: Spread | None, worst: float, enough: float
    ) -> Tetrahedra | None:
        """Finer where cells miss more than their share, those that miss most first, as far as `MOST_GROWTH` goes, or
        further where even a few are followed by more, as on a mesh of few cells."""
        so_far = (*self.before, (self.size.unknowns, worst))
        if self._last or self._foreseen(so_far) > self.below:
            return None
        by_axis = np.array(worst_of(goals))
        missing = by_axis.sum(axis=0)
        missing *= max(worst / max(float(missing.sum()), 1e-300), 1.0)
        too_much = missing > grading.share_of(missing, AIM * enough)
        shorter = self._long(by_axis) & too_much
        order = np.argsort(-missing)
        order = order[: np.searchsorted(np.cumsum(missing[order]), MARKED * missing.sum()) + 1]
        order = order[too_much[order]]
        best, least = None, None
        to_fewer = FEWER / self.size.unknowns
        room = min(self._limit, MOST_GROWTH, to_fewer if to_fewer >= TELLS else np.inf) - 1
        alone = np.cumsum(2.0 ** shorter.sum(axis=0)[order] - 1) / shorter.shape[1]
        fit = min(int(np.searchsorted(alone, FIRST * room)) + 1, len(order))
        for _ in range(TRIALS):
            if not fit:
                break
            finer = replace(self._finer(_of(shorter, order[:fit])), before=so_far)
            grown = finer.laid.cells.t.shape[1] / self.laid.cells.t.shape[1] - 1
            if grown <= room:
                best = finer
            elif grown <= self._limit - 1:
                least = finer
            if LEAST_ROOM * room <= grown <= room or (grown < room and fit == len(order)):
                break
            fit = min(max(int(fit * SURELY * room / grown), 1), len(order) if grown < room else fit - 1)
        return best or least

    def _foreseen(self, levels: tuple[tuple[int, float], ...]) -> float:
        """The largest error on as many tetrahedra as are made, if it falls with the unknowns as it fell between two of
        the last three levels; zero before there are three."""
        rates = [np.log(e / f) / np.log(m / n) for (n, e), (m, f) in pairwise(levels[-3:])]
        return 0.0 if len(rates) < 2 else float(levels[-1][1] * self._limit ** -max(rates))

    def begun(self) -> Tetrahedra:
        return self

    def raised(self) -> Tetrahedra | None:
        return None if self._last else self._finer(self._long())

    def _long(self, by_axis: np.ndarray | None = None) -> np.ndarray:
        """(3, cells): along which axes each cell is to be halved, for what is missing along each (3, cells)."""
        size: np.ndarray = np.ptp(self.laid.cells.p[:, self.laid.cells.t], axis=1)
        if by_axis is not None:
            varies = by_axis * size
            size[varies < VARIES * varies.max(axis=0)] = 0.0
        return size > SHORTER * size.max(axis=0)

    def _finer(self, shorter: np.ndarray) -> Tetrahedra:
        sharp = self._at_vertices.min(axis=0) < 1
        return replace(self, laid=self.laid.finer(shorter, sharp), levels=self.levels + 1)

    def field_error(self, level: Level) -> float:
        return field_error.relative(*self._sampled(level))

    def refined_for_field(self, level: Level) -> Tetrahedra | None:
        gaps, _ = self._sampled(level)
        worst = gaps.max(axis=1)
        return None if self._last else self._finer(self._long() & (worst >= field_error.CAUSES * worst.max()))

    def _sampled(self, level: Level) -> tuple[np.ndarray, np.ndarray]:
        """(cells, points) twice: how far degrees 2 and 3 are apart in each cell, and the fine field."""
        given, on = level.problems, self.domain.space.on(np.arange(self.size.cells))
        fine = on.value(given.heat.field(level.fine.state.rise))
        return np.abs(fine - on.value(given.heat.field(given.lifted(level.low.state.rise, 1)))), fine

    def steps(self, levels: int | None) -> tuple[Step, ...]:
        """The lines of the plan; after a run with the ``levels`` that it has."""
        return self.laid.steps(levels)

    def fields(
        self, heat: HeatProblem, part: Symmetry, state: SteadyState | None, transient: Transient | None
    ) -> MeshFields:
        return MeshFields(heat, state, transient)

    def on(self, scene: Any) -> Tetrahedra:
        """Another scene, with the same parts, on the same cells, for its accuracy."""
        return Tetrahedra(self.laid.of(scene), scene.accuracy, self.levels)

    def statistics(self, heat: HeatProblem) -> dict[str, Any]:
        weights = heat.domain.space.on(np.arange(self.size.cells)).weights
        return {
            "cells": self.size.cells, "nodes": heat.size, "refined": self.levels > 0,
            "lowest_degree": 3, "highest_degree": 3, "volume_m3": float(weights.sum()), **self.laid.statistics(),
        }  # fmt: skip

    def warnings(self, study: Study, relative: dict[str, float]) -> list[str]:
        return [
            *less_accurate(study, relative, f"as many tetrahedra of degree 3 as are made; {self.laid.advice}"),
            *self.laid.remarks(),
        ]


def _of(shorter: np.ndarray, which: np.ndarray) -> np.ndarray:
    """What is to be ``shorter`` (3, cells) of some cells (n,), and nothing of the others."""
    some = np.zeros_like(shorter)
    some[:, which] = shorter[:, which]
    return some


FINER = "give a finer mesh, above all at edges, corners and the rims of electrodes and fixed temperatures"


def less_accurate(study: Study, relative: dict[str, float], words: str) -> list[str]:
    """What is to be said of ``relative`` errors above the accuracy: ``words`` are on what they are, and what to do."""
    over = {name: e for name, e in relative.items() if e > study.accuracy}
    if not over:
        return []
    worst = max(over, key=lambda name: over[name])
    shown = f"{over[worst]:.1g}" if over[worst] > 2 * study.accuracy else f"{over[worst]:.3g}"
    if float(shown) <= study.accuracy:
        shown = f"just over {shown}"
    names = f"{len(over)} of {len(relative)} probes are" if len(over) > 1 else f'probe "{worst}" is'
    return [
        f"{names} less accurate than the {study.accuracy:g} asked for, {worst} with an estimated {shown}, on {words}"
    ]
