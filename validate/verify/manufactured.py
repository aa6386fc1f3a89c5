"""Manufactured solutions: smooth temperatures in a brick, with the loads on the interior and the faces that make them.

The brick is 1 x 0.8 x 0.6 m, in two layers along z. For the rise u the volume load is f = -div(k grad u) - (Joule heat)
and the load on a face with convection or flux is g = k du/dn + h u. Source of the method: Roache, J. Fluids Eng. 124,
2002, 4; Salari and Knupp, Code Verification by the Method of Manufactured Solutions, SAND2000-1444.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise, product
from typing import Any

import numpy as np
from scipy.optimize import brentq

from scenes.model import Boundary, Box, Material, Scene
from scenes.sink import face

SIZE = (1.0, 0.8, 0.6)
LAYER = 0.25  # m: the height at which the second layer begins
COEFFICIENT, FLUX = 3.0, 0.7  # W/(m2 K) on faces with convection, W/m2 into those with a flux
TINY = 1e-30  # m: a step whose square is nothing beside 1

ONE_K, LAYERS = (2.0, 2.0), (1.5, 3.0)  # W/(m K) of the two layers
ONE_CAPACITY, CAPACITIES = (1.5, 1.5), (1.2, 2.0)  # J/(m3 K)

Field = Callable[..., Any]  # of x, y, z, arrays of one shape
Pair = tuple[float, float]  # of the lower and the upper layer
RHO, ALPHA = 0.5, 0.3  # ohm m, 1/K: of the conductor


@dataclass(frozen=True)
class Manufactured:
    """A solution: the rise ``u`` (K) and the volume load ``f`` (W/m3).

    ``scene`` has the materials and the kinds of boundary; the rise is zero on faces of given temperature.
    ``weight`` defines a mean whose dual solution is smooth too, so that it converges at twice the degree.
    ``potential`` (V) belongs to the coupled problems, whose Joule heat ``f`` leaves out.
    """

    name: str
    scene: Scene
    u: Field
    f: Field
    weight: Field
    potential: Field | None = None

    def loads(self) -> Iterator[tuple[Boundary, Field]]:
        """The faces with convection or a flux, with k du/dn + h u (W/m2) less the flux that the scene gives already."""
        for b in self.scene.boundaries:
            if b.kind in ("convection", "heat_flux"):
                yield b, partial(self._entering, b)

    def _entering(self, face: Boundary, x: Any, y: Any, z: Any) -> Any:
        axis = next(d for d in range(3) if face.lower[d] == face.upper[d])
        outward = 1 if face.lower[axis] > SIZE[axis] / 2 else -1
        k = layered(*(box.material.thermal_conductivity for box in self.scene.boxes))(z)
        flux = outward * k * gradient(self.u, x, y, z)[axis]
        return flux + (face.value * self.u(x, y, z) if face.kind == "convection" else -face.value)  # type: ignore[operator]

    def distances(self, weights: Any, points: Any, values: Any, slopes: Any) -> dict[str, float]:
        """L2 norm and H1 seminorm of the error of a rise, and the error of its weighted mean, by a rule with weights
        (..., points): from its values there (..., points) and its gradient (3, ..., points)."""
        mean = float((weights * values * self.weight(*points)).sum())
        exact = integral(lambda *at: self.u(*at) * self.weight(*at))
        return norms("rise", weights, values, slopes, self.u, points) | {"mean": abs(mean - exact)}

    def power(self) -> float:
        """The electric power (W) that the potential dissipates."""
        assert self.potential is not None
        steep = partial(gradient, self.potential)
        return integral(lambda *at: (steep(*at) ** 2).sum(axis=0) / (RHO * (1 + ALPHA * self.u(*at))))


def norms(name: str, weights: Any, values: Any, slopes: Any, exact: Field, points: Any) -> dict[str, float]:
    """L2 norm and H1 seminorm of the error of a field, as in `Manufactured.distances`."""
    error, slope = values - exact(*points), slopes - gradient(exact, *points)
    squares = (weights * error**2).sum(), (weights * (slope**2).sum(axis=0)).sum()
    return {f"{name}, L2": float(np.sqrt(squares[0])), f"{name}, H1": float(np.sqrt(squares[1]))}


def layered(lower: Any, upper: Any) -> Callable[[Any], Any]:
    """Return a function of z with one value in each layer."""
    return lambda z: np.where(np.real(z) < LAYER, lower, upper)


def gradient(field: Field, *at: Any) -> np.ndarray:
    """(3, ...): exact to rounding, by a step along the imaginary axis (Squire and Trapp, SIAM Rev. 40, 1998, 110)."""
    at = np.broadcast_arrays(*at)
    return np.stack([np.imag(field(*(a + 1j * TINY * (d == e) for e, a in enumerate(at)))) / TINY for d in range(3)])


def integral(field: Field) -> float:
    """The integral of a field over the brick, by Gauss's rule in each layer."""
    points, weights = np.polynomial.legendre.leggauss(24)
    total = 0.0
    for low, high in pairwise((0.0, LAYER, SIZE[2])):
        x, y, z = (a + (b - a) * (points + 1) / 2 for a, b in ((0.0, SIZE[0]), (0.0, SIZE[1]), (low, high)))
        values = np.broadcast_to(field(x[:, None, None], y[:, None], z), (24, 24, 24))
        size = SIZE[0] * SIZE[1] * (high - low) / 8
        total += size * float(np.einsum("xyz,x,y,z->", values, weights, weights, weights))
    return total


