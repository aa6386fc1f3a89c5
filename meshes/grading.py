"""Where the intervals of a brick mesh lie: the first mesh of a scene, and its refinement by marked intervals.

Solutions are smooth but near some planes of each axis, the *features*, where a box begins or ends inside the solid.
Towards these, intervals shrink geometrically; where an edge in the plane is singular they go on shrinking, elsewhere
the degree rises. Both together converge exponentially (Babuska and Guo, The h-p version of the finite element method,
Computational Mechanics 1, 1986).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from meshes import singular
from meshes.axis import Axis
from meshes.bricks import BrickMesh
from meshes.planes import scene_planes as scene_planes
from scenes.model import Scene

RATIO = 0.15  # of neighbouring intervals towards a feature; 0.15 is optimal for corner singularities (Gui and Babuska)
HIGHEST_DEGREE = 8
LONG = 1.2  # times the narrowest spacing: longer intervals start with one degree more
SLIVER = 1e-3  # of the extent: closer planes set no length
STEP = 0.25  # of the error of an edge is what a refinement leaves of it
SHORTEST = 1e-9  # of the largest extent: intervals are not refined below it
COARSEST = 1e-2  # an accuracy as good as none
LAYERS = 75.0  # times the accuracy: where the first mesh expects singular edges to matter no more


@dataclass(frozen=True)
class Features:
    """Per axis, coordinates (m) of the planes inside the solid, and of those that are singular the exponents and the
    lengths (m) over which their edges spread (`meshes.singular.edges`)."""

    planes: tuple[list[float], list[float], list[float]]
    exponents: tuple[dict[float, float], dict[float, float], dict[float, float]]
    lengths: tuple[dict[float, float], dict[float, float], dict[float, float]]


def features(scene: Scene) -> Features:
    """The features of a scene."""
    planes = [scene_planes(scene, d) for d in range(3)]
    (a, b, c), (x, y, z) = singular.edges(scene)
    return Features((planes[0][1:-1], planes[1][1:-1], planes[2][1:-1]), (a, b, c), (x, y, z))


def first_mesh(scene: Scene, accuracy: float, most: int | None = None) -> BrickMesh:
    """The mesh with which the search for an accuracy starts, or a poorer one where that has more than ``most`` nodes:
    many boxes across each other need less than every one of their planes would have alone.
    """
    mesh = _first_mesh(scene, accuracy)
    while most is not None and mesh.solid.sum() > most and accuracy < COARSEST:
        accuracy *= 10
        mesh = _first_mesh(scene, accuracy)
    if most is not None and mesh.solid.sum() > most:
        mesh = mesh.with_degrees(-1, -1, -1, least=2)
    return mesh


def _first_mesh(scene: Scene, accuracy: float) -> BrickMesh:
    """Every plane of the scene is a breakpoint.

    Intervals at a feature are no longer than half the narrowest spacing of the planes in x and y, the length over which
    a constriction spreads, and at a singular edge of exponent s so short that their energy, which falls with the length
    to the power 2 s, suits the accuracy. Across layers in z that are thinner than that, degree 2 is where to start.
    """
    marks = features(scene)
    planes = [scene_planes(scene, d) for d in range(3)]
    # Slivers between planes that all but coincide are not what a constriction spreads over.
    narrowest = min(float(d) for p in planes[:2] for d in np.diff(p) if d > SLIVER * (p[-1] - p[0]))
    degree = int(np.clip(np.round(-np.log10(accuracy)), 3, 6))
    axes = []
    for d in range(3):
        breaks, degrees = [planes[d][0]], []
        for a, b in zip(planes[d][:-1], planes[d][1:], strict=True):
            longest = [_longest(c, marks, d, narrowest, accuracy) for c in (a, b)]
            inner = [] if d == 2 and b - a <= narrowest / 2 else _graded(a, b, *longest)
            breaks += [*inner, b]
            degrees += [2 if d == 2 and not inner else degree] * (len(inner) + 1)
        axes.append(Axis(np.array(breaks), _degrees(np.array(breaks), np.array(degrees), marks, d, narrowest)))
    x, y, z = axes
    return BrickMesh((x, y, z), scene.boxes)


def _degrees(breaks: np.ndarray, degrees: np.ndarray, marks: Features, axis: int, narrowest: float) -> np.ndarray:
    """Degrees that rise away from singular planes: one less at them, one more where intervals are long."""
    found = degrees + (np.diff(breaks) > LONG * narrowest)
    near = np.isfinite(exponents_at(Axis(breaks, found), marks.exponents[axis]))
    for i in range(len(found)):
        if near[i] or near[i + 1]:
            found[i] = max(found[i] - 1, min(found[i], 3))
    return found


def _longest(plane: float, marks: Features, axis: int, narrowest: float, accuracy: float) -> float | None:
    """The longest first interval at a plane; None where it needn't be graded."""
    s = marks.exponents[axis].get(plane)
    if s is not None:
        return narrowest * min(0.5, (LAYERS * accuracy) ** (1 / (2 * s)))
    return narrowest / 2 if plane in marks.planes[axis] else None


