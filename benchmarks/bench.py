"""The parts of `validate bench`, each as plain numbers and as a section of its page: run time against error, skips and
start-up."""

from __future__ import annotations

import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import metadata
from typing import Any

import numpy as np

from benchmarks import measure, programs
from benchmarks.measure import Entry
from compare.processes import processors
from compare.report import Row, Table

OURS, REDUCTION, SCIKIT_FEM = "this toolkit", "reductions", "scikit-fem"
TOOLS = OURS, SCIKIT_FEM
REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # the last one makes the reference
# Of scikit-fem: the first cell at an edge (m), the ratio of neighbours, and steps to an octave.
SETTINGS = ((3e-5, 4, 1), (1.5e-5, 4, 1), (8e-6, 4, 1), (4e-6, 3, 1), (2e-6, 3, 2), (5e-7, 3, 2))
TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
ABOUT = (
    f"*{OURS}* gets the scene and an accuracy: it finds the mesh and estimates the error of every number. "
    "scikit-fem is a plain program: it gets a graded mesh of the quarter, takes the current density as uniform, which "
    "only this scene's ideal electrodes allow, and knows no error. Its settings were found by trial. "
    "The time begins with the assembly; no time includes imports."
)
Say = Callable[[str], None]
Content = list[str | Table]
BARE = (sys.executable, "-c", "import skfem")
PLAIN = ("sink", "--no-figures")
SKIPS = {
    "with and without figures": (("sink",), PLAIN),
    "transient, and `--steady` alone": (PLAIN, (*PLAIN, "--steady")),
    "both models, and `--only 1d`": (PLAIN, (*PLAIN, "--only", "1d")),
    "with and without `--fields`": ((*PLAIN, "--fields"), PLAIN),
}
STARTS = {"run without figures, and `import skfem`": (PLAIN, BARE), "run, and `import skfem`": (("sink",), BARE)}


def own(transient: bool, accuracy: float) -> Entry:
    """Return the entry of a whole run of the sink in 3D."""
    return Entry(OURS, f"accuracy {accuracy:.0e}", partial(programs.own, "3d", transient, accuracy))


def work_precision(transient: bool, rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return every entry's time and error, beside this toolkit's finest solution."""
    few = 2 if quick else None
    entries = [own(transient, accuracy) for accuracy in ACCURACIES[:-1][:few]]
    entries += [Entry(REDUCTION, name, partial(programs.own, name, transient)) for name in REDUCTIONS]
    for first, ratio, steps in SETTINGS[:few]:
        label = f"cells from {first * 1e6:g} um" + f", {steps} steps an octave" * transient
        entries.append(Entry(SCIKIT_FEM, label, partial(programs.plain, transient, first, ratio, steps)))
    finest = own(transient, 1e-4 if quick else ACCURACIES[-1])
    say("reference")
    reference = measure.once(finest)["values"]
    rows = measure.in_turns(entries, rounds, say, 0.0 if quick else measure.PATIENCE)
    for row in rows:
        if not row["failure"]:
            row["error"] = error_of(row.pop("values"), reference)
    return {"made_by": f"{OURS}, {finest.label}", "rows": rows}


def error_of(values: Mapping[str, Any], reference: Mapping[str, Any]) -> float:
    """Return the largest error of a quantity at any time, relative to its last value."""
    return max(float(np.abs(np.subtract(values[q], r)).max()) / abs(r[-1]) for q, r in reference.items())


def fastest(rows: Sequence[dict[str, Any]], tool: str, target: float) -> float | None:
    """Return the least time of a tool's entries whose error is at most a target."""
    times = [r["median_s"] for r in rows if r["tool"] == tool and not r["failure"] and r["error"] <= target]
    return min(times, default=None)


def _seconds(arguments: tuple[str, ...], folder: str) -> float:
    """The seconds of a command on the wall, as its user waits for it."""
    whole = (sys.executable, "-m", "validate", *arguments, "--quiet", "--out", f"{folder}/run")
    started = time.perf_counter()
    subprocess.run(BARE if arguments == BARE else whole, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def pairs_of(
    pairs: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]], rounds: int, quick: bool, say: Say
) -> list[dict[str, Any]]:
    """Time pairs of commands, one after the other from cold: medians, and the range of the ratios."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, pair in list(pairs.items())[: 2 if quick else None]:
            say(name)
            times = [[_seconds(arguments, folder) for arguments in pair] for _ in range(rounds)]
            ratios = [a / b for a, b in times]
            first, second = (statistics.median(column) for column in zip(*times, strict=True))
            rows.append({"name": name, "first_s": first, "second_s": second, "ratio": statistics.median(ratios),
                         "least": min(ratios), "most": max(ratios)})  # fmt: skip
    return rows


def run(parts: Sequence[str], rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return the measurements of the named parts.

    Raises ArithmeticError where a reference can't be made; an entry that fails is a row with the reason."""
    return {"quick": quick, "machine": _machine(), **{part: PARTS[part][1](rounds, quick, say) for part in parts}}


