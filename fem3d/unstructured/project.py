"""The coupled problem of a mesh with groups, projected on a few temperature fields and current fields."""

from __future__ import annotations

from typing import Any

import numpy as np

from fem3d.reduced import Reduced, orthonormal
from fem3d.unstructured.conductor import Conductor
from fem3d.unstructured.heat import Heat
from fem3d.unstructured.patterns import Pattern


def project(heat: Heat, conductor: Conductor | None, fields: np.ndarray, patterns: list[Pattern]) -> Reduced:
    """The reduced problem (`fem3d.reduced`) on temperature fields (free nodes, r) and current fields.

    The heat of pairs of current fields is tested with vectors and one sparse matrix a pair, which hold every integral.
    """
    untyped: Any = heat
    basis = orthonormal(untyped, fields)
    r, m, n, channels = basis.shape[1], len(patterns), heat.free, heat.inputs.count
    stiffness = basis.T @ (heat.inner_stiffness @ basis)
    lifts = heat.lifts
    lifted = [c for c in range(channels) if lifts[c].any()]
    source, inertia = heat.loads[:, :n] @ basis, np.zeros((channels, r))
    for c in lifted:
        inertia[c] = (heat.mass @ lifts[c])[:n] @ basis
        if not heat.anchored:
            source[c] -= (heat.stiffness @ lifts[c])[:n] @ basis
    supply = np.stack([p.supply for p in patterns], axis=1) if m else np.zeros((channels, 0))
    cold, warm = np.zeros((channels, m, m)), np.zeros((m, m, r))
    cold_load, warm_load = np.zeros((channels, m, m, r)), np.zeros((m, m, r, r))
    held = {name: (np.zeros((channels, m, m)), np.zeros((m, m, r))) for name in heat.fixed_sets}
    warms = conductor is not None and bool(conductor.warm.any())
    for i in range(m):
        for j in range(i + 1):
            assert conductor is not None
            both = (patterns[i].density * patterns[j].density).sum(axis=-1)
            at_start = heat.space.load(conductor.cold * both, conductor.cells)
            per_kelvin = heat.space.mass(conductor.warm * both, conductor.cells) if warms else None
            for p, q in {(i, j), (j, i)}:
                cold[0, p, q] = at_start.sum()
                cold_load[0, p, q] = at_start[:n] @ basis
                for name, nodes in heat.fixed_sets.items():
                    held[name][0][0, p, q] = at_start[nodes].sum()
            if per_kelvin is None:
                continue
            spread = per_kelvin[:, :n] @ basis  # (all nodes, r)
            shifted = {c: per_kelvin @ lifts[c] for c in lifted}
            for p, q in {(i, j), (j, i)}:
                warm[p, q] = spread.sum(axis=0)
                warm_load[p, q] = basis.T @ spread[:n]
                for c, own in shifted.items():
                    cold[c, p, q] += own.sum()
                    cold_load[c, p, q] += own[:n] @ basis
                for name, nodes in heat.fixed_sets.items():
                    held[name][1][p, q] = spread[nodes].sum(axis=0)
                    for c, own in shifted.items():
                        held[name][0][c, p, q] += own[nodes].sum()
    return Reduced(basis, stiffness, source, inertia, supply, cold, warm, cold_load, warm_load, {}, held, {})
