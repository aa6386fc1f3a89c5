"""Derivatives of quantities by the keys of a scene: differences on a moved mesh.

With f(h) a quantity at a key larger by a relative step h, the derivative is (f(h) - f(0)) / ln(1 + h), or for a steady
quantity the mean for h and -h, whose distance from the former bounds the truncation error. A steady state beside
another one is solved to the first order in h (`fem3d.solution.steady`), as terms of the second order cancel in the
mean. All solutions share their cells, factors and quadratures, so that their rounding errors allow small steps. The
error of space is estimated in the next lower space: the difference is a smooth function of the mesh, and converges as
the quantities do. Steady quantities are differentiated in logarithms, which are straight for powers.

Transients are projected on the fields of the base for all values of a key: Krylov fields of the loads, and of the dual
problems of the traces. A trace is then off by the product of the errors of both solutions, and the change of the fields
by the key matters to second order alone (Becker and Rannacher, Acta Numerica 10, 2001).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from threadpoolctl import threadpool_limits

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import FASTEST, tail
from fem3d.adaptivity.goal_errors import goal_row
from fem3d.adaptivity.mesh import Answer
from fem3d.adaptivity.nested import Problems
from fem3d.adaptivity.responses import make_base, search_hot_states
from fem3d.problems.cholesky import Solver
from fem3d.problems.current import Conductor
from fem3d.results import outputs
from fem3d.results.outputs import Study
from fem3d.results.probes import Reading, keep_places, reading
from fem3d.runs.motion import move
from fem3d.solution import transient
from fem3d.solution.reduced import Reduced
from fem3d.solution.steady import SteadyState, Tangent
from fem3d.solution.transient import Base, Krylov
from fem3d.spaces import edge_exponents
from meshes import grading
from scenes import physics
from scenes.errors import NumericsError, SceneError
from scenes.model import Scene
from scenes.result import Estimate

STEP = 2.0**-12  # relative step of a key, to both sides: the mean is then off by some 1e-7 of a derivative
# Relative step of a key to one side, over time, and the truncation error of a derivative of order one. The time steps
# have the square of it as their relative error, which over the step is as large.
SHORT = 2.0**-15
NOISE = 1e-11  # relative error of two solutions that rounding leaves in their difference
FEWER = 2  # generations of Krylov fields that the lower space takes less, to show the error of leaving out fields

Table = dict[str, dict[str, Estimate]]
"""By key and quantity: d ln quantity / d ln key."""
Traces = dict[str, np.ndarray]
Vary = Callable[[float], Study]
"""Make the study of the scene whose key is larger by a relative step. Raises SceneError where there is none."""


@dataclass(frozen=True, eq=False)
class Course:
    """Derivatives of traces.

    Attributes
    ----------
    times : (n,) s
    traces : (n,) by trace, in its unit
    values : d trace / d ln key (n,) by key and trace, in the trace's unit
    errors : errors of these (n,), by key and trace
    """

    times: np.ndarray
    traces: Traces
    values: dict[str, Traces]
    errors: dict[str, Traces]


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives of an answer.

    Attributes
    ----------
    steady : d ln quantity / d ln key with errors, by key and quantity
    values : the quantities of ``steady``, temperatures as rises
    course : derivatives of the traces, if the answer has traces
    profile : d rise / d ln key (places,) at places that move along, by key
    left_out : reason why a key or a quantity has none
    """

    steady: Table
    values: dict[str, Estimate]
    course: Course | None = None
    profile: dict[str, np.ndarray] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Values:
    """The steady quantities, the rises of a profile (places,) and the traces of a scene in one space."""

    steady: dict[str, float]
    profile: np.ndarray = field(default_factory=lambda: np.empty(0))
    traces: Traces = field(default_factory=dict)


Levels = tuple[Values, Values]
"""The values of a scene, and its values in the next lower space, in fewer Krylov fields."""


