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
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks import measure
from benchmarks.measure import Entry
from compare.processes import processors
from compare.report.table import Row, Table

SCHEMA = 4
OURS, REDUCTION, SCIKIT_FEM, NGSOLVE = "this toolkit", "reductions", "scikit-fem", "NGSolve"
TOOLS = (OURS, SCIKIT_FEM, NGSOLVE)
REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
# Of the other programs: the order, the first cell at an edge (m), the ratio of neighbours, and steps to an octave.
SETTINGS = {
    SCIKIT_FEM: (
        (2, 3e-5, 4, 1), (2, 1.5e-5, 4, 1), (2, 8e-6, 4, 1), (2, 4e-6, 3, 1), (2, 2e-6, 3, 2), (2, 5e-7, 3, 2),
    ),
    NGSOLVE: ((2, 3e-5, 4, 1), (2, 8e-6, 4, 1), (3, 3e-5, 4, 1), (3, 8e-6, 4, 1), (4, 4e-6, 4, 2), (4, 1e-6, 4, 2)),
}  # fmt: skip
QUICK, FINEST = (3, 8e-6, 4, 1), (5, 1e-6, 4, 2)  # NGSolve's references
TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
ABOUT = (
    f"*{OURS}* gets the scene and an accuracy: it finds the mesh and estimates the error of every number. "
    "NGSolve and scikit-fem are plain programs: they get a graded mesh of the "
    "quarter, take the current density as uniform, which only this scene's ideal electrodes allow, and know no error. "
    "Their settings were found by trial. The time begins with the assembly; no time includes imports."
)
Say = Callable[[str], None]
Content = list[str | Table]
BARE = (sys.executable, "-c", "import skfem")
PLAIN = ("sink", "--no-figures")
SKIPS = {
    "figures (`--no-figures`)": (PLAIN, ("sink",)),
    "transient (`--steady`)": ((*PLAIN, "--steady"), PLAIN),
    "3D model (`--only 1d`)": ((*PLAIN, "--only", "1d"), PLAIN),
    "fields (not written without `--fields`)": (PLAIN, (*PLAIN, "--fields")),
}
STARTS = {"cold run without figures": (PLAIN, BARE), "cold run with its four figures": (("sink",), BARE)}


def own(transient: bool, accuracy: float) -> Entry:
    """Return the entry of a whole run of the sink in 3D."""
    options = {"model": "3d", "transient": transient, "accuracy": accuracy}
    return Entry(OURS, f"accuracy {accuracy:.0e}", "own_models", options)


def other(tool: str, transient: bool, order: int, first: float, ratio: float, steps: int) -> Entry:
    """Return the entry of another program."""
    options = {"transient": transient, "order": order, "first": first, "ratio": ratio, "steps": steps}
    label = f"degree {order}, cells from {first * 1e6:g} um" + f", {steps} steps an octave" * transient
    return Entry(tool, label, "skfem_sink" if tool == SCIKIT_FEM else "ngsolve_sink", options)


def work_precision(transient: bool, rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return every entry's time and error, beside NGSolve's finest solution or, without NGSolve, this toolkit's."""
    few, with_ngsolve = 2 if quick else None, find_spec("ngsolve") is not None
    entries = [own(transient, accuracy) for accuracy in ACCURACIES[:-1][:few]]
    entries += [Entry(REDUCTION, name, "own_models", {"model": name, "transient": transient}) for name in REDUCTIONS]
    for tool in (SCIKIT_FEM, NGSOLVE) if with_ngsolve else (SCIKIT_FEM,):
        entries += [other(tool, transient, *settings) for settings in SETTINGS[tool][:few]]
    finest = own(transient, 1e-4 if quick else ACCURACIES[-1])
    say("reference")
    reference = check = measure.once(finest)["values"]
    made_by, apart = f"{OURS}, {finest.label}", None
    if with_ngsolve:
        best = other(NGSOLVE, transient, *(QUICK if quick else FINEST))
        reference, made_by = measure.once(best)["values"], f"{NGSOLVE}, {best.label}"
        apart = error_of(check, reference)
    rows = measure.in_turns(entries, rounds, say, 0.0 if quick else measure.PATIENCE)
    for row in rows:
        if not row["failure"]:
            row["error"] = error_of(row.pop("values"), reference)
    return {"made_by": made_by, "checked_by": f"{OURS}, {finest.label}", "uncertainty": apart, "rows": rows}


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


def run(parts: Sequence[str], rounds: int, quick: bool, say: Say, earlier: Mapping[str, Any]) -> dict[str, Any]:
    """Return the named parts and the parts of an ``earlier`` run.

    Raises ArithmeticError where a reference can't be made; an entry that fails is a row with the reason."""
    document: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": _machine(), **earlier}
    return document | {part: PARTS[part][1](rounds, quick, say) for part in parts if part not in document}


def _machine() -> dict[str, str]:
    """The kind of machine (no names), system, versions and threads."""
    return {
        "system": f"{platform.system()} {platform.machine()}, {processors()} cores to use",
        "threads": "1 in every program", "Python": platform.python_version(),
        **{package: metadata.version(package) for package in ("numpy", "scipy", "scikit-fem")},
        "ngsolve": metadata.version("ngsolve") if find_spec("ngsolve") else "not installed",
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
    doubt = part["uncertainty"]
    checked = "not checked by another program" if doubt is None else f"{doubt:.1e} off {part['checked_by']}"
    rows = part["rows"]
    tools = [tool for tool in TOOLS if any(row["tool"] == tool for row in rows)]
    times = []
    for target in TARGETS:
        best = (fastest(rows, tool, target) for tool in tools)
        times.append([f"{target * 100:g} %", *("-" if seconds is None else f"{seconds:.3g}" for seconds in best)])
    return [
        "Seconds of the fastest entry whose error is at most:",
        Table(("error", *tools), times),
        "Error: the largest of the rises of peak, end and mean and of the current, over time at octaves from 10 us on, "
        f"relative to the last value. Reference: {part['made_by']}, {checked}.",
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


def _skips(part: Sequence[Mapping[str, Any]]) -> Content:
    rows = [(r["name"], f"{r['first_s']:.3g}", f"{r['second_s']:.3g}", f"{1 / r['ratio']:.2f}") for r in part]
    table = Table(("skipped", "with, s", "without, s", "ratio"), rows)
    return ["Whole commands from cold, on the wall, in turns.", table]


def _start_up(part: Sequence[Mapping[str, Any]]) -> Content:
    rows = [(r["name"], f"{r['ratio']:.2f}", f"{r['least']:.2f} to {r['most']:.2f}") for r in part]
    about = "Wall-clock time over that of `import skfem`, each pair of processes one after the other."
    return [about, Table(("", "ratio", "range"), rows)]


PARTS: dict[str, tuple[str, Callable[[int, bool, Say], Any], Callable[[Any], Content]]] = {
    "transient": ("The whole transient of the sink", partial(work_precision, True), _work),
    "steady": ("The sink's steady state", partial(work_precision, False), _work),
    "skips": ("What each skip of the plan saves", partial(pairs_of, SKIPS), _skips),
    "start-up": ("Start-up", partial(pairs_of, STARTS), _start_up),
}
"""The title of each part, its measurement, and the content of its section."""


def sections_of(measurements: Mapping[str, Any]) -> dict[str, tuple[str, Content]]:
    """Return the title and the content of each part that was measured."""
    return {name: (title, make(measurements[name])) for name, (title, _, make) in PARTS.items() if name in measurements}
