"""What constants of the 3D engine are good for: how much the element leaves of an edge, against what its estimator says
is left (`fem3d.adaptivity.estimate.lag`); how many unknowns random scenes take with other values of those that place
cells, and how long scenes with laws at other values of those that iterations take steps by; and how true errors compare
with stated ones at other values of those that errors are made with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from time import process_time
from typing import Any

import numpy as np

from validate.pool import side_by_side
from validate.processes import TimeIsUpError, limited
from validate.stress.report import Row

GROUP = "constants"
DEGREES = ((4, 4), (5, 5), (6, 6), (5, 4), (4, 3), (4, 2), (5, 3), (6, 3))  # along x and y
ASPECTS = ((1.0, 1.0), (4.0, 1.0), (4.0, 4.0))  # lengths along x, before and behind the edge, of cells 1 wide
PLACING = {
    "meshes.grading.LAYERS": (25.0, 225.0), "meshes.grading.FAR": (30.0, np.inf), "meshes.grading.AT_ONCE": (1, 6),
    "fem3d.adaptivity.brick_mesh.AIM": (0.25, 1.0),
}  # fmt: skip
STEPPING = {
    "fem3d.solution.newton.SLOW": (0.03, 0.3), "fem3d.solution.newton.SECANTS": (1, 10),
    "fem3d.solution.newton.AROUND": (0.02, 0.1), "fem3d.solution.newton.NEXT_TO": (1e-3, 1e-1),
    "fem3d.solution.newton.WORSE": (1.1, 3.0), "fem3d.solution.slight.SLIGHT": (0.0, 0.1),
    "fem3d.adaptivity.suited.LOWER": (1, 3), "fem3d.adaptivity.suited.SHARE": (0.1, 1.0),
}  # fmt: skip
STATING = {
    "fem3d.adaptivity.estimate.LEAST_SEEN": (0.0, 1.0), "fem3d.adaptivity.estimate.LENGTHY": (1.0, np.inf),
    "fem3d.adaptivity.goal_errors.OF_WORST": (0.0, 0.5),
}  # fmt: skip
"""Constants by module and name, with other values than those in use."""
COUNT = 12  # random scenes: each is solved some thirty times
LONGEST, PATIENCE = 10, 5  # s that a scene with laws may take here, and times that by the clock
COSTLIER = 1.25  # the value in use may take at most this factor times what any other value takes

Angular = Callable[[np.ndarray], np.ndarray]
Measure = Callable[[range], dict[int, Any]]
Case = tuple[Measure, str, float]  # what is measured, with which constant of which value; "": with those in use


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
    seeds = range(first, first + COUNT)
    groups: tuple[tuple[Measure, dict[str, tuple[float, float]]], ...] = (
        (unknowns, PLACING), (seconds, STEPPING), (errors, STATING)
    )  # fmt: skip
    cases: list[Case] = []
    for measure, constants in groups:
        cases += [(measure, "", 0.0), *((measure, name, v) for name, values in constants.items() for v in values)]
    measured = dict(side_by_side(partial(_measured, cases, seeds), range(len(cases)), jobs))
    usual = {cases[i][0]: seen for i, seen in measured.items() if not cases[i][1]}
    for i, (measure, name, value) in enumerate(cases):
        if measure is errors:
            yield _stated(seeds, measured[i], name, value)
        elif name:
            yield _compared(seeds, measure, usual[measure], measured[i], f"{name} of {value:g}")


def _measured(cases: list[Case], seeds: range, number: int) -> dict[int, Any]:
    measure, name, value = cases[number]
    if not name:
        return measure(seeds)
    with other(name, value):
        return measure(seeds)


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


def _compared(seeds: range, measure: Measure, usual: dict[int, Any], others: dict[int, Any], what: str) -> Row:
    """The row of what scenes take with the value in use, over what they take with another one."""
    both = [s for s in usual if s in others]
    ratio = sum(usual[s] for s in both) / max(sum(others[s] for s in both), 1e-300)
    unit = "unknowns of all levels" if measure is unknowns else "processor time"
    kind = "steady scenes" if measure is unknowns else "steady scenes with laws"
    return Row(GROUP, what, f"{len(both)} {kind}, seeds {seeds[0]} to {seeds[-1]}",
               f"{unit} with the value in use over that with this", ratio, COSTLIER,
               said=f"{len(usual)} solved, {len(others)} with this")  # fmt: skip


def _stated(seeds: range, seen: dict[int, tuple[float, float]], name: str, value: float) -> Row:
    """The row of the errors stated with a value of a constant, or with those in use."""
    violations, paddings = zip(*seen.values(), strict=True)
    known = [padding for padding in paddings if padding < np.inf]
    return Row(GROUP, f"{name} of {value:g}" if name else "the values in use",
               f"{len(seen)} steady scenes, seeds {seeds[0]} to {seeds[-1]}", "true over stated error, largest",
               max(violations), 1.0, not name,
               said=f"stated over true error where that is least: {np.median(known):.3g} in the median")  # fmt: skip


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


def unknowns(seeds: range) -> dict[int, int]:
    """For each steady scene that is solved the unknowns of all levels."""
    from fem3d.runs.scene import solve
    from scenes.errors import NumericsError
    from validate.stress.random_scenes import draw

    taken = {}
    for seed in seeds:
        said: list[str] = []
        if (scene := draw(seed).scene).steady:
            try:
                solve(scene, said.append)
            except NumericsError:
                continue
            taken[seed] = sum(int(line.split()[-2]) for line in said if line.endswith(" unknowns"))
    return taken


def seconds(seeds: range) -> dict[int, float]:
    """For each steady scene with laws that is solved soon the processor time (s)."""
    from fem3d.runs.scene import solve
    from scenes.errors import NumericsError
    from validate.stress.random_effects import draw

    taken = {}
    for seed in seeds:
        try:
            with limited(LONGEST, PATIENCE * LONGEST):
                if (scene := draw(seed).scene).steady:
                    started = process_time()
                    solve(scene)
                    taken[seed] = process_time() - started
        except (NumericsError, TimeIsUpError):
            continue
    return taken


def errors(seeds: range) -> dict[int, tuple[float, float]]:
    """For each steady scene that is solved `invariants.compared` with one ten times finer."""
    from scenes.errors import NumericsError
    from validate.stress import invariants
    from validate.stress.random_scenes import draw

    seen = {}
    for drawn in map(draw, seeds):
        if drawn.scene.steady:
            try:
                seen[drawn.seed] = invariants.compared(drawn, invariants.solve(drawn.scene), 10.0)
            except NumericsError:
                continue
    return seen
