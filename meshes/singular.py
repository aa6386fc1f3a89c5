"""How singular a solution is along the edges of a union of boxes.

Near an edge along z (or x, y) the solution behaves as r^s; the smallest exponent s > 0 belongs to the angular problem
-(k u')' = s^2 k u around the edge, with the conductivity k of each of the four quadrants (zero: void). A flat surface
or a convex corner has s of 1 or more, a re-entrant corner 2/3; a jump of conductivity shifts it. Sources: Grisvard,
Elliptic Problems in Nonsmooth Domains, section 4.4; Kellogg, Applicable Analysis 4, 1975.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from meshes.bricks import VOID, BrickMesh

REGULAR = 0.95  # edges of this exponent or more are left to the degree


def exponents(mesh: BrickMesh) -> list[dict[float, float]]:
    """Per axis, for the coordinate (m) of each plane with a singular edge in it, the smallest exponent.

    An edge lies in two planes, one of each axis across it; both are listed.
    """
    k = np.zeros(tuple(n + 2 for n in mesh.owner.shape))
    conductivity = np.array([b.material.thermal_conductivity for b in mesh.boxes])
    k[1:-1, 1:-1, 1:-1] = np.where(mesh.owner != VOID, conductivity[mesh.owner], 0.0)
    found: list[dict[float, float]] = [{}, {}, {}]
    for along in range(3):
        first, second = (d for d in range(3) if d != along)
        cells = np.moveaxis(k, (first, second, along), (0, 1, 2))
        quadrants = np.stack([cells[1:, 1:], cells[:-1, 1:], cells[:-1, :-1], cells[1:, :-1]], axis=-1)
        for i, j, layer in np.argwhere(quadrants.min(axis=-1) != quadrants.max(axis=-1)):
            s = exponent(tuple(quadrants[i, j, layer].tolist()))
            if s < REGULAR:
                for d, at in ((first, i), (second, j)):
                    plane = float(mesh.axes[d].breaks[at])
                    found[d][plane] = min(s, found[d].get(plane, 1.0))
    return found


@lru_cache(maxsize=256)
def exponent(quadrants: tuple[float, float, float, float]) -> float:
    """The smallest positive exponent around an edge whose quadrants, in order, have these conductivities.

    The angular problem is solved with quadratic elements, 6 to a quadrant (error below 1e-5); 0 conducts nothing.
    """
    per_quadrant, h = 6, np.pi / 12
    stiffness = np.array([[7, -8, 1], [-8, 16, -8], [1, -8, 7]]) / (3 * h)
    mass = np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) * (h / 30)
    n = 8 * per_quadrant
    a, b = np.zeros((n, n)), np.zeros((n, n))
    for element in range(4 * per_quadrant):
        k = quadrants[element // per_quadrant]
        nodes = (2 * element + np.arange(3)) % n
        a[np.ix_(nodes, nodes)] += k * stiffness
        b[np.ix_(nodes, nodes)] += k * mass
    solid = np.flatnonzero(np.diag(b) > 0)
    root = np.linalg.cholesky(b[np.ix_(solid, solid)])
    half = np.linalg.solve(root, a[np.ix_(solid, solid)])
    squares = np.linalg.eigvalsh(np.linalg.solve(root, half.T))
    # Each separate solid piece has a constant of exponent zero.
    pieces = (
        sum(1 for q, before in zip(quadrants, quadrants[-1:] + quadrants[:-1], strict=True) if q > 0 == before) or 1
    )
    return float(np.sqrt(max(squares[pieces], 0.0))) if len(squares) > pieces else 1.0
