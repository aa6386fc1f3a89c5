"""Entries measured in turns, so that whatever else the machine does falls on all of them alike."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from validate.bench import launch
from validate.bench.entries import Entry

PATIENCE = 1.0  # s a worker repeats its solve for
MOST = 5  # repeats in one worker
LONG = 20.0  # s: entries that take longer are measured once


@dataclass(frozen=True, eq=False)
class Measured:
    """An entry, the seconds of every timed solve, the medians, and what the last worker found; ``failure`` says why
    there is nothing."""

    entry: Entry
    seconds: tuple[float, ...]
    start_up_s: float
    peak_MB: float  # noqa: N815 - a unit keeps its capitals
    found: dict[str, Any]
    failure: str = ""

    @property
    def median_s(self) -> float:
        """The median over all timed solves."""
        return statistics.median(self.seconds)


def patience(quick: bool) -> float:
    """How long (s) a worker repeats its solve for; in a quick run the first solve is the only one."""
    return 0.0 if quick else PATIENCE


def measure(
    entries: Sequence[Entry], rounds: int, progress: Callable[[str], None], patience: float = PATIENCE
) -> list[Measured]:
    """Every entry, ``rounds`` times, one after another, each worker with so much ``patience`` (s)."""
    results: list[list[dict[str, Any]]] = [[] for _ in entries]
    failures = ["" for _ in entries]
    for turn in range(rounds):
        for i, entry in enumerate(entries):
            if failures[i] or (results[i] and min(results[i][0]["seconds"]) > LONG):
                continue
            progress(f"round {turn + 1} of {rounds}: {entry.tool}, {entry.label}")
            try:
                results[i].append(launch.measure(entry, MOST, patience))
            except launch.EntryError as error:
                failures[i] = str(error)
    return [_together(*each) for each in zip(entries, results, failures, strict=True)]


def _together(entry: Entry, results: list[dict[str, Any]], failure: str) -> Measured:
    if failure or not results:
        return Measured(entry, (float("nan"),), float("nan"), float("nan"), {}, failure or "not measured")
    seconds = tuple(s for result in results for s in result["seconds"])
    return Measured(
        entry, seconds, statistics.median(r["start_up_s"] for r in results), max(r["peak_MB"] for r in results),
        results[-1],
    )  # fmt: skip
