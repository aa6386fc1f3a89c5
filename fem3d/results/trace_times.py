"""At which times traces are written: as few as linear interpolation between them allows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Protocol

import numpy as np


class Step(Protocol):
    """A step in time."""

    @property
    def start(self) -> float:
        """Its start (s)."""

    @property
    def length(self) -> float:
        """Its length (s)."""


MOST_ROWS, FEWEST = 50_000, 40


def choose(
    steps: Sequence[Step],
    evaluate: Callable[[np.ndarray], dict[str, np.ndarray]],
    allowed: dict[str, float],
    jumps: Sequence[float] = (),
    instants: Sequence[float] = (),
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, float]]:
    """Return times (s) from 0 on between which linear interpolation errs by at most ``allowed`` in each trace,
    the traces there, and the interpolation errors.

    The error of a straight line over h is h^2 |y''| / 8, so the rows take equal shares of the integral of
    sqrt(|y''| / 8 / allowed) (de Boor's equidistribution), with a margin. Intervals are halved where a trace
    still deviates, in the middle between two rows or at any other sample.
    Traces may jump at ``jumps``: there are rows just before and at each. ``instants`` are rows too.
    """
    inner = (1 - np.cos(np.linspace(0, np.pi, 25)[:-1])) / 2
    end = steps[-1].start + steps[-1].length
    cuts = [0.0, *jumps, end]
    pieces = []
    for start, stop in pairwise(cuts):
        within = [s for s in steps if start <= s.start < stop]
        last = stop if stop == end else stop - 1e-9 * (stop - start)
        fine = np.concatenate([s.start + s.length * inner for s in within] + [[last]])
        pieces.append(_piece(fine, evaluate, allowed, MOST_ROWS // len(cuts), FEWEST if len(cuts) == 2 else 4))
    times = np.unique(np.concatenate([*(p[0] for p in pieces), [t for t in instants if 0.0 <= t <= end]]))
    # A stretch alone has been evaluated at its rows.
    traces = pieces[0][2] if len(pieces) == 1 and len(times) == len(pieces[0][0]) else evaluate(times)
    return times, traces, {name: max(p[1][name] for p in pieces) for name in allowed}


def _piece(
    fine: np.ndarray,
    evaluate: Callable[[np.ndarray], dict[str, np.ndarray]],
    allowed: dict[str, float],
    most: int,
    fewest: int,
) -> tuple[np.ndarray, dict[str, float], dict[str, np.ndarray]]:
    """The rows of a stretch without jumps, sampled at ``fine``, the errors between them, and the traces there."""
    traces = evaluate(fine)
    h = np.diff(fine)
    density = np.zeros(len(fine))
    for name, y in traces.items():
        slope = np.diff(y) / h
        bend = np.abs(np.diff(slope)) / ((h[1:] + h[:-1]) / 2)
        bend = np.concatenate([bend[:1], bend, bend[-1:]])
        density = np.maximum(density, np.sqrt(bend / 8 / allowed[name]))
    share = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * h)])
    share += 1e-9 * np.arange(len(fine))
    count = min(max(int(np.ceil(1.3 * share[-1])), fewest), most)
    times = np.interp(np.linspace(0, share[-1], count + 1), share, fine)
    times[0], times[-1] = fine[0], fine[-1]
    rows, new = evaluate(times), np.arange(count)  # a stretch is known by the place of the row that it begins at
    while True:
        fine = np.concatenate([fine, middles := (times[new] + times[new + 1]) / 2])
        between = evaluate(middles)
        traces = {name: np.concatenate([y, between[name]]) for name, y in traces.items()}
        off = {name: np.abs(np.interp(fine, times, rows[name]) - y) for name, y in traces.items()}
        missed = fine[np.any([off[name] > allowed[name] for name in off], axis=0)]
        coarse = np.unique(np.clip(np.searchsorted(times, missed), 1, len(times) - 1))
        if not len(coarse) or len(times) + len(coarse) > most + 1:
            return times, {name: float(y.max()) for name, y in off.items()}, rows
        added = (times[coarse - 1] + times[coarse]) / 2
        at_added = evaluate(added)
        times = np.insert(times, coarse, added)
        rows = {name: np.insert(y, coarse, at_added[name]) for name, y in rows.items()}
        behind = coarse + np.arange(len(coarse))
        new = np.sort(np.concatenate([behind - 1, behind]))
