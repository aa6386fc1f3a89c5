"""The current fields of a reduced problem: independent, and free of sources inside the conductor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fem3d.problems.current import Conductor, Pattern, Potential

SAME = 1e-9  # relative size below which a current field is taken for a sum of others


def independent(conductor: Conductor, potentials: Sequence[Potential]) -> list[Pattern]:
    """The current fields of some potentials, without sources and orthogonal to earlier fields in the
    cold resistance, scaled to the first; dependent fields are left out."""
    patterns: list[Pattern] = []
    product = conductor.product
    for potential in potentials:
        new = conductor.pattern(potential)
        whole = product(new.density, new.density)
        for pattern in patterns:
            share = product(pattern.density, new.density) / product(pattern.density, pattern.density)
            new = new.plus(-share, pattern, 1.0)
        new = closed(conductor, new)
        remaining = product(new.density, new.density)
        if remaining > SAME**2 * whole:
            size = product(patterns[0].density, patterns[0].density) if patterns else remaining
            patterns.append(new.plus(0.0, new, np.sqrt(size / remaining)))
    return patterns


def closed(conductor: Conductor, pattern: Pattern) -> Pattern:
    """A current field without the currents that enter inside the conductor: minus the cold conductor's response.

    The residual of a potential enters there. The difference of two nearly equal fields may consist of such residuals:
    scaled up it would violate the conservation of charge that the principle of least dissipation needs. The response is
    orthogonal in the cold resistance to all closed fields.
    """
    potential = np.zeros(conductor.space.size)
    potential[conductor.free] = conductor.solve_cold(conductor.on.flow(pattern.density)[conductor.free])
    density = -conductor.on.gradient(potential) / conductor.cold
    through = {name: float(conductor.crossing_row(name) @ potential) for name in conductor.sections}
    answer = conductor.pattern(Potential(potential, density, -conductor.on.flow(density), through))
    return pattern.plus(1.0, answer, 1.0)


def combined(parts: Sequence[Pattern | Potential], c: np.ndarray) -> np.ndarray:
    """The current density with coefficients c."""
    return np.sum([f * p.density for f, p in zip(c, parts, strict=True)], axis=0)
