"""How fast the toolkit is, as ratios measured side by side: ``python -m compare.benchmark [repeats]``.

Each line gives the median, and the smallest and largest, over the repeats. Whole processes are started anew each time,
one after the other with the process they are compared to; nothing is asserted.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

IMPORT = "import skfem"
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
WARM = """
import sys, time
started = time.perf_counter()
import skfem
imported = time.perf_counter() - started
from dataclasses import replace
import fem3d.run, scipy.sparse.linalg
from scenes.loading import load
from scenes.plan import Request
sink = load("sink", ["accuracy={accuracy}"])
started = time.perf_counter()
first = fem3d.run.solve(sink, Request())
solved = time.perf_counter() - started
started = time.perf_counter()
fem3d.run.solve(replace(sink, voltage=2.0), Request(), earlier=first)
again = time.perf_counter() - started
print(imported, solved, again)
"""


def main() -> None:
    """Prints the table."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    print(f"Python {sys.version.split()[0]}, {repeats} repeats; median (smallest to largest)\n")
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "compare.cli", "sink", "--voltage", "1", "--quiet", "--out"]
        no_figures = [*command, str(Path(folder, "a")), "--no-figures"]
        figures = [*command, str(Path(folder, "b"))]
        bare = [sys.executable, "-c", IMPORT]
        _line("cold run at 1e-3 without figures / import skfem", repeats, lambda: _seconds(no_figures) / _seconds(bare))
        _line(
            "cold run at 1e-3 with its four figures / import skfem", repeats, lambda: _seconds(figures) / _seconds(bare)
        )
        for accuracy in ("1e-3", "1e-4"):
            rows = [_warm(accuracy) for _ in range(repeats)]
            ratios = iter([solved / imported for imported, solved, _ in rows])
            _line(f"3D part at {accuracy}, after imports / import skfem", repeats, partial(next, ratios))
            again = iter([second / solved for _, solved, second in rows])
            _line(f"second voltage at {accuracy} / first", repeats, partial(next, again))
        print(f"\nlargest memory of the run without figures: {_memory(no_figures):.0f} MB")


def _line(name: str, repeats: int, measure: Callable[[], float]) -> None:
    found = [measure() for _ in range(repeats)]
    print(f"{name:55s} {statistics.median(found):6.2f} ({min(found):.2f} to {max(found):.2f})", flush=True)


def _seconds(command: list[str]) -> float:
    started = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def _warm(accuracy: str) -> tuple[float, float, float]:
    code = WARM.replace("{accuracy}", accuracy)
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    imported, solved, again = (float(word) for word in done.stdout.split())
    return imported, solved, again


def _memory(command: list[str]) -> float:
    """The largest resident size of one process, in MB; a process between keeps those of other children out."""
    done = subprocess.run([sys.executable, "-c", PEAK, *command], check=True, capture_output=True, text=True)
    return int(done.stdout.split()[-1]) / 1024


if __name__ == "__main__":
    main()
