"""Sparse Cholesky factors, to solve and to precondition: a nested dissection, and multifrontal elimination."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations_with_replacement, pairwise

import numpy as np
from scipy.linalg.blas import dsyrk
from scipy.linalg.lapack import dpotrf, dtrtri
from scipy.sparse import csc_array

from fem3d.spaces.size import LEAF
from fem3d.spaces.sparse import submatrix
from scenes.errors import NumericsError

# The least share of the unknowns on either side of a cut: with 0.4 factors of a mesh from Gmsh take 16 % more
# operations and of a meander among pads 6 %; cut in the middle they take twice as many.
SMALLEST_SIDE = 0.3

Solver = Callable[[np.ndarray], np.ndarray]
"""The solutions (n,) or (k, n) for right-hand sides of the same shape."""
Cut = tuple[float, np.ndarray, np.ndarray]
"""The size of a separator, its nodes (on one side, with neighbours on the other), and the nodes on the right."""


class Ordering:
    """Elimination order of groups of functions (one group per vertex, edge, facet or cell, at ``places`` (groups, 3)).

    The order is a nested dissection of the first matrix. It serves all matrices that couple no other groups. Each of
    its pieces follows the pieces that it joins.

    Attributes
    ----------
    rank : (groups,), order of elimination, negative for groups that are absent
    starts : (pieces + 1,), the rank of the first group of each piece
    joined : for each piece, the pieces that it joins
    outer : for each piece, the ranks of later groups that the elimination of earlier groups couples to this piece
    """

    starts: np.ndarray
    joined: list[list[int]]
    outer: list[np.ndarray]

    def __init__(self, places: np.ndarray) -> None:
        self._places, self.rank = places, np.full(len(places), -1)
        self.starts, self.joined, self.outer = np.zeros(1, int), [], []  # of no unknowns, whose groups all have a rank

    def hold(self, matrix: csc_array, groups: np.ndarray) -> None:
        """Make the dissection for a matrix whose unknowns are of ``groups`` (n,), if a group has no rank yet."""
        if (self.rank[groups] >= 0).all():
            return
        entities, group, sizes = np.unique(groups, return_inverse=True, return_counts=True)
        count = len(entities)
        rows, columns = group[matrix.indices], np.repeat(group, np.diff(matrix.indptr))
        below = rows > columns
        pairs = rows[below], columns[below]
        graph = csc_array((np.ones(len(pairs[0]), np.int8), pairs), shape=(count, count))
        rows, columns = graph.tocoo().coords
        pieces, self.joined = dissection(self._places[entities], sizes, rows, columns)
        place = np.argsort(np.concatenate(pieces))
        self.starts = np.concatenate([[0], np.cumsum([len(p) for p in pieces])])
        first, last = np.sort([place[rows], place[columns]], axis=0)
        by_first = np.argsort(first, kind="stable")
        last, at = last[by_first], np.searchsorted(first[by_first], self.starts)
        self.outer = []
        for piece, end in enumerate(self.starts[1:]):
            near = np.zeros(count, bool)
            near[last[at[piece] : at[piece + 1]]] = True
            for j in self.joined[piece]:
                near[self.outer[j]] = True
            self.outer.append(end + np.flatnonzero(near[end:]))
        self.rank = np.full(len(self._places), -1)
        self.rank[entities] = place


class Factors:
    """Cholesky factors of a symmetric positive definite matrix with unknowns in ``groups`` (n,), by multifrontal
    elimination (Duff and Reid, ACM Trans. Math. Softw. 9, 1983): each piece of a dissection has a dense matrix of its
    own and later unknowns, and passes its Schur complement on to the later pieces. Inverse triangles of the pieces take
    the place of substitutions, which are slower (Du Croz and Higham, IMA J. Numer. Anal. 12, 1992). They are kept in a
    ``precision``: single numbers are read in half the time, and precise enough to precondition.

    Raises NumericsError where rounding leaves the matrix indefinite, or where it couples more than the ``ordering``."""

    def __init__(self, matrix: csc_array, groups: np.ndarray, ordering: Ordering, precision: type = float) -> None:
        ordering.hold(matrix, groups)
        rank, self._precision = ordering.rank[groups], precision
        self._order = np.argsort(rank, kind="stable")
        self._blocks: list[tuple[slice, np.ndarray, np.ndarray]] = []
        sizes = np.bincount(rank, minlength=ordering.starts[-1])
        first = np.concatenate([[0], np.cumsum(sizes)])
        ordered, place = submatrix(matrix, self._order), np.zeros(len(rank), int)
        updates: dict[int, tuple[np.ndarray, np.ndarray]] = {}
        for piece, (start, end) in enumerate(pairwise(first[ordering.starts].tolist())):
            # The unknowns of the later groups: a range for each.
            counts = sizes[ordering.outer[piece]]
            starts = first[ordering.outer[piece]] - np.cumsum(counts) + counts
            outer = np.repeat(starts, counts) + np.arange(counts.sum())
            pivots = end - start
            place[start:end] = np.arange(pivots)
            place[outer] = np.arange(pivots, pivots + len(outer))
            front = np.zeros((pivots + len(outer),) * 2)
            entries = slice(ordered.indptr[start], ordered.indptr[end])
            rows = ordered.indices[entries]
            columns = np.repeat(np.arange(pivots), np.diff(ordered.indptr[start : end + 1]))
            later = rows >= start
            rows, into = rows[later], np.append(np.arange(start, end), outer)
            at = place[rows]
            # Entries without a place in this front have one in another, or none.
            if not (at < len(into)).all() or (into[at] != rows).any():
                raise NumericsError("the matrix couples unknowns that the matrix of its ordering doesn't")
            front[columns[later], at] = ordered.data[entries][later]
            # Isolated pieces leave nothing to the separators.
            for j in (j for j in ordering.joined[piece] if j in updates):
                unknowns, update = updates.pop(j)
                _extend_add(front, update, place[unknowns])
            if not pivots:
                if len(outer):
                    updates[piece] = outer, front
                continue
            # The upper triangle by rows is LAPACK's lower one by columns.
            lower, failed = dpotrf(front[:pivots, :pivots].T, lower=1)
            if failed:
                raise NumericsError("sizes or conductivities differ by so much that rounding leaves no solution")
            inverse, _ = dtrtri(lower, lower=1)
            across = inverse @ front[:pivots, pivots:]
            if len(outer):
                updates[piece] = outer, dsyrk(-1.0, across.T, beta=1.0, c=front[pivots:, pivots:].T, lower=1).T
            block = np.vstack([inverse, -across.T @ inverse])
            self._blocks.append((slice(start, end), into, block.astype(precision, copy=False)))

    @property
    def entries(self) -> int:
        """How many numbers the factors hold."""
        return sum(block.size for _, _, block in self._blocks)

    def solve(self, b: np.ndarray) -> np.ndarray:
        """The solutions for right-hand sides (n,) or (k, n); several at once read the factors once."""
        x: np.ndarray = b[..., self._order].T.astype(self._precision, order="C")
        for rows, both, block in self._blocks:
            parts, pivots = block @ x[rows], block.shape[1]
            x[rows] = parts[:pivots]
            x[both[pivots:]] += parts[pivots:]
        for rows, both, block in reversed(self._blocks):
            x[rows] = block.T @ x[both]
        solutions = np.empty_like(b)
        solutions[..., self._order] = x.T
        return solutions


def _extend_add(front: np.ndarray, update: np.ndarray, at: np.ndarray) -> None:
    """Add the upper triangle of an update (n, n) to a front, at the places ``at`` (n,), ascending."""
    # Block by block between runs of neighbours, which are few.
    cuts = [0, *(np.flatnonzero(np.diff(at) > 1) + 1).tolist(), len(at)]
    runs = [(slice(a, b), slice(at[a], at[a] + b - a)) for a, b in pairwise(cuts)]
    for (above, into_above), (right, into_right) in combinations_with_replacement(runs, 2):
        front[into_above, into_right] += update[above, right]


def dissection(
    places: np.ndarray, sizes: np.ndarray, rows: np.ndarray, columns: np.ndarray
) -> tuple[list[np.ndarray], list[list[int]]]:
    """The pieces of a graph of nodes at some places (n, 3) and of some sizes (n,), whose edges are pairs (rows,
    columns), such that elimination in their order fills in little; and for each the earlier pieces that it joins.

    The two sides of a plane come first, then the separator (George, SIAM J. Numer. Anal. 10, 1973): of all planes
    across the axes with at least a share `SMALLEST_SIDE` on either side that with the smallest separator.
    """
    pieces: list[np.ndarray] = []
    joined: list[list[int]] = []
    side, number = np.zeros(len(places), np.int8), np.zeros(len(places), int)

    def cut(nodes: np.ndarray, axis: int, rows: np.ndarray, columns: np.ndarray) -> Cut:
        order = nodes[np.argsort(places[nodes, axis], kind="stable")]
        number[order] = np.arange(len(order))
        size, joins, right = narrowest(places[order, axis], sizes[order], number[rows], number[columns])
        return size, order[joins], order[right]

    def split(nodes: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> list[int]:
        whole: Cut = np.inf, nodes[:0], nodes
        cuts = [cut(nodes, axis, rows, columns) for axis in range(3)] if sizes[nodes].sum() > LEAF else []
        size, joins, right = min([whole, *cuts], key=lambda each: each[0])
        if not np.isfinite(size):
            pieces.append(nodes)
            joined.append([])
            return [len(pieces) - 1]
        side[nodes] = 1
        side[right] = 2
        side[joins] = 3
        halves = []
        for which in (1, 2):
            within = (side[rows] == which) & (side[columns] == which)
            halves.append((nodes[side[nodes] == which], rows[within], columns[within]))
        below = [piece for half in halves if len(half[0]) for piece in split(*half)]
        if not len(joins):
            return below
        # Along the plane, so that the neighbours of a piece are contiguous.
        pieces.append(joins[np.lexsort(places[joins].T[np.ptp(places[joins], axis=0).argsort()])])
        joined.append(below)
        return [len(pieces) - 1]

    split(np.arange(len(places)), rows, columns)
    return pieces, joined


def narrowest(along: np.ndarray, sizes: np.ndarray, one: np.ndarray, other: np.ndarray) -> Cut:
    """Return the cut with the smallest separator between nodes in the order of their places ``along`` an axis (n,), of
    some sizes (n,), with edges from ``one`` to the ``other``; of equal cuts the nearest to the middle. Its size is
    infinite where all nodes have one place."""
    count, low, high = len(along), np.minimum(one, other), np.maximum(one, other)
    at, farthest, nearest = np.arange(count), np.arange(count), np.arange(count)
    np.maximum.at(farthest, low, high)
    np.minimum.at(nearest, high, low)
    # A node on the left of a cut joins from where it stands to before its farthest neighbour, and so on the right.
    starts, ends, back = (np.bincount(i, sizes, count) for i in (at, farthest, nearest))
    left, right = np.cumsum(starts - ends), np.cumsum(back - starts)
    off = np.abs(np.cumsum(sizes) / sizes.sum() - 0.5)
    off[~np.append(along[1:] > along[:-1], False)] = np.inf
    least = np.where(off <= max(0.5 - SMALLEST_SIDE, off.min()), np.minimum(left, right) + off, np.inf)
    k = int(least.argmin())
    joins = at[: k + 1][farthest[: k + 1] > k] if left[k] <= right[k] else at[k + 1 :][nearest[k + 1 :] <= k]
    return float(least[k]), joins, at[k + 1 :]
