"""The fields of a long row of spans from those of the spans that are solved: the innermost island and span again for
each of those that they stand for."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from fem3d.results.fields.fields import Fields
from fem3d.results.fields.quadratic import Quadratic, Snapshot
from scenes.sink import Sink, different, start

NEAR = 1e-9  # points nearer to a plane than this fraction of a span are on it


class Longer:
    """Points and hexahedra of the innermost island and span of ``count`` and of all else, with those repeated behind
    themselves for each that they stand for; what follows is pushed on. The copies share no points."""

    def __init__(self, fields: Fields | Quadratic, sink: Sink, count: int) -> None:
        low, _, high, _ = planes(sink, count)
        copies, (points, hexes) = sink.spans - count, (fields.points, fields.hexes)
        y, period = points[hexes[:, 0], 1] / 2 + points[hexes[:, 6], 1] / 2, high - low
        blocks = [(y < high, 0), *(((y > low) & (y < high), n) for n in range(1, copies + 1)), (y > high, copies)]
        numbered, cells, taken, turn, first = [], [], [], [], 0
        for chosen, n in blocks:
            chosen_cells = np.flatnonzero(chosen)
            used, local = np.unique(hexes[chosen_cells], return_inverse=True)
            numbered.append(local.reshape(hexes[chosen_cells].shape) + first)
            first += len(used)
            cells.append(chosen_cells)
            taken.append(used)
            turn.append(np.full(len(used), n))
        self.hexes, self.cells = np.concatenate(numbered), np.concatenate(cells)
        self.taken, self.turn = np.concatenate(taken), np.concatenate(turn)
        self.points = points[self.taken] + np.outer(self.turn * period, [0.0, 1.0, 0.0])
        self.material = fields.material[self.cells]


class RowFields(Fields):
    """Those of a whole row of which ``count`` spans are solved, which are ``distinct``."""

    def __init__(self, solved: Fields, sink: Sink, count: int) -> None:
        super().__init__(solved._heat, solved._state, solved._symmetry, solved._transient)
        self._solved, self._sink, self._count = solved, sink, count

    @property
    def distinct(self) -> Fields:
        """The spans that are solved."""
        return self._solved

    @cached_property
    def _drawn(self) -> Any:
        return Longer(self._solved, self._sink, self._count)

    def _sampled(self, functions: np.ndarray) -> np.ndarray:
        return self._solved._sampled(functions)[..., self._drawn.taken]

    def quadratic(self, times: np.ndarray, accuracy: float) -> Any:
        """The `RowQuadratic`, as that of `Fields`."""
        solved = super().quadratic(times, accuracy)
        return RowQuadratic(solved, Longer(solved, self._sink, self._count), self._sink, self._count)


class RowQuadratic:
    """What `fem3d.results.fields.quadratic.Quadratic` has, of the whole row."""

    def __init__(self, solved: Quadratic, longer: Longer, sink: Sink, count: int) -> None:
        self._solved, self._longer, self._sink, self._count = solved, longer, sink, count
        self.points, self.hexes, self.error = longer.points, longer.hexes, solved.error
        self.material, self.material_names = longer.material, solved.material_names

    def snapshot(self, k: int) -> Snapshot:
        """The fields of the k-th state."""
        snapshot, longer = self._solved.snapshot(k), self._longer
        volts, fall = self._single(snapshot.potential)
        return Snapshot(
            snapshot.temperature[longer.taken], volts[longer.taken] + fall * longer.turn,
            snapshot.current_density[longer.cells], snapshot.heat_source[longer.cells],
        )  # fmt: skip

    def _single(self, potential: np.ndarray) -> tuple[np.ndarray, float]:
        """The potential of the solved spans where each falls by what it does itself, not by what all that it stands for
        do, and what one island and one span make of it (V)."""
        y, near = self._solved.points[:, 1], NEAR * self._sink.length
        edges = planes(self._sink, self._count)
        at = [float(np.nanmean(potential[np.abs(y - edge) < near])) for edge in edges]
        boxes = {b.name: b.stands_for for b in self._sink.scene(self._count).boxes}
        inner = different(self._count)
        each = [boxes[f"bridge-{inner - 1}"], boxes[f"span-{inner}"], boxes[f"bridge-{inner}"]]
        levels = np.cumsum([at[0], *((b - a) / n for a, b, n in zip(at[:-1], at[1:], each, strict=True))])
        part = np.searchsorted(np.array(edges) + near, y)
        start_of, level = np.array([at[0], *at])[part], np.array([at[0], *levels])[part]
        return level + (potential - start_of) / np.array([1.0, *each, 1.0])[part], float(levels[2] - levels[0])


def planes(sink: Sink, count: int) -> tuple[float, float, float, float]:
    """Where (m) the innermost span of ``count`` and the islands beside it begin and end."""
    inner = different(count)
    return (
        start(sink, inner) - sink.island, start(sink, inner), start(sink, inner) + sink.length, start(sink, inner + 1)
    )  # fmt: skip
