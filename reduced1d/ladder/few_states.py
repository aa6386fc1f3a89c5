"""The form that every reduction of the ladder takes: a few states, heated by a current.

    C da/dt = -G a + I^2 (s + alpha S a),   R = r + alpha s . a,   I = V / R,   a(0) = 0.

``s`` is the heat of a current of 1 A in the cold sink, which the resistivity's linear rise with temperature weighs by
1 + alpha T: so the same s gives the resistance, and the power I^2 R is what heats, to the last digit. Written in the
modes of (C, G) the capacity is one and the conductance diagonal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.linalg

OUTPUTS = ("peak", "end", "mean", "air", "air_beam")


@dataclass(frozen=True, eq=False)
class FewStates:
    """``rates`` (n,) in 1/s; ``source`` (n,) and ``feedback`` (n, n) of 1 A; ``resistance`` in ohm, ``coefficient``
    in 1/K; ``voltage`` in V. ``outputs`` are rows (n,) on the states: the rises peak, end, mean in K, and in W the heat
    to the air and that from the beam alone. ``source_beam`` and ``resistance_beam`` are the beam's part of the heat."""

    rates: np.ndarray
    source: np.ndarray
    feedback: np.ndarray
    resistance: float
    coefficient: float
    voltage: float
    outputs: dict[str, np.ndarray]
    source_beam: np.ndarray
    resistance_beam: float

    @property
    def states(self) -> int:
        """How many there are."""
        return len(self.rates)


@dataclass(frozen=True, eq=False)
class Matrices:
    """The same before it is in modes: dense ``capacity`` and ``conductance`` (n, n), and the heat of 1 A."""

    capacity: np.ndarray
    conductance: np.ndarray
    source: np.ndarray
    feedback: np.ndarray
    resistance: float
    source_beam: np.ndarray
    resistance_beam: float
    outputs: Mapping[str, np.ndarray]


def in_modes(given: Matrices, coefficient: float, voltage: float) -> FewStates:
    """The states of dense matrices (J/K, W/K), rotated into their modes.

    The pencil is solved for time constants, so that the slow modes keep full precision.
    """
    times, modes = scipy.linalg.eigh(given.capacity, given.conductance)
    rates = 1 / times[::-1]
    modes = modes[:, ::-1] * np.sqrt(rates)
    return FewStates(
        rates, given.source @ modes, modes.T @ given.feedback @ modes, given.resistance, coefficient, voltage,
        {name: row @ modes for name, row in given.outputs.items()}, given.source_beam @ modes, given.resistance_beam,
    )  # fmt: skip