def _graded(a: float, b: float, longest_at_a: float | None, longest_at_b: float | None) -> list[float]:
    """Breakpoints inside (a, b): one towards each feature, and more until its first interval is short enough."""
    inner = _inner(a, b, longest_at_a is not None, longest_at_b is not None)
    while longest_at_a is not None and inner[0] - a > longest_at_a:
        inner.insert(0, a + RATIO * (inner[0] - a))
    while longest_at_b is not None and b - inner[-1] > longest_at_b:
        inner.append(b - RATIO * (b - inner[-1]))
    return inner


def _inner(a: float, b: float, at_a: bool, at_b: bool) -> list[float]:
    left, right = a + RATIO * (b - a), b - RATIO * (b - a)
    return [left] * at_a + [right] * at_b


def refine(mesh: BrickMesh, marked: Sequence[np.ndarray], marks: Features, steps: int = 1) -> BrickMesh:
    """The mesh with the marked intervals (one boolean array per axis) refined by some steps.

    An interval at a singular plane is cut towards it, as often as it takes to leave `STEP` of the edge's error; any
    other gains a degree, or is halved at the highest degree.
    """
    axes, shortest = [], shortest_of(mesh)
    for d, axis in enumerate(mesh.axes):
        near = exponents_at(axis, marks.exponents[d])
        breaks, degrees = [axis.breaks[0]], []
        for i, degree in enumerate(axis.degrees.tolist()):
            a, b = axis.breaks[i], axis.breaks[i + 1]
            inner: list[float] = []
            if marked[d][i] and b - a > shortest:
                if min(near[i], near[i + 1]) < np.inf:
                    inner = _cut(a, b, near[i], near[i + 1], steps, shortest)
                elif degree < HIGHEST_DEGREE:
                    degree = min(degree + steps, HIGHEST_DEGREE)
                else:
                    inner = [(a + b) / 2]
            breaks += [*inner, b]
            degrees += [degree] * (len(inner) + 1)
        axes.append(Axis(np.array(breaks), np.array(degrees)))
    x, y, z = axes
    return BrickMesh((x, y, z), mesh.boxes)


def _cut(a: float, b: float, at_a: float, at_b: float, steps: int, shortest: float) -> list[float]:
    """Breakpoints inside (a, b) towards its ends where these have an exponent, none of them towards shorter ones."""
    left, right = (_layers(s, steps) if np.isfinite(s) else 0 for s in (at_a, at_b))
    inner = _inner(a, b, left > 0, right > 0)
    for _ in range(left - 1):
        if inner[0] - a > shortest:
            inner.insert(0, a + RATIO * (inner[0] - a))
    for _ in range(right - 1):
        if b - inner[-1] > shortest:
            inner.append(b - RATIO * (b - inner[-1]))
    return inner


def _layers(s: float, steps: int) -> int:
    """How many layers leave `STEP` of an error that falls with their length to the power 2 s, and that ``steps``
    times; at least one a step."""
    return steps * max(1, int(np.ceil(np.log(STEP) / (2 * s * np.log(RATIO)))))


def shortest_of(mesh: BrickMesh) -> float:
    """The length (m) below which intervals are not refined: flatter cells would leave nothing but rounding."""
    return SHORTEST * max(float(axis.breaks[-1] - axis.breaks[0]) for axis in mesh.axes)


def exponents_at(axis: Axis, exponents: Mapping[float, float]) -> list[float]:
    """For each breakpoint of an axis the exponent of the plane there, infinite where it isn't singular."""
    return [min((s for p, s in exponents.items() if abs(c - p) <= axis.tolerance), default=np.inf) for c in axis.breaks]


def singular_intervals(axis: Axis, exponents: Mapping[float, float]) -> np.ndarray:
    """(intervals,): which of them end at a singular plane."""
    near = np.isfinite(exponents_at(axis, exponents))
    found: np.ndarray = near[:-1] | near[1:]
    return found
