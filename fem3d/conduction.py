"""What the coupled problem needs of an electric problem, whatever its mesh, and the current fields that it makes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np

from fem3d.joule import Tested

Field = list[np.ndarray]
"""A function or a vector at the points of the quadrature, as arrays over the pieces of the conductor."""

SAME = 1e-9  # relative size below which a current field is taken for a sum of others


@dataclass(frozen=True, eq=False)
class Potential:
    """The potential (V) at the nodes of the conductor, the current density (A/m2), and the current (A) that enters at
    each node (zero at free ones); ``through``: that through sections, where it isn't read off the density; ``steps`` of
    the iteration."""

    potential: np.ndarray
    density: Field
    reaction: np.ndarray
    steps: int = 0
    through: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Pattern:
    """A current field: its density, the power (channels,) that the electrodes supply to it at their voltages, and the
    current (A) that enters at each electrode or passes a probe. All three are linear in the field."""

    density: Field
    supply: np.ndarray
    currents: dict[str, float]

    def plus(self, factor: float, other: Pattern, scale: float) -> Pattern:
        """(self + factor * other) * scale."""
        return Pattern(
            [(a + factor * b) * scale for a, b in zip(self.density, other.density, strict=True)],
            (self.supply + factor * other.supply) * scale,
            {name: (i + factor * other.currents[name]) * scale for name, i in self.currents.items()},
        )


class Conduction(Protocol):
    """The electric problem of one mesh: ``voltages`` (channels, given nodes), and whether the resistivity depends on
    the temperature. Rises are of all nodes of the heat problem."""

    @property
    def voltages(self) -> np.ndarray:
        """(channels, given nodes) in V."""

    @property
    def warms(self) -> bool:
        """Whether any resistivity depends on the temperature."""

    def conducts(self, rise: np.ndarray) -> bool:
        """Whether the resistivity is positive everywhere at a rise."""

    def solve(self, rise: np.ndarray, voltage: np.ndarray, guess: np.ndarray | None = None) -> Potential:
        """The potential at a rise and voltages of the given nodes, perhaps from that of a similar state."""

    def pattern(self, potential: Potential) -> Pattern:
        """The current field of a potential."""

    def product(self, a: Field, b: Field) -> float:
        """The integral of rho Ja . Jb at the initial temperature (W)."""

    def joule_load(self, a: Field, b: Field, rise: np.ndarray) -> np.ndarray:
        """(all nodes,): integral of rho Ja . Jb v, in W."""

    def joule(self, density: Field, rise: np.ndarray) -> dict[str, float]:
        """The Joule heat (W) of each conducting part by name."""

    def tested(self, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
        """The Joule heat of pairs of current fields, tested with temperature fields (free nodes, r)."""


C = TypeVar("C", bound=Conduction)


def independent(conductor: Conduction, potentials: Sequence[Potential]) -> list[Pattern]:
    """The current fields of some potentials, each without what earlier ones hold of it, orthogonal in the cold
    resistance and of the size of the first; those that add nothing are left out."""
    found: list[Pattern] = []
    product = conductor.product
    for potential in potentials:
        new = conductor.pattern(potential)
        whole = product(new.density, new.density)
        for pattern in found:
            share = product(pattern.density, new.density) / product(pattern.density, pattern.density)
            new = new.plus(-share, pattern, 1.0)
        left = product(new.density, new.density)
        if left > SAME**2 * whole:
            size = product(found[0].density, found[0].density) if found else left
            found.append(new.plus(0.0, new, np.sqrt(size / left)))
    return found


def supplies(patterns: Sequence[Pattern], channels: int) -> np.ndarray:
    """(channels, patterns): the power that the electrodes supply to each."""
    return np.stack([p.supply for p in patterns], axis=1) if patterns else np.zeros((channels, 0))


def combined(patterns: Sequence[Pattern], c: np.ndarray) -> Field:
    """The current field with coefficients c."""
    return combine([p.density for p in patterns], c)


def combine(densities: Sequence[Field], c: np.ndarray) -> Field:
    """The sum of some fields with coefficients c."""
    return [sum(f * d[b] for f, d in zip(c, densities, strict=True)) for b in range(len(densities[0]))]  # type: ignore[misc]
