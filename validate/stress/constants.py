"""What constants of the 3D engine are good for: how much the element leaves of an edge, against what its estimator says
is left (`fem3d.adaptivity.estimate.lag`); how many unknowns random scenes take with other values of those that place
cells, and how long scenes with laws with other values of those that iterations take steps by; and how true errors
compare with stated ones with other values of those that errors are made with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from importlib import import_module
from time import process_time
from typing import Any, Literal

import numpy as np

from compare.processes import TimeIsUpError, limited
from compare.worker import map_tasks
from validate.stress.random_scenes import Drawn
from validate.stress.report import Row

GROUP = "constants"
DEGREES = ((4, 4), (5, 5), (6, 6), (5, 4), (4, 3), (4, 2), (5, 3), (6, 3))  # along x and y
ASPECTS = ((1.0, 1.0), (4.0, 1.0), (4.0, 4.0))  # lengths along x, before and behind the edge, of cells 1 wide
Values = dict[str, tuple[float, float]]
"""Constants by module and name, with other values than those in use."""
PLACING: Values = {
    "meshes.grading.LAYERS": (25.0, 225.0), "meshes.grading.FAR": (30.0, np.inf), "meshes.grading.AT_ONCE": (1, 6),
    "meshes.edgewise.FALLS": (3.0, 30.0), "fem3d.adaptivity.brick_mesh.AIM": (0.25, 1.0),
    "fem3d.adaptivity.brick_mesh.MANY": (2e3, np.inf), "fem3d.adaptivity.reach.MANY": (300, 3e3),
}  # fmt: skip
PLACING_TETRAHEDRA: Values = {
    "fem3d.adaptivity.tetrahedra.FIRST": (0.1, 0.5), "fem3d.adaptivity.tetrahedra.AIM": (0.5, 0.9),
    "fem3d.adaptivity.tetrahedra.SECOND_GROWTH": (1.1, 1.5), "meshes.tiles.NEAR": (0.15, 0.5),
}  # fmt: skip
STEPPING: Values = {
    "fem3d.solution.newton.SLOW": (0.03, 0.3), "fem3d.solution.newton.SECANTS": (1, 10),
    "fem3d.solution.newton.AROUND": (0.02, 0.1), "fem3d.solution.newton.NEXT_TO": (1e-3, 1e-1),
    "fem3d.solution.newton.WORSE": (1.1, 3.0), "fem3d.solution.newton.OFF": (0.03, 0.3),
    "fem3d.solution.newton.ROUGH": (1e-3, 0.1), "fem3d.solution.newton.BETTER": (0.1, 1.0),
    "fem3d.solution.newton.INNER": (1e-4, 0.1),
    "fem3d.solution.slight.SLIGHT": (0.0, 0.1), "fem3d.solution.slight.QUADRATURE": (3e-3, 0.3),
    "fem3d.spaces.cut.ALIKE": (0.1, 0.6),
    "fem3d.adaptivity.suited.LOWER": (1, 3), "fem3d.adaptivity.suited.SHARE": (0.1, 1.0),
}  # fmt: skip
STATING: Values = {
    "fem3d.adaptivity.estimate.LEAST_SEEN": (0.0, 1.0), "fem3d.adaptivity.estimate.LENGTHY": (1.0, np.inf),
    "fem3d.adaptivity.goal_errors.OF_WORST": (0.0, 0.5),
}  # fmt: skip
STATING_OVER_TIME: Values = {
    "fem3d.adaptivity.trace_errors.FURTHER": (1.0, 5.0), "fem3d.adaptivity.trace_errors.ALIKE": (2.0, 10.0),
    "fem3d.adaptivity.law_response.ALIKE": (0.03, 0.3), "fem3d.adaptivity.law_response.FALLS": (0.1, 0.5),
}  # fmt: skip
STATING_TETRAHEDRA: Values = {
    "fem3d.adaptivity.estimate.LATER": (1.0, 3.0), "fem3d.adaptivity.estimate.LATER_IN_FLAT": (1.7, 5.0),
    "fem3d.adaptivity.estimate.FLAT": (6.0, 24.0), "fem3d.adaptivity.effectivity.FELL": (0.5, 1.0),
}  # fmt: skip
LONGEST, PATIENCE = 30, 5  # s that a scene may take here, with a finer solution if need be, and times that by the clock
FINER = 4.0  # times that the finer solutions are
COSTLIER = 1.25  # the value in use may take at most this factor times what any other value takes

Angular = Callable[[np.ndarray], np.ndarray]
Kind = Literal["boxes", "laws", "plates"]
Measure = Callable[[Drawn], Any]


@dataclass(frozen=True)
class Group:
    """Constants that are measured alike, on the scenes of a kind, at rest or over time, of ``count`` seeds."""

    measure: Measure
    kind: Kind
    over_time: bool
    count: int
    constants: Values
    first: int = 0

    @property
    def scenes(self) -> str:
        """What the scenes are, for a row."""
        kind = {"boxes": "scenes", "laws": "scenes with laws", "plates": "plates with pads"}[self.kind]
        rest = "over time" if self.over_time else "at rest"
        return f"{kind} {rest}, seeds {self.first} to {self.first + self.count - 1}"

    def measured(self) -> dict[int, Any]:
        """What is measured of each of the scenes that are solved soon, by seed."""
        from scenes.errors import NumericsError
        from validate.stress import random_effects, random_plates, random_scenes

        draw = {"boxes": random_scenes.draw, "laws": random_effects.draw, "plates": random_plates.draw}[self.kind]
        known = {}
        for seed in range(self.first, self.first + self.count):
            try:
                with limited(LONGEST, PATIENCE * LONGEST):
                    if (drawn := draw(seed)).scene.steady != self.over_time:
                        known[seed] = self.measure(drawn)
            except (NumericsError, TimeIsUpError):
                continue
        return known


Case = tuple[Group, str, float]  # what is measured, with which constant of which value; "": with those in use


@dataclass(frozen=True)
class Edge:
    """A distance to the power ``exponent`` times a function of the angle, known with its derivative, in some quadrants
    about an edge, each with its conductivity; at the angles ``held`` the value is given as zero."""

    exponent: float
    conductivity: dict[int, float]
    angular: dict[int, tuple[Angular, Angular]]
    held: tuple[float, ...] = ()


def rows(quick: bool, first: int = 0, jobs: int = 1) -> Iterator[Row]:
    """What edges leave, for each of some exponents, and what other values cost in scenes from a seed on."""
    for edge in edges():
        ratios = {(d, a): off(edge, d, a) for d in DEGREES for a in ASPECTS}
        worst = max(ratios, key=lambda case: ratios[case])
        extremes = f"exponent {edge.exponent:.2f}, degrees of 2 to 6, cells up to 4 times longer than wide"
        yield Row(GROUP, "what the element leaves of an edge", extremes, "true over estimated", ratios[worst], 1.0,
                  said=f"worst: degrees {worst[0]}, lengths {worst[1]}")  # fmt: skip
    if quick:
        return
    cases: list[Case] = [
        (group, name, value)
        for group in (replace(each, first=first) for each in groups())
        for name, values in {"": (0.0,), **group.constants}.items()
        for value in values
    ]
    measured = dict(map_tasks(partial(_measured, cases), range(len(cases)), jobs))
    usual = {(cases[i][0].measure, cases[i][0].scenes): seen for i, seen in measured.items() if not cases[i][1]}
    for i, (group, name, value) in enumerate(cases):
        if group.measure is errors:
            if measured[i] or not name:  # no scene may be in time
                yield _stated(group, measured[i], name, value)
        elif name:
            yield _compared(group, usual[group.measure, group.scenes], measured[i], f"{name} of {value:g}")


def groups() -> list[Group]:
    """All of them; scenes are solved once for each value of each constant, so there are few."""
    return [
        Group(unknowns, "boxes", False, 12, PLACING), Group(unknowns, "plates", False, 3, PLACING_TETRAHEDRA),
        Group(seconds, "laws", False, 12, STEPPING), Group(errors, "boxes", False, 12, STATING),
        Group(errors, "laws", True, 12, STATING_OVER_TIME), Group(errors, "plates", False, 3, STATING_TETRAHEDRA),
    ]  # fmt: skip


def _measured(cases: list[Case], number: int) -> dict[int, Any]:
    group, name, value = cases[number]
    with other(name, value) if name else nullcontext():
        return group.measured()


@contextmanager
def other(name: str, value: float) -> Iterator[None]:
    """Another value of a constant, by its module and name, for as long as it takes."""
    path, constant = name.rsplit(".", 1)
    module = import_module(path)
    before = vars(module)[constant]
    try:
        setattr(module, constant, value)
        yield
    finally:
        setattr(module, constant, before)


def _compared(group: Group, usual: dict[int, Any], others: dict[int, Any], what: str) -> Row:
    """The row of what scenes take with the value in use, over what they take with another one."""
    both = [s for s in usual if s in others]
    ratio = sum(usual[s] for s in both) / max(sum(others[s] for s in both), 1e-300)
    unit = "unknowns of all levels" if group.measure is unknowns else "processor time"
    return Row(GROUP, what, f"{len(both)} {group.scenes}", f"{unit} with the value in use over that with this", ratio,
               COSTLIER, said=f"{len(usual)} solved, {len(others)} with this")  # fmt: skip


def _stated(group: Group, seen: dict[int, tuple[float, float]], name: str, value: float) -> Row:
    """The row of the errors stated with a value of a constant, or with those in use."""
    violations, paddings = zip(*seen.values(), strict=True) if seen else ((np.inf,), ())
    known = [padding for padding in paddings if padding < np.inf]
    said = f"stated over true error where that is least: {np.median(known):.3g} in the median" if known else ""
    return Row(GROUP, f"{name} of {value:g}" if name else f"the values in use, {group.kind}",
               f"{len(seen)} {group.scenes}", "true over stated error, largest", max(violations), 1.0, not name,
               said=said)  # fmt: skip


def edges() -> list[Edge]:
    """A re-entrant edge; ends of a given value, on a plane and at such an edge; good and bad conductors in turns."""

    def sine(s: float) -> tuple[Angular, Angular]:
        return lambda t: np.sin(s * t), lambda t: s * np.cos(s * t)

    edges = [Edge(s, dict.fromkeys(range(count), 1.0), dict.fromkeys(range(count), sine(s)), held)
             for s, count, held in ((2 / 3, 3, (0.0, 1.5 * np.pi)), (0.5, 2, (0.0,)), (1 / 3, 3, (0.0,)))]  # fmt: skip
    return [*edges, *(_in_turns(contrast) for contrast in (30.0, 100.0))]


def _in_turns(contrast: float) -> Edge:
    s = 4 / np.pi * float(np.arctan(contrast**-0.5))
    high = np.cos(s * np.pi / 4) / np.sin(s * np.pi / 4)

    def angular(i: int) -> tuple[Angular, Angular]:
        middle, sign = (i + 0.5) * np.pi / 2, (1.0, -1.0, -1.0, 1.0)[i]
        if i % 2 == 0:
            return lambda t: sign * np.cos(s * (t - middle)), lambda t: -sign * s * np.sin(s * (t - middle))
        return lambda t: sign * high * np.sin(s * (t - middle)), lambda t: sign * high * s * np.cos(s * (t - middle))

    return Edge(s, {i: contrast if i % 2 == 0 else 1.0 for i in range(4)}, {i: angular(i) for i in range(4)})


def off(edge: Edge, degrees: tuple[int, int], lengths: tuple[float, float]) -> float:
    """The true error of the energy over the estimated one, on one layer of cells about the edge whose outer faces get
    the exact flux."""
    from scipy.sparse.linalg import spsolve

    from fem3d.adaptivity import estimate
    from fem3d.adaptivity.estimate import Estimator, Parts, Spread
    from fem3d.spaces.bricks import BrickSpace
    from meshes.grading import Features
    from meshes.grid import Grid
    from scenes.model import Box
    from scenes.sink import SILICON

    (before, behind), s = lengths, edge.exponent
    at_x, at_y = ((0.0, behind), (-before, 0.0)), ((0.0, 1.0), (-1.0, 0.0))
    corners = {0: (0, 0), 1: (1, 0), 2: (1, 1), 3: (0, 1)}
    boxes = []
    for i in edge.conductivity:
        (x, far_x), (y, far_y) = at_x[corners[i][0]], at_y[corners[i][1]]
        boxes.append(Box(str(i), SILICON, (x, y, 0.0), (far_x, far_y, 1.0)))
    breaks = np.array([-before, 0.0, behind]), np.array([-1.0, 0.0, 1.0]), np.array([0.0, 1.0])
    p, q = degrees
    grid = Grid(breaks, (np.array([p, p]), np.array([q, q]), np.array([2])), tuple(boxes))
    space: Any = BrickSpace(grid)
    quadrant = grid.owner[tuple(space.ijk)]
    conductivity = np.array([edge.conductivity[i] for i in quadrant.tolist()])
    matrix = space.stiffness(conductivity, np.arange(len(quadrant)))
    mesh = space.mesh
    middles = mesh.p[:, mesh.facets].mean(axis=1)
    outer = np.flatnonzero(np.isclose(middles[0], -before) | np.isclose(middles[0], behind)
                           | np.isclose(np.abs(middles[1]), 1.0))  # fmt: skip
    faces, cells = space.faces(outer, mesh.f2t[0, outer]), mesh.f2t[0, outer]
    x, y, _ = faces.points
    r, turn = np.hypot(x, y), (quadrant[cells, None] + 0.5) * np.pi / 2
    angle = turn + np.mod(np.arctan2(y, x) - turn + np.pi, 2 * np.pi) - np.pi
    value, slope = (np.array([edge.angular[i][k](t) for i, t in zip(quadrant[cells].tolist(), angle, strict=True)])
                    for k in (0, 1))  # fmt: skip
    across_x = ~np.isclose(np.abs(middles[1, outer]), 1.0)[:, None]
    normal = np.where(across_x, np.sign(x), 0.0), np.where(across_x, 0.0, np.sign(y))
    radial, around = (normal[0] * x + normal[1] * y) / r, (normal[1] * x - normal[0] * y) / r
    flux = conductivity[cells, None] * r ** (s - 1) * (s * value * radial + slope * around)
    load = faces.load(flux)
    energy = float((faces.areas * flux * r**s * value).sum())
    fixed = np.zeros(space.size, bool)
    for held in edge.held:
        towards = np.cos(held) * middles[0] + np.sin(held) * middles[1]
        aside = np.cos(held) * middles[1] - np.sin(held) * middles[0]
        on = np.flatnonzero(np.isclose(aside, 0.0) & (towards > 0))
        fixed |= space.faces(on, mesh.f2t[0, on]).functions
    fixed[space.dofs[:8][np.isclose(mesh.p[:2, mesh.t], 0.0).all(axis=0)]] = True
    solved = []
    for mask in space.nested:
        free, u = np.flatnonzero(mask & ~fixed), np.zeros(space.size)
        u[free] = spsolve(matrix[free][:, free].tocsc(), load[free])
        solved.append(u)

    def took(k: int) -> Spread:
        new = np.flatnonzero(space.nested[k] & ~space.nested[k - 1] & ~fixed)
        return space.spread(new, (solved[k] * (load - matrix @ solved[k - 1]))[new])

    marks = Features((frozenset({0.0}), frozenset({0.0}), frozenset()), ({0.0: s}, {0.0: s}, {}))
    nothing = [np.zeros(len(d)) for d in grid.degrees]
    said = estimate.total(Estimator.of_grid(grid, marks).remains(Parts(took(1), took(2), nothing)))
    return (energy - float(load @ solved[-1])) / said


def unknowns(drawn: Drawn) -> int:
    """The unknowns of all levels of a scene."""
    from fem3d.runs.scene import solve

    said: list[str] = []
    solve(drawn.scene, said.append)
    return sum(int(line.split()[-2]) for line in said if line.endswith(" unknowns"))


def seconds(drawn: Drawn) -> float:
    """The processor time (s) of a scene."""
    from fem3d.runs.scene import solve

    started = process_time()
    solve(drawn.scene)
    return process_time() - started


def errors(drawn: Drawn) -> tuple[float, float]:
    """`invariants.compared` with a finer solution."""
    from validate.stress import invariants

    return invariants.compared(drawn, invariants.solve(drawn.scene), FINER)
