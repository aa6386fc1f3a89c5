"""How singular a solution is at the vertices of a mesh of tetrahedra: the exponents (`meshes.singular`) of the edges
that end there, whatever the angles."""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem.refdom import RefTet

from fem3d.spaces.domain import Domain
from meshes.singular import REGULAR, RESOLVED, exponent
from scenes import physics

# Angles (radians) are rounded to this, a degree: an exponent moves by a percent, and this limits
# the number of eigenvalue problems.
TOLD_APART = np.pi / 180
_EDGES, _FACETS = np.array(RefTet.edges), np.array(RefTet.facets)
_OTHERS = np.array([[i for i in range(4) if i not in edge] for edge in RefTet.edges])
_BESIDE = np.array([[[set(f) == {*edge, c} for f in RefTet.facets].index(True) for c in others]
                    for edge, others in zip(RefTet.edges, _OTHERS.tolist(), strict=True)])  # fmt: skip


def at_vertices(domain: Domain) -> np.ndarray:
    """(2, 3, vertices): the smallest exponents of the temperature and of the potential at the edges that end at each
    vertex, by the axis closest to each edge's direction; infinite where all are regular. At a contact the smaller of
    the exponents with and without the contact counts, as in `meshes.singular`."""
    mesh: Any = domain.space.mesh
    regular = np.full(mesh.edges.shape[1], np.inf)
    thermal, electric = [regular], [regular]
    if physics.heat(domain.scene):
        k, given, torn = (
            _mean(domain.per_cell("thermal_conductivity")),
            _given(domain, "temperature"),
            domain.space.torn,
        )
        thermal.append(_at_edges(mesh, k, given))
        if len(torn):
            largest = max(joint.contact.thermal_resistance for joint in domain.contacts)
            fine = RESOLVED * np.linalg.norm(np.diff(mesh.p[:, mesh.edges], axis=1), axis=0).min()
            thermal.append(_at_edges(mesh, np.where(k * largest > fine, k, 0.0), given, torn))
    if domain.live.any():
        resistivity = domain.per_cell("resistivity")
        sigma = np.where(domain.live, 1 / _mean(np.where(domain.live, resistivity, 1.0)), 0.0)
        given, torn = _given(domain, "voltage"), domain.electric.space.torn
        electric += [_at_edges(mesh, sigma, given, facets) for facets in ([None, torn] if len(torn) else [None])]
    axis = np.abs(mesh.p[:, mesh.edges[1]] - mesh.p[:, mesh.edges[0]]).argmax(axis=0)
    smallest = np.full((2, 3, mesh.p.shape[1]), np.inf)
    for at, exponents in zip(smallest, (np.min(thermal, axis=0), np.min(electric, axis=0)), strict=True):
        for end in mesh.edges:
            np.minimum.at(at, (axis, end), exponents)
    return smallest


def of_cells(mesh: Any, smallest: np.ndarray) -> np.ndarray:
    """(2, cells): the smallest of exponents `at_vertices` (2, 3, vertices) at an edge that a cell touches."""
    at: np.ndarray = smallest.min(axis=1)[:, mesh.t].min(axis=1)
    return at


def _mean(k: np.ndarray) -> np.ndarray:
    """(cells,): a property of each cell; of one that differs along the axes (3, cells) the geometric mean."""
    return k if k.ndim == 1 else np.exp(np.log(k).mean(axis=0))


def _given(domain: Domain, kind: str) -> np.ndarray:
    """(facets,): the number of the value that each facet is given; 0 for none."""
    numbers, given = dict[Any, int](), np.zeros(domain.space.mesh.facets.shape[1], int)
    for b in domain.scene.boundaries:
        if b.kind == kind and not b.contact_resistance:
            given[domain.on(b)] = numbers.setdefault(b.value, len(numbers) + 1)
    return given


