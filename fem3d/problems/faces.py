"""Boundaries whose heat is no straight line of their face's temperature (`scenes.faces`), as terms beside the linear
problem.

With q(T) the flux that leaves, the linear problem has a film of a coefficient h, which is q's own near T_l, the higher
of ambient and initial temperature T_0, towards the rise at which as much enters at T_0. `Surface` adds the rest,

    int (q(T_0 + u) - q(T_0) - h u) v.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Faces
from scenes import faces
from scenes.model import bends


def film(domain: Domain, boundary: Any) -> tuple[float, float]:
    """The coefficient (W/(m2 K)) of the linear problem's film, and the flux (W/m2) that enters at the initial
    temperature."""
    start = domain.scene.initial_temperature
    near = np.array(max(start, float(boundary.ambient)))
    return float(faces.coefficient(boundary, near)), -float(faces.flux(boundary, np.array(start)))


@dataclass(frozen=True, eq=False)
class Surface:
    """Boundaries with one law, beyond their films, by a quadrature of ``more`` points along each axis than is due."""

    domain: Domain
    boundaries: tuple[Any, ...]
    more: int = 1

    @cached_property
    def on(self) -> Faces:
        """The faces of all, with the points of the quadrature."""
        facets = np.concatenate([self.domain.on(b) for b in self.boundaries])
        return self.domain.seen(facets).finer(self.more)

    def on_one(self, facets: np.ndarray) -> Faces:
        """Some of the facets, with the points of the quadrature; kept, as their flux is read again and again."""
        key = facets.tobytes()
        if key not in self._some:
            self._some[key] = self.domain.seen(facets).finer(self.more)
        return self._some[key]

    @cached_property
    def _some(self) -> dict[bytes, Faces]:
        return {}

    def through(self, on: Faces, u: np.ndarray) -> np.ndarray:
        """Return (functions,) the row that gives the heat (W) beyond the film through some faces at a field u."""
        excess = faces.secant(self.boundary, self._start, on.value(u)) - film(self.domain, self.boundary)[0]
        return on.load(excess)

    @property
    def boundary(self) -> Any:
        """One that stands for all."""
        return self.boundaries[0]

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): the heat that leaves beyond the film, in W."""
        rise, (h, entering) = self.on.value(u), film(self.domain, self.boundary)
        return self.on.load(faces.flux(self.boundary, self._start + rise) + entering - h * rise)

    def tangent(self, u: np.ndarray) -> tuple[csc_array, csc_array | None]:
        """(functions, functions) twice: the derivative in W/K, of `scenes.faces.coefficient` beyond the film's and of
        the rest."""
        at = self._start + self.on.value(u)
        rest = faces.beyond(self.boundary, at)
        slope = faces.coefficient(self.boundary, at) - film(self.domain, self.boundary)[0]
        return self.on.mass_of(slope), None if rest is None else self.on.mass_of(rest)

    def finer(self, points: int) -> Surface:
        """By a quadrature of so many more points along each axis."""
        return replace(self, more=self.more + points)

    def entering(self, u: np.ndarray, on: Faces) -> tuple[float, np.ndarray]:
        """The heat (W) that enters by some faces, by the tangent at a field u: at no rise, and per kelvin
        (functions,)."""
        seen = self.on_one(on.facets)
        at = self._start + seen.value(u)
        per_kelvin = -seen.load(faces.slope(self.boundary, at))
        return -float((seen.areas * faces.flux(self.boundary, at)).sum()) - float(per_kelvin @ u), per_kelvin

    @property
    def _start(self) -> float:
        return float(self.domain.scene.initial_temperature)


def surfaces(domain: Domain) -> tuple[Surface, ...]:
    """One of each law of boundaries whose heat is no straight line of the temperature."""
    alike: dict[Any, list[Any]] = {}
    for b in domain.scene.boundaries:
        if bends(b) and len(domain.on(b)):
            alike.setdefault((b.kind, b.value, b.ambient), []).append(b)
    return tuple(Surface(domain, tuple(boundaries)) for boundaries in alike.values())