def sensitivities(
    study: Study, answer: Answer, known: Mapping[str, Estimate], keys: Mapping[str, Vary], rows: csr_array | None = None
) -> Sensitivities:
    """Return the derivatives of an answer by ``keys``, for each the function that makes the study of a scene beside.

    The ``study`` of the answer has rises in place of temperatures. The steady quantities to differentiate are ``known``
    with their errors. The ``rows`` (places, functions) sample the rise for ``Sensitivities.profile``.
    Raises NumericsError if the scene itself cannot be solved again.
    """
    solver = _Neighbours(study, answer, rows)
    steady, course = Table(), Course(solver.times, solver.base[0].traces, {}, {})
    profile, left_out = dict[str, np.ndarray](), dict[str, str]()
    near = np.abs(np.log2(course.times / course.times[:, None])) <= 1.0
    for key, found in solver.differences(keys):
        if isinstance(found, Exception):
            left_out[key] = str(found)
            continue
        steady[key] = {name: found.logarithmic(name, e) for name, e in known.items()}
        if rows is not None:
            profile[key] = found.steady(lambda values: values.profile)[0]
        traces = {name: found.of_trace(name) for name in course.traces}
        course.values[key] = {name: value for name, (value, _) in traces.items()}
        # At some time both levels agree by chance: an error is the largest one between half and twice its time.
        course.errors[key] = {name: np.where(near, error, 0.0).max(axis=1) for name, (_, error) in traces.items()}
    return Sensitivities(steady, dict(known), None if answer.response is None else course, profile, left_out)


