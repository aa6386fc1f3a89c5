"""Where a solution leaves the ends of a table over the temperature, beyond which the property is taken for constant."""

from __future__ import annotations

import numpy as np

from fem3d.problems.heat import HeatProblem
from scenes import laws

# a table is left only beyond this fraction of the span of temperatures: given temperatures at its end are met to that
CLOSE = 1e-3


def tables(heat: HeatProblem, rises: np.ndarray, keys: tuple[str, ...]) -> list[str]:
    """A sentence for each table among some properties that fields (k, all nodes), rises in K, get out of."""
    domain, sentences = heat.domain, dict[str, None]()
    space, start, fields = domain.space, domain.scene.initial_temperature, heat.field(np.atleast_2d(rises))
    for body, material in enumerate(domain.materials):
        cells = np.flatnonzero(domain.body == body)
        given = [(key, law) for key in keys for law in laws.of(getattr(material, key)) if isinstance(law, laws.Table)]
        if not given or not len(cells):
            continue
        # Inside the cells, and at their vertices, where the coefficient of a function is its value.
        vertices = np.flatnonzero(space.of(cells) & (space.unit > 0))
        reached = np.concatenate([fields[:, vertices].ravel(), *(space.on(cells).value(u).ravel() for u in fields)])
        low, high = start + float(reached.min()), start + float(reached.max())
        slack = CLOSE * (high - low)
        for key, law in given:
            first, last = law.temperatures[0], law.temperatures[-1]
            if low < first - slack or high > last + slack:
                known = f"{key} of {material.name} is a table from {first:,.0f} to {last:,.0f} K"
                sentences[f"{known}, and {low:,.0f} to {high:,.0f} K are reached: beyond its ends it is constant"] = (
                    None
                )
    return list(sentences)
