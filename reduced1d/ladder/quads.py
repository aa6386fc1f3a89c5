"""Quadrilaterals of a quarter of the sink's silicon layer, graded towards where the plate's solution bends."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from scenes.sink import Sink

if TYPE_CHECKING:
    import skfem

Growth = Callable[[float], float]

SLIVER = 1e-3
"""Planes closer than this part of the narrowest size are one plane."""


@dataclass(frozen=True)
class Grading:
    """How fine a mesh is: the first cell at the corner of beam and pad, and that at the oxide's outline, as parts of
    the narrowest size there; the largest ratio of neighbouring cells, in general and, where they are longer than the
    outline's, above the oxide; the longest cell, as a part of half the beam."""

    corner: float
    outline: float
    ratio: float
    above: float
    longest: float


FINE = Grading(0.0005, 0.25, 2.0, 1.4, 0.1)
COARSE = Grading(0.003, 0.5, 2.8, 2.0, 0.15)
"""Two meshes whose answers differ by more than the error of the finer one."""


@dataclass(frozen=True)
class Quarter:
    """A mesh (m) of x >= 0, y <= length / 2, and which of its elements are ``beam``, ``pad`` and, of these, above
    ``oxide`` (booleans, one per element)."""

    mesh: skfem.MeshQuad
    beam: np.ndarray
    pad: np.ndarray
    oxide: np.ndarray


def quarter(sink: Sink, grading: Grading) -> Quarter:
    """The mesh of a sink.

    Only the corner where the beam meets a pad of another width is singular (exponent 2/3), and there cells shrink
    geometrically. Across the oxide's outline the field has a kink in its second derivative, and decays within the
    healing length sqrt(k t / h): cells there are a part of it.
    """
    from skfem import MeshQuad

    w, pad, oxide = sink.width / 2, sink.pad_width / 2, sink.oxide_width / 2
    near, far, length = sink.anchor_distance, sink.anchor_distance + sink.oxide_length, sink.pad_length
    narrow = min(w, pad)
    healing = math.sqrt(sink.silicon.thermal_conductivity * sink.thickness / film(sink))
    outline = grading.outline * min(healing, oxide, sink.oxide_length / 2)
    corner = grading.corner * narrow
    small = SLIVER * min(narrow, sink.oxide_length / 2, oxide)
    across = [(0.0, None), (min(w, pad), corner), (max(w, pad), None), (oxide, outline)]
    along = [(-length, None), (-far, outline), (-near, outline), (0.0, corner), (sink.length / 2, None)]
    longest = grading.longest * sink.length / 2

    def free(distance: float) -> float:
        return (grading.ratio - 1) * distance

    def above(distance: float) -> float:
        return min(free(distance), max(outline, (grading.above - 1) * distance))

    x = _lines(across, small, lambda at: above if at < oxide else free)
    y = _lines(along, small, lambda at: above if -far < at < -near else lambda d: min(free(d), longest))
    mesh = MeshQuad.init_tensor(x, y)
    cx, cy = mesh.p[:, mesh.t].mean(axis=1)
    solid = ((cy > 0) & (cx < w)) | ((cy < 0) & (cx < pad))
    mesh = mesh.restrict(np.flatnonzero(solid))
    cx, cy = mesh.p[:, mesh.t].mean(axis=1)
    return Quarter(mesh, cy > 0, cy < 0, (cx < oxide) & (cy < -near) & (cy > -far))


def film(sink: Sink) -> float:
    """The oxide as a film coefficient (W/(m2 K)) under the silicon's mean temperature: 1/h = t_o/k_o + t/(3 k).

    The oxide's own resistance, and that of the silicon's thickness: with heat taken off below and none above, the
    temperature is a parabola across the layer, whose mean is q t / (3 k) above its foot.
    """
    return 1 / (
        sink.oxide_thickness / sink.oxide.thermal_conductivity
        + sink.thickness / (3 * sink.silicon.thermal_conductivity)
    )


def _lines(
    planes: list[tuple[float, float | None]], small: float, grows_at: Callable[[float], Growth]
) -> np.ndarray:  # fmt: skip
    """Coordinates through the planes, the cells at each no longer than its value (``None``: as long as others let),
    and between them as long as ``grows_at`` of the middle says for a distance from the nearer plane."""
    merged: list[tuple[float, float | None]] = []
    for at, first in sorted(planes, key=lambda plane: plane[0]):
        if merged and at - merged[-1][0] < small:
            previous, other = merged[-1]
            merged[-1] = (previous, min((v for v in (first, other) if v is not None), default=None))
        else:
            merged.append((at, first))
    found = [merged[0][0]]
    for (a, at_a), (b, at_b) in pairwise(merged):
        found += [*_between(a, b, at_a, at_b, grows_at((a + b) / 2)), b]
    return np.array(found)


def _between(a: float, b: float, at_a: float | None, at_b: float | None, grows: Growth) -> list[float]:
    """Cells that grow from each end, the shorter side first, until they meet; one that is not graded follows the
    other, or the growth at the whole distance."""
    left, right = [a], [b]
    while True:
        gap = right[-1] - left[-1]
        following = [
            grows(b - a) if first is None else max(first, grows(abs(side[-1] - side[0])))
            for first, side in ((at_a, left), (at_b, right))
        ]
        shorter = min(following)
        if shorter >= 0.6 * gap:
            return sorted(left[1:] + right[1:])
        if following[0] <= following[1]:
            left.append(left[-1] + shorter)
        else:
            right.append(right[-1] - shorter)
