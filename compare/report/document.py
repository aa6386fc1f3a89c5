"""Entries of summary.json that all kinds of scenes share."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from scenes.result import Result


def in_3d(result: Result, *details: str) -> dict[str, Any]:
    """Return steady values with their errors, and some of the details of a 3D result."""
    named = {"dofs" if name == "unknowns" else name: result.details.get(name) for name in details}
    return {"steady": {key: asdict(estimate) for key, estimate in result.steady.items()}, **named}


def checks(outcome: Outcome[Any]) -> list[dict[str, Any]]:
    """Return the checks without the uncertainties that they lack."""
    entries = [asdict(check) for check in outcome.checks]
    for entry in entries:
        entry["time_s"] = entry.pop("time")
        for name in ("u_input", "u_data", "time_s"):
            if entry[name] is None:
                del entry[name]
    return entries
