"""Place the intervals of a grid of bricks: the first grid of a scene, and its refinement by error indicators.

Solutions are smooth but near some planes of each axis, the *features*, where a box begins or ends inside the solid.
Towards these, intervals shrink geometrically; where an edge in the plane is singular they go on shrinking, elsewhere
the degree rises. Both together converge exponentially (Babuska and Guo, The h-p version of the finite element method,
Computational Mechanics 1, 1986). The three axes are treated alike.

A face whose temperature jumps gets layers: heat has gone no further than sqrt(D t) from it at a time t.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np

from meshes import grid as grids
from meshes.grid import Grid
from scenes import faces, laws
from scenes.model import ROUNDING, Boundary, Scene, Schedule, bends, values

# Ratio of neighbouring intervals towards a feature; 0.15 is optimal for corner singularities (Gui and Babuska).
RATIO = 0.15
HIGHEST_DEGREE = 8  # of edges; a sink needs it at 1e-6, the smallest accuracy (summary.json: fem3d.mesh)
LEAST_AT_EDGE = 4  # also of layers: functions of facets begin at degree 4, and show the error of an edge
SLIVER = 1e-3  # planes closer than this fraction of the extent set no length: a choice, 1 um in 1 mm
# In the first grid the energy at singular edges may miss this factor times the accuracy; on random scenes 25 and 225
# take as many unknowns within 15 %.
LAYERS = 75.0
FINE = 3e-5  # accuracy from which on the first grid has degree 6 (`validate bench`: levels at 3e-5 and 1e-5)
FALLS = 10.0  # an edge's indicator is expected to fall so per degree: (4/3)^8, the fastest rate (estimator.FASTEST)


@dataclass(frozen=True)
class Features:
    """Planes of a scene at which its solution is not smooth.

    Attributes
    ----------
    planes: per axis the coordinates (m) of all planes inside the solid.
    exponents: per axis the exponent of each singular plane by its coordinate (`fem3d.spaces.edge_exponents.features`).
    """

    planes: tuple[frozenset[float], ...]
    exponents: tuple[dict[float, float], ...]

    @property
    def sharpest(self) -> float:
        """The smallest exponent, or 1."""
        return min((s for by_plane in self.exponents for s in by_plane.values()), default=1.0)

    def near(self, grid: Grid) -> list[np.ndarray]:
        """Return per axis (breakpoints,) the exponent of a singular plane there, infinite elsewhere."""
        return [
            np.array([by_plane.get(at, np.inf) for at in breaks.tolist()])
            for breaks, by_plane in zip(grid.breaks, self.exponents, strict=True)
        ]


def first_grid(scene: Scene, accuracy: float, features: Features) -> Grid:
    """Return the grid to begin with for an accuracy. Every plane of the scene is a breakpoint.

    Intervals at a feature are no longer than half of its reach, the length over which a constriction there spreads, and
    at a singular edge of exponent s so short that their energy, which falls with the length to the power 2 s, suits the
    accuracy. One of over four reaches between two features is cut in the middle. A layer is thin if it is at most half
    as thick as the features at it are wide: one interval of low degree crosses it.
    """
    planes = grids.graph(scene).planes
    thin, reaches = _reaches(scene, planes)
    # About one degree for each further half digit (docs/benchmark.md).
    degree = 4 if accuracy > 3e-4 else 5 if accuracy > FINE else 6 if accuracy > FINE / 2 else 7
    across = 2 if accuracy > 3e-3 else 3 if accuracy > FINE else 4
    breaks, degrees = [], []
    for d in range(3):
        axis_breaks, axis_degrees = [planes[d][:1]], []
        for i, (a, b) in enumerate(pairwise(planes[d].tolist())):
            near = zip((a, b), reaches[d][i : i + 2].tolist(), strict=True)
            inner = [] if thin[d][i] else _graded(a, b, *(_longest(c, features, d, r, accuracy) for c, r in near))
            if not thin[d][i] and {a, b} <= features.planes[d] and b - a > 4 * reaches[d][i : i + 2].min():
                inner = sorted([*inner, (a + b) / 2])
            axis_breaks.append(np.array([*inner, b]))
            axis_degrees += [across] if thin[d][i] else [degree] * (len(inner) + 1)
        breaks.append(np.concatenate(axis_breaks))
        degrees.append(np.array(axis_degrees))
    return Grid(tuple(breaks), tuple(degrees), scene.boxes)


def _reaches(scene: Scene, planes: tuple[np.ndarray, ...]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return per axis which layers are thin, and (planes,) the reach of each plane (m).

    The reach is the least extent, along any axis, of the features there except thin layers and slivers, or the least
    reach of any plane where there are none.
    """
    gaps, faces = [np.diff(p) for p in planes], _faces(scene)

    def across(d: int, thin: list[np.ndarray]) -> np.ndarray:
        """(planes,): the least extent along the other axes."""
        extents = np.full(len(planes[d]), np.inf)
        for along, e in enumerate((e for e in range(3) if e != d), start=1):
            rows = np.moveaxis(faces[d], along, 2)
            starts = np.ones(rows.shape, bool)
            starts[..., 1:] = rows[..., 1:] != rows[..., :-1]
            first = np.flatnonzero(starts)
            lengths = np.add.reduceat(np.broadcast_to(gaps[e], rows.shape).ravel(), first)
            thick = np.logical_or.reduceat(np.broadcast_to(~thin[e], rows.shape).ravel(), first)
            counts = (rows.ravel()[first] > 0) & thick & (lengths > SLIVER * gaps[e].sum())
            np.minimum.at(extents, first[counts] // rows[0].size, lengths[counts])
        return extents

    none = [np.zeros(len(g), bool) for g in gaps]
    wide = [across(d, none) for d in range(3)]
    both = [np.minimum(w[:-1], w[1:]) for w in wide]
    thin = [(g <= 0.5 * w) & np.isfinite(w) for g, w in zip(gaps, both, strict=True)]
    reaches = []
    for d, g in enumerate(gaps):
        thicknesses = np.pad(np.where(thin[d] | (g <= SLIVER * g.sum()), np.inf, g), 1, constant_values=np.inf)
        reaches.append(np.minimum(across(d, thin), np.minimum(thicknesses[:-1], thicknesses[1:])))
    least = min(float(r.min()) for r in reaches)
    return thin, [np.where(np.isfinite(r), r, least) for r in reaches]


def _faces(scene: Scene) -> list[np.ndarray]:
    """Per axis (planes, cells, cells): a number for the faces across it, of the two materials that meet there and of
    the condition or the contact; 0 where nothing changes."""
    graph = grids.graph(scene)
    kinds = list(dict.fromkeys(b.material for b in scene.boxes))
    kind = np.pad(np.array([*(kinds.index(b.material) + 1 for b in scene.boxes), 0])[graph.owner], 1)
    faces, count = [], len(kinds) + 1
    given = [*map(graph.faces, scene.boundaries), *(graph.between(c) for c in scene.contacts if not c.perfect)]
    for d, marks in enumerate(graph.marked((faces, number) for number, faces in enumerate(given, start=1))):
        materials = np.moveaxis(kind, d, 0)[:, 1:-1, 1:-1]
        conditions = np.moveaxis(marks, d, 0).astype(int)
        changes = (materials[1:] != materials[:-1]) | (
            (conditions > 0) & (np.maximum(materials[1:], materials[:-1]) > 0)
        )
        faces.append(np.where(changes, (conditions * count + materials[1:]) * count + materials[:-1], 0))
    return faces


def _longest(plane: float, features: Features, d: int, reach: float, accuracy: float) -> float | None:
    """The longest first interval at a plane; None where it needn't be graded."""
    s = features.exponents[d].get(plane)
    if s is not None:
        return reach * min(0.5, (LAYERS * accuracy) ** (1 / (2 * s)))
    return reach / 2 if plane in features.planes[d] else None


def _graded(a: float, b: float, at_a: float | None, at_b: float | None) -> list[float]:
    """Breakpoints inside (a, b): one towards each feature, and more until its first interval is short enough."""

    def steps(longest: float | None) -> list[float]:
        distances: list[float] = []
        while longest is not None and (not distances or distances[-1] > longest):
            distances.append((distances[-1] if distances else b - a) * RATIO)
        return distances

    return [a + step for step in reversed(steps(at_a))] + [b - step for step in steps(at_b)]


def shortest_of(grid: Grid) -> float:
    """The length (m) below which intervals are not refined: flatter cells would leave nothing but rounding."""
    return ROUNDING * max(float(b[-1] - b[0]) for b in grid.breaks)


def refined(grid: Grid, missing: Sequence[np.ndarray], target: float, features: Features) -> Grid:
    """Return the grid refined until the indicator of each interval or edge is expected to be its share of a target.

    Of a grid with degrees of edges, an interval is refined by its edges of the highest degree there, and all other
    edges up to this degree.

    Parameters
    ----------
    missing: per axis the error indicator of each interval or edge (`Grid.spread`).
    target: the sum of all indicators afterwards.
    """
    if not grid.edges:
        return _refined_intervals(grid, missing, target, features)
    share = threshold(missing, target)
    at_top = [
        np.where((e == np.expand_dims(p, _across(d))) & (m > share), m, 0.0).sum(axis=_across(d))
        for d, (e, p, m) in enumerate(zip(grid.edges, grid.degrees, missing, strict=True))
    ]
    # Where the indicators at the top are below the target, some intervals are refined all the same.
    most = min(target, 0.5 * sum(float(m.sum()) for m in at_top))
    return finer(grid, missing, share, _refined_intervals(grid, at_top, most, features))


def finer(grid: Grid, missing: Sequence[np.ndarray], share: float, other: Grid) -> Grid:
    """Return the cells of an ``other`` grid with the degrees of this one, raised until the indicator of each edge
    (``missing``) is expected to be its ``share``, at most to the degrees of the other grid."""
    places = [_places(old, new) for old, new in zip(grid.breaks, other.breaks, strict=True)]
    edges = []
    for d, (degrees, missed, highest) in enumerate(zip(grid.edges, missing, other.degrees, strict=True)):
        more = np.ceil(np.log(np.maximum(missed / share, 1.0)) / np.log(FALLS)).astype(int)
        at = (place[int(e == d) :: 2] for e, place in enumerate(places))
        edges.append(np.minimum(grids.entities(degrees + more, d)[np.ix_(*at)], np.expand_dims(highest, _across(d))))
    on_each = (e.max(axis=_across(d)) for d, e in enumerate(edges))
    return replace(other, degrees=tuple(on_each), edges=tuple(edges))


def _across(d: int) -> tuple[int, ...]:
    """Return the other two axes."""
    return tuple({0, 1, 2} - {d})


def _places(old: np.ndarray, new: np.ndarray) -> np.ndarray:
    """Return (2 n + 1,) the place of each new breakpoint and interval among the old ones, as `entities` counts them."""
    points = np.empty(2 * len(new) - 1)
    points[::2], points[1::2] = new, (new[1:] + new[:-1]) / 2
    return np.asarray(np.searchsorted(old, points) + np.searchsorted(old, points, side="right") - 1)


def _refined_intervals(grid: Grid, missing: Sequence[np.ndarray], target: float, features: Features) -> Grid:
    """Return the grid refined until the indicator of each interval is expected to be its share of a target.

    Intervals towards a singular plane are cut in layers; others gain a degree, or are halved where it would exceed
    `HIGHEST_DEGREE`. Intervals that are too short to refine take their share of the target first.
    """
    near, shortest = features.near(grid), shortest_of(grid)
    able = [np.diff(b) > shortest for b in grid.breaks]
    fixed = sum(float(m[~a].sum()) for m, a in zip(missing, able, strict=True))
    share = threshold([m[a] for m, a in zip(missing, able, strict=True)], max(target - fixed, 0.1 * target))
    breaks, degrees = [], []
    for d, old in enumerate(grid.breaks):
        axis_breaks, axis_degrees = [float(old[0])], list[int]()
        for i, p in enumerate(grid.degrees[d].tolist()):
            a, b, ends = float(old[i]), float(old[i + 1]), near[d][i : i + 2]
            inner, pieces = list[float](), [p]
            if missing[d][i] > share and able[d][i]:
                excess = missing[d][i] / share
                if ends.min() < np.inf:
                    if p < LEAST_AT_EDGE:  # what is missing need not be the edge's
                        p, excess = p + 1, 1.0
                    inner, pieces = _cut(a, b, p, ends, excess, shortest)
                elif p < HIGHEST_DEGREE:
                    pieces = [p + 1]
                else:
                    inner, pieces = [(a + b) / 2], [p, p]
            axis_breaks += [*inner, b]
            axis_degrees += pieces
        breaks.append(np.array(axis_breaks))
        degrees.append(np.array(axis_degrees))
    return grid.with_axes(breaks, degrees)


def threshold(missing: Sequence[np.ndarray], target: float) -> float:
    """Return the level to which larger indicators must fall, so that the sum of all is the target."""
    every = np.concatenate([m.ravel() for m in missing])
    others = every.sum() - np.cumsum(np.sort(every)[::-1])
    return float(((target - others) / np.arange(1, len(every) + 1)).max(initial=0.0))


def _cut(
    a: float, b: float, p: int, exponents: np.ndarray, excess: float, shortest: float
) -> tuple[list[float], list[int]]:
    """Return breakpoints inside (a, b) towards its singular ends, and the degrees of all intervals, which fall towards
    the ends.

    The error falls with the length of the first interval to the power 2 s: there are as many breakpoints as it takes to
    fall by ``excess``.
    """
    most = max(1, int(np.log((b - a) / shortest) / -np.log(RATIO)))
    # Degrees by which a layer may have fewer than the next larger one, over the exponent: a layer reduces the error by
    # RATIO^(2 s), a degree beside a singular end by rho^-2 (`fem3d.adaptivity.estimator`).
    fall = -np.log(RATIO) / np.log((1 + np.sqrt(RATIO)) / (1 - np.sqrt(RATIO)))

    def layers(s: float) -> list[int]:
        if not np.isfinite(s):
            return []
        count = min(max(1, int(np.ceil(np.log(excess) / (-2 * s * np.log(RATIO)) - 0.3))), most)
        return [*(max(2, int(p - fall * s * k)) for k in range(1, count)), max(p - 1, min(p, LEAST_AT_EDGE))]

    at_a, at_b = (layers(s) for s in exponents.tolist())
    from_a = [a + (b - a) * RATIO ** (k + 1) for k in reversed(range(len(at_a)))]
    return from_a + [b - (b - a) * RATIO ** (k + 1) for k in range(len(at_b))], [*at_a[::-1], p, *at_b]


def raised(grid: Grid) -> Grid:
    """Return the grid with one degree more; while some can gain one, the intervals of the highest are halved."""
    if grid.edges:
        more, edges = (tuple(np.minimum(p + 1, HIGHEST_DEGREE) for p in each) for each in (grid.degrees, grid.edges))
        return replace(grid, degrees=more, edges=edges)
    axes = list(zip(grid.breaks, grid.degrees, strict=True))
    raisable = any((p < HIGHEST_DEGREE).any() for _, p in axes)
    halved = [(p == HIGHEST_DEGREE) & (np.diff(b) > shortest_of(grid)) & raisable for b, p in axes]
    breaks = [np.union1d(b, ((b[1:] + b[:-1]) / 2)[h]) for (b, _), h in zip(axes, halved, strict=True)]
    degrees = [np.repeat(np.minimum(p + 1, HIGHEST_DEGREE), 1 + h) for (_, p), h in zip(axes, halved, strict=True)]
    return grid.with_axes(breaks, degrees)


def with_diffusion_layers(grid: Grid, scene: Scene, earliest: float) -> Grid:
    """The grid with more intervals towards each face whose temperature jumps, down to the diffusion length of the
    earliest time of interest (s)."""
    axes = []
    for d, (breaks, degrees) in enumerate(zip(grid.breaks, grid.degrees, strict=True)):
        for plane, length in _lengths(scene, d, earliest).items():
            # Intervals above the plane, then those below it, seen from the other side.
            for side in (1, -1):
                breaks, degrees = _layered(side * breaks[::side], degrees[::side], side * plane, length)
                breaks, degrees = side * breaks[::side], degrees[::side]
        axes.append((breaks, degrees))
    return grid.with_axes(*zip(*axes, strict=True))


def _lengths(scene: Scene, d: int, earliest: float) -> dict[float, float]:
    """The shortest diffusion length (m) at each plane across an axis where a temperature jumps."""
    lengths: dict[float, float] = {}
    across = [b for b in scene.boundaries if b.kind != "voltage" and b.lower[d] == b.upper[d]]
    for b, box in product(across, scene.boxes):
        if all(b.lower[e] <= box.upper[e] and b.upper[e] >= box.lower[e] for e in range(3)):
            material = box.material.at(scene.initial_temperature)
            k = laws.along(material.thermal_conductivity)[d]
            length = float(np.sqrt(k / material.heat_capacity * earliest))
            if _jumps(b, scene.initial_temperature, k / length):
                lengths[b.lower[d]] = min(length, lengths.get(b.lower[d], np.inf))
    return lengths


def _jumps(b: Boundary, initial: float, conductance: float) -> bool:
    """Whether a boundary makes the temperature of its face jump; a film does that ever conducts a tenth
    of the ``conductance`` (W/(m2 K)) of a diffusion length."""
    if b.kind == "temperature":
        steps = isinstance(b.value, Schedule) and any(np.diff(b.value.times) == 0)
        return steps or values(b.value)[0] != initial
    film = max(values(b.value)) if b.kind == "convection" else 0.0
    if bends(b):
        film = float(faces.coefficient(b, np.array(max(initial, *values(b.ambient)))))
    return film > 0.1 * conductance


def _layered(at: np.ndarray, degrees: np.ndarray, plane: float, length: float) -> tuple[np.ndarray, np.ndarray]:
    """Cut the intervals above a plane until the first one is at most three diffusion lengths long."""
    breaks, orders = at.tolist(), degrees.tolist()
    i = int(np.abs(at - plane).argmin())
    while i + 1 < len(breaks) and (gap := breaks[i + 1] - breaks[i]) > 3 * length:
        orders[i] = max(orders[i], LEAST_AT_EDGE)
        breaks.insert(i + 1, breaks[i] + max(RATIO * gap, 1.5 * length))
        orders.insert(i, orders[i])
    return np.array(breaks), np.array(orders)
