"""The parts of the bench, each as plain numbers for a page or a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from validate.bench import device, growth, machine, skips, start_up, work

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
        "transient": lambda: work.work_precision(True, count, quick, there, progress),
        "steady": lambda: work.work_precision(False, count, quick, there, progress),
        "device": lambda: device.run(quick, count, progress),
        "growth": lambda: growth.run(quick, 1 if quick else min(count, 2), there, progress),
        "skips": lambda: skips.run(quick, count, progress),
        "start-up": lambda: start_up.run(count, progress),
    }
    found: dict[str, Any] = {"schema": SCHEMA, "quick": quick, "machine": machine.describe(), **(earlier or {})}
    return found | {part: jobs[part]() for part in PARTS if part in parts and part not in found}
