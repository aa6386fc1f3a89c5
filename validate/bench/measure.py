"""Entries measured in processes of their own, in turns, so that whatever else the machine does falls on all alike.

``python -m validate.bench.measure SPECIFICATION`` is such a process and prints one line of JSON. The specification,
JSON too: ``tool`` (a module of validate.bench), ``options`` for it, ``launched`` (s since the epoch), ``most`` (how
many timed solves at most) and ``patience`` (s on the wall): solves are repeated until that has passed. The first warms
up and does not count, unless it alone takes all the patience; no solve finds what an earlier one has worked out on the
scene or the mesh. Times are of the processor, but for tools that take theirs themselves.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from compare.processes import ONE_THREAD
from meshes import connected, singular
from validate.bench.entries import Entry

TIME_LIMIT = 900.0  # s
PATIENCE = 1.0  # s a worker repeats its solve for
MOST = 5  # repeats in one worker
LONG = 20.0  # s: entries that take longer are measured once


class EntryError(ArithmeticError):
    """An entry did not come to an end; the message says which and why."""


def once(entry: Entry, most: int = 0, patience: float = 0.0) -> dict[str, Any]:
    """What one worker found and took; EntryError where it failed or took longer than TIME_LIMIT."""
    given = {
        "tool": entry.module, "options": entry.options, "launched": time.time(), "most": most, "patience": patience,
    }  # fmt: skip
    command = [sys.executable, "-m", "validate.bench.measure", json.dumps(given)]
    try:
        # One thread in every program, whatever the environment says of some of them.
        done = subprocess.run(
            command, capture_output=True, encoding="utf-8", timeout=TIME_LIMIT, env=os.environ | ONE_THREAD, check=False
        )
    except subprocess.TimeoutExpired:
        raise EntryError(f"{entry.tool} ({entry.label}) took more than {TIME_LIMIT:g} s") from None
    if done.returncode:
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        raise EntryError(f"{entry.tool} ({entry.label}) failed: {last}")
    measurement: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return measurement


def in_turns(
    entries: Sequence[Entry], rounds: int, progress: Callable[[str], None], patient: bool
) -> list[dict[str, Any]]:  # fmt: skip
    """Every entry, ``rounds`` times, one after another; workers that aren't ``patient`` solve once. For each a row: its
    ``tool`` and ``label``, the ``failure`` that says why there is nothing more, or "", the median, least and most of
    the seconds of all timed solves, and what the last worker found."""
    results: list[list[dict[str, Any]]] = [[] for _ in entries]
    rows = [{"tool": entry.tool, "label": entry.label, "failure": ""} for entry in entries]
    for turn in range(rounds):
        for entry, row, measurements in zip(entries, rows, results, strict=True):
            if row["failure"] or (measurements and min(measurements[0]["seconds"]) > LONG):
                continue
            progress(f"round {turn + 1} of {rounds}: {entry.tool}, {entry.label}")
            try:
                measurements.append(once(entry, MOST, PATIENCE if patient else 0.0))
            except EntryError as error:
                row["failure"] = str(error)
    return [row if row["failure"] else row | _summed(each) for row, each in zip(rows, results, strict=True)]


def _summed(measurements: list[dict[str, Any]]) -> dict[str, Any]:
    seconds = [s for one in measurements for s in one["seconds"]]
    start_up, peak = (
        statistics.median(one["start_up_s"] for one in measurements),
        max(one["peak_MB"] for one in measurements),
    )
    return measurements[-1] | {
        "median_s": statistics.median(seconds), "fastest_s": min(seconds), "slowest_s": max(seconds),
        "solves": len(seconds), "start_up_s": start_up, "peak_MB": peak,
    }  # fmt: skip


def waited(*command: str) -> float:
    """The seconds of a command, on the wall as its user waits for it."""
    started = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def work(argument: str) -> dict[str, Any]:
    """Runs the entry of a specification: what came out."""
    given = json.loads(argument)
    tool = import_module(f"validate.bench.{given['tool']}")
    start_up, imported = time.time() - given["launched"], peak_memory()
    solve, read = tool.prepare(given["options"])
    patient = time.perf_counter() + given["patience"]
    seconds: list[float] = []
    while len(seconds) <= given["most"] and (not seconds or time.perf_counter() < patient):
        forget()
        started = time.process_time()
        answer = solve()
        seconds.append(time.process_time() - started)
    measurement = {"start_up_s": start_up, "seconds": seconds[1:] or seconds, "peak_MB": peak_memory()}
    return {**measurement, "imported_MB": imported, **read(answer)}


def forget() -> None:
    """Empty the caches of what belongs to a scene: a solve that is timed again must not find what an earlier one has
    worked out. Tables of reference elements serve every scene, and other programs keep theirs too."""
    for cache in (connected.coarsest, connected.anchored, connected._electrified, singular.exponent):
        cache.cache_clear()


def peak_memory() -> float:
    """The largest resident size of this process so far, in MB.

    Linux counts in ru_maxrss what the parent held when it started this process, but not in VmHWM.
    """
    status = Path("/proc/self/status")
    if status.exists():
        line = next(line for line in status.read_text(encoding="utf-8").splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) / 1024
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024 * 1024 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    print(json.dumps(work(sys.argv[1])))
