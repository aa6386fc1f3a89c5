"""What flows through a flat box: the normal component of a vector field that is known at the Gauss points.

Along the normal the field is carried on from the Gauss points of the adjoining cells to their face, as the polynomial
that it is; where both sides are solid their mean counts. Positive along the axis inside the solid, into the solid on
its surface.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.polynomial import legendre

from meshes.axis import Axis, reference
from meshes.bricks import VOID, Block, BrickMesh, Spans
from scenes.model import Probe


@dataclass(frozen=True, eq=False)
class Section:
    """A flat box as pieces of block faces: (number of the block, weights along x, y, z at its Gauss points).

    ``sign`` turns what enters the blocks there into what flows through: 0 where they lie on both sides.
    """

    axis: int
    pieces: tuple[tuple[int, tuple[np.ndarray, np.ndarray, np.ndarray]], ...]
    sign: float

    def flux(self, field: list[np.ndarray]) -> float:
        """The integral of the normal component of a field, one array (3, qx, qy, qz) a block."""
        return sum(float(np.einsum("xyz,x,y,z->", field[block][self.axis], *weights)) for block, weights in self.pieces)


def of(mesh: BrickMesh, probe: Probe, blocks: tuple[Block, ...]) -> Section:
    """The section of a flat probe through some blocks."""
    spans = mesh.spans(probe.lower, probe.upper)
    d = next(d for d in range(3) if spans[d][0] == spans[d][1])
    at = spans[d][0]
    sides = (at - 1, at)
    touched = [any(_piece(block, spans, d, cell) for block in blocks) for cell in sides]
    both = all(touched)
    # On the surface of the solid into it, inside along the axis; of what is there on both sides the mean.
    surface = not _solid_on_both_sides(mesh, spans, d, at)
    pieces = []
    for number, block in enumerate(blocks):
        for side, cell in enumerate(sides):
            here = _piece(block, spans, d, cell)
            if here is None:
                continue
            sign = 0.5 if both else (-1.0 if surface and side == 0 else 1.0)
            weights = [_across(mesh.axes[e], block.spans[e], here[e]) for e in range(3)]
            weights[d] = sign * _carried(mesh.axes[d], block.spans[d], cell, end=side == 0)
            pieces.append((number, (weights[0], weights[1], weights[2])))
    enters = 0.0 if both else (1.0 if surface or touched[1] else -1.0)
    return Section(d, tuple(pieces), enters)


def gradient_row(
    mesh: BrickMesh, section: Section, blocks: tuple[Block, ...], conductivities: list[float]
) -> np.ndarray:
    """(nodes of the grid,): the row whose product with nodal temperatures is the heat flow (W) through a section."""
    row = np.zeros(int(np.prod(mesh.shape)))
    d = section.axis
    for number, weights in section.pieces:
        parts = mesh.parts(blocks[number])
        factors = [w @ (p.slopes if e == d else p.values) for e, (w, p) in enumerate(zip(weights, parts, strict=True))]
        x, y, z = factors
        nodal = -conductivities[number] * x[:, None, None] * y[:, None] * z
        row[mesh.numbers(blocks[number]).ravel()] += nodal.ravel()
    return row


def _solid_on_both_sides(mesh: BrickMesh, spans: Spans, d: int, at: int) -> bool:
    """Whether a flat box has solid on both sides somewhere."""
    if not 0 < at < mesh.owner.shape[d]:
        return False
    window = [slice(*span) for span in spans]
    window[d] = slice(at - 1, at + 1)
    return bool((mesh.owner[tuple(window)] != VOID).all(axis=d).any())


def _piece(block: Block, spans: Spans, d: int, cell: int) -> list[tuple[int, int]] | None:
    """The intervals that a block shares with the flat box on one side of it."""
    if not block.spans[d][0] <= cell < block.spans[d][1]:
        return None
    found = [(max(a, p), min(b, q)) for (a, b), (p, q) in zip(block.spans, spans, strict=True)]
    return None if any(found[e][0] >= found[e][1] for e in range(3) if e != d) else found


def _across(axis: Axis, whole: tuple[int, int], piece: tuple[int, int]) -> np.ndarray:
    """(Gauss points of the block,): their weights within a piece of its intervals."""
    part = axis.part(*whole)
    found = np.zeros(len(part.weights))
    if piece[0] < piece[1]:
        at = slice(part.point_offsets[piece[0] - whole[0]], part.point_offsets[piece[1] - whole[0]])
        found[at] = part.weights[at]
    return found


def _carried(axis: Axis, whole: tuple[int, int], cell: int, end: bool) -> np.ndarray:
    """(Gauss points of the block,): weights that give a polynomial's value at the upper (or lower) end of a cell."""
    part = axis.part(*whole)
    found = np.zeros(len(part.weights))
    i = cell - whole[0]
    found[part.point_offsets[i] : part.point_offsets[i + 1]] = _to_end(int(axis.degrees[cell]), end)
    return found


@lru_cache(maxsize=32)
def _to_end(degree: int, end: bool) -> np.ndarray:
    points = reference(degree).points
    at_end = legendre.legvander(np.array([1.0 if end else -1.0]), degree)[0]
    found: np.ndarray = np.linalg.solve(legendre.legvander(points, degree).T, at_end)
    return found
