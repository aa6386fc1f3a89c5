"""Run time of entries, each in processes of its own and in turns, so that other work on the machine falls on
all alike.

The first of several solves of a process warms up and does not count. Times are of the processor, in seconds.
"""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import _lru_cache_wrapper
from typing import Any

from benchmarks.programs import Prepared
from compare.worker import Worker
from scenes.errors import SceneError

TIME_LIMIT = 900.0  # s
PATIENCE, MOST = 1.0, 5  # s and times that a process repeats its solve


@dataclass(frozen=True)
class Entry:
    """A program (``tool``), its settings in words (``label``), and the function that prepares it."""

    tool: str
    label: str
    prepare: Callable[[], Prepared]


class EntryError(ArithmeticError):
    """An entry did not come to an end; the message names it and the reason."""


def once(entry: Entry, patience: float = 0.0) -> dict[str, Any]:
    """Return the numbers and times of one process; raise EntryError where it failed or took too long."""
    name = f"{entry.tool} ({entry.label})"
    try:
        return Worker(name).run(TIME_LIMIT, work, entry, patience)
    except Exception as error:
        named = isinstance(error, SceneError)
        raise EntryError(str(error) if named else f"{name} failed: {type(error).__name__}: {error}") from None


def in_turns(
    entries: Sequence[Entry], rounds: int, progress: Callable[[str], None], patience: float
) -> list[dict[str, Any]]:  # fmt: skip
    """Measure every entry some times, one after another; return for each its numbers, or its ``failure``."""
    rows: list[dict[str, Any]] = [{"tool": e.tool, "label": e.label, "failure": "", "seconds": []} for e in entries]
    for turn in range(rounds):
        for entry, row in zip(entries, rows, strict=True):
            if row["failure"]:
                continue
            progress(f"round {turn + 1} of {rounds}: {entry.tool}, {entry.label}")
            try:
                answer = once(entry, patience)
            except EntryError as error:
                row["failure"] = str(error)
            else:
                row |= answer | {"seconds": row["seconds"] + answer["seconds"]}
    for row in rows:
        if not row["failure"]:
            seconds = row.pop("seconds")
            row |= {"median_s": statistics.median(seconds), "fastest_s": min(seconds), "slowest_s": max(seconds)}
    return rows


def work(entry: Entry, patience: float) -> dict[str, Any]:
    """Run an entry in this process; repeat the solve for a ``patience`` (s)."""
    solve, read = entry.prepare()
    end = time.perf_counter() + patience
    seconds: list[float] = []
    while len(seconds) <= MOST and (not seconds or time.perf_counter() < end):
        # A repeated solve must not find the results of an earlier one.
        for cache in [item for item in gc.get_objects() if isinstance(item, _lru_cache_wrapper)]:
            cache.cache_clear()
        started = time.process_time()
        answer = solve()
        seconds.append(time.process_time() - started)
    return {"seconds": seconds[1:] or seconds, **read(answer)}
