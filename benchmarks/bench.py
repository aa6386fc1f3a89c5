"""The parts of `validate bench`, each as plain numbers: run time against error, growth, skips and start-up."""

from __future__ import annotations

import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import measure
from benchmarks.measure import Entry
from compare.processes import processors

SCHEMA = 3
OURS, REDUCTION, SCIKIT_FEM, NGSOLVE = "this toolkit", "reductions", "scikit-fem", "NGSolve"
TOOLS = (OURS, SCIKIT_FEM, NGSOLVE)
REDUCTIONS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:4")
ACCURACIES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
# The settings of the other programs: the first cell at an edge (m), the ratio of neighbours, and steps to an octave.
SCIKIT_FEM_SETTINGS = ((3e-5, 4, 1), (1.5e-5, 4, 1), (8e-6, 4, 1), (4e-6, 3, 1), (2e-6, 3, 2), (5e-7, 3, 2))
NGSOLVE_SETTINGS = (
    (2, 3e-5, 4, 1), (2, 8e-6, 4, 1), (3, 3e-5, 4, 1), (3, 8e-6, 4, 1), (4, 4e-6, 4, 2), (4, 1e-6, 4, 2),
)  # fmt: skip
QUICK, FINEST = (3, 8e-6, 4, 1), (5, 1e-6, 4, 2)  # NGSolve's references
TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
SCHEMES = ((1e-6, 25, 10), (5e-7, 50, 10), (2.5e-7, 100, 10))
Say = Callable[[str], None]
Row = dict[str, Any]
BARE = (sys.executable, "-c", "import skfem")
PLAIN = ("sink", "--no-figures")
SKIPS = {
    "figures (`--no-figures`)": (PLAIN, ("sink",)),
    "transient (`--steady`)": ((*PLAIN, "--steady"), PLAIN),
    "3D model (`--only 1d`)": ((*PLAIN, "--only", "1d"), PLAIN),
    "fields (not written without `--fields`)": (PLAIN, (*PLAIN, "--fields")),
}
STARTS = {"cold run without figures": PLAIN, "cold run with its four figures": ("sink",)}
PEAK = """
import resource, subprocess, sys
subprocess.run(sys.argv[1:], check=True, stdout=subprocess.DEVNULL)
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""


def own(transient: bool, accuracy: float) -> Entry:
    """Return the entry of a whole run of the sink in 3D."""
    options = {"model": "3d", "transient": transient, "accuracy": accuracy}
    return Entry(OURS, f"accuracy {accuracy:.0e}", "own_models", options)


def other(tool: str, transient: bool, *settings: float) -> Entry:
    """Return the entry of another program."""
    order, first, ratio, steps = settings if len(settings) == 4 else (2, *settings)
    options = {"transient": transient, "order": order, "first": first, "ratio": ratio, "steps": steps}
    label = f"degree {order}, cells from {first * 1e6:g} um" + f", {steps} steps an octave" * transient
    return Entry(tool, label, "skfem_sink" if tool == SCIKIT_FEM else "ngsolve_sink", options)


def work_precision(transient: bool, rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return every entry's time and error, beside NGSolve's finest solution or, without NGSolve, this toolkit's."""
    few, with_ngsolve = 2 if quick else None, find_spec("ngsolve") is not None
    entries = [own(transient, accuracy) for accuracy in ACCURACIES[:-1][:few]]
    entries += [Entry(REDUCTION, name, "own_models", {"model": name, "transient": transient}) for name in REDUCTIONS]
    entries += [other(SCIKIT_FEM, transient, *settings) for settings in SCIKIT_FEM_SETTINGS[:few]]
    if with_ngsolve:
        entries += [other(NGSOLVE, transient, *settings) for settings in NGSOLVE_SETTINGS[:few]]
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


def fastest(rows: Sequence[Row], tool: str, target: float) -> float | None:
    """Return the least time of a tool's entries whose error is at most a target."""
    times = [r["median_s"] for r in rows if r["tool"] == tool and not r["failure"] and r["error"] <= target]
    return min(times, default=None)


