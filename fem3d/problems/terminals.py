"""Electrodes whose potential is not given: behind a resistance, or with a given current.

The potential phi of such an electrode is one number U: beside the functions that vanish on all electrodes the potential
is sought of one more, its unit function e, which is 1 on it. With the bilinear form a of the conductor

  a(phi, v) = 0  for all v that vanish on electrodes,  a(phi, e) + U / R = V / R  or  a(phi, e) = I,

V being the voltage behind the resistance R, I the current into the solid. A given current is the limit of an infinite
R.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Terminal:
    """An electrode with its ``unit`` function (functions,), a function ``at`` which its given value stands in vectors
    (its voltage in V, or its current in A), and its ``resistance`` (ohm), infinite for a given current."""

    name: str
    unit: np.ndarray
    at: int
    resistance: float

    @property
    def conductance(self) -> float:
        """Of the resistance (S)."""
        return 1 / self.resistance

    def load(self, given: np.ndarray) -> np.ndarray:
        """(...,): the current (A) of vectors of given values (..., functions) into the electrode at potential zero."""
        values: np.ndarray = given[..., self.at]
        return values if np.isinf(self.resistance) else values * self.conductance


def packed(terminals: Sequence[Terminal], free: np.ndarray, charge: np.ndarray) -> np.ndarray:
    """The charges (functions,) by unknowns: first free functions, then terminals."""
    return np.concatenate([charge[free], [t.unit @ charge for t in terminals]])


def unpacked(terminals: Sequence[Terminal], free: np.ndarray, unknowns: np.ndarray, size: int) -> np.ndarray:
    """The potential (functions,) of unknowns: of the free functions, then of the terminals."""
    potentials = np.zeros(size)
    potentials[free] = unknowns[: len(free)]
    for t, potential in zip(terminals, unknowns[len(free) :], strict=True):
        potentials += potential * t.unit
    return potentials
