"""Manufactured solutions: smooth temperatures in a brick, with the loads on the interior and the faces that make them.

The brick is 1 x 0.8 x 0.6 m, in two layers along z. For the rise u the volume load is f = -div(k grad u) - (Joule heat)
and the load on a face with convection or flux is g = k du/dn + h u. Source of the method: Roache, J. Fluids Eng. 124,
2002, 4; Salari and Knupp, Code Verification by the Method of Manufactured Solutions, SAND2000-1444.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from scenes.model import Boundary, Box, Material, Point, Scene

SIZE = (1.0, 0.8, 0.6)
LAYER = 0.25  # m: the height at which the second layer begins
COEFFICIENT, FLUX = 3.0, 0.7  # W/(m2 K) on faces with convection, W/m2 into those with a flux

Field = Callable[..., Any]  # of (layer, x, y, z), arrays of one shape


@dataclass(frozen=True)
class Manufactured:
    """A solution: the rise ``u`` (K), its gradient (3, ...), and the volume load ``f`` (W/m3), per layer.

    ``scene`` has the materials and the kinds of boundary; the rise is zero on faces of given temperature.
    ``weight`` is that of a mean whose dual solution is smooth too, so that it converges at twice the degree.
    ``potential`` (V) is that of the coupled problems, whose Joule heat ``f`` leaves out.
    """

    name: str
    scene: Scene
    u: Field
    gradient: Field
    f: Field
    weight: Field
    potential: Field | None = None
    potential_gradient: Field | None = None


def conduction(layered: bool) -> Manufactured:
    """Steady conduction with all three kinds of boundary; in layers the flux k du/dz is continuous, its parts are not.

    u = sin(2 x + 0.3) cos(y + 0.4) (e^(2 s - 2 s_top) - 1), s = (z - LAYER)/k in each layer.
    """
    k = (1.5, 3.0) if layered else (2.0, 2.0)
    top = (SIZE[2] - LAYER) / k[1]

    def parts(i: int, x: Any, y: Any, z: Any) -> Any:
        e = np.exp(2 * ((z - LAYER) / k[i] - top))
        a = 2 * x + 0.3
        return (np.sin(a), 2 * np.cos(a), -4), (np.cos(y + 0.4), -np.sin(y + 0.4), -1), (e - 1, 2 * e / k[i], e)

    def u(i: int, x: Any, y: Any, z: Any) -> Any:
        (a, _, _), (b, _, _), (c, _, _) = parts(i, x, y, z)
        return a * b * c

    def gradient(i: int, x: Any, y: Any, z: Any) -> Any:
        (a, da, _), (b, db, _), (c, dc, _) = parts(i, x, y, z)
        return np.stack([da * b * c, a * db * c, a * b * dc])

    def f(i: int, x: Any, y: Any, z: Any) -> Any:
        (a, _, xx), (b, _, yy), (c, _, e) = parts(i, x, y, z)
        return -k[i] * a * b * ((xx + yy) * c + 4 * e / k[i] ** 2)

    kinds = _sides("convection", "temperature")
    materials = [Material(f"layer {i}", conductivity, 1.0, 1.0) for i, conductivity in enumerate(k)]
    return Manufactured("k in layers" if layered else "constant k", _scene(materials, kinds), u, gradient, f, _weight)


def joule() -> Manufactured:
    """A conductor whose resistivity depends on the temperature, cooled from below and above, fluxes on its sides.

    With any harmonic psi, u = A psi + B psi^2 and phi = c integral of rho(u) dpsi, the current density -c grad psi has
    no divergence, whatever the resistivity rho(u) = rho_0 (1 + a u).
    """
    rho, a, c, A, B = 0.5, 0.3, 1.2, 0.6, 0.25
    p, q = 0.8, 0.7
    s = np.hypot(p, q)

    def psi(x: Any, y: Any, z: Any) -> Any:
        return np.exp(s * (x - 1)) * np.cos(p * y) * np.cos(q * z)

    def slopes(x: Any, y: Any, z: Any) -> Any:
        e = np.exp(s * (x - 1))
        return np.stack([
            s * e * np.cos(p * y) * np.cos(q * z), -p * e * np.sin(p * y) * np.cos(q * z),
            -q * e * np.cos(p * y) * np.sin(q * z),
        ])  # fmt: skip

    def u(_: int, *at: Any) -> Any:
        return A * psi(*at) + B * psi(*at) ** 2

    def f(_: int, *at: Any) -> Any:
        steep = (slopes(*at) ** 2).sum(axis=0)
        return -2.0 * 2 * B * steep - rho * (1 + a * u(0, *at)) * c**2 * steep

    def potential(_: int, *at: Any) -> Any:
        v = psi(*at)
        return c * rho * (v + a * (A * v**2 / 2 + B * v**3 / 3))

    kinds = _sides("convection", "convection")
    materials = [Material("conductor", 2.0, 1.0, 1.0, rho, a)] * 2
    return Manufactured(
        "resistivity of the temperature", _scene(materials, kinds, electrodes=True), u,
        lambda _, *at: (A + 2 * B * psi(*at)) * slopes(*at), f, _weight, potential,
        lambda _, *at: c * rho * (1 + a * u(0, *at)) * slopes(*at),
    )  # fmt: skip


@dataclass(frozen=True)
class Heating:
    """A transient from rest under a load that is constant in time: the sum over some eigenfunctions w of
    (1 - e^(-rate t)) w, with the load rate rho c w. ``scene`` has the boundaries, ``modes`` are (rate in 1/s, w,
    grad w); it is the manufactured solution of a heater that is switched on."""

    name: str
    scene: Scene
    modes: tuple[tuple[float, Field, Field], ...]

    def at(self, time: float) -> Manufactured:
        """The solution at one time (s, may be infinite), with the load that makes it."""
        grown = [-np.expm1(-rate * time) for rate, _, _ in self.modes]
        heat_capacity = [box.material.heat_capacity for box in self.scene.boxes]

        def u(i: int, *where: Any) -> Any:
            return sum(g * w(i, *where) for g, (_, w, _) in zip(grown, self.modes, strict=True))

        def gradient(i: int, *where: Any) -> Any:
            return sum(g * slope(i, *where) for g, (_, _, slope) in zip(grown, self.modes, strict=True))

        def f(i: int, *where: Any) -> Any:
            return heat_capacity[i] * sum(rate * w(i, *where) for rate, w, _ in self.modes)

        return Manufactured(self.name, self.scene, u, gradient, f, self.modes[0][1])


def heating(layered: bool) -> Heating:
    """Two eigenfunctions sin(m x) cos(n y) Z(z): at x = 0 and z = top the temperature is given, at the far x there is
    convection, the rest is adiabatic."""
    k, rc = ((1.5, 3.0), (1.2, 2.0)) if layered else ((2.0, 2.0), (1.5, 1.5))
    beta = 1.25  # 1/m: h/k at the far x, equal in both layers so that the eigenfunctions separate
    m = float(brentq(lambda m: m * np.cos(m) + beta * np.sin(m), 1.6, 3.1))
    modes = tuple(_eigenfunction(k, rc, m, n, size) for n, size in ((0.0, 1.0), (np.pi / SIZE[1], 0.5)))
    materials = [Material(f"layer {i}", k[i], 1.0, rc[i]) for i in (0, 1)]
    scene = _scene(materials, {(0, 0): "temperature", (2, 1): "temperature"})
    films = tuple(
        Boundary(f"far {i}", "convection", (SIZE[0], 0.0, low), (SIZE[0], SIZE[1], high), beta * k[i], 293.0)
        for i, (low, high) in enumerate([(0.0, LAYER), (LAYER, SIZE[2])])
    )
    name = "k and c in layers" if layered else "constant k"
    return Heating(name, replace(scene, boundaries=(*scene.boundaries, *films)), modes)


def _eigenfunction(
    k: tuple[float, float], rc: tuple[float, float], m: float, n: float, size: float
) -> tuple[float, Field, Field]:  # fmt: skip
    """Rate, function and gradient of the slowest eigenfunction with these m and n that oscillates in both layers."""
    thick = SIZE[2] - LAYER

    def waves(rate: float) -> tuple[float, float]:
        q = np.sqrt(rate * np.array(rc) / np.array(k) - m**2 - n**2)
        return float(q[0]), float(q[1])

    def mismatch(rate: float) -> float:
        p, q = waves(rate)
        return float(
            k[0] * p * np.sin(p * LAYER) * np.sin(q * thick) - k[1] * q * np.cos(p * LAYER) * np.cos(q * thick)
        )

    low = (m**2 + n**2) * max(k[0] / rc[0], k[1] / rc[1]) * (1 + 1e-9)
    tried = np.linspace(low, low + 40 * k[1], 400)
    change = int(np.flatnonzero(np.diff(np.sign([mismatch(r) for r in tried])))[0])
    rate = float(brentq(mismatch, tried[change], tried[change + 1], xtol=1e-13))
    p, q = waves(rate)
    scale = np.cos(p * LAYER) / np.sin(q * thick)

    def up(i: int, z: Any) -> tuple[Any, Any]:
        if i == 0:
            return np.cos(p * z), -p * np.sin(p * z)
        return scale * np.sin(q * (SIZE[2] - z)), -scale * q * np.cos(q * (SIZE[2] - z))

    def w(i: int, x: Any, y: Any, z: Any) -> Any:
        return size * np.sin(m * x) * np.cos(n * y) * up(i, z)[0]

    def gradient(i: int, x: Any, y: Any, z: Any) -> Any:
        c, dc = up(i, z)
        a, b = np.sin(m * x), np.cos(n * y)
        return size * np.stack([m * np.cos(m * x) * b * c, -n * a * np.sin(n * y) * c, a * b * dc])

    return rate, w, gradient


def _weight(_: int, x: Any, y: Any, z: Any) -> Any:
    """Smooth when mirrored in the four sides, where the dual problem of steady conduction is adiabatic."""
    return np.cos(np.pi * x / SIZE[0]) * np.cos(np.pi * y / SIZE[1]) + 0 * z


def _sides(bottom: str, top: str) -> dict[tuple[int, int], str]:
    """The kinds of boundary by (axis, side): fluxes on the four sides."""
    return {(d, side): "heat_flux" for d in (0, 1) for side in (0, 1)} | {(2, 0): bottom, (2, 1): top}


def _scene(materials: list[Material], kinds: dict[tuple[int, int], Any], electrodes: bool = False) -> Scene:
    x, y, _ = SIZE
    boxes = (Box("lower", materials[0], (0.0, 0.0, 0.0), (x, y, LAYER)),
             Box("upper", materials[1], (0.0, 0.0, LAYER), SIZE))  # fmt: skip
    value = {"temperature": 293.0, "convection": COEFFICIENT, "heat_flux": FLUX}
    faces = []
    for (d, side), kind in kinds.items():
        lower, upper = face(d, side)
        faces.append(Boundary(f"{kind} {'xyz'[d]}{side}", kind, lower, upper, value[kind], 293.0))
        if electrodes:
            # The voltages are only there to be replaced by those of the manufactured potential.
            faces.append(Boundary(f"electrode {'xyz'[d]}{side}", "voltage", lower, upper, float(2 * d + side)))
    return Scene("manufactured", boxes, tuple(faces), ())


def face(axis: int, side: int) -> tuple[Point, Point]:
    """The flat box of the brick's lower (0) or upper (1) face along an axis."""
    lower, upper = [0.0, 0.0, 0.0], list(SIZE)
    lower[axis] = upper[axis] = SIZE[axis] * side
    return (lower[0], lower[1], lower[2]), (upper[0], upper[1], upper[2])
