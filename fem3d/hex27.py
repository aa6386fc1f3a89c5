"""Triquadratic hexahedra as VTK numbers their points, and the fields that go on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# VTK's order of the 27 points of a triquadratic hexahedron: corners, edges, faces, middle; as steps of half a cell.
_CORNERS = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)]
_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
_FACES = [(0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2)]
_MIDDLES = [tuple((p + q) // 2 for p, q in zip(_CORNERS[a], _CORNERS[b], strict=True)) for a, b in _EDGES]
ORDER = [*_CORNERS, *_MIDDLES, *_FACES, (1, 1, 1)]


@dataclass(frozen=True)
class Snapshot:
    """One state: temperature (points,) in K; potential (points,) in V, not a number where no current flows; current
    density (cells, 3) in A/m2 and heat source (cells,) in W/m3, means over the cells."""

    temperature: np.ndarray
    potential: np.ndarray
    current_density: np.ndarray
    heat_source: np.ndarray


@dataclass(frozen=True)
class State:
    """A state to be shown: the rise (all nodes, K), and the values (channels,) of what drives the scene then."""

    rise: np.ndarray
    inputs: np.ndarray
