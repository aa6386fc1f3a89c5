"""Radiation of a grey face to black surroundings, emissivity times sigma (T^4 - T_a^4), as a term beside the linear
problem.

The linear problem has a film of the coefficient h = 4 eps sigma T_l^3 that is right near T_l, the higher of ambient and
initial temperature T_0, towards the rise at which as much enters at T_0. `Radiation` adds the rest,

    int (eps sigma ((T_0 + u)^4 - T_0^4) - h u) v,

whose derivative, int (4 eps sigma T^3 - h) w v, is symmetric, and not negative together with the film.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Faces

SIGMA = 5.670374419e-8
"""Stefan's and Boltzmann's constant, W/(m2 K4): CODATA 2018, exact in the SI."""
COLDEST = 1.0  # K: at less the film would have no coefficient


def film(domain: Domain, boundary: Any) -> tuple[float, float]:
    """The coefficient (W/(m2 K)) of the linear problem's film, and the flux (W/m2) that enters at the initial
    temperature."""
    start, ambient = domain.scene.initial_temperature, float(boundary.ambient)
    strength = boundary.value * SIGMA
    return 4 * strength * max(start, ambient, COLDEST) ** 3, strength * (ambient**4 - start**4)


@dataclass(frozen=True, eq=False)
class Radiation:
    """That of one boundary beyond its film, by a quadrature of ``more`` points along each axis than is its due."""

    domain: Domain
    boundary: Any
    more: int = 1

    @cached_property
    def faces(self) -> Faces:
        return self.domain.faces(self.boundary).finer(self.more)

    def outflow(self, u: np.ndarray) -> np.ndarray:
        """(functions,): what leaves beyond the film, in W."""
        return self.faces.load(self._beyond(self.faces.value(u)))

    def tangent(self, u: np.ndarray) -> tuple[csc_array, None]:
        """(functions, functions): its derivative in W/K, which is symmetric."""
        slope = self._slope(self.faces.value(u)) - film(self.domain, self.boundary)[0]
        return self.faces.mass_of(slope), None

    def bent(self, u: np.ndarray) -> np.ndarray:
        """(3, all cells): nowhere."""
        return np.zeros((3, len(self.domain.body)))

    def finer(self, u: np.ndarray) -> Radiation:
        """By two more points along each axis."""
        return replace(self, more=self.more + 2)

    def entering(self, u: np.ndarray, faces: Faces | None = None) -> tuple[float, np.ndarray]:
        """The heat (W) that enters, of the whole boundary or some ``faces`` of it, as a tangent at a field u: at no
        rise, and per kelvin (functions,)."""
        on = faces or self.faces
        rise = on.value(u)
        flux = film(self.domain, self.boundary)[1] - self._emitted(rise)
        per_kelvin = -on.load(self._slope(rise))
        return float((on.areas * flux).sum()) - float(per_kelvin @ u), per_kelvin

    def _emitted(self, rise: np.ndarray) -> np.ndarray:
        """eps sigma ((T_0 + u)^4 - T_0^4), in W/m2, odd in the temperature: a state on the way may be below zero."""
        start = self.domain.scene.initial_temperature
        at = start + rise
        emitted: np.ndarray = self.boundary.value * SIGMA * (at * np.abs(at) ** 3 - start**4)
        return emitted

    def _slope(self, rise: np.ndarray) -> np.ndarray:
        slope: np.ndarray = 4 * self.boundary.value * SIGMA * np.abs(self.domain.scene.initial_temperature + rise) ** 3
        return slope

    def _beyond(self, rise: np.ndarray) -> np.ndarray:
        return self._emitted(rise) - film(self.domain, self.boundary)[0] * rise


def radiating(domain: Domain) -> tuple[Radiation, ...]:
    """One of each boundary that radiates."""
    return tuple(Radiation(domain, b) for b in domain.scene.boundaries if b.kind == "radiation")
