"""What errors are measured against: a solution that no entry makes, and how far another program is from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from validate.bench import launch
from validate.bench.entries import NGSOLVE, WHOLE, Entry
from validate.bench.entries import reference as ngsolve_reference
from validate.bench.sample import steady_errors, trace_errors

Values = dict[str, list[float]]


@dataclass(frozen=True, eq=False)
class Reference:
    """The values, those they are relative to, who made them, and how well they are known."""

    values: Values
    steady: Values
    made_by: str
    uncertainty: float
    checked_by: str
    transient: bool

    def errors(self, values: Values) -> dict[str, float]:
        """The error of each quantity of an entry."""
        if self.transient:
            return trace_errors(values, self.values, self.steady)
        return steady_errors(values, self.values)


def find(transient: bool, quick: bool, installed: frozenset[str], progress: Callable[[str], None]) -> Reference:
    """NGSolve's where it is installed, its uncertainty the distance of this toolkit's at its finest; without NGSolve
    this toolkit's alone, and no uncertainty (NaN). Raises launch.EntryError where neither comes to an end."""
    accuracy = 1e-4 if quick else 1e-6
    options = {"accuracy": accuracy, "transient": transient}
    own = _values(Entry(WHOLE, f"accuracy {accuracy:.0e}", "fem3d_sink", options), progress)
    name = f"this toolkit at an accuracy of {accuracy:.0e}"
    if NGSOLVE not in installed:
        return Reference(own["values"], own["steady"], name, float("nan"), "no other program", transient)
    entry = ngsolve_reference(transient, quick)
    found = _values(entry, progress)
    steady = {q: [v[-1]] for q, v in found["values"].items()}
    made = Reference(found["values"], steady, f"{NGSOLVE} ({entry.label})", float("nan"), name, transient)
    apart = max(made.errors(own["values"]).values())
    return Reference(made.values, steady, made.made_by, apart, name, transient)


def _values(entry: Entry, progress: Callable[[str], None]) -> dict[str, Any]:
    progress(f"reference: {entry.tool}, {entry.label}")
    return launch.measure(entry, 0, 0.0)
