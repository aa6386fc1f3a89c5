"""The parts of the bench, each as plain numbers for a page or a file; where and with what they were taken. Of time
against error on the sink: the reference, every entry's time and error, and who is ahead at which error."""

from __future__ import annotations

import platform
import re
from collections.abc import Callable, Mapping, Sequence
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from compare.processes import processors
from validate.bench import device, entries, growth, measure, whole_runs
from validate.bench.entries import GIVEN, NGSOLVE, OURS, PEERS, WHOLE
from validate.bench.problem import errors

TARGETS = (1e-2, 1e-3, 1e-4, 1e-5)
WORDS = {WHOLE: "our whole run", GIVEN: "our solve on a given mesh"}
Row = dict[str, Any]
Best = Mapping[str, Any] | None
PARTS = ("transient", "steady", "device", "growth", "skips", "start-up")
SCHEMA = 2


def work_precision(
    transient: bool, count: int, quick: bool, installed: frozenset[str], progress: Callable[[str], None]
) -> dict[str, Any]:
    """Every entry's time and error, the reference, and who is ahead at which error."""
    reference = find(transient, quick, installed, progress)
    known = reference.pop("values"), reference.pop("steady")
    rows = measure.in_turns(entries.sink_entries(transient, quick, installed), count, progress, not quick)
    for row in rows:
        if not row["failure"]:
            off = errors(row.pop("values"), *known)
            row |= {"error": max(off.values()), "errors": off, "claimed": row.get("claimed")}
    return {"reference": reference, "rows": rows, "targets": targets(rows)}


def find(transient: bool, quick: bool, installed: frozenset[str], progress: Callable[[str], None]) -> dict[str, Any]:
    """The reference: its ``values`` and the ``steady`` ones that they are relative to, who it is ``made_by`` and
    ``checked_by``, and its ``uncertainty``. NGSolve's where it is installed, its uncertainty the distance of this
    toolkit's at its finest; without NGSolve this toolkit's alone, and no uncertainty (None). Raises measure.EntryError
    where neither comes to an end."""
    accuracy = 1e-4 if quick else 1e-6
    finest = entries.own(transient, accuracy)
    progress(f"reference: {finest.tool}, {finest.label}")
    ours = measure.once(finest)
    name = f"this toolkit at an accuracy of {accuracy:.0e}"
    if NGSOLVE not in installed:
        said: dict[str, Any] = {"made_by": name, "checked_by": "no other program", "uncertainty": None}
        return said | {"values": ours["values"], "steady": ours["steady"]}
    entry = entries.reference(transient, quick)
    progress(f"reference: {entry.tool}, {entry.label}")
    values = measure.once(entry)["values"]
    steady = {q: [v[-1]] for q, v in values.items()}
    apart = max(errors(ours["values"], values, steady).values())
    said = {"made_by": f"{NGSOLVE} ({entry.label})", "checked_by": name, "uncertainty": apart}
    return said | {"values": values, "steady": steady}


def targets(rows: list[Row]) -> list[dict[str, Any]]:
    """For each of TARGETS the least median time of each tool at an error at or below it (``None``: not reached), and
    each peer's over each of ours."""
    table = []
    for target in TARGETS:
        fastest = {tool: _fastest(rows, tool, target) for tool in (*OURS, *PEERS)}
        ratios = {peer: {kind: _ratio(fastest[peer], fastest[kind]) for kind in OURS} for peer in PEERS}
        table.append({"target": target, "fastest": fastest, "ratios": ratios})
    return table


def beside_given(rows: list[Row]) -> list[tuple[Row, float, bool]]:
    """Each whole run, how many times as long it takes as a solve on a given mesh that has the same error and solves the
    electric problem too, and whether that is a bound, as none is as accurate: between the fastest of these, logarithms
    of times are linear in those of errors. Nothing without such solves."""
    given = [r for r in rows if r["tool"] == GIVEN and not r["failure"] and entries.WORDS[entries.FULL] in r["label"]]
    points = fastest([(r["error"], r["median_s"]) for r in given])[::-1]
    if not points:
        return []
    off, seconds = np.log(points).T
    whole = [(r, np.log(r["error"])) for r in rows if r["tool"] == WHOLE and not r["failure"]]
    return [(r, r["median_s"] / float(np.exp(np.interp(at, off, seconds))), bool(at < off[0])) for r, at in whole]


def fastest(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """The points (error, time) that no other beats in both, by falling error."""
    kept = [p for p in points if not any(q != p and q[0] <= p[0] and q[1] <= p[1] for q in points)]
    return sorted(kept, reverse=True)


def _ratio(peer: Best, ours: Best) -> float | None:
    return None if peer is None or ours is None else float(peer["median_s"] / ours["median_s"])


def _fastest(rows: list[Row], tool: str, target: float) -> Row | None:
    candidates = [row for row in rows if row["tool"] == tool and not row["failure"] and row["error"] <= target]
    best = min(candidates, key=lambda row: row["median_s"], default=None)
    return None if best is None else {key: best[key] for key in ("label", "median_s", "error", "peak_MB")}


def taking_part(rows: list[Row]) -> list[str]:
    """Ours, and those of the others that have an entry: who is not installed is not said to be slow."""
    return [*OURS, *(peer for peer in PEERS if any(row["tool"] == peer for row in rows))]


def verdict(peer: Best, ours: Mapping[str, Best]) -> str:
    """A peer's fastest entry beside ours of each kind, in words for a table; bold where the peer is ahead."""
    if peer is None:
        return "no entry gets there"
    return "; ".join([f"{peer['median_s']:.3g} s", *(_beside(peer, ours[kind], WORDS[kind]) for kind in OURS)])


def _beside(peer: Best, ours: Best, name: str) -> str:
    ratio = _ratio(peer, ours)
    if ratio is None:
        return f"**ahead of {name}, which does not get there**"
    if ratio >= 1:
        return f"{ratio:.1f} times as long as {name}"
    return f"**ahead: {1 / ratio:.1f} times as fast as {name}**"


def run(
    parts: Sequence[str], count: int, quick: bool, progress: Callable[[str], None], earlier: Mapping[str, Any]
) -> dict[str, Any]:
    """The parts asked for, in the order of PARTS, ``count`` rounds each, and those that ``earlier`` has.

    Raises ArithmeticError where a reference cannot be made; an entry that fails is a row that says so."""
    installed = frozenset([NGSOLVE] if find_spec("ngsolve") is not None else [])
    jobs: dict[str, Callable[[], Any]] = {
        "transient": lambda: work_precision(True, count, quick, installed, progress),
        "steady": lambda: work_precision(False, count, quick, installed, progress),
        "device": lambda: device.run(quick, count, progress),
        "growth": lambda: growth.run(quick, 1 if quick else min(count, 2), installed, progress),
        "skips": lambda: whole_runs.skips(quick, count, progress),
        "start-up": lambda: whole_runs.start_up(count, progress),
    }
    document: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": _machine(), **earlier}
    return document | {part: jobs[part]() for part in PARTS if part in parts and part not in document}


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
