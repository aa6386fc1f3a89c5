"""Manufactured solutions on scikit-fem's hexahedra through the second, independent path: the errors on one mesh."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from skfem import Basis, FacetBasis, LinearForm

from scenes.model import Boundary, Scene
from validate.verify import loads, reference
from validate.verify.bricks import mesh
from validate.verify.manufactured import Heating, Manufactured
from validate.verify.reference import FullOrder

ORDER = 8  # of the quadrature for loads and errors


def errors(solution: Manufactured, degree: int, cuts: int) -> dict[str, float]:
    """The errors on one mesh of degree 1 or 2, as `bricks.errors` has them but for the power."""
    full = prepare(solution, degree, cuts)
    rise = reference.steady(full)
    found = _distances(full, rise, solution)
    if solution.potential is not None:
        power = full.heated(rise)[1]["power"]
        found["power"] = abs(power - loads.power(solution))
    return found


def transient_errors(heating: Heating, degree: int, cuts: int, end: float, steps: int) -> dict[str, float]:
    """The errors at an end time (s) after some steps of the diagonally implicit method of order 3."""
    full = prepare(heating.at(np.inf), degree, cuts)
    found = _distances(full, march(full, end, steps)[0], heating.at(end))
    del found["mean"]  # it converges faster in space than the method does in time
    return found


def march(full: FullOrder, end: float, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """The rise (nodes,) and its rate at an end time (s) after equal steps from rest."""
    return reference.transient(full, np.linspace(0.0, end, steps + 1))[-1]


def prepare(solution: Manufactured, degree: int, cuts: int) -> FullOrder:
    """The second path's matrices of a solution, with the manufactured loads and potential."""
    # It says in a log whenever it copies an array.
    logging.getLogger("skfem").setLevel(logging.ERROR)
    scene = solution.scene if solution.potential is not None else _dead(solution.scene)
    full = reference.assemble(scene, mesh(scene, degree, cuts))
    volume = Basis(full.basis.mesh, full.basis.elem, intorder=ORDER)
    load = full.load + _source.assemble(volume, density=loads.at(solution.f, *volume.global_coordinates()))
    for boundary, entering in loads.loaded(solution):
        where = full.basis.mesh.facets_satisfying(_on(boundary), boundaries_only=True)
        face = FacetBasis(full.basis.mesh, full.basis.elem, facets=where, intorder=ORDER)
        load = load + _source.assemble(face, density=entering(*face.global_coordinates()))
    full = replace(full, load=np.asarray(load))
    if solution.potential is not None:
        # The scene's electrodes have one voltage each; the manufactured potential varies along them.
        held = {
            name: (nodes, solution.potential(0, *full.basis.doflocs[:, nodes]))
            for name, (nodes, _) in full.held.items()
        }
        vars(full)["held"] = held
    return full


def _dead(scene: Scene) -> Scene:
    """The scene as a conductor without voltage: the second path always solves the electric problem too."""
    boxes = tuple(replace(box, material=replace(box.material, resistivity=1.0)) for box in scene.boxes)
    lower, upper = boxes[0].lower, boxes[-1].upper
    ground = Boundary("ground", "voltage", lower, (lower[0], upper[1], upper[2]), 0.0)
    return replace(scene, boxes=boxes, boundaries=(*scene.boundaries, ground))


def _on(boundary: Boundary) -> Callable[[np.ndarray], np.ndarray]:
    """Whether points (3, ...) lie on a boundary."""
    low, high, small = np.array(boundary.lower), np.array(boundary.upper), 1e-9

    def inside(x: np.ndarray) -> np.ndarray:
        near = (low - small < x.T) & (high + small > x.T)
        return np.asarray(near[..., 0] & near[..., 1] & near[..., 2]).T

    return inside


def _distances(full: FullOrder, nodal: np.ndarray, solution: Manufactured) -> dict[str, float]:
    basis = Basis(full.basis.mesh, full.basis.elem, intorder=ORDER)
    field = basis.interpolate(nodal)
    return loads.distances(solution, basis.dx, basis.global_coordinates(), np.asarray(field), field.grad)


@LinearForm
def _source(v: Any, w: Any) -> Any:
    return w.density * v
