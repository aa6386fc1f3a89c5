"""Derivatives of quantities by the keys of a scene: differences on a moved mesh.

With f(x) the quantity at a key larger by a relative step x, and two steps a and b, usually h and -h, the derivative of
the parabola through f(0), f(a) and f(b) is

    D = (b D_a - a D_b) / (b - a),    D_a = (f(a) - f(0)) / a,

for h and -h the central difference. Its distance from D_a bounds the truncation error. A steady state beside another
one is solved to the first order in h (`fem3d.solution.tangent`), as terms of the second order cancel. The error of
space is estimated in the next lower space: all solutions share their cells, so that the difference D_a is a smooth
function of the mesh, and converges as the quantities do. Steady quantities are differentiated in logarithms, which are
straight for powers.

Transients are projected on the same fields for all values of a key: Krylov fields of the loads, and of the dual
problems of the traces. A trace is then off by the product of the errors of both solutions, and the change of the fields
by the key matters to second order alone (Becker and Rannacher, Acta Numerica 10, 2001).

The mesh moves with the faces of another scene that has the same parts. Each axis is mapped by itself: a plane of faces
goes where its faces go, and coordinates between two planes move in proportion. Bricks stay bricks, and cells, functions
and unknowns stay the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np

from fem3d.adaptivity import nested
from fem3d.adaptivity.estimator import left
from fem3d.adaptivity.goal_errors import goal_row
from fem3d.adaptivity.marched import hold, searched
from fem3d.adaptivity.mesh import Answer
from fem3d.adaptivity.nested import Problems
from fem3d.results import outputs
from fem3d.results.outputs import Study
from fem3d.results.probes import reading
from fem3d.solution import transient
from fem3d.solution.reduced import orthonormal
from fem3d.solution.tangent import Tangent
from fem3d.solution.transient import Base, Krylov
from fem3d.spaces import edge_exponents
from fem3d.spaces.bricks import BrickSpace
from fem3d.spaces.domain import Domain, box_cells, boxes, groups
from meshes import grading
from meshes.grouped.check import Placed
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import NumericsError, SceneError
from scenes.model import ROUNDING, AnyScene, MeshScene, Scene
from scenes.result import Estimate

TOGETHER = 1e-6
"""Faces in one plane move together where their displacements differ by less than this fraction of the largest one."""


def move(domain: Any, part: Symmetry, other: Symmetry) -> Domain:
    """Return the domain of another scene on the cells of a scene's domain, moved.

    Parameters
    ----------
    domain : the domain of ``part``
    part, other : the parts of both scenes that are solved

    Raises
    ------
    SceneError
        if no such motion exists: faces in one plane move apart or past others, or a part or a symmetry is lost
    """
    alike = [p[::2] for p in part.planes] == [p[::2] for p in other.planes]
    if not alike or _names(part.scene) != _names(other.scene):
        raise SceneError("the scene loses a mirror plane or a part when it changes")
    scene: Any = other.scene
    if isinstance(scene, MeshScene):
        return groups(Placed(scene, domain.placed.mesh), domain.space.p)
    maps = [_planes(part.scene, scene, axis) for axis in range(3)]
    if not isinstance(domain.space, BrickSpace):
        mesh = domain.space.mesh
        points = np.array([np.interp(x, *each) for x, each in zip(mesh.p, maps, strict=True)])
        return box_cells(scene, replace(mesh, doflocs=points), domain.space.p)
    grid = domain.space.grid
    breaks = tuple(np.interp(x, *each) for x, each in zip(grid.breaks, maps, strict=True))
    return boxes(scene, replace(grid, breaks=breaks, boxes=scene.boxes))


def _planes(scene: Any, other: Any, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (m) of the planes across an axis, ascending, in a scene and in another one."""
    pairs = np.array(sorted(_faces(scene, other, axis)))
    extent, largest = np.ptp(pairs[:, 0]), np.abs(pairs[:, 1] - pairs[:, 0]).max()
    at, to = [pairs[0, 0]], [pairs[0, 1]]
    for before, after in pairs[1:]:
        if before - at[-1] > ROUNDING * extent:
            at.append(before)
            to.append(after)
        elif abs((after - before) - (to[-1] - at[-1])) > TOGETHER * largest + ROUNDING * ROUNDING * extent:
            raise SceneError(f"faces at {'xyz'[axis]} = {before:.6g} m lie in one plane and move apart")
    if (np.diff(to) <= 0).any():
        raise SceneError(f"faces across {'xyz'[axis]} move past each other")
    return np.array(at), np.array(to)


