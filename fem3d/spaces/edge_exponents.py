"""How singular a solution is along the edges of a mesh: where angles, materials or conditions meet.

Near an edge the solution behaves as r^s. The smallest exponent s > 0 belongs to the angular problem `exponent` of the
cells around the edge. A flat surface or a convex corner has s of 1 or more, a re-entrant corner 2/3, the rim of an
electrode on a flat face 1/2; a jump of conductivity shifts it.

- Where a given temperature meets a face that heat passes, s may be 1 while the two conditions contradict each other,
  which leaves r log r: too rough for the degree alone, unless the heat that passes is small.
- Where two given values differ the solution jumps (s = 0). Its effect on a reading falls with the length of the first
  cell to the power of the exponent of the dual solution, as if both had half of this exponent.
- Near the rim of a contact nothing passes the contact; beyond its resistance times the conductivity the contact is as
  good as perfect. The smaller of both exponents counts. A cell in which that distance is not resolved counts as void in
  the former: it carries less around the rim than the contact passes.

References: Grisvard, Elliptic Problems in Nonsmooth Domains, section 4.4; Kellogg, Applicable Analysis 4, 1975.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from skfem import Basis, ElementLinePp, Mesh, MeshLine
from skfem.models.poisson import laplace, mass
from skfem.refdom import Refdom

from fem3d.spaces.domain import Domain, box_domain
from meshes import grid as grids
from meshes.grading import Features
from scenes import faces, physics
from scenes.model import Scene, Value, bends, values

AROUND_ONE = 0.05  # edges of an exponent nearer to 1, or above, are left to the degree, but for contradictions
RESOLVED = 1e-3  # of the shortest edge: at a contact with a shorter length k R the rim counts as smooth: a choice
PASSES = 0.05  # Biot number, with the scene's extent, from which on convection contradicts: 5 % of a rise as gradient
ANGULAR = 8  # degree of the angular problem's elements, whose exponents are then exact to about 1e-8
DEGREE = np.pi / 180  # angles are rounded to this, which moves an exponent by a percent

Numbers = tuple[float, ...]
Rays = tuple[bool, ...]


def features(scene: Scene) -> Features:
    """Return the planes of a scene of boxes with the smallest exponent of the edges in each, for either problem."""
    grid = grids.coarsest(scene, 1)
    domain = box_domain(scene, grid)
    mesh, exponents = domain.space.mesh, at_edges(domain).min(axis=0)
    ends = mesh.p[:, mesh.edges]
    across = np.where((ends[:, 0] == ends[:, 1]) & np.isfinite(exponents), ends[:, 0], np.nan)
    by_plane = tuple(
        {x: float(exponents[at == x].min()) for x in np.unique(at[~np.isnan(at)]).tolist()} for at in across
    )
    return Features(tuple(frozenset(b[1:-1].tolist()) for b in grid.breaks), by_plane)


def at_edges(domain: Domain) -> np.ndarray:
    """Return (2, edges) the smallest exponents of the temperature and of the potential; infinite at regular edges."""
    mesh = domain.space.mesh
    every = [[np.full(mesh.edges.shape[1], np.inf)] for _ in range(2)]
    if physics.heat(domain.scene):
        k, torn = _across(domain.per_cell("thermal_conductivity")), domain.space.torn
        given, passing = _given(domain, "temperature"), _passing(domain)
        every[0].append(_exponents(mesh, k, given, passing))
        if len(torn):
            largest = max(joint.contact.thermal_resistance for joint in domain.contacts)
            fine = RESOLVED * np.linalg.norm(np.diff(mesh.p[:, mesh.edges], axis=1), axis=0).min()
            every[0].append(_exponents(mesh, np.where(k * largest > fine, k, 0.0), given, passing, torn))
    if domain.live.any():
        sigma = np.where(domain.live, 1 / _across(np.where(domain.live, domain.per_cell("resistivity"), 1.0)), 0.0)
        given, torn = _given(domain, "voltage"), domain.electric.space.torn
        nowhere = np.zeros(len(given), bool)
        every[1] += [
            _exponents(mesh, sigma, given, nowhere, facets) for facets in ([None, torn] if len(torn) else [None])
        ]
    return np.array([np.min(each, axis=0) for each in every])


def at_vertices(domain: Domain) -> np.ndarray:
    """Return (2, 3, vertices) the smallest exponent below 1 of edges at each vertex, by the axis closest to an edge."""
    mesh = domain.space.mesh
    smallest = np.full((2, 3, mesh.p.shape[1]), np.inf)
    for at, exponents in zip(smallest, at_edges(domain), strict=True):
        for end in mesh.edges:
            np.minimum.at(at, (_axis(mesh), end), np.where(exponents < 1 - AROUND_ONE, exponents, np.inf))
    return smallest


def _axis(mesh: Mesh) -> np.ndarray:
    """Return (edges,) the axis closest to each edge."""
    return np.abs(mesh.p[:, mesh.edges[1]] - mesh.p[:, mesh.edges[0]]).argmax(axis=0)


def _across(k: np.ndarray) -> np.ndarray:
    """Return (3, cells) a property around edges along each axis: stretched to be isotropic, the geometric mean across.

    ``k`` is (cells,), or (3, cells) along the axes.
    """
    k = np.broadcast_to(k, (3, k.shape[-1]))
    return np.sqrt(k[[1, 0, 0]] * k[[2, 2, 1]])


def _given(domain: Domain, kind: str) -> np.ndarray:
    """Return (facets,) the number of the value that each facet is given; 0 for none."""
    numbers, given = dict[Value, int](), np.zeros(domain.space.mesh.facets.shape[1], int)
    for b in domain.scene.boundaries:
        if b.kind == kind:
            given[domain.facets(b)] = numbers.setdefault(b.value, len(numbers) + 1)
    return given


def _passing(domain: Domain) -> np.ndarray:
    """Return (facets,) which facets heat passes: by a given flux, or by convection from the Biot number `PASSES` on.

    Radiation and laws of convection are taken at the hottest given temperature plus a rise: that of the largest given
    flux across the least extent."""
    mesh, scene = domain.space.mesh, domain.scene
    passing, extents = np.zeros(mesh.facets.shape[1], bool), np.ptp(mesh.p, axis=1)
    k = np.broadcast_to(domain.per_cell("thermal_conductivity"), (3, len(domain.body)))
    given = [b.value if b.kind == "temperature" else b.ambient for b in scene.boundaries if b.kind != "voltage"]
    hottest = max([scene.initial_temperature, *(t for t in given if isinstance(t, float | int))])
    fluxes = [abs(q) for b in scene.boundaries if b.kind == "heat_flux" for q in values(b.value)]
    hottest += max(fluxes, default=0.0) * extents.min() / k.min()
    for b in scene.boundaries:
        if b.kind == "heat_flux":
            passing[domain.facets(b)] |= b.value != 0.0
        elif bends(b) or (b.kind == "convection" and isinstance(b.value, float | int)):
            h, facets = faces.coefficient(b, np.array(hottest)) if bends(b) else b.value, domain.facets(b)
            normal = np.ptp(mesh.p[:, mesh.facets[:, facets]], axis=1).argmin(axis=0)
            passing[facets] |= h * extents[normal] >= PASSES * k[normal, mesh.f2t[0, facets]]
    return passing


def _exponents(
    mesh: Mesh, k: np.ndarray, given: np.ndarray, passing: np.ndarray, torn: np.ndarray | None = None
) -> np.ndarray:
    """Return (edges,) the exponent at each edge; infinite where regular.

    ``k`` (3, cells) is the conductivity around edges along each axis, ``given`` (facets,) numbers the given values, and
    heat is ``passing`` (facets,). The facets ``torn`` are insulated; if given, only their edges are evaluated.
    """
    exponents, cut = np.full(mesh.edges.shape[1], np.inf), np.zeros(len(given), bool)
    # Facets at which the conductivity changes or a value is given: their edges may be singular.
    pair = np.where(mesh.f2t >= 0, k[:, mesh.f2t], 0.0)
    uneven = (pair[:, 0] != pair[:, 1]).any(axis=0) | ((given > 0) & pair.any(axis=(0, 1)))
    if torn is not None:
        cut[torn] = True
        uneven = cut
    marked = np.zeros(mesh.p.shape[1], bool)
    marked[mesh.facets[:, uneven]] = True
    around = _wedges(mesh, marked, np.all(k > 0, axis=0))
    k, cut = k[_axis(mesh)[around.edge], around.cell], cut[around.first]
    passing = passing[around.first] | passing[around.last]
    ahead, behind, gap, angle = given[around.first], given[around.last[around.before]], around.gap, around.angle
    # Rays at which a wedge of another kind begins; wedges between two of them are joined.
    breaks = (k != k[around.before]) | (ahead > 0) | (gap > 0) | cut
    for i, j in pairwise([*np.flatnonzero(np.diff(around.edge, prepend=-1)).tolist(), len(k)]):
        at = i + np.flatnonzero(breaks[i:j])
        values = {*ahead[i:j].tolist(), *behind[i:j].tolist()} - {0}
        flat = len(at) == 1 and not values and angle[i:j].sum() < np.pi + DEGREE
        if not len(at) or flat or (torn is not None and not cut[at].any()):
            continue
        sums = np.add.reduceat(np.concatenate([angle[at[0] : j], angle[i : at[0]]]), at - at[0])
        wedges: list[tuple[float, bool, bool, float]] = []
        for n, whole in zip(at.tolist(), np.maximum(np.round(sums / DEGREE), 1).tolist(), strict=True):
            if gap[n]:
                wedges.append((0.0, bool(behind[n]), False, round(gap[n] / DEGREE) * DEGREE))
            wedges.append((float(k[n]), bool(ahead[n]), bool(cut[n]), whole * DEGREE))
        # Half of the exponent of the dual solution where the solution jumps.
        s = exponent(*zip(*wedges, strict=True)) / (2 if len(values) > 1 else 1)
        if s < 1 + (AROUND_ONE if len(values) > 1 or (values and passing[i:j].any()) else -AROUND_ONE):
            exponents[around.edge[i]] = s
    return exponents


@lru_cache
def _sides(reference: type[Refdom]) -> tuple[np.ndarray, np.ndarray]:
    """Return (2, edges) the two facets at each edge of a reference cell, and a corner of each that is off the edge."""
    facets = [[n for n, facet in enumerate(reference.facets) if {*edge} <= {*facet}] for edge in reference.edges]
    corners = [
        [next(c for c in reference.facets[n] if c not in edge) for n in both]
        for edge, both in zip(reference.edges, facets, strict=True)
    ]
    return np.array(facets).T, np.array(corners).T


class _Wedges(NamedTuple):
    """The cells around some edges (n,), one edge after the other, and in turn around each."""

    edge: np.ndarray
    cell: np.ndarray
    angle: np.ndarray  # radians
    gap: np.ndarray  # radians, of the void before a wedge
    first: np.ndarray  # facet at which a wedge begins
    last: np.ndarray
    before: np.ndarray  # index of the wedge before, around the same edge


def _wedges(mesh: Mesh, marked: np.ndarray, solid: np.ndarray) -> _Wedges:
    """Return the wedges around edges between ``marked`` vertices (vertices,), of ``solid`` cells (cells,)."""
    cells = np.flatnonzero((marked[mesh.t].sum(axis=0) >= 2) & solid)
    at, edges = mesh.p[:, mesh.t[:, cells]], mesh.t2e[:, cells].ravel()
    ends = mesh.p[:, mesh.edges[:, edges]]
    axis = ends[:, 1] - ends[:, 0]
    axis /= np.linalg.norm(axis, axis=0)
    across = np.eye(3)[np.abs(axis).argmin(axis=0)].T
    across -= axis * (axis * across).sum(axis=0)
    across /= np.linalg.norm(across, axis=0)
    upright = np.cross(axis.T, across.T).T
    angles, facets = [], []
    for numbers, corners in zip(*_sides(mesh.refdom), strict=True):
        away = at[:, corners].reshape(3, -1) - ends[:, 0]
        angles.append(np.arctan2((away * upright).sum(axis=0), (away * across).sum(axis=0)))
        facets.append(mesh.t2f[numbers][:, cells].ravel())
    turn = (angles[1] - angles[0]) % (2 * np.pi)
    swapped = turn > np.pi
    start, angle = np.where(swapped, angles[1], angles[0]) % (2 * np.pi), np.where(swapped, 2 * np.pi - turn, turn)
    first, last = np.where(swapped, facets[::-1], facets)
    order = np.lexsort([start, edges])
    order = order[marked[mesh.edges[:, edges[order]]].all(axis=0)]
    each = edges, np.tile(cells, len(mesh.t2e)), angle, first, last, start
    edge, cell, angle, first, last, start = (x[order] for x in each)
    begins = np.flatnonzero(np.diff(edge, prepend=-1))
    before = np.arange(len(edge)) - 1
    before[begins] = np.append(begins[1:], len(edge))[: len(begins)] - 1
    gap = (start - start[before] - angle[before]) % (2 * np.pi)
    gap = np.where((gap > DEGREE) & (gap < 2 * np.pi - DEGREE), gap, 0.0)
    return _Wedges(edge, cell, angle, gap, first, last, before)


@lru_cache(maxsize=512)
def exponent(
    wedges: Numbers, rays: Rays = (False,) * 4, cuts: Rays = (False,) * 4, angles: Numbers = (np.pi / 2,) * 4
) -> float:
    """Return the smallest exponent s > 0 around an edge: -(k u')' = s^2 k u, with u = 0 on rays with given values.

    Parameters
    ----------
    wedges : conductivity of each wedge around the edge; 0 conducts nothing
    rays : whether a value is given where each wedge begins
    cuts : whether nothing passes from the wedge before
    angles : of the wedges (radians)

    One element of degree `ANGULAR` for each wedge solves the problem.
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
    # Each separate solid piece without a given value has a constant, whose square is zero but for rounding.
    positive = squares[squares > np.sqrt(np.finfo(float).eps)]
    return float(np.sqrt(min(positive, default=1.0)))


@lru_cache(maxsize=1)
def _angular() -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness and the mass matrix of a wedge of one radian, its first ray first and its last ray last."""
    basis = Basis(MeshLine(np.array([0.0, 1.0])), ElementLinePp(ANGULAR))
    order = [0, *range(2, ANGULAR + 1), 1]
    stiffness, weights = (form.assemble(basis).toarray()[np.ix_(order, order)] for form in (laplace, mass))
    return stiffness, weights
