"""Entries of summary.json that all kinds of scenes share."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.verdict import Check
    from scenes.result import Result


def of_3d(result: Result, *details: str) -> dict[str, Any]:
    """Steady values with their errors, and some of the details of a 3D result."""
    named = {"dofs" if name == "unknowns" else name: result.details.get(name) for name in details}
    return {"steady": {key: {"value": e.value, "error": e.error} for key, e in result.steady.items()}, **named}


def check_document(check: Check) -> dict[str, Any]:
    entry = asdict(check)
    time = entry.pop("time")
    for name in ("u_input", "u_data"):
        if entry[name] is None:
            del entry[name]
    return entry if time is None else entry | {"time_s": time}
