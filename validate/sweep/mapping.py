"""The line of a tolerance over two keys: cells are solved in rounds, each chosen from the results of the earlier ones.

The difference over the cells is interpolated from the solved ones twice, by cubic and by linear radial functions. The
largest distance of the two among the cells next to a solved one is its part of the error; a cell has the largest part
of its three nearest solved cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
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
NEXT = 3  # Solved cells that a cell is next to, as a triangle has corners.


@dataclass(frozen=True, eq=False)
class Map:
    """The map of a check over two keys; arrays are (n, m), over the cells.

    Attributes
    ----------
    solved : rows of the solved cells by number
    tolerance : tolerance of the check
    value : difference, NaN where no solved cell next to it has an answer
    error : error bound of ``value``, infinite where one of these cells has no answer
    solved_error : the part of the error bound that the solved cells have themselves
    refused : whether the design can't be built
    """

    solved: dict[int, Row]
    tolerance: float
    value: np.ndarray
    error: np.ndarray
    solved_error: np.ndarray
    refused: np.ndarray

    @cached_property
    def verdicts(self) -> np.ndarray:
        """ "agrees", "differs" or "unresolved"; where there is no answer the status of the nearest solved cell."""
        size = np.abs(self.value)
        verdicts = np.full(size.shape, "unresolved", dtype=object)
        verdicts[size - self.error > self.tolerance] = "differs"
        verdicts[size + self.error <= self.tolerance] = "agrees"
        unanswered = np.isnan(self.value)
        status = {number: row.status for number, row in self.solved.items() if row.status not in ("ok", "refused")}
        verdicts[unanswered] = self._nearest(status)[unanswered]
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
        """(n, m, ...): values of some solved cells, interpolated to all cells; NaN for none."""
        return _interpolate(values, self.value.shape, "linear") if values else np.full(self.value.shape, np.nan)

    def _nearest(self, words: Mapping[int, str]) -> np.ndarray:
        """(n, m): the word of the nearest of some solved cells; "" without any."""
        if not words:
            return np.full(self.value.shape, "", object)
        return np.array(list(words.values()), object)[_nearest(words, self.value.shape)[0]].reshape(self.value.shape)


def _places(numbers: Iterable[int], shape: tuple[int, ...]) -> np.ndarray:
    """(k, 2): where some cells are, in parts of the map."""
    places = np.column_stack(np.unravel_index(np.asarray(list(numbers)), shape))
    return places / np.maximum(np.array(shape) - 1, 1)


def _nearest(numbers: Iterable[int], shape: tuple[int, ...], count: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """(cells, count): of some cells the nearest ones to each cell, by their order in ``numbers``; and the distances."""
    from scipy.spatial import KDTree

    tree = KDTree(_places(numbers, shape))
    distances, nearest = tree.query(_places(range(math.prod(shape)), shape), range(1, min(count, tree.n) + 1))
    return nearest, distances


def _interpolate(values: Mapping[int, Any], shape: tuple[int, ...], kernel: str) -> np.ndarray:
    """(n, m, ...): the values of some cells, interpolated to all cells by radial functions."""
    from scipy.interpolate import RBFInterpolator

    given = np.array(list(values.values()), float)
    surface = RBFInterpolator(_places(values, shape), given, kernel=kernel, degree=1 if len(given) > 2 else 0)
    between: np.ndarray = surface(_places(range(math.prod(shape)), shape))
    return between.reshape(*shape, *given.shape[1:])


def refine(job: Job, store: Store, gather: Callable[[Iterable[Work], int, str], None]) -> Map:
    """Solve cells until few are unresolved, or the limit of solutions is reached; refused designs don't count.

    ``gather`` solves cells and stores their rows; its other arguments are the limit and a remark for the progress.
    """
    shape, limit = job.design.shape, job.solves or 0
    first = [np.unique(np.linspace(0, n - 1, min(FIRST, n, math.isqrt(limit))).round().astype(int)) for n in shape]
    wanted = np.ravel_multi_index(np.ix_(*first), shape).ravel().tolist()
    solved: dict[int, Row] = {}
    rounds, remark = 0, ""

    @cache
    def is_refused(number: int) -> bool:
        try:
            job.base.at(settings(job.base, job.design.keys, job.design.point(number)))
        except SceneError:
            return True
        return False

    while True:
        gather((job.work(n, rounds == 0) for n in wanted if n not in store), limit, remark)
        solved |= {row.point: row for row in store.rows() if row.point in wanted}
        cells = _estimate(job, solved, is_refused)
        rounds += 1
        paid = sum(row.status != "refused" for row in solved.values())
        wanted = _choose_next(cells, rounds, min(ROUND, limit - paid))
        if not wanted:
            return cells
        remark = f", {np.mean(cells.verdicts == 'unresolved'):.1%} unresolved"


def _estimate(job: Job, solved: dict[int, Row], is_refused: Callable[[int], bool]) -> Map:
    """Interpolate between the solved cells; refused ones are surrounded by others as far as ``is_refused``."""
    from scipy.ndimage import binary_dilation

    shape = job.design.shape
    refused = np.zeros(shape, bool)
    found = [n for n, row in solved.items() if row.status == "refused"]
    while found:
        refused.flat[found] = True
        found = [n for n in np.flatnonzero(binary_dilation(refused) & ~refused).tolist() if is_refused(n)]
    value, error, solved_error = np.full(shape, np.nan), np.full(shape, np.inf), np.zeros(shape)
    names = (f"{job.scope.check}_difference", f"{job.scope.check}_u_num")
    rows = {n: [row.values.get(name, np.nan) for name in names] for n, row in solved.items() if row.status != "refused"}
    answers = {n: row[0] for n, row in rows.items() if np.isfinite(row).all()}
    if len(answers) > NEXT:
        values, errors = np.array(list(rows.values())).T
        smooth, linear = (_interpolate(answers, shape, kernel) for kernel in ("cubic", "linear"))
        around, _ = _nearest(rows, shape, NEXT)
        distance = np.zeros(len(rows))
        np.maximum.at(distance, around, np.abs(smooth - linear).reshape(-1, 1))
        distance[np.isnan(values)] = np.inf
        value = np.where(np.isnan(values)[around].all(axis=1).reshape(shape), np.nan, smooth)
        solved_error = np.nan_to_num(errors)[around].max(axis=1).reshape(shape)
        error = solved_error + distance[around].max(axis=1).reshape(shape)
        value.flat[list(rows)] = values
        error.flat[list(rows)] = np.where(np.isnan(values), np.inf, errors)
    value[refused] = np.nan
    tolerance: float = job.base.at(()).tolerance(job.scope.check)  # type: ignore[union-attr]
    return Map(solved, tolerance, value, error, solved_error, refused)


def _choose_next(cells: Map, rounds: int, most: int) -> list[int]:
    """The numbers of the cells to solve next, far from solved ones; none where enough is resolved."""
    shape = cells.value.shape
    # Where the solved values' own error reaches the tolerance more of them would not tell.
    clear = ~(np.abs(np.abs(cells.value) - cells.tolerance) <= cells.solved_error)
    unresolved = ((cells.verdicts == "unresolved") & clear).ravel()
    unresolved[list(cells.solved)] = False
    if unresolved.mean() <= ENOUGH and rounds > LOOKS:
        return []
    places, distance = _places(range(unresolved.size), shape), _nearest(cells.solved, shape)[1].ravel()
    rough = np.where(np.isfinite(cells.error) & ~cells.refused, cells.error, 0.0).ravel()
    chosen: list[int] = []
    for n in range(most):
        score = distance * (unresolved if rounds > LOOKS and n < most * 3 // 4 else rough)
        best = int(np.argmax(score))
        if score[best] > 0:
            chosen.append(best)
            distance = np.minimum(distance, np.linalg.norm(places - places[best], axis=1))
    return chosen
