"""How singular a solution is along the edges of a union of boxes and of the conditions on them.

Near an edge along z (or x, y) the solution behaves as r^s; the smallest exponent s > 0 belongs to the angular problem
-(k u')' = s^2 k u around the edge, with the conductivity k of each of the four quadrants (zero: void) and u = 0 on the
rays along which its value is given. A flat surface or a convex corner has s of 1 or more, a re-entrant corner 2/3, the
rim of an electrode on a flat face 1/2; a jump of conductivity shifts it. Sources: Grisvard, Elliptic Problems in
Nonsmooth Domains, section 4.4; Kellogg, Applicable Analysis 4, 1975.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from meshes import connected
from meshes.bricks import VOID, BrickMesh
from scenes.model import Scene

REGULAR = 0.95  # edges of this exponent or more are left to the degree

Numbers = tuple[float, float, float, float]
Rays = tuple[bool, bool, bool, bool]


def exponents(scene: Scene) -> list[dict[float, float]]:
    """Per axis, for the coordinate (m) of each plane with a singular edge in it, the smallest exponent, be it of the
    temperature or of the potential.

    An edge lies in two planes, one of each axis across it; both are listed.
    """
    mesh = connected.coarsest(scene)
    thermal = np.array([b.material.thermal_conductivity for b in mesh.boxes])
    electric = np.array([1 / (b.material.resistivity or np.inf) for b in mesh.boxes])
    found: list[dict[float, float]] = [{}, {}, {}]
    solid, live = mesh.owner != VOID, connected.live(scene)
    _collect(mesh, np.where(solid, thermal[mesh.owner], 0.0), _held(mesh, scene, "temperature"), found)
    if live.any():
        _collect(mesh, np.where(live, electric[mesh.owner], 0.0), _held(mesh, scene, "voltage"), found)
    return found


def _collect(
    mesh: BrickMesh, conductivity: np.ndarray, held: list[np.ndarray], found: list[dict[float, float]]
) -> None:
    """Add the planes of singular edges; ``held`` says per axis which faces across it have a given value."""
    k = np.pad(conductivity, 1)
    for along in range(3):
        first, second = (d for d in range(3) if d != along)
        cells = np.moveaxis(k, (first, second, along), (0, 1, 2))
        quadrants = np.stack([cells[1:, 1:], cells[:-1, 1:], cells[:-1, :-1], cells[1:, :-1]], axis=-1)
        flat_second = np.moveaxis(held[second], (first, second, along), (0, 1, 2))
        flat_first = np.moveaxis(held[first], (first, second, along), (0, 1, 2))
        rays = np.stack([flat_second[1:], flat_first[:, 1:], flat_second[:-1], flat_first[:, :-1]], axis=-1)
        uneven = (quadrants.min(axis=-1) != quadrants.max(axis=-1)) | (rays.any(axis=-1) & ~rays.all(axis=-1))
        for i, j, layer in np.argwhere(uneven & (quadrants.max(axis=-1) > 0)):
            a, b, c, d = quadrants[i, j, layer].tolist()
            p, q, r, s = rays[i, j, layer].tolist()
            exponent_here = exponent((a, b, c, d), (p, q, r, s))
            if exponent_here < REGULAR:
                for axis, at in ((first, i), (second, j)):
                    plane = float(mesh.axes[axis].breaks[at])
                    found[axis][plane] = min(exponent_here, found[axis].get(plane, 1.0))


def _held(mesh: BrickMesh, scene: Scene, kind: str) -> list[np.ndarray]:
    """Per axis, which faces across it have a given value: one plane more than cells along it, and a margin of one
    cell across, as `_collect` pads."""
    shape = mesh.owner.shape
    found = []
    for d in range(3):
        faces = np.zeros([n + 1 if e == d else n + 2 for e, n in enumerate(shape)], dtype=bool)
        for b in scene.boundaries:
            spans = mesh.spans(b.lower, b.upper)
            if b.kind == kind and spans[d][0] == spans[d][1]:
                at = [slice(p + 1, q + 1) for p, q in spans]
                at[d] = slice(spans[d][0], spans[d][0] + 1)
                faces[tuple(at)] = True
        found.append(faces)
    return found


@lru_cache(maxsize=512)
def exponent(quadrants: Numbers, rays: Rays = (False, False, False, False)) -> float:
    """The smallest positive exponent around an edge whose quadrants, in order, have these conductivities; ray i, at
    which quadrant i begins, has a given value or not.

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
    given = np.zeros(n, dtype=bool)
    given[[2 * per_quadrant * i for i in range(4) if rays[i]]] = True
    solid = np.flatnonzero((np.diag(b) > 0) & ~given)
    if not len(solid):
        return 1.0
    root = np.linalg.cholesky(b[np.ix_(solid, solid)])
    half = np.linalg.solve(root, a[np.ix_(solid, solid)])
    squares = np.linalg.eigvalsh(np.linalg.solve(root, half.T))
    constants = _constants(quadrants, rays)
    return float(np.sqrt(max(squares[constants], 0.0))) if len(squares) > constants else 1.0


def _constants(quadrants: Numbers, rays: Rays) -> int:
    """How many separate solid pieces have no given value: each has a constant of exponent zero."""
    joined = [q > 0 and quadrants[i - 1] > 0 and not rays[i] for i, q in enumerate(quadrants)]
    if all(joined):
        return 1
    count = 0
    for start in range(4):
        if quadrants[start] <= 0 or joined[start]:
            continue
        end = start
        while joined[(end + 1) % 4]:
            end = (end + 1) % 4
        count += not rays[start] and not rays[(end + 1) % 4]
    return count