def _at_edges(mesh: Any, k: np.ndarray, given: np.ndarray, torn: np.ndarray | None = None) -> np.ndarray:
    """(edges,): the exponent at each edge of a mesh of cells that conduct ``k`` (cells,), for the numbers of the values
    ``given`` on facets; infinite where it is regular. The facets ``torn`` are insulated; if given, only their edges are
    evaluated."""
    exponents, cut = np.full(mesh.edges.shape[1], np.inf), np.zeros(len(given), bool)
    pair = np.where(mesh.f2t >= 0, k[mesh.f2t], 0.0)
    uneven = np.flatnonzero((pair[0] != pair[1]) | ((given > 0) & pair.any(axis=0))) if torn is None else torn
    cut[[] if torn is None else torn] = True
    marked = np.zeros(mesh.p.shape[1], bool)
    marked[mesh.facets[:, uneven]] = True
    cells = np.flatnonzero((marked[mesh.t].sum(axis=0) >= 2) & (k > 0))
    edge, start, angle, of_cell, first, last = _wedges(mesh, cells)
    order = np.lexsort([start, edge])
    order = order[marked[mesh.edges[:, edge[order]]].all(axis=0)]
    edge, start, angle, k, first, last = (x[order] for x in (edge, start, angle, k[of_cell], first, last))
    # Index of the previous wedge around the same edge.
    begins = np.flatnonzero(np.diff(edge, prepend=-1))
    ends = np.append(begins[1:], len(edge))[: len(begins)] - 1
    before = np.arange(len(edge)) - 1
    before[begins] = ends
    gap = (start - start[before] - angle[before]) % (2 * np.pi)
    gap = np.where((gap > TOLD_APART) & (gap < 2 * np.pi - TOLD_APART), gap, 0.0)
    cut = cut[first]
    breaks = (k != k[before]) | (given[first] > 0) | (gap > 0) | cut
    held, behind = given[first], given[last[before]]
    seen: dict[Any, float] = {}
    for i, j in zip(begins.tolist(), (ends + 1).tolist(), strict=True):
        at = i + np.flatnonzero(breaks[i:j])
        flat = len(at) == 1 and not (held[at[0]] or behind[at[0]]) and angle[i:j].sum() < np.pi + TOLD_APART
        if not len(at) or flat or (torn is not None and not cut[at].any()):
            continue
        sums = np.add.reduceat(np.concatenate([angle[at[0] : j], angle[i : at[0]]]), at - at[0])
        key = tuple(
            (max(round(a / TOLD_APART), 1), n, round(g / TOLD_APART), h, b, c)
            for a, n, g, h, b, c in zip(
                sums.tolist(), *(x[at].tolist() for x in (k, gap, held, behind, cut)), strict=True
            )
        )
        if key not in seen:
            seen[key] = _exponent(key)
        exponents[edge[i]] = seen[key]
    exponents[exponents >= REGULAR] = np.inf
    return exponents


def _exponent(ring: tuple[tuple[int, float, int, int, int, bool], ...]) -> float:
    """The exponent of wedges, each with its angle, conductivity, the gap before it, the given values at its start and
    at the end of the previous wedge, and whether its start is insulated; half the exponent where two given values
    meet."""
    wedges = []
    for angle, k, gap, given, behind, cut in ring:
        if gap:
            wedges.append((0.0, behind > 0, False, gap * TOLD_APART))
        wedges.append((k, given > 0, cut, angle * TOLD_APART))
    values = {n for _, _, _, *both, _ in ring for n in both if n}
    s = exponent(*zip(*wedges, strict=True))
    return s / 2 if len(values) > 1 else s


def _wedges(mesh: Any, cells: np.ndarray) -> tuple[np.ndarray, ...]:
    """For the six edges of some cells (n,): the edge, the start angle about it and the angle of the cell (radians), the
    cell, and its first and last facet about the edge; (6 n,) each."""
    at = mesh.p[:, mesh.t[:, cells]]
    edges = mesh.t2e[:, cells].ravel()
    ends = mesh.p[:, mesh.edges[:, edges]]
    axis = ends[:, 1] - ends[:, 0]
    axis /= np.linalg.norm(axis, axis=0)
    across = np.eye(3)[np.abs(axis).argmin(axis=0)].T
    across -= axis * (axis * across).sum(axis=0)
    across /= np.linalg.norm(across, axis=0)
    upright = np.cross(axis.T, across.T).T
    angles = []
    for other in (0, 1):
        away = at[:, _OTHERS[:, other]].reshape(3, -1) - ends[:, 0]
        angles.append(np.arctan2((away * upright).sum(axis=0), (away * across).sum(axis=0)))
    facets = [mesh.t2f[_BESIDE[:, other]][:, cells].ravel() for other in (0, 1)]
    turn = (angles[1] - angles[0]) % (2 * np.pi)
    swapped = turn > np.pi
    start = np.where(swapped, angles[1], angles[0]) % (2 * np.pi)
    begin, end = np.where(swapped, facets[::-1], facets)
    return edges, start, np.where(swapped, 2 * np.pi - turn, turn), np.tile(cells, 6), begin, end
