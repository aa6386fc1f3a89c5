"""The line of a tolerance over two keys: cells are solved in rounds, each chosen from the results of the earlier ones.

The difference over the cells is interpolated from the solved ones twice, by cubic and by linear radial functions. The
largest distance of the two among the cells next to a solved one is its part of the error; a cell has the largest part
of its three nearest solved cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from scenes.errors import SceneError
from scenes.loading import overridden
from validate.sweep.design import Job, Row, Task

VERDICTS = ("agrees", "differs", "unresolved")
FIRST = 9  # Cells along either key that are solved first, the corners of the map among them.
ROUND = 16  # Cells of a round: a quarter where interpolations disagree most, the others where the verdict is open.
LOOKS = 2  # Rounds that only look for disagreement, before verdicts rely on the error.
ENOUGH = 0.01  # The part of the cells that may stay unresolved; each of the last ones would need a solution.
NEXT = 3  # Solved cells that a cell is next to, as a triangle has corners.


class Map:
    """The map of a check over two keys, interpolated between the ``solved`` cells; arrays have an entry for each cell.

    The ``value`` is NaN where no solved cell next to it has an answer, and the ``error`` infinite where one has none;
    between solved cells in one line nothing is interpolated. The solved cells' own part of the error is
    ``solved_error``. Verdicts are "agrees", "differs", "unresolved",
    "refused" or, without an answer, the status of the nearest solved cell.
    """

    def __init__(self, job: Job, solved: dict[int, Row], refused: np.ndarray) -> None:
        shape, check, count = job.design.shape, job.scope.check, refused.size
        self.places = np.indices(shape).reshape(2, -1).T / (np.array(shape) - 1)
        self.solved, self.refused, self.tolerance = solved, refused, job.scope.scene.tolerance(check)
        self.value, self.error, self.solved_error = np.full(count, np.nan), np.full(count, np.inf), np.zeros(count)
        built = {n: row for n, row in solved.items() if row["status"] != "refused"}
        values, errors = (
            np.array([row.get(f"{check}_{part}", np.nan) for row in built.values()]) for part in ("difference", "u_num")
        )
        answers = {n: value for n, value in zip(built, values, strict=True) if np.isfinite(value)}
        if len(answers) > NEXT and self._spans(answers):
            smooth, linear = (self._interpolated(answers, kernel) for kernel in ("cubic", "linear"))
            around, _ = self.nearest(built, NEXT)
            distance = np.zeros(len(built))
            np.maximum.at(distance, around, np.abs(smooth - linear)[:, None])
            distance[np.isnan(values)] = np.inf
            self.value = np.where(np.isnan(values)[around].all(axis=1), np.nan, smooth)
            self.solved_error = np.nan_to_num(errors)[around].max(axis=1)
            self.error = self.solved_error + distance[around].max(axis=1)
        self.value[[*built]], self.error[[*built]] = values, np.where(np.isnan(values), np.inf, errors)
        self.value[refused] = np.nan
        size, status = np.abs(self.value), {n: row["status"] for n, row in built.items() if row["status"] != "ok"}
        self.verdicts = np.full(count, "unresolved", object)
        self.verdicts[size - self.error > self.tolerance] = "differs"
        self.verdicts[size + self.error <= self.tolerance] = "agrees"
        self.verdicts = np.where(np.isnan(self.value), self._word(status), self.verdicts)
        self.verdicts[refused] = "refused"

    def columns(self) -> dict[str, np.ndarray]:
        """Return the columns of map.csv beside the keys.

        The blame is the assumption with the largest part, interpolated between the cells that know it, or "".
        """
        parts = {n: row["parts"] for n, row in self.solved.items() if row.get("parts")}
        names = np.array([*next(iter(parts.values()), {"": 0.0})], object)
        sizes = np.abs(self._interpolated({n: [*part.values()] for n, part in parts.items()})).reshape(-1, len(names))
        blamed = np.isin(self.verdicts, VERDICTS) & (sizes.max(axis=1) > 0)
        how = np.full(self.value.size, "interpolated", object)
        how[[*self.solved]] = ["refused" if row["status"] == "refused" else "solved" for row in self.solved.values()]
        return {
            "difference": self.value, "error": np.where(np.isfinite(self.value), self.error, np.nan),
            "verdict": self.verdicts, "how": how, "blame": np.where(blamed, names[sizes.argmax(axis=1)], ""),
        }  # fmt: skip

    def nearest(self, numbers: Iterable[int], count: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """(cells, count): of some cells the nearest ones to each cell, by their order, and the distances."""
        from scipy.spatial import KDTree

        tree = KDTree(self.places[[*numbers]])
        distances, nearest = tree.query(self.places, range(1, min(count, tree.n) + 1))
        return nearest, distances

    def _word(self, words: Mapping[int, str]) -> np.ndarray:
        """The word of the nearest of some cells; "unresolved" without any."""
        none = np.full(self.value.size, "unresolved", object)
        return np.array([*words.values()], object)[self.nearest(words)[0][:, 0]] if words else none

    def _spans(self, numbers: Iterable[int]) -> bool:
        """Whether some cells do not lie in one line."""
        places = self.places[[*numbers]]
        return bool(np.linalg.matrix_rank(places - places[0]) == 2)

    def _interpolated(self, values: Mapping[int, Any], kernel: str = "linear") -> np.ndarray:
        """(cells, ...): the values of some cells, interpolated by radial functions; NaN without any."""
        from scipy.interpolate import RBFInterpolator

        if not values:
            return np.full(self.value.size, np.nan)
        given, places = np.array([*values.values()], float), self.places[[*values]]
        surface = RBFInterpolator(places, given, kernel=kernel, degree=int(self._spans(values)))
        between: np.ndarray = surface(self.places)
        return between


def refine(job: Job, rows: Mapping[int, Row], gather: Callable[[Iterable[Task], str], None]) -> Map:
    """Solve cells until few are unresolved, or the limit of solutions is reached; refused designs don't count.

    ``gather`` solves cells and adds their ``rows``; its other argument is a remark for the progress.
    Refused cells are surrounded by others; these need no solution.
    """
    from scipy.ndimage import binary_dilation

    shape, limit = job.design.shape, job.solves or 0
    first = [np.unique(np.linspace(0, n - 1, min(FIRST, n, math.isqrt(limit))).round().astype(int)) for n in shape]
    wanted = np.ravel_multi_index(np.ix_(*first), shape).ravel().tolist()
    solved: dict[int, Row] = {}
    refused, rounds, remark = np.zeros(job.design.count, bool), 0, ""
    while True:
        gather((job.task(n, rounds == 0) for n in wanted if n not in rows), remark)
        solved |= {n: rows[n] for n in wanted}
        found = [n for n in wanted if solved[n]["status"] == "refused"]
        while found:
            refused[found] = True
            border = binary_dilation(refused.reshape(shape)).ravel() & ~refused
            found = [n for n in np.flatnonzero(border).tolist() if n not in solved and _is_refused(job, n)]
        cells = Map(job, solved, refused)
        rounds += 1
        paid = sum(row["status"] != "refused" for row in solved.values())
        wanted = _choose_next(cells, rounds, min(ROUND, limit - paid))
        if not wanted:
            return cells
        remark = f", {np.mean(cells.verdicts == 'unresolved'):.1%} unresolved"


def _is_refused(job: Job, number: int) -> bool:
    try:
        overridden(job.scope.scene, job.task(number)[2])
    except SceneError:
        return True
    return False


def _choose_next(cells: Map, rounds: int, most: int) -> list[int]:
    """The numbers of the cells to solve next, far from solved ones; none where enough is resolved."""
    # Where the solved values' own error reaches the tolerance more of them would not tell.
    clear = ~(np.abs(np.abs(cells.value) - cells.tolerance) <= cells.solved_error)
    unresolved = (cells.verdicts == "unresolved") & clear
    unresolved[[*cells.solved]] = False
    if unresolved.mean() <= ENOUGH and rounds > LOOKS:
        return []
    distance = cells.nearest(cells.solved)[1][:, 0]
    rough = np.where(np.isfinite(cells.error) & ~cells.refused, cells.error, 0.0)
    chosen: list[int] = []
    for n in range(most):
        score = distance * (unresolved if rounds > LOOKS and n < most * 3 // 4 else rough)
        best = int(np.argmax(score))
        if score[best] > 0:
            chosen.append(best)
            distance = np.minimum(distance, np.linalg.norm(cells.places - cells.places[best], axis=1))
    return chosen
