"""Whole runs of the default sink: what each skip of the plan saves, with it and without it in turns; and what starting
costs, as ratios to a bare ``import skfem`` measured side by side.

What a skip switches is the input of the solver (the part that is solved, the request, the scene), never a flag made for
this. Whole `validate` commands are timed from cold, on the wall as their user waits for them.
"""

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

ACCURACY, QUICK_ACCURACY = 1e-3, 1e-2
SOLVER = {
    "symmetry": "symmetry: a quarter is solved in place of the whole",
    "transient": "transient (`--steady`)",
    "second voltage": "mesh, factorization and fields of a second voltage (those of the first serve)",
}
PLAIN = ["sink", "--no-figures"]
COMMANDS = {
    "figures (`--no-figures`), whole command from cold": (PLAIN, ["sink"]),
    "3D model (`--only 1d --no-figures`), whole command from cold": ([*PLAIN, "--only", "1d"], PLAIN),
    "fields: not written without `--fields`, whole command from cold": (PLAIN, [*PLAIN, "--fields"]),
}
BARE = (sys.executable, "-c", "import skfem")
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def skips(quick: bool, count: int, progress: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each skip: median seconds with it and without."""
    accuracy = QUICK_ACCURACY if quick else ACCURACY
    pairs: dict[str, list[dict[str, Any]]] = {
        name: [{"skip": skip, "off": off, "accuracy": accuracy} for off in (False, True)]
        for skip, name in list(SOLVER.items())[: 2 if quick else None]
    }
    for name, both in list(COMMANDS.items())[: 1 if quick else None]:
        pairs[name] = [{"arguments": arguments} for arguments in both]
    entries = [Entry(name, ("on", "off")[i], "whole_runs", both[i]) for name, both in pairs.items() for i in (0, 1)]
    rows = measure.in_turns(entries, count, progress, not quick)
    return [
        {"skip": name, "failure": on["failure"] or off["failure"], "on_s": on.get("median_s"),
         "off_s": off.get("median_s")}
        for name, on, off in zip(pairs, rows[::2], rows[1::2], strict=True)
    ]  # fmt: skip


def _command(arguments: list[str]) -> float:
    """The seconds of a command with its results in a folder that is removed."""
    with tempfile.TemporaryDirectory() as folder:
        return measure.waited(sys.executable, "-m", "validate", *arguments, "--quiet", "--out", folder + "/run")


def start_up(count: int, progress: Callable[[str], None]) -> dict[str, Any]:
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
                measurement = measure.once(Entry(WHOLE, f"{accuracy:.0e}", "whole_runs", {"accuracy": accuracy}))
                add(
                    f"3D part at {accuracy:.0e}, after imports / import skfem",
                    measurement["solved_s"] / measurement["import_s"],
                )
                add(f"second voltage at {accuracy:.0e} / first", measurement["again_s"] / measurement["solved_s"])
        peak = subprocess.run(
            [sys.executable, "-c", PEAK, *no_figures], check=True, capture_output=True, encoding="utf-8"
        )
    rows = [
        {"name": name, "median": statistics.median(each), "smallest": min(each), "largest": max(each)}
        for name, each in ratios.items()
    ]
    return {"ratios": rows, "peak_MB": int(peak.stdout.split()[-1]) / 1024}


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Any], Callable[[Any], dict[str, Any]]]:
    """A command; the job of the sink at an ``accuracy`` with a ``skip`` on or ``off``; or, for start-up, none."""
    if "arguments" in options:
        return lambda: _command(options["arguments"]), lambda seconds: {"seconds": [seconds]}
    if "skip" not in options:
        return _from_cold(options["accuracy"]), dict
    from fem3d.adaptivity import loop
    from fem3d.runs import sink_quantities
    from fem3d.runs.sink import solve
    from meshes import symmetry
    from scenes.loading import load

    sink, off = load("sink", [f"accuracy={options['accuracy']}"]), options["off"]
    if options["skip"] == "transient":
        return lambda: solve(sink, transient=off), lambda _: {}
    if options["skip"] == "second voltage":
        earlier = None if off else solve(sink)
        twice = replace(sink, voltage=2 * sink.voltage)
        return lambda: solve(twice, earlier=earlier), lambda _: {}
    scene = sink.scene()
    part = symmetry.uncut(scene, [box.name for box in scene.boxes]) if off else symmetry.reduce(scene)
    return lambda: loop.solve(sink_quantities.study(sink, part), True), lambda _: {}


def _from_cold(accuracy: float) -> Callable[[], dict[str, float]]:
    """Imports, a first solve and one at twice the voltage with what is known, in one fresh process, in wall-clock
    time."""
    times = [time.perf_counter()]
    import skfem  # noqa: F401 - timed

    times.append(time.perf_counter())
    import scipy.sparse.linalg  # noqa: F401 - not part of the solve

    from fem3d.runs import sink as of_3d
    from scenes.loading import load

    sink = load("sink", [f"accuracy={accuracy}"])

    def solve() -> dict[str, float]:
        started = time.perf_counter()
        first = of_3d.solve(sink)
        solved = time.perf_counter()
        of_3d.solve(replace(sink, voltage=2 * sink.voltage), earlier=first)
        again = time.perf_counter() - solved
        return {"import_s": times[1] - times[0], "solved_s": solved - started, "again_s": again}

    return solve
