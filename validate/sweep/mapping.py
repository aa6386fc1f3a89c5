"""The line of a tolerance over two keys: cells are solved in rounds, each chosen from the results of the earlier ones.

The difference over the cells is interpolated from the solved ones twice: piecewise linear on the triangles between
them, and smooth through all of them (cubic radial functions). The largest distance of the two in a triangle estimates
the error there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from scenes.errors import SceneError
from validate.sweep.design import settings
from validate.sweep.point import Job, Row, Work, blame
from validate.sweep.store import Store

VERDICTS = ("agrees", "differs", "unresolved")
FIRST = 9  # Cells along either key that are solved first, the corners of the map among them.
ROUND = 16  # Cells of a round: a quarter where interpolations disagree most, the others where the verdict is open.
LOOKS = 2  # Rounds that only look for disagreement, before verdicts rely on the error.
ENOUGH = 0.01
"""The part of the cells that may stay unresolved; each of the last ones would need a solution."""


@dataclass(frozen=True, eq=False)
class Map:
    """The map of a check over two keys; arrays are (n, m), over the cells.

    Attributes
    ----------
    solved : rows of the solved cells by number
    tolerance : tolerance of the check
    value : difference, NaN without an answer
    corner_error : error bound of the solved values at the corners of the triangle
    disagreement : error of the interpolation; infinite where a corner has no answer
    unanswered : whether no corner has an answer
    refused : whether the design can't be built
    """

    solved: dict[int, Row]
    tolerance: float
    value: np.ndarray
    corner_error: np.ndarray
    disagreement: np.ndarray
    unanswered: np.ndarray
    refused: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """The error bound of ``value``."""
        return self.disagreement + self.corner_error

    @cached_property
    def verdicts(self) -> np.ndarray:
        """ "agrees", "differs" or "unresolved"; where there is no answer the status of the cells around."""
        size, error = np.abs(self.value), self.error
        verdicts = np.full(size.shape, "unresolved", dtype=object)
        verdicts[size - error > self.tolerance] = "differs"
        verdicts[size + error <= self.tolerance] = "agrees"
        status = {number: row.status for number, row in self.solved.items()}
        verdicts[self.unanswered] = self._nearest(status)[self.unanswered]
        for number, word in status.items():
            if word != "ok":
                verdicts.flat[number] = word
        verdicts[self.refused] = "refused"
        return verdicts

    @cached_property
    def blames(self) -> np.ndarray:
        """(n, m): the assumption with the largest part, interpolated between cells that know it; or ""."""
        by_cell = {number: row.parts for number, row in self.solved.items() if row.parts}
        names = list(next(iter(by_cell.values()), ()))
        parts = self._between({n: [given.get(name, 0.0) for name in names] for n, given in by_cell.items()})
        words = np.full(self.value.shape, "", object)
        for cell in np.argwhere(np.isin(self.verdicts, VERDICTS) & bool(names)).tolist():
            words[*cell] = blame(dict(zip(names, parts[*cell], strict=True)))["blame"]
        return words

    @cached_property
    def excess(self) -> np.ndarray:
        """(n, m): the excess (K) of a material over its valid_to, interpolated between the solved cells; NaN without an
        answer or a valid_to."""
        column = "past_valid_to_K"
        excess = self._between({n: row.values[column] for n, row in self.solved.items() if column in row.values})
        return np.where(np.isin(self.verdicts, VERDICTS), excess, np.nan)

    @cached_property
    def too_hot(self) -> np.ndarray:
        """(n, m): the material that gets past its valid_to, from the nearest such cell; "" where none does."""
        names = {n: row.values["too_hot"] for n, row in self.solved.items() if row.values.get("too_hot")}
        return np.where(self.excess > 0, self._nearest(names), "")

    def _between(self, values: Mapping[int, Any]) -> np.ndarray:
        """(n, m, ...): values of some solved cells, interpolated linearly by their distances; NaN for none."""
        from scipy.interpolate import RBFInterpolator

        shape = self.value.shape
        if not values:
            return np.full(shape, np.nan)
        given = np.array(list(values.values()), float)
        surface = RBFInterpolator(_places(values, shape), given, kernel="linear")
        between: np.ndarray = surface(_places(range(math.prod(shape)), shape))
        return between.reshape(*shape, *given.shape[1:])

    def _nearest(self, words: Mapping[int, str]) -> np.ndarray:
        """(n, m): the word of the nearest of some solved cells; "" without any."""
        from scipy.spatial import KDTree

        shape = self.value.shape
        if not words:
            return np.full(shape, "", object)
        nearest = KDTree(_places(words, shape)).query(_places(range(math.prod(shape)), shape))[1]
        return np.array(list(words.values()), object)[nearest].reshape(shape)


def _places(numbers: Iterable[int], shape: tuple[int, ...]) -> np.ndarray:
    """(k, 2): where some cells are."""
    return np.column_stack(np.unravel_index(np.asarray(list(numbers)), shape)).astype(float)


def refine(job: Job, store: Store, gather: Callable[[Iterable[Work], int, str], None]) -> Map:
    """Solve cells until few are unresolved, or the limit of solutions is reached; refused designs don't count.

    ``gather`` solves cells and stores their rows; its other arguments are the limit and a remark for the progress.
    """
    shape, limit = job.design.shape, job.solves or 0
    first = [np.unique(np.linspace(0, n - 1, min(FIRST, n, math.isqrt(limit))).round().astype(int)) for n in shape]
    wanted = np.ravel_multi_index(np.ix_(*first), shape).ravel()
    solved: dict[int, Row] = {}
    refused: dict[int, bool] = {}
    rounds, remark = 0, ""
    while True:
        gather((job.work(n, rounds == 0) for n in wanted.tolist() if n not in store), limit, remark)
        chosen = set(wanted.tolist())
        solved |= {row.point: row for row in store.rows() if row.point in chosen}
        cells = _interpolate(job, solved, refused)
        rounds += 1
        paid = sum(row.status != "refused" for row in solved.values())
        wanted = _choose_next(cells, rounds, min(ROUND, limit - paid))
        if not len(wanted):
            return cells
        remark = f", {np.mean(cells.verdicts == 'unresolved'):.1%} unresolved"


def _interpolate(job: Job, solved: dict[int, Row], known: dict[int, bool]) -> Map:
    """Interpolate between the solved cells, the corners among them. ``known`` caches the cells that can't be built.

    Where a corner of a triangle can't be built, the smooth surface goes on to it.
    """
    from scipy.interpolate import LinearNDInterpolator, RBFInterpolator
    from scipy.spatial import Delaunay

    shape = job.design.shape
    values, errors = (
        np.array([row.values.get(f"{job.scope.check}_{name}", np.nan) for row in solved.values()], float)
        for name in ("difference", "u_num")
    )
    cells, everywhere = _places(list(solved), shape), _places(np.arange(math.prod(shape)), shape)
    answered = np.isfinite(values) & np.isfinite(errors)
    barred = np.array([row.status == "refused" and _refused(job, n, known) for n, row in solved.items()])
    net = Delaunay(cells)
    inside = net.find_simplex(everywhere)
    bad, barred_near = (
        flags[net.simplices].sum(axis=1)[inside].reshape(shape) for flags in (~answered & ~barred, barred)
    )
    refused = np.zeros(shape, bool)
    refused.flat[[n for n in np.flatnonzero(barred_near).tolist() if _refused(job, n, known)]] = True
    smooth = np.full(shape, np.nan)
    apart = np.full(shape, np.inf)
    if answered.sum() >= 6:
        sides = np.maximum(np.array(shape) - 1, 1)
        surface = RBFInterpolator(cells[answered] / sides, values[answered], kernel="cubic")
        smooth = surface(everywhere / sides).reshape(shape)
        values[barred] = smooth[tuple(cells[barred].astype(int).T)]
        linear = LinearNDInterpolator(net, np.where(answered | barred, values, 0.0))(everywhere).reshape(shape)
        most = np.zeros(len(net.simplices))
        np.maximum.at(most, inside, np.abs(smooth - linear).ravel())
        # A bend in the surface may lie where two triangles meet.
        most = np.maximum(most, np.where(net.neighbors >= 0, most[net.neighbors], 0.0).max(axis=1))
        apart = np.where((bad == 0) & (barred_near < 3), most[inside].reshape(shape), np.inf)
    at = tuple(cells.astype(int).T)
    smooth[at], apart[at] = np.where(answered, values, np.nan), np.where(answered, 0.0, np.inf)
    known_error = np.where(answered, errors, 0.0)[net.simplices].max(axis=1)[inside].reshape(shape)
    known_error[at] = errors
    value = np.where((bad == 3) | refused, np.nan, smooth)
    tolerance: float = job.base.at(()).tolerance(job.scope.check)  # type: ignore[union-attr]
    return Map(solved, tolerance, value, known_error, apart, bad == 3, refused)


def _refused(job: Job, number: int, known: dict[int, bool]) -> bool:
    """Whether the scene of a cell is refused."""
    if number not in known:
        try:
            job.base.at(settings(job.base, job.design.keys, job.design.point(number)))
            known[number] = False
        except SceneError:
            known[number] = True
    return known[number]


def _choose_next(cells: Map, rounds: int, most: int) -> np.ndarray:
    """The numbers of the cells to solve next, apart from each other; none where enough is resolved."""
    from scipy.ndimage import distance_transform_edt

    value = cells.value
    free = np.ones(value.shape, bool)
    free.flat[list(cells.solved)] = False
    free &= ~cells.refused
    # Where the solved values' own error reaches the tolerance more of them would not tell.
    clear = ~(np.abs(np.abs(value) - cells.tolerance) <= cells.corner_error)
    unresolved = (cells.verdicts == "unresolved") & free & clear
    chosen: list[int] = []
    if unresolved.mean() <= ENOUGH and rounds > LOOKS:
        return np.array(chosen, int)
    # Where an answer ends there is no error to go by: the middle of the gap halves it.
    edge = np.isinf(cells.disagreement) & ~cells.unanswered & free
    rough = np.where(edge, 0.0, cells.error)
    gap = max(2, int(0.35 * np.sqrt(value.size / len(cells.solved))))

    def take(score: np.ndarray, count: int) -> None:
        for _ in range(count):
            score = np.where(free, score, 0.0)
            best = int(np.argmax(score))
            if not score.flat[best] > 0:
                return
            i, j = np.unravel_index(best, value.shape)
            chosen.append(best)
            free[max(i - gap, 0) : i + gap + 1, max(j - gap, 0) : j + gap + 1] = False

    if rounds > LOOKS:
        if edge.any():
            take(np.where(edge, distance_transform_edt(free), 0.0), most // 4)
        take(np.where(unresolved, rough, 0.0), most * 3 // 4 - len(chosen))
    take(rough, most - len(chosen))
    return np.array(chosen, int)