def _machine() -> dict[str, str]:
    """The kind of machine (no names), system, versions and threads."""
    return {
        "system": f"{platform.system()} {platform.machine()}, {processors()} cores to use",
        "threads": "1 in every program", "Python": platform.python_version(),
        **{package: metadata.version(package) for package in ("numpy", "scipy", "scikit-fem")},
    }  # fmt: skip


def preface(measurements: Mapping[str, Any]) -> Content:
    """Return the beginning of the page: how the numbers were made, and on which machine."""
    quick = " --quick" if measurements["quick"] else ""
    return [
        f"Made by `validate bench{quick}` on the default sink at 1 V. Each entry runs in processes of its own, in "
        "turns with the others. A time is the median, in seconds of processor time of one thread. A process repeats "
        "its solve for a second, with emptied caches; the first one warms up.",
        Table(("", ""), [*measurements["machine"].items()]),
    ]  # fmt: skip


def _work(part: Mapping[str, Any]) -> Content:
    rows, times = part["rows"], []
    for target in TARGETS:
        best = (fastest(rows, tool, target) for tool in TOOLS)
        times.append([f"{target * 100:g} %", *("-" if seconds is None else f"{seconds:.3g}" for seconds in best)])
    return [
        "Seconds of the fastest entry whose error is at most:",
        Table(("error", *TOOLS), times),
        "Error: the largest of the rises of peak, end and mean and of the current, over time at octaves from 10 us on, "
        f"relative to the last value. Reference: {part['made_by']}; the errors of scikit-fem check it.",
        Table(("entry", "unknowns", "error", "error bound", "time, s", "range, s"), [*map(_entry, rows)]),
        ABOUT,
    ]


def _entry(row: Mapping[str, Any]) -> Row:
    """The name of an entry, then its numbers or the failure."""
    name = f"{row['tool']}: {row['label']}"
    if row["failure"]:
        return Row([name], below=row["failure"])
    bound = f"{row['bound']:.1e}" if row.get("bound") else ""
    times = f"{row['median_s']:.3g}", f"{row['fastest_s']:.3g} to {row['slowest_s']:.3g}"
    return Row([name, str(row["unknowns"]), f"{row['error']:.1e}", bound, *times])


def _pairs(part: Sequence[Mapping[str, Any]]) -> Content:
    rows = [(r["name"], *(f"{r[key]:.3g}" for key in ("first_s", "second_s", "ratio", "least", "most"))) for r in part]
    heads = ("", "one, s", "other, s", "ratio", "least", "most")
    return ["Whole commands from cold, on the wall, each pair one after the other.", Table(heads, rows)]


PARTS: dict[str, tuple[str, Callable[[int, bool, Say], Any], Callable[[Any], Content]]] = {
    "transient": ("The whole transient of the sink", partial(work_precision, True), _work),
    "steady": ("The sink's steady state", partial(work_precision, False), _work),
    "skips": ("What each skip of the plan saves", partial(pairs_of, SKIPS), _pairs),
    "start-up": ("Start-up", partial(pairs_of, STARTS), _pairs),
}
"""The title of each part, its measurement, and the content of its section."""


def sections_of(measurements: Mapping[str, Any]) -> dict[str, tuple[str, Content]]:
    """Return the title and the content of each part that was measured."""
    return {name: (title, make(measurements[name])) for name, (title, _, make) in PARTS.items() if name in measurements}
