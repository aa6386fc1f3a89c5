"""Starting a worker: one entry in a process of its own, with the threads that were asked for."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from typing import Any

from validate.bench.entries import Entry

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NGS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
TIME_LIMIT = 900.0  # s


class EntryError(ArithmeticError):
    """An entry did not come to an end; the message says which and why."""


def measure(entry: Entry, most: int, patience: float) -> dict[str, Any]:
    """What one worker found and took; EntryError where it failed or took longer than TIME_LIMIT."""
    return run("validate.bench.worker", entry, {"most": most, "patience": patience})


def run(module: str, entry: Entry, more: dict[str, Any]) -> dict[str, Any]:
    """The last line of a module's output, read as JSON."""
    given = {"tool": entry.module, "options": entry.options, "launched": time.time(), **more}
    command = [sys.executable, "-m", module, json.dumps(given)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=TIME_LIMIT, env=environment(), check=False
        )
    except subprocess.TimeoutExpired:
        raise EntryError(f"{entry.tool} ({entry.label}) took more than {TIME_LIMIT:g} s") from None
    if done.returncode:
        last = (done.stderr.strip() or "no message").splitlines()[-1]
        raise EntryError(f"{entry.tool} ({entry.label}) failed: {last}")
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def environment() -> dict[str, str]:
    """That of a worker: one thread in every library that has them."""
    return {**os.environ, **dict.fromkeys(THREADS, "1")}
