"""A graded brick mesh of a union of boxes: three axes, and which box owns each cell of their grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from meshes.axis import Axis, Part
from scenes.model import Box, Point

VOID = -1


Spans = tuple[tuple[int, int], ...]


class Block(NamedTuple):
    """A brick of cells of one box, or a rectangle of faces: ranges of intervals along x, y, z, one of them empty."""

    box: int
    spans: Spans


@dataclass(frozen=True, eq=False)
class BrickMesh:
    """Axes along x, y, z and the boxes whose union is meshed (later boxes win)."""

    axes: tuple[Axis, Axis, Axis]
    boxes: tuple[Box, ...]

    @cached_property
    def owner(self) -> np.ndarray:
        """(nx, ny, nz): the number of the box that owns each cell, or VOID."""
        owner = np.full(tuple(len(a.degrees) for a in self.axes), VOID)
        for number, box in enumerate(self.boxes):
            owner[tuple(slice(*span) for span in self.spans(box.lower, box.upper))] = number
        return owner

    @cached_property
    def blocks(self) -> tuple[Block, ...]:
        """The owned cells as disjoint bricks, as large as a greedy walk finds them."""
        return tuple(bricks_of(self.owner))

    @cached_property
    def shape(self) -> tuple[int, int, int]:
        """Nodes of the whole grid along x, y, z, whether they belong to the solid or not."""
        x, y, z = self.axes
        return x.size, y.size, z.size

    @cached_property
    def solid(self) -> np.ndarray:
        """(nodes of the grid,): which nodes belong to the solid."""
        return self.nodes_of(self.blocks)

    def nodes_of(self, blocks: tuple[Block, ...]) -> np.ndarray:
        """(nodes of the grid,): which nodes belong to some blocks."""
        found = np.zeros(self.shape, dtype=bool)
        for block in blocks:
            found[tuple(part.node_slice for part in self.parts(block))] = True
        return found.ravel()

    def parts(self, block: Block) -> tuple[Part, Part, Part]:
        """The three 1D factors of a block."""
        x, y, z = (axis.part(*span) for axis, span in zip(self.axes, block.spans, strict=True))
        return x, y, z

    def numbers(self, block: Block) -> np.ndarray:
        """(nodes x, nodes y, nodes z): grid numbers of a block's nodes."""
        found = self._numbers.get(block.spans)
        if found is None:
            x, y, z = (np.arange(part.node_slice.start, part.node_slice.stop) for part in self.parts(block))
            found = (x[:, None, None] * self.shape[1] + y[:, None]) * self.shape[2] + z
            found.flags.writeable = False
            self._numbers[block.spans] = found
        return found

    @cached_property
    def _numbers(self) -> dict[Spans, np.ndarray]:
        return {}

    def spans(self, lower: Point, upper: Point) -> Spans:
        """Interval ranges of a box whose corners lie on breakpoints."""
        return tuple(axis.span(lower[d], upper[d]) for d, axis in enumerate(self.axes))

    def coordinates(self) -> np.ndarray:
        """(3, nodes of the grid): where the nodes are (m)."""
        return np.stack(np.meshgrid(*(axis.nodes for axis in self.axes), indexing="ij")).reshape(3, -1)

    def with_degrees(self, in_x: int, in_y: int, in_z: int, least: int = 1) -> BrickMesh:
        """The same cells with the degrees along each axis changed by a number, but none lowered below ``least``."""
        changes = zip(self.axes, (in_x, in_y, in_z), strict=True)
        x, y, z = (
            axis.with_degrees(np.maximum(axis.degrees + change, np.minimum(axis.degrees, least)))
            for axis, change in changes
        )
        return BrickMesh((x, y, z), self.boxes)

    def faces(self, lower: Point, upper: Point, boxes: set[int] | None = None, exposed: bool = False) -> list[Block]:
        """The part of a flat box that touches the solid (or some boxes of it), as rectangles of interval ranges;
        ``exposed``: only where its other side is void.

        The flat axis has an empty range (i, i), i the number of its breakpoint.
        """
        spans = self.spans(lower, upper)
        flat = next(d for d in range(3) if spans[d][0] == spans[d][1])
        wanted = self.owner != VOID if boxes is None else np.isin(self.owner, sorted(boxes))
        at = spans[flat][0]
        sides = []
        for cell in (at - 1, at):
            if 0 <= cell < wanted.shape[flat]:
                window = [slice(*span) for span in spans]
                window[flat] = slice(cell, cell + 1)
                sides.append(wanted[tuple(window)])
        touched = np.logical_xor.reduce(sides) if exposed else np.logical_or.reduce(sides)
        starts = [span[0] for span in spans]
        found = []
        for block in bricks_of(np.where(touched, 0, VOID)):
            shifted = [(s + a, s + b) for s, (a, b) in zip(starts, block.spans, strict=True)]
            shifted[flat] = (at, at)
            found.append(Block(VOID, tuple(shifted)))
        return found


def bricks_of(labels: np.ndarray) -> list[Block]:
    """The cells of each label but VOID as disjoint bricks, as large as a greedy walk finds them."""
    free = labels.copy()
    found = []
    while (cells := np.argwhere(free != VOID)).size:
        start = cells[0]
        stop = start + 1
        label = int(free[tuple(start)])
        for d in range(free.ndim):
            while stop[d] < free.shape[d]:
                ahead = [slice(a, b) for a, b in zip(start, stop, strict=True)]
                ahead[d] = slice(stop[d], stop[d] + 1)
                if (free[tuple(ahead)] != label).any():
                    break
                stop[d] += 1
        free[tuple(slice(a, b) for a, b in zip(start, stop, strict=True))] = VOID
        found.append(Block(label, tuple(zip(start.tolist(), stop.tolist(), strict=True))))
    return found
