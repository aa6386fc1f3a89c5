"""What starting costs, as ratios measured side by side: whole commands from cold against a bare ``import skfem``."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from validate.bench import measure
from validate.bench.entries import WHOLE, Entry

BARE = (sys.executable, "-c", "import skfem")
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def run(count: int, progress: Callable[[str], None]) -> dict[str, Any]:
    """``ratios`` (one row each: name, median, smallest, largest) and the largest memory of a run (MB).

    Whole processes are started anew each time, one after the other with the process they are compared to. Wall-clock
    time, since a part of a command runs beside the rest.
    """
    ratios: dict[str, list[float]] = {}

    def add(name: str, value: float) -> None:
        ratios.setdefault(name, []).append(value)

    with tempfile.TemporaryDirectory() as folder:
        figures = [sys.executable, "-m", "validate", "sink", "--voltage", "1", "--quiet", "--out", folder + "/run"]
        no_figures = [*figures, "--no-figures"]
        for turn in range(count):
            progress(f"start-up: round {turn + 1} of {count}")
            for name, whole in (("without figures", no_figures), ("with its four figures", figures)):
                add(f"cold run at 1e-3 {name} / import skfem", measure.waited(*whole) / measure.waited(*BARE))
            for accuracy in (1e-3, 1e-4):
                found = measure.once(Entry(WHOLE, f"{accuracy:.0e}", "start_up", {"accuracy": accuracy}))
                add(f"3D part at {accuracy:.0e}, after imports / import skfem", found["solved_s"] / found["import_s"])
                add(f"second voltage at {accuracy:.0e} / first", found["again_s"] / found["solved_s"])
        peak = subprocess.run([sys.executable, "-c", PEAK, *no_figures], check=True, capture_output=True, text=True)
    rows = [
        {"name": name, "median": statistics.median(each), "smallest": min(each), "largest": max(each)}
        for name, each in ratios.items()
    ]
    return {"ratios": rows, "peak_MB": int(peak.stdout.split()[-1]) / 1024}


def prepare(options: dict[str, Any]) -> tuple[Callable[[], dict[str, float]], Callable[[Any], dict[str, Any]]]:
    """Imports, a first solve at an ``accuracy`` and one at twice the voltage with what is known, in one fresh process,
    in wall-clock time."""
    times = [time.perf_counter()]
    import skfem  # noqa: F401 - timed

    times.append(time.perf_counter())
    import scipy.sparse.linalg  # noqa: F401 - not part of the solve

    from fem3d import run as of_3d
    from scenes.loading import load
    from scenes.plan import Request

    sink = load("sink", [f"accuracy={options['accuracy']}"])

    def solve() -> dict[str, float]:
        started = time.perf_counter()
        first = of_3d.solve(sink, Request())
        solved = time.perf_counter()
        of_3d.solve(replace(sink, voltage=2 * sink.voltage), Request(), earlier=first)
        again = time.perf_counter() - solved
        return {"import_s": times[1] - times[0], "solved_s": solved - started, "again_s": again}

    return solve, dict
