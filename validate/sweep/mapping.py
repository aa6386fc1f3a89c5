"""The line of a tolerance over two keys, found by solving where it runs: each round of cells is chosen from what all
before it have shown, so that a map goes on as it would have after any interruption."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from validate.sweep.job import Job
from validate.sweep.point import Row, Work, blame
from validate.sweep.store import Store
from validate.sweep.surface import Record, Surface, surface

VERDICTS = ("agrees", "differs", "unresolved")
FIRST = 9
"""Cells along either key that are solved first, the corners of the map among them."""

ROUND = 16
"""Cells of a round; a quarter are where the interpolations disagree most, the rest where the verdict is open."""

LOOKS = 2
"""Rounds that look only for where they disagree, so that the error has been measured before it is relied on."""

ENOUGH = 0.01
"""The part of the cells that may stay unresolved by interpolation; the last ones would each need a solution."""


@dataclass(frozen=True, eq=False)
class Map:
    """Over the cells (n, m): the surface, the row of each cell that is solved, by its number, and the tolerance."""

    surface: Surface
    solved: dict[int, Row]
    tolerance: float

    @cached_property
    def verdicts(self) -> np.ndarray:
        """ "agrees", "differs" or "unresolved"; where there is no answer the status of the cells around."""
        size, error = np.abs(self.surface.value), self.surface.error
        found = np.full(size.shape, "unresolved", dtype=object)
        with np.errstate(invalid="ignore"):
            found[size - error > self.tolerance] = "differs"
            found[size + error <= self.tolerance] = "agrees"
        numbers = np.array(list(self.solved))
        places = np.column_stack(np.unravel_index(numbers, size.shape))
        if self.surface.lost.any():
            from scipy.spatial import KDTree

            lost = np.argwhere(self.surface.lost)
            nearest = KDTree(places).query(lost)[1]
            found[tuple(lost.T)] = [self.solved[int(numbers[i])].status for i in np.atleast_1d(nearest)]
        for place, row in zip(map(tuple, places), self.solved.values(), strict=True):
            if row.status != "ok":
                found[place] = row.status
        return found

    @cached_property
    def blames(self) -> np.ndarray:
        """(n, m): the assumption with the largest part, "" where there is no answer; the parts are interpolated between
        the cells that have them."""
        from scipy.interpolate import NearestNDInterpolator, RBFInterpolator

        shape = self.surface.value.shape
        rows = [row for row in self.solved.values() if row.parts]
        if not rows:
            return np.full(shape, "", object)
        names = list(rows[0].parts or {})
        at = np.column_stack(np.unravel_index([row.point for row in rows], shape)).astype(float)
        parts = np.array([[(row.parts or {}).get(name, 0.0) for name in names] for row in rows])
        everywhere = np.indices(shape).reshape(2, -1).T.astype(float)
        through = RBFInterpolator(at, parts, kernel="linear") if len(rows) > 2 else NearestNDInterpolator(at, parts)
        values = through(everywhere)
        words = np.array([blame(dict(zip(names, row, strict=True)))["blame"] for row in values], object).reshape(shape)
        words[~np.isin(self.verdicts, VERDICTS)] = ""
        return words


def refine(job: Job, store: Store, gather: Callable[[Iterable[Work], int, str], None]) -> Map:
    """Solves cells until few are unresolved, or as many are solved as may be. Cells that are refused, which costs
    nothing, don't count. ``gather`` solves tasks and stores their rows; it is told of how many in all, and what else to
    say."""
    shape = (job.design.shape[0], job.design.shape[1])
    tolerance = job.base.at(()).tolerance(job.scope.check)  # type: ignore[union-attr]
    limit = job.solves or 0
    first = [np.unique(np.linspace(0, n - 1, min(FIRST, n, math.isqrt(limit))).round().astype(int)) for n in shape]
    wanted = np.array([(i, j) for i in first[0] for j in first[1]])
    record, rounds = Record(), 0
    solved: dict[int, Row] = {}
    found: Map | None = None
    while True:
        numbers = [int(n) for n in np.ravel_multi_index(tuple(wanted.T), shape)]
        work = (job.work([n], found is None and job.scope.blame) for n in numbers if n not in store)
        said = "" if found is None else f", {np.mean(found.verdicts == 'unresolved'):.1%} unresolved"
        gather(work, limit, said)
        solved |= {row.point: row for row in store.some(numbers)}
        if found is not None:
            record.add(found.surface, wanted, _values(job, solved, numbers)[0])
        found = _map(job, solved, shape, record.share, tolerance)
        rounds += 1
        paid = sum(row.status != "refused" for row in solved.values())
        wanted = _next(found, rounds, min(ROUND, limit - paid))
        if not len(wanted):
            return found


def _values(job: Job, solved: dict[int, Row], numbers: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """(k,), (k,): the difference of the check in some solved cells and its numerical error, NaN where there is none."""
    check = job.scope.check
    rows = [solved[n].values for n in numbers]
    value, error = (
        np.array([row.get(f"{check}_{name}", np.nan) for row in rows], float) for name in ("difference", "u_num")
    )
    return np.where(np.isfinite(error), value, np.nan), error


def _map(job: Job, solved: dict[int, Row], shape: tuple[int, int], share: float, tolerance: float) -> Map:
    numbers = list(solved)
    values, errors = _values(job, solved, numbers)
    cells = np.column_stack(np.unravel_index(numbers, shape))
    return Map(surface(shape, cells, values, errors, share), solved, tolerance)


def _next(found: Map, rounds: int, most: int) -> np.ndarray:
    """(k, 2): the cells to solve next, apart from each other; none where enough is resolved."""
    from scipy.ndimage import distance_transform_edt

    value, shape = found.surface.value, found.surface.value.shape
    free = np.ones(shape, bool)
    free.flat[list(found.solved)] = False
    # Where the solved values' own error reaches the tolerance more of them would not tell.
    told = ~(np.abs(np.abs(value) - found.tolerance) <= found.surface.own)
    unresolved = (found.verdicts == "unresolved") & free & told
    if unresolved.mean() <= ENOUGH and rounds > LOOKS:
        return np.empty((0, 2), int)
    # Where an answer ends there is no error to go by: the middle of the gap halves it.
    edge = np.isinf(found.surface.disagreement) & ~found.surface.lost & free
    rough = np.where(edge, 0.0, found.surface.error)
    gap = max(2, int(0.35 * np.sqrt(value.size / len(found.solved))))
    chosen: list[tuple[int, int]] = []

    def take(score: np.ndarray, count: int) -> None:
        for _ in range(count):
            score = np.where(free, score, 0.0)
            at = np.unravel_index(int(np.argmax(score)), shape)
            if not score[at] > 0:
                return
            i, j = int(at[0]), int(at[1])
            chosen.append((i, j))
            free[max(i - gap, 0) : i + gap + 1, max(j - gap, 0) : j + gap + 1] = False

    if rounds > LOOKS:
        if edge.any():
            take(np.where(edge, distance_transform_edt(free), 0.0), most // 4)
        take(np.where(unresolved, rough, 0.0), most * 3 // 4 - len(chosen))
    take(rough, most - len(chosen))
    return np.array(chosen, int).reshape(-1, 2)
