"""The weak forms of the two problems, in scikit-fem; the matrices of bricks are tested against these definitions.

Heat:      rho c dT/dt = div(k grad T) + |J|^2 / sigma,   k dT/dn + h (T - T_air) = 0 on cooled faces,
Current:   div(sigma grad phi) = 0,                       J = -sigma grad phi,   sigma = 1 / resistivity(T).

Each function takes the coefficient of an element as ``w.<name>`` (per quadrature point).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem import BilinearForm, LinearForm
from skfem.helpers import dot, grad


@BilinearForm
def conduction(u: Any, v: Any, w: Any) -> Any:
    """k grad u . grad v, or sigma grad u . grad v; k one for each axis where there are three."""
    if np.ndim(w.conductivity) > 2:
        return (w.conductivity * grad(u) * grad(v)).sum(axis=0)
    return w.conductivity * dot(grad(u), grad(v))


@BilinearForm
def capacity(u: Any, v: Any, w: Any) -> Any:
    """rho c u v."""
    return w.heat_capacity * u * v


@BilinearForm
def film(u: Any, v: Any, w: Any) -> Any:
    """h u v on a cooled face."""
    return w.coefficient * u * v


@LinearForm
def joule_heat(v: Any, w: Any) -> Any:
    """sigma |grad phi|^2 v."""
    return w.conductivity * dot(grad(w.potential), grad(w.potential)) * v