@dataclass(frozen=True, eq=False)
class Difference:
    """The values of a scene, and of its neighbours: in the steady state with a key larger by `STEP` (``more``) and
    smaller by it (``less``), over time with a key larger by `SHORT`. ``edges`` is the ratio of the error of space to
    the change by the lower space; ``stretched`` tells whether the key moves the mesh."""

    base: Levels
    more: Levels
    less: Values
    edges: float
    over_time: Levels | None = None
    stretched: bool = False

    def _one_sided(self, beside: Levels, step: float, read: Callable[[Values], Any]) -> tuple[Any, Any]:
        """The derivative of a reading by the logarithm of the key, and its error of space."""
        pairs = zip(beside, self.base, strict=True)
        fine, low = ((read(there) - read(here)) / np.log1p(step) for there, here in pairs)
        return fine, self.edges * abs(fine - low)

    def steady(self, read: Callable[[Values], Any]) -> tuple[Any, Any]:
        """Return the derivative of a steady reading, and its error."""
        first, error = self._one_sided(self.more, STEP, read)
        mean = (first + (read(self.less) - read(self.base[0])) / np.log1p(-STEP)) / 2
        return mean, error + abs(mean - first)

    def logarithmic(self, name: str, known: Estimate) -> Estimate:
        """Return d ln quantity / d ln key. Errors fall like h^2s, s up to FASTEST / 4: cells that are longer by 1 %
        change them by 2s %."""
        zero = self.base[0].steady[name]
        if zero == self.more[0].steady[name] == self.less.steady[name]:
            return Estimate(0.0, 0.0)
        slope, error = self.steady(lambda values: np.log(abs(values.steady[name])))
        rounding = NOISE / STEP * (1 + abs(float(slope)))
        of_quantity = (1 + FASTEST / 2 * self.stretched) * known.error / abs(known.value)
        return Estimate(float(slope), float(error) + of_quantity + rounding)

    def of_trace(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return d trace / d ln key (n,) and its error (n,), in the trace's unit."""
        assert self.over_time is not None
        slope, error = self._one_sided(self.over_time, SHORT, lambda values: values.traces[name])
        size = float(np.abs(self.base[0].traces[name]).max())
        # Of the time steps, of a power, and of a pole.
        return slope, error + SHORT * (2 * size + float(np.abs(slope).max()) ** 2 / (size or 1.0))


class _Neighbours:
    """Values of scenes next to the scene of an answer, on its mesh, moved."""

    def __init__(self, study: Study, answer: Answer, rows: csr_array | None) -> None:
        self._answer, self._part, self._rows = answer, study.part, rows
        self.times = np.empty(0)
        if answer.response is not None:
            rows = answer.response.times
            self.times = np.union1d(rows[rows >= study.earliest], min(study.earliest, study.end))
            self._near = dict[int, tuple[Reduced, np.ndarray | None, dict[str, Reading]]]()
        self._edges = 1.0
        if isinstance(study.part.scene, Scene):
            sharpest = edge_exponents.features(study.part.scene).sharpest
            self._edges = max(1.0, float(tail(np.array([grading.LEAST_AT_EDGE]), np.array([4 * sharpest]))[0]))
        self._problems, self._tangents = nested.discretize(answer.heat.domain, study.accuracy), dict[int, Tangent]()
        self._shift = transient.shift(min(study.end, transient.slowest(self._problems.heats[0])), study.earliest)
        if answer.response is not None and answer.steady is None:
            lower = self._problems.heats[-2], self._problems.conductors[-2], self._shift
            _, self._hot = search_hot_states(*lower, study.earliest, study.end, study.accuracy)
        if answer.steady is not None and physics.heat(study.part.scene):
            problems, start = self._problems, answer.steady.state.heat.field(answer.steady.state.rise)
            self._tangents = {
                k: Tangent(nested.solve_space(study, problems, k, start=start).state, study.accuracy) for k in (-1, -2)
            }
        self.base = self._values(study, self._problems, -1), self._values(study, self._problems, -2)

    def differences(self, keys: Mapping[str, Vary]) -> Iterator[tuple[str, Difference | Exception]]:
        """Yield each key with its differences, or the reason why there are none; each processor solves one."""

        def tried(vary: Vary) -> Difference | Exception:
            try:
                return self.difference(vary)
            except (SceneError, NumericsError) as error:
                return error

        with threadpool_limits(1), ThreadPoolExecutor(os.cpu_count()) as pool:
            yield from zip(keys, pool.map(tried, keys.values()), strict=True)

    def difference(self, vary: Vary) -> Difference:
        """Solve with a larger and a smaller key. Raises SceneError where a scene beside the base is not the same but
        for its numbers, and NumericsError where one has no solution."""
        more, less, stretched, over_time = self.base, self.base[0], False, None
        if self._answer.steady is not None:
            study, other = vary(STEP), vary(-STEP)
            problems = self._moved(study)
            more = self._steady(study, problems, -1)[0], self._steady(study, problems, -2)[0]
            less = self._steady(other, self._moved(other), -1)[0]
            points = (each.domain.space.mesh.p for each in (problems, self._problems))
            stretched = not np.array_equal(*points)
        if self._answer.response is not None:
            study = vary(SHORT)
            problems = self._moved(study)
            over_time = self._values(study, problems, -1), self._values(study, problems, -2)
        return Difference(self.base, more, less, self._edges, over_time, stretched)

    def _moved(self, study: Study) -> Problems:
        """The problems of a scene on the mesh of the answer, moved, with the factors of the answer's scene."""
        domain = move(self._answer.heat.domain, self._part, study.part)
        problems = nested.discretize(domain, study.accuracy)
        if not np.array_equal(problems.heat.order, self._problems.heat.order):
            raise SceneError("other nodes have given temperatures when the scene changes")
        for heat, base in zip(problems.heats, self._problems.heats, strict=True):
            heat.cache.update(solve_steady=lambda load, base=base: base.solve_steady(load))
        for conductor, known in zip(problems.conductors, self._problems.conductors, strict=True):
            if conductor is not None and known is not None:
                solve = _corrected(known.solve_cold, conductor)
                # Supplied at these potentials are currents into electrodes, where they are exact, and residuals.
                given_here, given_there = (c.given(c.voltages) for c in (conductor, known))
                supplied = known.cold_potentials + given_here - given_there
                conductor.cache.update(near=known.near, solve_cold=solve, cold_potentials=supplied)
        return problems

    def _steady(self, study: Study, problems: Problems, number: int) -> tuple[Values, SteadyState]:
        """Solve the steady state in one of the nested spaces."""
        if (tangent := self._tangents.get(number)) is None:
            state = nested.solve_space(study, problems, number).state
        else:
            state = tangent.state(problems.heats[number], problems.conductors[number])
        steady = {n: float(v) for n, v in study.steady(outputs.of_steady(state, study.part)).items()}
        profile = np.empty(0) if self._rows is None else self._rows @ state.heat.field(state.rise)
        return Values(steady, profile), state

    def _values(self, study: Study, problems: Problems, number: int) -> Values:
        """Solve in one of the nested spaces; over time in the fields of the base, whose conductor resists."""
        values, response = Values({}), self._answer.response
        if self._answer.steady is not None:
            values, state = self._steady(study, problems, number)
        if response is None:
            return values
        if self._answer.steady is not None:
            base = Base.of_steady(state, study.accuracy)
        else:
            base = make_base(problems.heats[number], problems.conductors[number], self._hot)
        if number not in self._near:
            self._near[number] = *self._fields(study, base, number), keep_places(base.heat)
        near, at_points, places = self._near[number]
        base.heat.cache.update(**places)
        marched = transient.march(replace(base, conductor=None), base.near(near, at_points), study.end, SHORT**2)
        out = outputs.of_transient(replace(marched, base=base), study.part, self.times)
        return replace(values, traces=study.traces(out))

    def _fields(self, study: Study, base: Base, number: int) -> tuple[Reduced, np.ndarray | None]:
        """The problem of a base on its fields, the Krylov fields of its loads, and of the dual problems of the
        traces; and the values of these fields in the conductor."""
        heat, conductor, response = self._answer.heat, base.conductor, self._answer.response
        assert response is not None
        fewer, tolerance = (FEWER, study.accuracy**0.5) if number < -1 else (0, study.accuracy)
        earliest, duals = min(study.earliest, study.end), list[np.ndarray | None]()
        # The place of an extreme moves: its dual problems are of its places at some times.
        rises = response.transient.rises(np.geomspace(earliest, study.end, 8))
        for probe in (heat.domain.probes[name] for name in dict.fromkeys(study.trace_goals.values())):
            duals += [goal_row(heat, probe, rise) for rise in rises]
            if probe.quantity == "heat_flow":
                duals += [heat.reaction_rows[name][1] for name in reading(heat, probe).boundaries]
        if conductor is not None and conductor.warms:
            # A current follows the temperature by the resistivity times the heat of each pair of current fields.
            cold, warm = 0 * base.heat.unit, base.heat.unit
            for a, b in combinations_with_replacement([p.density for p in base.patterns], 2):
                duals.append(conductor.joule_load(a, warm, b) - conductor.joule_load(a, cold, b))
        loads = [row for row in duals if row is not None and row.any()]
        dual, count = replace(base, fields=base.fields[:, :0], loads=loads), response.generations - fewer
        # The errors of both multiply: half as many generations of the dual fields suffice, and of these what matters.
        halves = (base, count), (dual, count // 2)
        fields, rows = (Krylov(each, self._shift, earliest).fields(generations) for each, generations in halves)
        # The residual of the moment matters too: the dual problems begin before the first time of interest.
        times = np.geomspace(earliest / 10, study.end, 2 + int(np.log2(10 * study.end / earliest)))
        reduced = base.project(np.column_stack([fields, _essential(dual, rows, times, tolerance)]))
        return reduced, None if conductor is None else conductor.on.value(base.heat.field(reduced.basis.T))


def _essential(base: Base, fields: np.ndarray, times: np.ndarray, tolerance: float) -> np.ndarray:
    """(free nodes, fewer): the sums of mass-orthonormal fields (free nodes, k) in which the solutions of
    (M + t K) u = load for the loads of a base are at all times to a relative tolerance."""
    rates, modes = np.linalg.eigh(fields.T @ (base.heat.inner_stiffness @ fields))
    loads = [load[: base.heat.free] @ fields @ modes for load in base.loads]
    solutions = np.array([load / (1 + time * rates) for load in loads if load.any() for time in times])
    if not len(solutions):
        return fields[:, :0]
    _, sizes, sums = np.linalg.svd(solutions / np.linalg.norm(solutions, axis=1, keepdims=True), full_matrices=False)
    return fields @ (modes @ sums[sizes > tolerance].T)


def _corrected(solve: Solver, conductor: Conductor) -> Solver:
    """Return a solver of a cold conductor by one of a conductor near it, to the cube of their difference."""

    def solved(load: np.ndarray) -> np.ndarray:
        solution, matrix = solve(load), conductor.system(conductor.matrix)
        for _ in range(2):
            solution = solution + solve(load - (matrix @ solution.T).T)
        return solution

    return solved
