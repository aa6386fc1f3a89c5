"""The outer surface of a field of hexahedra, thinned and packed for the page's 3D scene."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass

import numpy as np

MOST_POINTS = 12_000
"""With so many points a page has a few hundred kilobytes, and a phone turns it smoothly."""

_FACES = np.array([[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1], [4, 5, 6, 7]])


@dataclass(frozen=True)
class Surface:
    """Points (n, 3) in m and values (n,), quadrilaterals (m, 4) and the edges (k, 2) where the surface bends."""

    points: np.ndarray
    values: np.ndarray
    faces: np.ndarray
    edges: np.ndarray


def surface(points: np.ndarray, hexes: np.ndarray, values: np.ndarray, most: int = MOST_POINTS) -> Surface:
    """The surface of axis-parallel hexahedra (m, 8), with about ``most`` points at most.

    Coincident points are one. Where there are too many, coordinates along x, y and z are left out evenly, but none in
    which a face lies: the shape stays exact, and each point that stays keeps its own value.
    """
    coordinates, on = zip(*(_distinct(points[:, d]) for d in range(3)), strict=True)
    shape = tuple(len(c) for c in coordinates)
    keys, which, number = np.unique(np.ravel_multi_index(on, shape), return_index=True, return_inverse=True)
    places, level = np.stack(np.unravel_index(keys, shape), axis=1), values[which]
    faces = number.ravel()[hexes[:, _FACES].reshape(-1, 4)]
    indices, count = _single(faces)
    faces = faces[indices[count == 1]]
    peak, steps = places[int(np.argmax(level))], 1
    while True:
        moved = [_thin(places, faces, d, shape[d], steps, int(peak[d])) for d in range(3)]
        key = np.ravel_multi_index(moved, shape)
        kept = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        # A place without a point stays where it was.
        kept = np.where(keys[kept] == key, kept, np.arange(len(keys)))
        if steps >= 64 or len(np.unique(kept[faces])) <= most:
            break
        steps *= 2
    faces = kept[faces]
    faces = faces[(np.diff(np.sort(faces, axis=1), axis=1) > 0).all(axis=1)]
    faces = faces[_single(faces)[0]]
    used, local = np.unique(faces, return_inverse=True)
    faces = local.reshape(faces.shape)
    where = np.stack([coordinates[d][places[used, d]] for d in range(3)], axis=1)
    return Surface(where, level[used], faces, _bends(places[used], faces))


def _single(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each face once, and how often it is there. The first and last of a rectangle's corners tell it."""
    keys = faces.min(axis=1).astype(np.int64) * (int(faces.max()) + 1) + faces.max(axis=1)
    _, first, count = np.unique(keys, return_index=True, return_counts=True)
    return first, count


def packed(mesh: Surface, colours: np.ndarray, factor: float) -> str:
    """The surface as JSON for the page's script: 16-bit places and values, 32-bit indices, all in base64.

    ``colours`` (256, 3) are for the values from 0 to the largest; z is drawn ``factor`` times as large.
    """
    lower, size = mesh.points.min(axis=0), np.ptp(mesh.points, axis=0)
    places = np.round((mesh.points - lower) / size * 65535).astype("<u2")
    triangles = np.concatenate([mesh.faces[:, [0, 1, 2]], mesh.faces[:, [0, 2, 3]]]).astype("<u4")
    top = float(mesh.values.max()) or 1.0
    arrays = {
        "places": places,
        "values": np.round(np.clip(mesh.values / top, 0, 1) * 65535).astype("<u2"),
        "triangles": triangles,
        "edges": mesh.edges.astype("<u4"),
        "colours": colours.astype(np.uint8),
    }
    texts = {name: base64.b64encode(array.tobytes()).decode("ascii") for name, array in arrays.items()}
    return json.dumps({"size": (size * 1e6).tolist(), "factor": factor, **texts})


def _distinct(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The coordinates that differ by more than rounding, ascending, and the number of each value's."""
    order = np.argsort(values)
    ascending = values[order]
    new = np.diff(ascending, prepend=-np.inf) > 1e-9 * np.ptp(values)
    number = np.empty(len(values), dtype=int)
    number[order] = np.cumsum(new) - 1
    return ascending[new], number


def _thin(places: np.ndarray, faces: np.ndarray, axis: int, count: int, steps: int, peak: int) -> np.ndarray:
    """(points,): each point's coordinate number, moved to the nearest that is kept; that of the peak is."""
    corners = places[faces][:, :, axis]
    flat = np.unique(corners[np.ptp(corners, axis=1) == 0])
    kept = np.unique(np.concatenate([flat, np.arange(0, count, steps), [count - 1, peak]]))
    middle = (kept[:-1] + kept[1:]) / 2
    return kept[np.searchsorted(middle, places[:, axis])]


def _bends(places: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """(k, 2): the edges that faces of different directions share."""
    corners = places[faces]
    normal = np.argmin(np.ptp(corners, axis=1), axis=1)
    pairs = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    keys, which = np.unique(pairs[:, 0] * len(places) + pairs[:, 1], return_inverse=True)
    edges = np.stack(np.divmod(keys, len(places)), axis=1)
    directions = np.zeros((len(edges), 3), dtype=bool)
    directions[which.ravel(), np.repeat(normal, 4)] = True
    return edges[directions.sum(axis=1) > 1]
