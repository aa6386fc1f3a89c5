"""Current fields, of which a reduced problem takes a few, and the heat that they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem3d.unstructured.conductor import Conductor, Field, Potential

SAME = 1e-9  # relative size below which a current field is taken for a sum of others


@dataclass(frozen=True, eq=False)
class Pattern:
    """A current field: its density, the power (channels,) that the electrodes supply to it at their voltages, and the
    current (A) that enters at each electrode or passes a section. All are linear in the field."""

    density: Field
    supply: np.ndarray
    currents: dict[str, float]

    @staticmethod
    def of(conductor: Conductor, found: Potential) -> Pattern:
        """The current field of a potential."""
        currents = {name: float(found.reaction[nodes].sum()) for name, nodes in conductor.electrodes.items()}
        currents |= {f"through:{name}": current for name, current in found.through.items()}
        return Pattern(found.density, conductor.voltages @ found.reaction, currents)

    def plus(self, factor: float, other: Pattern, scale: float) -> Pattern:
        """(self + factor * other) * scale."""
        return Pattern(
            (self.density + factor * other.density) * scale,
            (self.supply + factor * other.supply) * scale,
            {name: (i + factor * other.currents[name]) * scale for name, i in self.currents.items()},
        )


def independent(conductor: Conductor, potentials: Sequence[Potential]) -> list[Pattern]:
    """The current fields of some potentials, each without what earlier ones hold of it, orthogonal in the cold
    resistance and of the size of the first; those that add nothing are left out."""
    weights = conductor.heat.space.weights[conductor.cells] * conductor.cold

    def product(a: Pattern, b: Pattern) -> float:
        return float(np.einsum("cp,cpd,cpd->", weights, a.density, b.density))

    found: list[Pattern] = []
    for potential in potentials:
        new = Pattern.of(conductor, potential)
        whole = product(new, new)
        for pattern in found:
            new = new.plus(-product(pattern, new) / product(pattern, pattern), pattern, 1.0)
        left = product(new, new)
        if left > SAME**2 * whole:
            size = product(found[0], found[0]) if found else left
            found.append(new.plus(0.0, new, np.sqrt(size / left)))
    return found


def combined(patterns: Sequence[Pattern], c: np.ndarray) -> Field:
    """The current field with coefficients c."""
    found: Field = sum(f * p.density for f, p in zip(c, patterns, strict=True))  # type: ignore[assignment]
    return found


def joule_load(conductor: Conductor, a: Field, b: Field, rise: np.ndarray) -> np.ndarray:
    """(all nodes,): integral of rho Ja . Jb v, in W."""
    return conductor.heat.space.load(conductor.resistivity(rise) * (a * b).sum(axis=-1), conductor.cells)
