"""Transients of walls of any layers, in the Laplace domain, inverted on Talbot's contour.

With A = sqrt(s/alpha), a layer takes the admittance Y = q/T at its far face to the admittance at its near face,
Y_near = k A (Y_far + k A tanh(A d)) / (k A + Y_far tanh(A d)), and T_far/T_near = 1/(cosh(A d) + Y_far/(k A) sinh(A d))
(Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed., 3.7). Inversion: Abate and Valko, Int. J. Numer. Meth. Eng.
60, 2004, 979.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

POINTS = 22  # of the contour: good to rounding
INVERSION = 1e-11  # of the step: a bound of the inversion's error
HELD = 1e30  # W/(m2 K): a film that holds its face at the ambient temperature


@dataclass(frozen=True)
class Layer:
    """Thickness (m), conductivity (W/(m K)), heat capacity (J/(m3 K))."""

    thickness: float
    conductivity: float
    heat_capacity: float


def step_response(
    layers: Sequence[Layer], drive: Literal["temperature", "flux", "film"], size: float, far: float, times: np.ndarray,
    coefficient: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """(times, layers + 1): the rise (K) at the faces of the layers, near to far, after a step at the near face.

    The step is of its temperature (K), of the flux into it (W/m2), or of the ambient (K) behind a film of some
    ``coefficient`` (W/(m2 K)). ``far`` is the coefficient of the film at the far face towards no rise: 0 adiabatic,
    HELD held.
    """

    def transform(s: Any) -> Any:
        admittance, ratios = complex(far), []
        for layer in reversed(layers):
            root = np.sqrt(s * layer.heat_capacity / layer.conductivity)
            characteristic, d = layer.conductivity * root, root * layer.thickness
            tanh = np.tanh(d)
            ratios.append(1 / (np.cosh(d) + admittance / characteristic * np.sinh(d)))
            admittance = characteristic * (admittance + characteristic * tanh) / (characteristic + admittance * tanh)
        near = {
            "temperature": size / s, "flux": size / (s * admittance),
            "film": size / s * coefficient / (coefficient + admittance),
        }[drive]  # fmt: skip
        return near * np.cumprod([1.0, *reversed(ratios)])

    return np.array([_invert(transform, float(t)) for t in times])


def _invert(transform: Any, time: float) -> np.ndarray:
    r, angle = 2 * POINTS / (5 * time), np.arange(1, POINTS) * np.pi / POINTS
    cot = 1 / np.tan(angle)
    points, slopes = np.r_[r, r * angle * (cot + 1j)], np.r_[0.5, 1 + 1j * (angle + (angle * cot - 1) * cot)]
    terms = [np.exp(time * s) * transform(s) * slope for s, slope in zip(points, slopes, strict=True)]
    return np.asarray(r / POINTS * np.sum(terms, axis=0).real)
