"""Boundaries whose heat is no straight line of their face's temperature (`scenes.model.bends`): the flux that leaves
there, and how it follows.

    radiation    eps sigma (T^4 - T_a^4), of a grey face to surroundings of the temperature T_a that take all
    convection   h(T) (T - T_a), with a coefficient that follows the face's temperature by a law
"""

from __future__ import annotations

from typing import Any

import numpy as np

SIGMA = 5.670374419e-8
"""The Stefan-Boltzmann constant, W/(m2 K4): CODATA 2018, exact in the SI."""
COLDEST = 1.0  # K: laws are evaluated no lower, as states on the way to the solution may be.


def flux(boundary: Any, temperature: np.ndarray) -> np.ndarray:
    """Return the heat flux (W/m2) out of a boundary at temperatures (K) of its face."""
    t, ambient = np.maximum(temperature, COLDEST), float(boundary.ambient)
    if boundary.kind == "radiation":
        # Straight on below the coldest temperature, so that the flux keeps to its slope.
        squared = t * t
        emitted: np.ndarray = boundary.value * SIGMA * (squared * squared - ambient**4)
        return emitted + coefficient(boundary, t) * (temperature - t)
    return np.asarray(boundary.value(t) * (temperature - ambient))


def coefficient(boundary: Any, temperature: np.ndarray) -> np.ndarray:
    """Return the positive part of the flux's derivative, in W/(m2 K): 4 eps sigma T^3, or h(T)."""
    t = np.maximum(temperature, COLDEST)
    return 4 * boundary.value * SIGMA * (t * t * t) if boundary.kind == "radiation" else boundary.value(t)


def beyond(boundary: Any, temperature: np.ndarray) -> np.ndarray | None:
    """Return the other part of the derivative, h'(T) (T - T_a), of either sign; None for radiation."""
    if boundary.kind == "radiation":
        return None
    t = np.maximum(temperature, COLDEST)
    return np.asarray(boundary.value.slope(t) * (temperature - float(boundary.ambient)))


def slope(boundary: Any, temperature: np.ndarray) -> np.ndarray:
    """Return the derivative of the flux, in W/(m2 K)."""
    rest = beyond(boundary, temperature)
    return coefficient(boundary, temperature) + (0.0 if rest is None else rest)
