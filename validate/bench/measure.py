"""Entries measured in processes of their own, in turns, so that whatever else the machine does falls on all alike."""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from validate.bench.entries import Entry
from validate.processes import ONE_THREAD

TIME_LIMIT = 900.0  # s
PATIENCE = 1.0  # s a worker repeats its solve for
MOST = 5  # repeats in one worker
LONG = 20.0  # s: entries that take longer are measured once


class EntryError(ArithmeticError):
    """An entry did not come to an end; the message says which and why."""


def once(entry: Entry, most: int = 0, patience: float = 0.0) -> dict[str, Any]:
    """What one worker found and took; EntryError where it failed or took longer than TIME_LIMIT."""
    given = {
        "tool": entry.module,
        "options": entry.options,
        "launched": time.time(),
        "most": most,
        "patience": patience,
    }
    command = [sys.executable, "-m", "validate.bench.worker", json.dumps(given)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIME_LIMIT, env=os.environ | ONE_THREAD, check=False
        )
    except subprocess.TimeoutExpired:
        raise EntryError(f"{entry.tool} ({entry.label}) took more than {TIME_LIMIT:g} s") from None
    if done.returncode:
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        raise EntryError(f"{entry.tool} ({entry.label}) failed: {last}")
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


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


def in_turns(entries: Sequence[Entry], rounds: int, progress: Callable[[str], None], patient: bool) -> list[Measured]:
    """Every entry, ``rounds`` times, one after another; workers that aren't ``patient`` solve once."""
    patience = PATIENCE if patient else 0.0
    results: list[list[dict[str, Any]]] = [[] for _ in entries]
    failures = ["" for _ in entries]
    for turn in range(rounds):
        for i, entry in enumerate(entries):
            if failures[i] or (results[i] and min(results[i][0]["seconds"]) > LONG):
                continue
            progress(f"round {turn + 1} of {rounds}: {entry.tool}, {entry.label}")
            try:
                results[i].append(once(entry, MOST, patience))
            except EntryError as error:
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
