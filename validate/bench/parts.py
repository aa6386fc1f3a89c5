"""The parts of the bench, each as plain numbers for a page or a file."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from validate.bench import device, entries, frontier, growth, machine, reference, rounds, skips, start_up

PARTS = ("transient", "steady", "device", "growth", "skips", "start-up")
SCHEMA = 2
Progress = Callable[[str], None]


def run(
    parts: Sequence[str], count: int, quick: bool, progress: Progress, earlier: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The parts asked for, in the order of PARTS, ``count`` rounds each, and those that ``earlier`` has.

    Raises ArithmeticError where a reference cannot be made; an entry that fails is a row that says so."""
    there = machine.installed()
    jobs: dict[str, Callable[[], Any]] = {
        "transient": lambda: work_precision(True, count, quick, there, progress),
        "steady": lambda: work_precision(False, count, quick, there, progress),
        "device": lambda: device.run(quick, count, progress),
        "growth": lambda: _growth(quick, count, there, progress),
        "skips": lambda: skips.run(quick, count, progress),
        "start-up": lambda: start_up.run(count, progress),
    }
    found: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": machine.describe(), **(earlier or {})}
    return found | {part: jobs[part]() for part in PARTS if part in parts and part not in found}


def work_precision(
    transient: bool, count: int, quick: bool, installed: frozenset[str], progress: Progress
) -> dict[str, Any]:
    """Every entry's time and error, the reference, and who is ahead at which error."""
    against = reference.find(transient, quick, installed, progress)
    measured = rounds.measure(
        entries.sink_entries(transient, quick, installed), count, progress, rounds.patience(quick)
    )
    rows = [_row(m, against) for m in measured]
    uncertainty = None if math.isnan(against.uncertainty) else against.uncertainty
    return {
        "reference": {"made_by": against.made_by, "checked_by": against.checked_by, "uncertainty": uncertainty},
        "rows": rows,
        "targets": frontier.targets(rows),
    }


def _row(measured: rounds.Measured, against: reference.Reference) -> dict[str, Any]:
    found = {"tool": measured.entry.tool, "label": measured.entry.label, "failure": measured.failure}
    if measured.failure:
        return found
    errors = against.errors(measured.found["values"])
    return found | {
        "median_s": measured.median_s, "fastest_s": min(measured.seconds), "slowest_s": max(measured.seconds),
        "solves": len(measured.seconds), "start_up_s": measured.start_up_s, "peak_MB": measured.peak_MB,
        "unknowns": measured.found["unknowns"], "steps": measured.found["steps"], "error": max(errors.values()),
        "errors": errors, "claimed": measured.found.get("claimed"),
    }  # fmt: skip


def _growth(quick: bool, count: int, installed: frozenset[str], progress: Progress) -> dict[str, Any]:
    rows = growth.run(quick, 1 if quick else min(count, 2), installed, progress)
    return {"rows": rows, "exponents": growth.exponents(rows)}
