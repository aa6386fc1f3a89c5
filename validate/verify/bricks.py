"""Manufactured solutions on this project's bricks of any degree: the errors on one grid."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse.linalg import spsolve

from fem3d import conductor as conductors
from fem3d import steady, transient
from fem3d.assembly import assemble
from fem3d.conductor import Conductor
from fem3d.domain import boxes
from fem3d.heat import HeatProblem
from fem3d.transient import Base, Krylov
from meshes.grid import Grid
from scenes.model import Scene
from validate.verify import loads
from validate.verify.manufactured import LAYER, SIZE, Heating, Manufactured

PLANES = ((0.0, 0.45, SIZE[0]), (0.0, 0.35, SIZE[1]), (0.0, LAYER, SIZE[2]))
FINER = 3  # Gauss points more than usual along each axis, at which errors are integrated
PICARD, SETTLED = 200, 1e-13


def mesh(scene: Scene, degree: int, cuts: int) -> Grid:
    """Two unequal intervals along each axis, each cut into some equal ones."""
    breaks = []
    for planes in PLANES:
        pieces = [np.linspace(a, b, cuts + 1)[:-1] for a, b in pairwise(planes)]
        breaks.append(np.append(np.concatenate(pieces), planes[-1]))
    return Grid(tuple(breaks), tuple(np.full(2 * cuts, degree) for _ in range(3)), scene.boxes)


def errors(solution: Manufactured, degree: int, cuts: int) -> dict[str, float]:
    """The errors on one mesh: of the rise (and of the potential) in L2 and H1, of a weighted mean, of the power."""
    heat = _problem(solution.scene, degree, cuts)
    load = manufactured_load(heat, solution)
    if solution.potential is None:
        return distances(heat, heat.whole(heat.solve_steady(load[: heat.free])), solution)
    rise, found = _coupled(heat, solution, load)
    return distances(heat, heat.whole(rise), solution) | found


def transient_errors(heating: Heating, degree: int, cuts: int, times: np.ndarray) -> dict[str, float]:
    """The largest errors over some times (s) of a transient, by the product's own Krylov fields and time stepping.

    The fields and the tolerance are such that the error is that of space.
    """
    final = heating.at(np.inf)
    heat = _problem(heating.scene, degree, cuts)
    heat = replace(heat, loads=manufactured_load(heat, final)[None])
    state = steady.coupled(heat, None, True, 0.0, 1e-13)
    base = Base.of_steady(state)
    fields = Krylov(base, transient.shift(1 / heating.modes[0][0], float(times[0]))).fields(12)
    answer = transient.march(base, base.project(fields), float(times[-1]), 1e-12)
    worst: dict[str, float] = {}
    for time, rise in zip(times, answer.rises(times), strict=True):
        found = distances(heat, rise, heating.at(time))
        worst = {name: max(value, worst.get(name, 0.0)) for name, value in found.items()}
    return worst


def _problem(scene: Scene, degree: int, cuts: int) -> HeatProblem:
    return assemble(boxes(scene, mesh(scene, degree, cuts)))


def manufactured_load(heat: HeatProblem, solution: Manufactured) -> np.ndarray:
    """(all nodes,): the manufactured loads and those of the scene itself (W)."""
    domain = heat.domain
    on: Any = domain.space.on(np.arange(len(domain.body)))
    load = on.load(loads.at(solution.f, *on.points))
    for boundary, entering in loads.loaded(solution):
        face: Any = domain.faces(boundary)
        load += face.load(entering(*face.points))
    return heat.loads[0] + heat.take(load)


def distances(heat: HeatProblem, rise: np.ndarray, solution: Manufactured) -> dict[str, float]:
    """The errors of a rise (all nodes), integrated with more points."""
    on, u = _finely(heat), heat.field(rise)
    return loads.distances(solution, on.weights, on.points, on.value(u), on.gradient(u))


def _finely(heat: HeatProblem) -> Any:
    space: Any = heat.domain.space
    return space.on(np.arange(len(heat.domain.body)), FINER)


def _coupled(
    heat: HeatProblem, solution: Manufactured, load: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:  # fmt: skip
    """The rise with its Joule heat, by Picard's iteration, and the errors of the potential and the power."""
    conductor = conductors.find(heat)
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
    assert solution.potential_gradient is not None
    off = on.value(phi) - solution.potential(0, *on.points)
    bent = on.gradient(phi) - solution.potential_gradient(0, *on.points)
    power = float(phi @ electric.reaction)
    return rise, loads.norms("potential", on.weights, off, bent) | {"power": abs(power - loads.power(solution))}


def _on_electrodes(conductor: Conductor, solution: Manufactured) -> np.ndarray:
    """(functions,): the manufactured potential, which varies along the electrodes, projected on their functions; the
    scene's electrodes have one voltage each."""
    assert solution.potential is not None
    domain = conductor.heat.domain
    faces: list[Any] = [domain.faces(b) for b in domain.scene.boundaries if b.kind == "voltage"]
    on = np.flatnonzero(np.any([face.functions for face in faces], axis=0))
    mass = sum(face.mass() for face in faces)
    load = sum(face.load(solution.potential(0, *face.points)) for face in faces)
    found = np.zeros(domain.space.size)
    found[on] = spsolve(mass[on][:, on].tocsc(), load[on])
    return found
