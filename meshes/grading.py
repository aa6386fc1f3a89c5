"""Where the intervals of a brick mesh lie: the first mesh of a scene, and its refinement by marked intervals.

Solutions are smooth but at a few planes of each axis, the *features*, where a box begins or ends inside the solid and
a re-entrant edge or a jump of material may sit. Towards these, intervals shrink geometrically; away from them the
degree rises. Both together converge exponentially (Babuska and Guo, The h-p version of the finite element method,
1986).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshes.axis import Axis
from meshes.bricks import BrickMesh
from scenes.model import Scene

FIRST_RATIO = 0.25  # of neighbouring intervals in the first mesh, which resolves heat fronts too
RATIO = 0.15  # of neighbouring intervals towards a feature; 0.15 is optimal for corner singularities (Gui and Babuska)
HIGHEST_DEGREE = 8


def first_mesh(scene: Scene, degree: int = 3) -> BrickMesh:
    """The coarsest graded mesh of a scene: every plane of its boxes, conditions and probes is a breakpoint.

    In x and y intervals at a feature are no longer than half the narrowest spacing of the planes of both axes, the
    length over which a constriction spreads. Across thin layers, along z, degree 2 on one interval is where to start.
    """
    planes = [scene_planes(scene, d) for d in range(3)]
    narrowest = min(float(np.diff(p).min()) for p in planes[:2])
    axes = []
    for d in range(3):
        features = scene_features(scene, d)
        breaks = [planes[d][0]]
        for a, b in zip(planes[d][:-1], planes[d][1:], strict=True):
            inner = [] if d == 2 else _graded(a, b, a in features, b in features, narrowest / 2)
            breaks += [*inner, b]
        axes.append(Axis(np.array(breaks), np.full(len(breaks) - 1, 2 if d == 2 else degree)))
    x, y, z = axes
    return BrickMesh((x, y, z), scene.boxes)


def _graded(a: float, b: float, at_a: bool, at_b: bool, longest: float) -> list[float]:
    """Breakpoints inside (a, b) such that intervals at its features are at most of a length."""
    inner = _inner(a, b, at_a, at_b, FIRST_RATIO)
    while inner and at_a and inner[0] - a > longest:
        inner.insert(0, a + FIRST_RATIO * (inner[0] - a))
    while inner and at_b and b - inner[-1] > longest:
        inner.append(b - FIRST_RATIO * (b - inner[-1]))
    return inner


def scene_planes(scene: Scene, axis: int) -> list[float]:
    """Coordinates (m) along an axis that must be breakpoints: faces of boxes, conditions and extended probes."""
    found = [c for b in scene.boxes for c in (b.lower[axis], b.upper[axis])]
    low, high = min(found), max(found)
    small = 1e-9 * (high - low)
    for item in (*scene.boundaries, *(p for p in scene.probes if p.quantity == "temperature" and p.lower != p.upper)):
        found += [c for c in (item.lower[axis], item.upper[axis]) if low - small <= c <= high + small]
    found.sort()
    return [c for i, c in enumerate(found) if i == 0 or c - found[i - 1] > small]


def scene_features(scene: Scene, axis: int) -> list[float]:
    """The breakpoints inside the solid's extent, where an edge of a box may be singular."""
    return scene_planes(scene, axis)[1:-1]


def _inner(a: float, b: float, at_a: bool, at_b: bool, ratio: float) -> list[float]:
    if at_a and at_b:
        return [a + ratio * (b - a), b - ratio * (b - a)]
    if at_a:
        return [a + ratio * (b - a)]
    if at_b:
        return [b - ratio * (b - a)]
    return []


def refine(
    mesh: BrickMesh, marked: Sequence[np.ndarray], rough: Sequence[np.ndarray], features: Sequence[Sequence[float]]
) -> BrickMesh:
    """The mesh with marked intervals of each axis refined.

    ``marked`` and ``rough`` hold one boolean array (intervals,) per axis: a marked interval that is rough and touches a
    feature is cut towards it; any other marked one gains a degree, or is halved at the highest degree.
    """
    axes = []
    for axis, marks, uneven, planes in zip(mesh.axes, marked, rough, features, strict=True):
        near = [any(abs(c - p) <= axis.tolerance for p in planes) for c in axis.breaks]
        breaks, degrees = [axis.breaks[0]], []
        for i, degree in enumerate(axis.degrees.tolist()):
            a, b = axis.breaks[i], axis.breaks[i + 1]
            inner: list[float] = []
            if marks[i]:
                if uneven[i] and (near[i] or near[i + 1]):
                    inner = _inner(a, b, near[i], near[i + 1], RATIO)
                elif degree < HIGHEST_DEGREE:
                    degree += 1
                else:
                    inner = [(a + b) / 2]
            breaks += [*inner, b]
            degrees += [degree] * (len(inner) + 1)
        axes.append(Axis(np.array(breaks), np.array(degrees)))
    x, y, z = axes
    return BrickMesh((x, y, z), mesh.boxes)
