"""Observed orders of convergence in space, of this project's bricks of any degree on manufactured solutions.

Errors are norms of the rise (and of the potential) in L2 and H1, of a weighted mean, and of the power.

The order in unknowns of the current of an L-shaped conductor on tetrahedra that are refined where needed.

At the inner corner the potential goes like r^(2/3), so that cells of size h miss h^(4/3) of the current whatever their
degree (Strang and Fix, An Analysis of the Finite Element Method, chapter 8). Uniform cells number h^-3; where cells
along the edge alone are halved, their number goes like 1/h, and less fast where cells stay long along it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import spsolve

from benchmarks.rows import Row
from fem3d.adaptivity.adapt import Refinement, indicators
from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.runs import scene as scene_run
from fem3d.solution import steady, transient
from fem3d.solution.transient import Base, Krylov
from fem3d.spaces.domain import box_domain
from meshes.grid import Grid
from scenes.model import Boundary, Box, Material, Probe, Scene
from validate.verify import manufactured
from validate.verify.expected import observed_order, order_row
from validate.verify.manufactured import LAYER, SIZE, Heating, Manufactured

PLANES = ((0.0, 0.45, SIZE[0]), (0.0, 0.35, SIZE[1]), (0.0, LAYER, SIZE[2]))
FINER = 3  # Gauss points more than usual along each axis, at which errors are integrated
PICARD, SETTLED = 200, 1e-13
Errors = dict[str, float]
FAMILY = "observed orders of convergence in space"
CUTS = {1: (4, 6), 2: (4, 6), 3: (5, 6), 4: (3, 4), 5: (3, 4), 6: (2, 3)}  # of two intervals an axis, by degree
COUPLED_CUTS = CUTS | {4: (4, 5)}  # the rise comes within the tolerance of its order from 4 cuts on only
TRANSIENT_CUTS = {1: (4, 8), 2: (3, 6), 3: (3, 4), 4: (2, 3)}
MEANS = (1, 2, 4)  # degrees: means take finer meshes at 3, and drown in rounding from 5 on
CASE = "L-shaped conductor, tetrahedra of degree 3"
WIDTH, ARM = 1e-5, 4  # m; in widths
FIRST, LAST = 1_000, 10_000  # unknowns: on fewer all cells are refined; from LAST on a mesh is the last


def bricks(solution: Manufactured | Heating, *degrees: int) -> Iterator[Row]:
    """Refine this project's bricks on a steady solution, or on a transient, the worst of some instants.

    In theory the order is p + 1 in L2, p in H1, 2 p for the power and for means with a smooth weight (Strang and Fix,
    chapter 3).
    """
    for degree in degrees:
        if isinstance(solution, Manufactured):
            kind, cuts = "steady", (COUPLED_CUTS if solution.potential else CUTS)[degree]
            coarse, fine = (on_bricks(solution, degree, n) for n in cuts)
        else:
            kind, cuts = "transient", TRANSIENT_CUTS[degree]
            times = np.array([0.1, 0.5, 2.0]) / solution.modes[0][0]
            coarse, fine = (on_bricks_over_time(solution, degree, n, times) for n in cuts)
        for quantity in coarse:
            norm = quantity[-2:]
            # The weight suits the dual problem of conduction; the dual of the coupled problem is less smooth with it.
            means = degree in MEANS and not ("power" in coarse and (quantity == "mean" or degree > 2))
            # At degree 3 the potential's part of the next order is as large: 4.21 in L2 from 2 to 3 cuts.
            if not (means or norm in ("L2", "H1")) or (degree == 3 and quantity.startswith("potential")):
                continue
            theory = {"L2": degree + 1, "H1": degree}.get(norm, 2 * degree)
            order = observed_order([coarse[quantity], fine[quantity]], cuts[1] / cuts[0])
            named = "weighted mean" if quantity == "mean" else quantity
            yield order_row(FAMILY, f"brick, {kind}, {solution.name}, degree {degree}", named, theory, order)


def _mesh(scene: Scene, degree: int, cuts: int) -> Grid:
    """Two unequal intervals along each axis, each cut into ``cuts`` equal parts."""
    breaks = [
        np.append(np.concatenate([np.linspace(a, b, cuts, endpoint=False) for a, b in pairwise(planes)]), planes[-1])
        for planes in PLANES
    ]
    return Grid(tuple(breaks), tuple(np.full(2 * cuts, degree) for _ in range(3)), scene.boxes)


def on_bricks(solution: Manufactured, degree: int, cuts: int) -> Errors:
    heat = assemble(box_domain(solution.scene, _mesh(solution.scene, degree, cuts)))
    load = _load(heat, solution)
    if solution.potential is None:
        return _distances(heat, heat.whole(heat.solve_steady(load[: heat.free])), solution)
    rise, errors = _coupled(heat, solution, load)
    return _distances(heat, heat.whole(rise), solution) | errors


def on_bricks_over_time(heating: Heating, degree: int, cuts: int, times: np.ndarray) -> Errors:
    """The largest errors over some times (s) of a transient, by the product's own Krylov fields and time stepping.

    The fields and the tolerance are such that the error of space dominates.
    """
    heat = assemble(box_domain(heating.scene, _mesh(heating.scene, degree, cuts)))
    heat = replace(heat, loads=_load(heat, heating.at(np.inf))[None])
    base = Base.of_steady(steady.solve_steady(heat, None, 0.0, 1e-13))
    fields = Krylov(base, transient.shift(1 / heating.modes[0][0], float(times[0]))).fields(12)
    answer = transient.march(base, base.project(fields), float(times[-1]), 1e-12)
    errors = [_distances(heat, rise, heating.at(t)) for t, rise in zip(times, answer.rises(times), strict=True)]
    return {name: max(each[name] for each in errors) for name in errors[0]}


def _load(heat: HeatProblem, solution: Manufactured) -> np.ndarray:
    """(all dofs,): the manufactured loads and the loads of the scene (W)."""
    domain = heat.domain
    on: Any = domain.space.on(np.arange(len(domain.body)))
    load = on.load(solution.f(*on.points))
    for boundary, entering in solution.loads():
        face: Any = domain.faces(boundary)
        load += sum(cells.load(entering(*cells.points)) for _, cells, _ in face.sides)
    return heat.loads[0] + heat.take(load)


def _distances(heat: HeatProblem, rise: np.ndarray, solution: Manufactured) -> Errors:
    on, u = _finely(heat), heat.field(rise)
    return solution.distances(on.weights, on.points, on.value(u), on.gradient(u))


def _finely(heat: HeatProblem) -> Any:
    space: Any = heat.domain.space
    return space.on(np.arange(len(heat.domain.body)), FINER)


def _coupled(heat: HeatProblem, solution: Manufactured, load: np.ndarray) -> tuple[np.ndarray, Errors]:
    """The rise with its Joule heat, by Picard's iteration, and the errors of the potential and the power."""
    conductor = conductors.assemble_conductor(heat)
    assert conductor is not None
    assert solution.potential is not None
    fixed = _on_electrodes(conductor, solution)
    rise, electric = np.zeros(heat.free), conductor.solve(np.zeros(heat.free), fixed)
    for _ in range(PICARD):
        electric = conductor.solve(rise, fixed, electric.potential)
        old, rise = rise, heat.solve_steady((load + conductor.joule_load(electric.density, rise))[: heat.free])
        if np.abs(rise - old).max() <= SETTLED * np.abs(rise).max():
            break
    on, phi = _finely(heat), electric.potential
    exact = solution.potential
    errors = manufactured.norms("potential", on.weights, on.value(phi), on.gradient(phi), exact, on.points)
    return rise, errors | {"power": abs(float(phi @ conductor.on.flow(electric.density)) + solution.power())}


