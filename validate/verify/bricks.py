"""Manufactured solutions on this project's bricks of any degree: the errors on one mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d import steady, tensor, transient
from fem3d.conductor import find_conductor
from fem3d.operators import HeatProblem, assemble
from fem3d.steady import joule_load
from fem3d.transient import Base, Krylov
from meshes.axis import Axis
from meshes.bricks import BrickMesh
from scenes.model import Scene
from validate.verify import loads
from validate.verify.manufactured import LAYER, SIZE, Heating, Manufactured

PLANES = ((0.0, 0.45, SIZE[0]), (0.0, 0.35, SIZE[1]), (0.0, LAYER, SIZE[2]))
FINER = 3  # degrees above the solution's at which errors are integrated
PICARD, SETTLED = 200, 1e-13


def mesh(scene: Scene, degree: int, cuts: int) -> BrickMesh:
    """Two unequal intervals along each axis, each cut into some equal ones."""
    axes = []
    for planes in PLANES:
        pieces = [np.linspace(a, b, cuts + 1)[:-1] for a, b in pairwise(planes)]
        axes.append(Axis(np.append(np.concatenate(pieces), planes[-1]), np.full(2 * cuts, degree)))
    x, y, z = axes
    return BrickMesh((x, y, z), scene.boxes)


def errors(solution: Manufactured, degree: int, cuts: int) -> dict[str, float]:
    """The errors on one mesh: of the rise (and of the potential) in L2 and H1, of a weighted mean, of the power."""
    heat = assemble(solution.scene, mesh(solution.scene, degree, cuts))
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
    heat = assemble(heating.scene, mesh(heating.scene, degree, cuts))
    heat = replace(heat, loads=manufactured_load(heat, final)[None])
    base = Base.of_steady(steady.solve(heat, 0.0, 1e-13))
    fields = Krylov(base, transient.shift(1 / heating.modes[0][0], float(times[0]))).fields(12)
    answer = transient.march(base, base.project(fields), float(times[-1]), 1e-12)
    worst: dict[str, float] = {}
    for time, rise in zip(times, answer.rises(times), strict=True):
        found = distances(heat, rise, heating.at(time))
        worst = {name: max(value, worst.get(name, 0.0)) for name, value in found.items()}
    return worst


def manufactured_load(heat: HeatProblem, solution: Manufactured) -> np.ndarray:
    """(nodes,): the manufactured loads and those of the scene itself (W)."""
    load = heat.loads[0].copy()
    for block in heat.mesh.blocks:
        parts = heat.mesh.parts(block)
        heat.scatter(block, tensor.load(parts, loads.at(solution.f, *_points(parts))), load)
    for boundary, entering in loads.loaded(solution):
        for face in heat.mesh.faces(boundary.lower, boundary.upper):
            parts = heat.mesh.parts(face)
            values = np.broadcast_to(entering(*_points(parts)), tuple(len(p.points) for p in parts))
            heat.scatter(face, tensor.load(parts, values), load)
    return load


def distances(heat: HeatProblem, nodal: np.ndarray, solution: Manufactured) -> dict[str, float]:
    """L2 norm, H1 seminorm and weighted mean of the error of a rise at all nodes, integrated at higher degrees."""
    squares, mean = np.zeros(2), 0.0
    for weights, values, gradient, points in _sampled(heat, nodal):
        squares += _squares(weights, values - loads.at(solution.u, *points),
                            gradient - loads.at(solution.gradient, *points))  # fmt: skip
        mean += float((weights * values * loads.at(solution.weight, *points)).sum())
    return _named("rise", squares) | {"mean": abs(mean - loads.weighted(solution))}


def _sampled(heat: HeatProblem, nodal: np.ndarray) -> Iterator[tuple[Any, Any, Any, Any]]:
    """Weights, values, gradients and points of a function given at all nodes, at the Gauss points of higher degrees."""
    coarse = heat.mesh
    fine = coarse.with_degrees(FINER, FINER, FINER)
    x, y, z = (b.interpolation(a.nodes) for a, b in zip(fine.axes, coarse.axes, strict=True))
    values = tensor.along(x, y, z, nodal[heat.number].reshape(coarse.shape)).ravel()
    for block in fine.blocks:
        parts, here = fine.parts(block), values[fine.numbers(block)]
        yield tensor.weights(parts), tensor.values(parts, here), tensor.gradient(parts, here), _points(parts)


def _squares(weights: Any, error: Any, slope: Any) -> np.ndarray:
    return np.array([(weights * error**2).sum(), (weights * (slope**2).sum(axis=0)).sum()])


def _named(name: str, squares: np.ndarray) -> dict[str, float]:
    return {f"{name}, L2": float(np.sqrt(squares[0])), f"{name}, H1": float(np.sqrt(squares[1]))}


def _coupled(
    heat: HeatProblem, solution: Manufactured, load: np.ndarray
) -> tuple[np.ndarray, dict[str, float]]:  # fmt: skip
    """The rise with its Joule heat, by Picard's iteration, and the errors of the potential and the power."""
    conductor = find_conductor(heat)
    assert conductor is not None
    assert solution.potential is not None
    # The scene's electrodes have one voltage each; the manufactured potential varies along them.
    exact, held = solution.potential(0, *heat.mesh.coordinates()), conductor.number >= conductor.free
    fixed = np.empty(conductor.voltages.shape[1])
    fixed[conductor.number[held] - conductor.free] = exact[held]
    rise, electric = np.zeros(heat.free), conductor.solve(np.zeros(heat.free), fixed)
    for _ in range(PICARD):
        electric = conductor.solve(rise, fixed, electric.potential, accuracy=1e-13)
        old, rise = rise, heat.solve_steady((load + joule_load(conductor, electric.density, rise))[: heat.free])
        if np.abs(rise - old).max() <= SETTLED * np.abs(rise).max():
            break
    phi = electric.potential[conductor.number]
    nodal = np.zeros(heat.size)
    nodal[heat.number] = phi
    assert solution.potential_gradient is not None
    squares = np.zeros(2)
    for weights, values, gradient, points in _sampled(heat, nodal):
        squares += _squares(weights, values - solution.potential(0, *points),
                            gradient - solution.potential_gradient(0, *points))  # fmt: skip
    power = float(electric.potential @ electric.reaction)
    return rise, _named("potential", squares) | {"power": abs(power - loads.power(solution))}


def _points(parts: tensor.Parts) -> tuple[Any, Any, Any]:
    x, y, z = (part.points for part in parts)
    return x[:, None, None], y[:, None], z