def joule() -> Manufactured:
    """A conductor whose resistivity depends on the temperature, cooled from below and above, fluxes on its sides.

    With any harmonic psi, u = A psi + B psi^2 and phi = c integral of rho(u) dpsi, the current density -c grad psi has
    no divergence, whatever the resistivity rho(u) = rho_0 (1 + a u). None passes the sides: where electrodes met at an
    angle the current would jump, and the error of their potential would cost the power half its order.
    """
    c, A, B, k = 1.2, 0.6, 0.25, 2.0
    p, q = np.pi / SIZE[1], np.pi / SIZE[2]

    def psi(x: Any, y: Any, z: Any) -> Any:
        return (1 + x + np.exp(p * (x - 1)) * np.cos(p * y) / 8 + np.exp(-q * x) * np.cos(q * z) / 64) / 2

    def u(*at: Any) -> Any:
        return A * psi(*at) + B * psi(*at) ** 2

    def f(*at: Any) -> Any:
        return -(2 * k * B + RHO * (1 + ALPHA * u(*at)) * c**2) * (gradient(psi, *at) ** 2).sum(axis=0)

    def potential(*at: Any) -> Any:
        v = psi(*at)
        return c * RHO * (v + ALPHA * (A * v**2 / 2 + B * v**3 / 3))

    materials = [Material("conductor", k, 1.0, 1.0, RHO, ALPHA)] * 2
    kinds = dict.fromkeys(product((0, 1), (0, 1)), "heat_flux") | {(2, 0): "convection", (2, 1): "convection"}
    scene = _scene(materials, kinds, electrodes=True)
    return Manufactured("resistivity of the temperature", scene, u, f, _weight, potential)


@dataclass(frozen=True)
class Heating:
    """A transient from rest under a load that is constant in time: the sum over some eigenfunctions w of
    (1 - e^(-rate t)) w, with the load rate rho c w. ``scene`` has the boundaries, ``modes`` are (rate in 1/s, w); it is
    the manufactured solution of a heater that is switched on."""

    name: str
    scene: Scene
    modes: tuple[tuple[float, Field], ...]

    def at(self, time: float) -> Manufactured:
        """The solution at one time (s, may be infinite), with the load that makes it."""
        heat_capacity = layered(*(box.material.heat_capacity for box in self.scene.boxes))

        def u(*where: Any) -> Any:
            return sum(-np.expm1(-rate * time) * w(*where) for rate, w in self.modes)

        def f(*where: Any) -> Any:
            return heat_capacity(where[2]) * sum(rate * w(*where) for rate, w in self.modes)

        return Manufactured(self.name, self.scene, u, f, self.modes[0][1])