def _faces(scene: Scene, other: Scene, axis: int) -> Iterator[tuple[float, float]]:
    """Coordinates along an axis of all faces inside the extent of a scene's boxes, and the same in another scene."""
    extent = [c for box in scene.boxes for c in (box.lower[axis], box.upper[axis])]
    low, high = min(extent), max(extent)
    small = ROUNDING * (high - low)
    extended = [(p, q) for p, q in zip(scene.probes, other.probes, strict=True) if p.lower != p.upper]
    items: list[tuple[Any, Any]] = [
        *zip(scene.boxes, other.boxes, strict=True),
        *zip(scene.boundaries, other.boundaries, strict=True),
        *extended,
    ]  # fmt: skip
    for a, b in items:
        for p, q in ((a.lower[axis], b.lower[axis]), (a.upper[axis], b.upper[axis])):
            if low - small <= p <= high + small:
                yield p, q


def _names(scene: AnyScene) -> list[str]:
    parts: tuple[Any, ...] = getattr(scene, "boxes", ())
    return [item.name for items in (parts, scene.boundaries, scene.probes) for item in items]


STEP = 2.0**-10
"""Relative step of a key: a parabola is then off by some 1e-6 of a derivative."""
NOISE = 1e-8
"""Relative error that rounding in two solutions leaves in their difference over the step."""
FEWER = 2
"""Generations of Krylov fields that the lower space takes less, to show the error of leaving out fields."""
MARCHED = 1e-8
"""Relative error of time steps, which is divided by the step."""
SMALL = 0.1
"""Relative change of a quantity up to which its logarithm is differentiated; larger ones are of values near zero."""

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


class Point(NamedTuple):
    """The values of a scene, and if needed its values in the next lower space, in fewer Krylov fields."""

    fine: Values
    low: Values | None = None


def sensitivities(
    study: Study,
    answer: Answer,
    known: Mapping[str, Estimate],
    keys: Mapping[str, Vary],
    rows: Any = None,
) -> Sensitivities:
    """Return the derivatives of an answer by keys.

    Parameters
    ----------
    study : the study of the answer, with rises in place of temperatures
    known : the steady quantities to differentiate, with their errors
    keys : by key the function that makes the study of a scene next to the answer's
    rows : (places, functions) that sample the rise, for ``Sensitivities.profile``

    Raises
    ------
    NumericsError
        if the scene itself cannot be solved again
    """
    solver = _Solver(study, answer, rows)
    base = solver.base
    steady, course = Table(), Course(solver.times, base.fine.traces, {}, {})
    profile, left_out = dict[str, np.ndarray](), dict[str, str]()
    for key, vary in keys.items():
        try:
            found = difference(base, partial(solver.beside, vary), solver.edges)
        except (SceneError, NumericsError) as error:
            left_out[key] = str(error)
            continue
        steady[key] = {name: found.logarithmic(name, e) for name, e in known.items()}
        if rows is not None:
            profile[key] = found.slope(lambda values: values.profile)[0]
        traces = {name: found.of_trace(name) for name in base.fine.traces}
        course.values[key] = {name: value for name, (value, _) in traces.items()}
        course.errors[key] = {name: error for name, (_, error) in traces.items()}
    return Sensitivities(steady, dict(known), None if answer.response is None else course, profile, left_out)


