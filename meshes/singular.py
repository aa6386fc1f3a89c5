"""How singular a solution is along the edges of a union of boxes and of the conditions on them.

Near an edge along z (or x, y) the solution behaves as r^s; the smallest exponent s > 0 belongs to the angular problem
-(k u')' = s^2 k u around the edge, with the conductivity k of each of the four quadrants (zero: void) and u = 0 on the
rays along which its value is given. A flat surface or a convex corner has s of 1 or more, a re-entrant corner 2/3, the
rim of an electrode on a flat face 1/2; a jump of conductivity shifts it. Where a given temperature meets, at a right
angle, a face that heat passes, s is 1 and the two conditions contradict each other at the edge, which leaves r log r:
too rough for the degree alone, unless the heat that passes is small. Where two given values differ the solution itself
jumps (s = 0), and its effect on a reading falls with the length of the first interval to the power of the exponent of
the dual solution, as if both had half of this exponent. Across a contact nothing passes at distances from its rim below
its resistance times the conductivity, and as if it were perfect far beyond these: the smaller exponent of the two
counts, and 1/2 where a contact ends inside. A quadrant for which that distance is not resolved counts as void in
the former: as near to the rim as any cell comes it carries less around it than the contact passes. Sources: Grisvard,
Elliptic Problems in Nonsmooth Domains, section 4.4; Kellogg, Applicable Analysis 4, 1975.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from meshes import grid as grids
from meshes.grid import Grid
from scenes import faces, laws
from scenes.model import Scene, Value, bends

REGULAR = 0.95  # edges of this exponent or more are left to the degree, but for contradictions up to the next one
RESONANT = 1.05
CONSTANT = 1e-10  # squares of exponents that are zero but for rounding
ANGULAR = 8  # degree of the angular problem's elements, whose exponents are then exact to about 1e-8
RESOLVED = 1e-3  # of the smallest extent: beneath, the rim of a contact is not looked at
PASSES = 0.05  # Biot number of a film, with its box's extent across the edge, from which on it contradicts

Numbers = tuple[float, ...]
Rays = tuple[bool, ...]


def edges(scene: Scene) -> list[dict[float, float]]:
    """Per axis, for the coordinate (m) of each plane with a singular edge in it, the smallest exponent, for the
    temperature or the potential.

    An edge lies in two planes, one of each axis across it; both are listed.
    """
    grid, graph = grids.coarsest(scene), grids.graph(scene)
    cold = [b.material.at(scene.initial_temperature) for b in grid.boxes]
    thermal = np.array([laws.along(m.thermal_conductivity) for m in cold]).T
    electric = np.array([[1 / (rho or np.inf) for rho in laws.along(m.resistivity)] for m in cold]).T
    exponents: list[dict[float, float]] = [{}, {}, {}]
    live = graph.live.reshape(graph.owner.shape)
    k = np.where(grid.solid, thermal[:, grid.owner], 0.0)
    fine = RESOLVED * min(float(np.diff(b).min()) for b in grid.breaks)
    largest = max((c.thermal_resistance for c in scene.contacts), default=1.0)
    beside = np.where(k * largest > fine, k, 0.0)
    _collect(
        grid, k, beside, _held(scene, "temperature"), graph.jumps("thermal_resistance"), _passing(scene), exponents
    )
    if live.any():
        sigma, nowhere = np.where(live, electric[:, grid.owner], 0.0), graph.marked([])
        cuts = graph.jumps("electrical_resistance")
        _collect(grid, sigma, sigma, _held(scene, "voltage"), cuts, nowhere, exponents)
    return exponents


def _collect(
    grid: Grid,
    conductivity: np.ndarray,
    beside: np.ndarray,
    held: list[np.ndarray],
    cuts: list[np.ndarray],
    passing: list[np.ndarray],
    exponents: list[dict[float, float]],
) -> None:
    """Add the planes of singular edges, for the ``conductivity`` (3, cells) along each axis.

    Per axis, ``held`` numbers the value given on each face across it (0: none), ``cuts`` says where a contact lets
    nothing pass, with the conductivity ``beside`` it, and ``passing`` where so much passes that it contradicts a value.

    A cell whose conductivities differ behaves across an edge as one of their geometric mean, stretched."""
    for along in range(3):
        first, second = (d for d in range(3) if d != along)
        whole, other = (_quadrants(k, first, second, along) for k in (conductivity, beside))
        rays, cut, against = (_rays(faces, first, second, along) for faces in (held, cuts, passing))
        uneven = (whole.min(axis=-1) != whole.max(axis=-1)) | (rays.any(axis=-1) & ~rays.all(axis=-1))
        uneven |= cut.any(axis=-1)
        contradicted = np.logical_and(rays.any(axis=-1), against.any(axis=-1))
        for at in map(tuple, np.argwhere(uneven & (whole.max(axis=-1) > 0)).tolist()):
            given = tuple((rays[at] > 0).tolist())
            torn = len({*rays[at].tolist()} - {0}) > 1
            s = exponent(tuple(whole[at].tolist()), given) * (0.5 if torn else 1.0)
            if cut[at].any():
                s = min(s, exponent(tuple(other[at].tolist()), given, tuple((cut[at] > 0).tolist())))
            if s < (RESONANT if torn or contradicted[at] else REGULAR):
                for axis, i in ((first, at[0]), (second, at[1])):
                    plane = float(grid.breaks[axis][i])
                    exponents[axis][plane] = min(s, exponents[axis].get(plane, RESONANT))


def _quadrants(conductivity: np.ndarray, first: int, second: int, along: int) -> np.ndarray:
    """(planes of the first axis, of the second, cells along, 4): the conductivity of the cells around each edge."""
    k = np.pad(np.sqrt(conductivity[first] * conductivity[second]), 1)
    cells = np.moveaxis(k, (first, second, along), (0, 1, 2))[..., 1:-1]
    return np.stack([cells[1:, 1:], cells[:-1, 1:], cells[:-1, :-1], cells[1:, :-1]], axis=-1)


def _rays(faces: list[np.ndarray], first: int, second: int, along: int) -> np.ndarray:
    """(planes of the first axis, of the second, cells along, 4): the marks of the four faces at each edge."""
    across_first, across_second = (np.pad(np.moveaxis(faces[d], (first, second, along), (0, 1, 2)), 1)[..., 1:-1]
                                   for d in (first, second))  # fmt: skip
    across_first, across_second = across_first[1:-1], across_second[:, 1:-1]
    return np.stack([across_second[1:], across_first[:, 1:], across_second[:-1], across_first[:, :-1]], axis=-1)


def _passing(scene: Scene) -> list[np.ndarray]:
    """Per axis, which faces across it heat passes by a given flux, or by a film that is no mere trifle."""
    graph, through, start = grids.graph(scene), [], scene.initial_temperature
    given = [b.value if b.kind == "temperature" else b.ambient for b in scene.boundaries if b.kind != "voltage"]
    hottest = max([start, *(t for t in given if isinstance(t, float | int))])
    for b in scene.boundaries:
        if b.kind == "heat_flux" and b.value != 0.0:
            through.append(b)
        elif bends(b) or (b.kind == "convection" and isinstance(b.value, float | int)):
            (d,), sides = graph.flat(b.lower, b.upper), graph.f2t[:, graph.faces(b)]
            film: Any = float(faces.coefficient(b, np.array(hottest))) if bends(b) else b.value
            boxes = [scene.boxes[n] for n in np.unique(graph.owner.ravel()[sides[sides >= 0]])]
            k = [laws.along(box.material.at(start).thermal_conductivity)[d] for box in boxes]
            if any(film * (box.upper[d] - box.lower[d]) >= PASSES * k_box for k_box, box in zip(k, boxes, strict=True)):
                through.append(b)
    return graph.marked((graph.faces(b), 1) for b in through)


def _held(scene: Scene, kind: str) -> list[np.ndarray]:
    """Per axis, the number of the value of a kind that each face across it is given; 0 for none."""
    graph, numbers = grids.graph(scene), dict[Value, int]()
    given = [b for b in scene.boundaries if b.kind == kind]
    return graph.marked((graph.faces(b), numbers.setdefault(b.value, len(numbers) + 1)) for b in given)


@lru_cache(maxsize=512)
def exponent(
    wedges: Numbers, rays: Rays = (False,) * 4, cuts: Rays = (False,) * 4, angles: Numbers = (np.pi / 2,) * 4
) -> float:
    """The smallest positive exponent around an edge whose wedges of some ``angles``, in order, have these
    conductivities; ray i, at which wedge i begins, has a given value or not, and is one that nothing passes (one of
    ``cuts``) or not.

    The angular problem is solved with one element of degree `ANGULAR` for each wedge; 0 conducts nothing.
    """
    stiffness, mass = _angular()
    count = len(wedges)
    n = count * ANGULAR
    a, b = np.zeros((n + count, n + count)), np.zeros((n + count, n + count))
    for i, (k, angle) in enumerate(zip(wedges, angles, strict=True)):
        # The ray at which it begins, its inner functions, the ray of the next one: of a cut the other side.
        dofs, following = (ANGULAR * i + np.arange(ANGULAR + 1)) % n, (i + 1) % count
        dofs[-1] = n + following if cuts[following] else ANGULAR * following
        a[np.ix_(dofs, dofs)] += k / angle * stiffness
        b[np.ix_(dofs, dofs)] += k * angle * mass
    given = np.zeros(n + count, dtype=bool)
    given[[at for i in range(count) if rays[i] for at in (ANGULAR * i, n + i)]] = True
    solid = np.flatnonzero((np.diag(b) > 0) & ~given)
    root = np.linalg.cholesky(b[np.ix_(solid, solid)])
    half = np.linalg.solve(root, a[np.ix_(solid, solid)])
    squares = np.linalg.eigvalsh(np.linalg.solve(root, half.T))
    # Each separate solid piece without a given value has a constant.
    return float(np.sqrt(min(squares[squares > CONSTANT], default=1.0)))


@lru_cache(maxsize=1)
def _angular() -> tuple[np.ndarray, np.ndarray]:
    """(functions, functions) twice: the stiffness and the mass matrix of a wedge of one radian; the function of the ray
    at which it begins is first, the ray at its end last."""
    from skfem import Basis, ElementLinePp, MeshLine
    from skfem.models.poisson import laplace, mass

    basis = Basis(MeshLine(np.array([0.0, 1.0])), ElementLinePp(ANGULAR))
    order = [0, *range(2, ANGULAR + 1), 1]
    stiffness, weights = (form.assemble(basis).toarray()[np.ix_(order, order)] for form in (laplace, mass))
    return stiffness, weights