def device(rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return the time and error of the whole sensor in 1D, beside the accurate scheme at 1e-8."""
    end = {"model": "device", "end_time": 0.005 if quick else 0.05}
    reference = np.array(measure.once(Entry("", "finest", "own_models", end | {"accuracy": 1e-8}))["values"])
    entries = [
        Entry("accurate scheme", f"accuracy {a:.0e}", "own_models", end | {"accuracy": a}) for a in ACCURACIES[1:]
    ]
    for dt, nx, nt in SCHEMES[: 2 if quick else None]:
        label = f"dt {dt * 1e6:g} us, {nx} intervals"
        entries.append(Entry("the paper's scheme", label, "own_models", end | {"scheme": (dt, nx, nt)}))
    rows = measure.in_turns(entries, rounds, say, 0.0 if quick else measure.PATIENCE)
    for row in rows:
        if not row["failure"]:
            off = np.abs(np.array(row.pop("values")) - reference)
            row |= {"error": float(off.max()), "error_at_end": float(off[:, -1].max())}
    return {"end_time_s": end["end_time"], "rows": rows}


def growth(rounds: int, quick: bool, say: Say) -> dict[str, Any]:
    """Return time, memory and unknowns of whole runs at higher and higher accuracy, and the exponents of power laws."""
    entries = [own(transient, a) for transient in (False, True) for a in ACCURACIES[: 3 if quick else None]]
    rows = measure.in_turns(entries, rounds, say, 0.0)
    exponents = {}
    for name, group in zip(("steady", "transient"), (rows[: len(rows) // 2], rows[len(rows) // 2 :]), strict=True):
        good = [row for row in group if not row["failure"]]
        for row in group:
            row.pop("values", None)
            row["tool"] = name
        logs = np.log([[row["unknowns"], row["median_s"], row["peak_MB"]] for row in good]).T
        exponents[name] = [float(np.polyfit(logs[0], log, 1)[0]) for log in logs[1:]] if len(good) > 1 else None
    return {"rows": rows, "exponents": exponents}


def _seconds(arguments: Sequence[str], folder: str) -> float:
    """The seconds of a command on the wall, as its user waits for it."""
    started = time.perf_counter()
    subprocess.run(_whole(arguments, folder), check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - started


def _whole(arguments: Sequence[str], folder: str) -> tuple[str, ...]:
    if tuple(arguments) == BARE:
        return BARE
    return (sys.executable, "-m", "validate", *arguments, "--quiet", "--out", f"{folder}/run")


def _pairs(pairs: Mapping[str, tuple[Sequence[str], Sequence[str]]], rounds: int, say: Say) -> list[Row]:
    """Time pairs of commands, one after the other from cold: medians, and the range of the ratios."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, pair in pairs.items():
            say(name)
            times = [[_seconds(arguments, folder) for arguments in pair] for _ in range(rounds)]
            ratios = [a / b for a, b in times]
            first, second = (statistics.median(column) for column in zip(*times, strict=True))
            rows.append({"name": name, "first_s": first, "second_s": second, "ratio": statistics.median(ratios),
                         "least": min(ratios), "most": max(ratios)})  # fmt: skip
    return rows


def start_up(rounds: int, say: Say) -> dict[str, Any]:
    """Return the time of cold runs over a bare ``import skfem``, and their largest memory (MB)."""
    rows = _pairs({name: (arguments, BARE) for name, arguments in STARTS.items()}, rounds, say)
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-c", PEAK, *_whole(PLAIN, folder)]
        peak = subprocess.run(command, check=True, capture_output=True, encoding="utf-8")
    return {"rows": rows, "peak_MB": int(peak.stdout.split()[-1]) / 1024}


PARTS: dict[str, Callable[[int, bool, Say], Any]] = {
    "transient": partial(work_precision, True),
    "steady": partial(work_precision, False),
    "device": device,
    "growth": growth,
    "skips": lambda rounds, quick, say: _pairs(dict(list(SKIPS.items())[: 2 if quick else None]), rounds, say),
    "start-up": lambda rounds, _, say: start_up(rounds, say),
}


def run(parts: Sequence[str], rounds: int, quick: bool, say: Say, earlier: Mapping[str, Any]) -> dict[str, Any]:
    """Return the named parts and the parts of an ``earlier`` run.

    Raises ArithmeticError where a reference can't be made; an entry that fails is a row with the reason."""
    document: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": _machine(), **earlier}
    return document | {part: PARTS[part](rounds, quick, say) for part in parts if part not in document}


def _machine() -> dict[str, str]:
    """The kind of machine (no names), system, versions and threads."""
    info = Path("/proc/cpuinfo")
    listed = info.read_text(encoding="utf-8") if info.exists() else ""
    named = re.search(r"^model name\s*: (.+)$", listed, re.MULTILINE)
    processor = named[1].strip() if named else platform.processor() or platform.machine()
    machine = {
        "processor": f"{processor}, {processors()} cores to use", "system": f"{platform.system()} {platform.machine()}",
        "threads": "1 in every program", "Python": platform.python_version(),
    }  # fmt: skip
    for package in ("numpy", "scipy", "scikit-fem", "ngsolve"):
        try:
            machine[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            machine[package] = "not installed"
    return machine