@dataclass(frozen=True, eq=False)
class Difference:
    """A scene and two neighbours, whose key differs by the relative ``steps``; ``edges`` is the ratio of the error of
    space to the change by the lower space."""

    base: Point
    steps: tuple[float, float]
    points: tuple[Point, Point]
    edges: float

    def slope(self, read: Callable[[Values], Any]) -> tuple[Any, Any]:
        """Return the derivative of a reading, and its error."""
        (a, b), zero = self.steps, read(self.base.fine)
        first, second = ((read(p.fine) - zero) / h for p, h in zip(self.points, self.steps, strict=True))
        slope = (b * first - a * second) / (b - a)
        low, base_low = self.points[0].low, self.base.low
        assert low is not None
        assert base_low is not None
        lower = (read(low) - read(base_low)) / a
        return slope, abs(slope - first) + self.edges * abs(first - lower)

    def logarithmic(self, name: str, known: Estimate) -> Estimate:
        """Return d ln quantity / d ln key, by differences of logarithms if these are small."""
        zero = self.base.fine.steady[name]
        changes = [p.fine.steady[name] / zero - 1 for p in self.points]
        if not any(changes):
            return Estimate(0.0, 0.0)
        if max(map(abs, changes)) < SMALL:
            slope, error = self.slope(lambda values: np.log(abs(values.steady[name])))
        else:
            slope, error = self.slope(lambda values: values.steady[name] / zero)
        rounding = NOISE * (1 + abs(float(slope)))
        return Estimate(float(slope), float(error) + known.error / abs(known.value) + rounding)

    def of_trace(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return d trace / d ln key (n,) and its error (n,), in the trace's unit."""
        slope, error = self.slope(lambda values: values.traces[name])
        return slope, error + MARCHED / STEP * np.abs(self.base.fine.traces[name]).max()


def difference(base: Point, solve: Callable[[float, bool], Point], edges: float) -> Difference:
    """Solve with a key changed on both sides, or twice on one side where the other has no solution.

    ``solve`` takes the relative step of the key, and whether the lower space is needed. Raises SceneError where a scene
    beside the base is not the same but for its numbers, and NumericsError where neither side has a solution.
    """
    solved, failure = list[tuple[float, Point]](), None
    for step in (STEP, -STEP, STEP / 2, -STEP / 2):
        try:
            solved.append((step, solve(step, not solved)))
        except NumericsError as error:
            failure = failure or error
        if len(solved) == 2:
            (a, one), (b, other) = solved
            return Difference(base, (a, b), (one, other), edges)
    assert failure is not None
    raise failure


class _Solver:
    """Values of scenes next to the scene of an answer, on its mesh, moved."""

    def __init__(self, study: Study, answer: Answer, rows: Any) -> None:
        self._answer, self._part, self._rows = answer, study.part, rows
        self.times = np.empty(0)
        if answer.response is not None:
            rows = answer.response.times
            self.times = np.union1d(rows[rows >= study.earliest], min(study.earliest, study.end))
            self._shift = transient.shift(min(study.end, answer.response.slowest), study.earliest)
            self._fields = dict[int, np.ndarray]()
            if answer.steady is None:
                self._base, self._hot = searched(answer.heat, answer.conductor, self._shift, study.end, study.accuracy)
        self.edges = 1.0
        if isinstance(study.part.scene, Scene):
            sharpest = edge_exponents.features(study.part.scene).sharpest
            self.edges = max(1.0, float(left(np.array([grading.LEAST_AT_EDGE]), np.array([4 * sharpest]))[0]))
        self._own: Problems | None = None
        self._own, self._tangents = self._moved(study), dict[int, Tangent]()
        if answer.steady is not None and physics.heat(study.part.scene):
            given, start = self._own, answer.steady.state.heat.field(answer.steady.state.rise)
            self._tangents = {
                k: Tangent(nested.solution(study, given, k, start=start).state, study.accuracy) for k in (-1, -2)
            }

        self.base = self._point(study, self._own, True)

    def beside(self, vary: Vary, step: float, lower: bool) -> Point:
        """Return the values of the scene whose key is larger by a relative step, in the ``lower`` space too."""
        study = vary(step)
        return self._point(study, self._moved(study), lower)

    def _point(self, study: Study, given: Problems, lower: bool) -> Point:
        return Point(self._values(study, given, -1), self._values(study, given, -2) if lower else None)

    def _moved(self, study: Study) -> Problems:
        """The problems of a scene on the mesh of the answer, moved."""
        given = nested.problems(move(self._answer.heat.domain, self._part, study.part), study.accuracy)
        for heat, conductor in zip(given.heats, given.conductors, strict=True):
            heat.ordering.share(self._answer.heat.ordering)
            if conductor is not None and self._answer.conductor is not None:
                conductor.ordering.share(self._answer.conductor.ordering)
        if self._own is not None:
            # The factors of the scene itself are near enough to start from and to correct by.
            for heat, own in zip(given.heats, self._own.heats, strict=True):
                heat.kept.tell(solve_steady=own.solve_steady)
            for conductor, known in zip(given.conductors, self._own.conductors, strict=True):
                if conductor is not None and known is not None:
                    near = known.kept.get("near", lambda: None) or known
                    conductor.kept.tell(near=near, cold_potentials=known.cold_potentials)
        return given

    def _values(self, study: Study, given: Problems, level: int) -> Values:
        """Solve in one of the nested spaces; over time in the fields of the base."""
        steady, profile, response = dict[str, float](), np.empty(0), self._answer.response
        if self._answer.steady is not None:
            tangent = self._tangents.get(level)
            if tangent is None:
                state = nested.solution(study, given, level).state
            else:
                state = tangent.state(given.heats[level], given.conductors[level])
            steady = {n: float(v) for n, v in study.steady(outputs.of_steady(state, study.part)).items()}
            if self._rows is not None:
                profile = self._rows @ state.heat.field(state.rise)
        if response is None:
            return Values(steady, profile, {})
        if self._answer.steady is not None:
            base = Base.of_steady(state, study.accuracy)
        else:
            base = hold(given.heats[level], given.conductors[level], self._hot, self._base.heat)
        if level not in self._fields:
            self._fields[level] = self._loads_and_duals(study, base, response.generations - FEWER * (level < -1))
        reduced = base.project(np.column_stack([base.fields, self._fields[level]]))
        marched = transient.march(base, reduced, study.end, MARCHED)
        return Values(steady, profile, study.traces(outputs.of_transient(marched, study.part, self.times)))

    def _loads_and_duals(self, study: Study, base: Base, generations: int) -> np.ndarray:
        """(free nodes, fields): the Krylov fields of the loads of a base, and of the dual problems of the traces."""
        heat, conductor, response = self._answer.heat, base.conductor, self._answer.response
        assert response is not None
        earliest, duals = min(study.earliest, study.end), list[np.ndarray | None]()
        # The place of an extreme moves: its dual problems are of its places at some times.
        rises = response.transient.rises(np.geomspace(earliest, study.end, 8))
        for probe in (heat.domain.probes[name] for name in dict.fromkeys(study.trace_goals.values())):
            duals += [goal_row(heat, probe, rise) for rise in rises]
            if probe.quantity == "heat_flow":
                duals += [heat.held_rows[name][1] for name in reading(heat, probe).boundaries]
        if conductor is not None and conductor.warms:
            # A current follows the temperature by the resistivity times the heat of each pair of current fields.
            cold, warm = 0 * base.heat.unit, base.heat.unit
            for a, b in combinations_with_replacement([p.density for p in base.patterns], 2):
                duals.append(conductor.joule_load(a, warm, b) - conductor.joule_load(a, cold, b))
        bare = replace(base, fields=base.fields[:, :0])
        dual = replace(bare, loads=[row for row in duals if row is not None and row.any()])
        # The errors of both multiply: half as many generations of the dual fields suffice.
        halves = (bare, generations), (dual, generations // 2)
        spaces = [Krylov(each, self._shift, earliest).fields(count) for each, count in halves]
        return orthonormal(base.heat, np.column_stack(spaces))
