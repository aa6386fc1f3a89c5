"""The Joule heat of pairs of current fields on a mesh with groups, tested with temperature fields.

Vectors and one sparse matrix a pair hold every integral.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from fem3d.conduction import Pattern
from fem3d.joule import Tested

if TYPE_CHECKING:
    from fem3d.unstructured.conductor import Conductor


def tested(conductor: Conductor, basis: np.ndarray, patterns: Sequence[Pattern]) -> Tested:
    """The sums of `Tested` for temperature fields (free nodes, r) and some current fields; ``in_box`` and
    ``potentials`` are left empty."""
    heat, lifts = conductor.heat, conductor.heat.lifts
    m, n, channels = len(patterns), heat.free, heat.inputs.count
    lifted = [c for c in range(channels) if lifts[c].any()]
    found = Tested.nothing(channels, m, basis.shape[1], heat.held)
    for i in range(m):
        for j in range(i + 1):
            both = (patterns[i].density[0] * patterns[j].density[0]).sum(axis=-1)
            at_start = heat.space.load(conductor.cold * both, conductor.cells)
            for p, q in {(i, j), (j, i)}:
                found.cold[0, p, q] = at_start.sum()
                found.cold_load[0, p, q] = at_start[:n] @ basis
                for name, part in heat.held.items():
                    found.at_held[name][0][0, p, q] = part @ at_start[n:]
            if not conductor.warms:
                continue
            per_kelvin = heat.space.mass(conductor.warm * both, conductor.cells)
            spread = per_kelvin[:, :n] @ basis  # (all nodes, r)
            shifted = {c: per_kelvin @ lifts[c] for c in lifted}
            for p, q in {(i, j), (j, i)}:
                found.warm[p, q] = spread.sum(axis=0)
                found.warm_load[p, q] = basis.T @ spread[:n]
                for c, own in shifted.items():
                    found.cold[c, p, q] += own.sum()
                    found.cold_load[c, p, q] += own[:n] @ basis
                for name, part in heat.held.items():
                    found.at_held[name][1][p, q] = part @ spread[n:]
                    for c, own in shifted.items():
                        found.at_held[name][0][c, p, q] += part @ own[n:]
    return found
