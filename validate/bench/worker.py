"""One entry in a process of its own: ``python -m validate.bench.worker SPECIFICATION`` prints one line of JSON.

The specification, JSON too: ``tool`` (a module of validate.bench.tools), ``options`` for it, ``launched`` (s since the
epoch), ``most`` (how many timed solves at most) and ``patience`` (s on the wall): solves are repeated until that has
passed. The first warms up and does not count, unless it alone takes all the patience; no solve finds what an earlier
one has worked out on the scene or the mesh. Times are of the processor, but for tools that take theirs themselves.
"""

from __future__ import annotations

import json
import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from meshes import connected, singular

# What is kept of scenes. Tables of reference elements serve every scene, and other programs keep theirs too.
KEPT = (connected.coarsest, connected.anchored, connected._electrified, singular.exponent)


def main(argument: str) -> None:
    """Runs the entry and prints what came out."""
    given = json.loads(argument)
    tool = import_module(f"validate.bench.tools.{given['tool']}")
    start_up = time.time() - given["launched"]
    imported = peak_memory()
    solve, read = tool.prepare(given["options"])
    patient = time.perf_counter() + given["patience"]
    answer, first = _timed(solve)
    seconds: list[float] = []
    while time.perf_counter() < patient and len(seconds) < given["most"]:
        answer, spent = _timed(solve)
        seconds.append(spent)
    peak = peak_memory()
    found = {"start_up_s": start_up, "first_s": first, "seconds": seconds or [first], "peak_MB": peak}
    print(json.dumps({**found, "imported_MB": imported, **read(answer)}))


def _timed(solve: Any) -> tuple[Any, float]:
    forget()
    started = time.process_time()
    answer = solve()
    return answer, time.process_time() - started


def forget() -> None:
    """Empty the caches of what belongs to a scene: a solve that is timed again must not find what an earlier one has
    worked out."""
    for cache in KEPT:
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
    main(sys.argv[1])