def _on_electrodes(conductor: Conductor, solution: Manufactured) -> np.ndarray:
    """(functions,): the manufactured potential, which varies along the electrodes, projected on their functions; the
    scene's electrodes have one voltage each."""
    assert solution.potential is not None
    domain = conductor.heat.domain
    faces: list[Any] = [domain.faces(b) for b in domain.scene.boundaries if b.kind == "voltage"]
    on = np.flatnonzero(np.any([face.functions for face in faces], axis=0))
    mass = sum(face.mass_of() for face in faces)
    load = sum(cells.load(solution.potential(*cells.points)) for face in faces for _, cells, _ in face.sides)
    potential = np.zeros(domain.space.size)
    potential[on] = spsolve(mass[on][:, on].tocsc(), load[on])
    return potential


def rows() -> Iterator[Row]:
    """Yield the order from the first mesh of `FIRST` unknowns to the last: it is uneven from level to level."""
    (few, coarse), *_, (many, fine) = [level for level in levels(LAST) if level[0] >= FIRST]
    order = observed_order([coarse, fine], many / few)
    yield order_row(FAMILY, CASE, "current by unknowns", 4 / 3, order, "a square corner: 1 - 2 ln2/pi", at_least=True)


def levels(most: int) -> list[tuple[int, float]]:
    """Return the unknowns and the relative error of the current of each mesh, until one has ``most`` unknowns."""
    metal, far = Material("metal", 1.0, 1.0, 1.0, 1e-6), (ARM + 1) * WIDTH
    boxes = (
        Box("along x", metal, (0.0, 0.0, 0.0), (far, WIDTH, WIDTH)),
        Box("along y", metal, (ARM * WIDTH, WIDTH, 0.0), (far, far, WIDTH)),
    )
    near = (0.0, 0.0, 0.0), (0.0, WIDTH, WIDTH)
    ends = (
        Boundary("plus", "voltage", *near, 1.0),
        Boundary("minus", "voltage", (ARM * WIDTH, far, 0.0), (far, far, WIDTH), 0.0),
    )
    probes = (Probe("current", *near, "current"),)
    # No mesh reaches that accuracy: the last one is the largest.
    scene = Scene("L", boxes, ends, probes, accuracy=1e-9, steady=True, mesh="tetrahedra")
    exact = WIDTH / 1e-6 / (2 * ARM + 1 - 2 * np.log(2) / np.pi)
    study, mesh = scene_run.start(scene)
    # The error of the mesh itself, without the extrapolation.
    search = Refinement(replace(study, extrapolated=False), True, False, lambda _: None)
    levels, finer = list[tuple[int, float]](), [mesh]
    while finer and (not levels or levels[-1][0] < most):
        answer, level = search.solve(finer[0], len(levels))
        levels.append((answer.heat.size, abs(float(answer.fine.quantities["current"]) / exact - 1)))
        finer = [*filter(None, [finer[0].refine(indicators(level), search.tolerance)])]
    return levels