def heating(k: Pair, heat_capacity: Pair) -> Heating:
    """Two eigenfunctions sin(m x) cos(n y) Z(z): at x = 0 and z = top the temperature is given, at the far x there is
    convection, the rest is adiabatic."""
    beta = 1.25  # 1/m: h/k at the far x, equal in both layers so that the eigenfunctions separate
    m = float(brentq(lambda m: m * np.cos(m) + beta * np.sin(m), 1.6, 3.1))
    modes = tuple(_eigenfunction(k, heat_capacity, m, n, size) for n, size in ((0.0, 1.0), (np.pi / SIZE[1], 0.5)))
    materials = [Material(f"layer {i}", k[i], 1.0, heat_capacity[i]) for i in (0, 1)]
    scene = _scene(materials, {(0, 0): "temperature", (2, 1): "temperature"})
    films = tuple(
        Boundary(f"far {i}", "convection", (SIZE[0], 0.0, low), (SIZE[0], SIZE[1], high), beta * k[i], 293.0)
        for i, (low, high) in enumerate(pairwise((0.0, LAYER, SIZE[2])))
    )
    name = "constant k" if k[0] == k[1] else "k and c in layers"
    return Heating(name, replace(scene, boundaries=(*scene.boundaries, *films)), modes)


def _eigenfunction(k: Pair, heat_capacity: Pair, m: float, n: float, size: float) -> tuple[float, Field]:
    """Rate and function of the slowest eigenfunction with these m and n that oscillates in both layers."""
    thick = SIZE[2] - LAYER

    def waves(rate: float) -> Any:
        return np.sqrt(rate * np.array(heat_capacity) / np.array(k) - m**2 - n**2)

    def mismatch(rate: float) -> float:
        p, q = waves(rate)
        up, down = k[0] * p * np.sin(p * LAYER) * np.sin(q * thick), k[1] * q * np.cos(p * LAYER) * np.cos(q * thick)
        return float(up - down)

    low = (m**2 + n**2) * max(k[0] / heat_capacity[0], k[1] / heat_capacity[1]) * (1 + 1e-9)
    tried = np.linspace(low, low + 40 * k[1], 400)
    change = int(np.flatnonzero(np.diff(np.sign([mismatch(r) for r in tried])))[0])
    rate = float(brentq(mismatch, tried[change], tried[change + 1], xtol=1e-13))
    p, q = waves(rate)
    scale = np.cos(p * LAYER) / np.sin(q * thick)

    def w(x: Any, y: Any, z: Any) -> Any:
        up = layered(np.cos(p * z), scale * np.sin(q * (SIZE[2] - z)))(z)
        return size * np.sin(m * x) * np.cos(n * y) * up

    return rate, w


def _weight(x: Any, y: Any, z: Any) -> Any:
    """Smooth when mirrored in the four sides, where the dual problem is adiabatic."""
    return np.cos(np.pi * x / SIZE[0]) * np.cos(np.pi * y / SIZE[1]) + 0 * z


def _scene(materials: list[Material], kinds: dict[tuple[int, int], Any], electrodes: bool = False) -> Scene:
    x, y, _ = SIZE
    boxes = (Box("lower", materials[0], (0.0, 0.0, 0.0), (x, y, LAYER)),
             Box("upper", materials[1], (0.0, 0.0, LAYER), SIZE))  # fmt: skip
    value = {"temperature": 293.0, "convection": COEFFICIENT, "heat_flux": FLUX}
    faces, whole = [], Box("both", materials[0], (0.0, 0.0, 0.0), SIZE)
    for (d, side), kind in kinds.items():
        at = face(whole, d, side)
        faces.append(Boundary(f"{kind} {'xyz'[d]}{side}", kind, *at, value[kind], 293.0))
        if electrodes and d == 0:
            # The manufactured potential replaces these voltages.
            faces.append(Boundary(f"electrode {'xyz'[d]}{side}", "voltage", *at, float(2 * d + side)))
    return Scene("manufactured", boxes, tuple(faces), ())
