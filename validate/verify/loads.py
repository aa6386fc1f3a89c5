"""Manufactured fields on points, in the right layer; integrals of them; the loads on faces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from scenes.model import Boundary, Point
from validate.verify.manufactured import LAYER, SIZE, Field, Manufactured


def at(field: Field, x: Any, y: Any, z: Any) -> Any:
    """The field in the layer that each point lies in."""
    return np.where(z < LAYER, field(0, x, y, z), field(1, x, y, z))


def conductivity(solution: Manufactured, z: Any) -> Any:
    """W/(m K) at some heights (m)."""
    lower, upper = (box.material.thermal_conductivity for box in solution.scene.boxes)
    return np.where(z < LAYER, lower, upper)


def outward(boundary: Boundary) -> tuple[int, int]:
    """The axis of a face's normal, and whether it points along it (1) or against it (-1)."""
    axis = next(d for d in range(3) if boundary.lower[d] == boundary.upper[d])
    return axis, 1 if boundary.lower[axis] > SIZE[axis] / 2 else -1


def entering(solution: Manufactured, boundary: Boundary) -> Field:
    """(x, y, z) to k du/dn + h u (W/m2), less the flux that the scene gives already."""
    axis, sign = outward(boundary)
    assert isinstance(boundary.value, float)
    h = boundary.value if boundary.kind == "convection" else 0.0
    given = boundary.value if boundary.kind == "heat_flux" else 0.0

    def load(x: Any, y: Any, z: Any) -> Any:
        flux = sign * conductivity(solution, z) * at(solution.gradient, x, y, z)[axis]
        return flux + h * at(solution.u, x, y, z) - given

    return load


def loaded(solution: Manufactured) -> Iterator[tuple[Boundary, Field]]:
    """The faces that take a load, with it."""
    for b in solution.scene.boundaries:
        if b.kind in ("convection", "heat_flux"):
            yield b, entering(solution, b)


def integral(field: Callable[..., Any], lower: Point, upper: Point) -> float:
    """The integral of a field (x, y, z) over a box, flat or not, by Gauss's rule in each layer."""
    points, weights = np.polynomial.legendre.leggauss(24)
    total = 0.0
    planes = [lower[2], LAYER, upper[2]] if lower[2] < LAYER < upper[2] else [lower[2], upper[2]]
    spans = list(pairwise(planes)) if lower[2] < upper[2] else [(lower[2], lower[2])]
    for bottom, top in spans:
        axes = []
        for a, b in ((lower[0], upper[0]), (lower[1], upper[1]), (bottom, top)):
            flat = a == b
            axes.append(
                (np.array([a]), np.ones(1)) if flat else (a + (b - a) * (points + 1) / 2, weights * (b - a) / 2)
            )
        (x, wx), (y, wy), (z, wz) = axes
        values = field(x[:, None, None], y[:, None], z)
        total += float(np.einsum("xyz,x,y,z->", np.broadcast_to(values, (len(x), len(y), len(z))), wx, wy, wz))
    return total


def weighted(solution: Manufactured) -> float:
    """The integral of the rise with the solution's weight (K m3)."""
    return integral(lambda *w: at(solution.u, *w) * at(solution.weight, *w), (0.0, 0.0, 0.0), SIZE)


def power(solution: Manufactured) -> float:
    """The electric power (W) that the manufactured potential dissipates."""
    assert solution.potential_gradient is not None
    gradient, material = solution.potential_gradient, solution.scene.boxes[0].material
    assert material.resistivity is not None
    rho, a = material.resistivity, material.temperature_coefficient

    def density(*where: Any) -> Any:
        return (gradient(0, *where) ** 2).sum(axis=0) / (rho * (1 + a * solution.u(0, *where)))

    return integral(density, (0.0, 0.0, 0.0), SIZE)


def distances(solution: Manufactured, weights: Any, points: Any, values: Any, slopes: Any) -> dict[str, float]:
    """L2 norm and H1 seminorm of the error of a rise, and the error of its weighted mean, by a rule with weights
    (..., points): from its values there (..., points) and its gradient (3, ..., points)."""
    mean = float((weights * values * at(solution.weight, *points)).sum())
    found = norms("rise", weights, values - at(solution.u, *points), slopes - at(solution.gradient, *points))
    return found | {"mean": abs(mean - weighted(solution))}


def norms(name: str, weights: Any, error: Any, slope: Any) -> dict[str, float]:
    """L2 norm and H1 seminorm of an error, from its values and its gradient."""
    squares = (weights * error**2).sum(), (weights * (slope**2).sum(axis=0)).sum()
    return {f"{name}, L2": float(np.sqrt(squares[0])), f"{name}, H1": float(np.sqrt(squares[1]))}
