"""summary.json: everything about a run that a program may want, as plain numbers and texts."""

from __future__ import annotations

import json
import math
import platform
import sys
from dataclasses import asdict
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validate.report import of
from validate.report.folder import SCHEMA

if TYPE_CHECKING:
    from compare.verdict import Check
    from scenes.result import Result
    from validate.run.outcome import Outcome

_LIBRARIES = {"numpy": "numpy", "scipy": "scipy", "skfem": "scikit-fem", "matplotlib": "matplotlib"}
_ANALYSES = {
    "calibration": "fit", "validation": "validation", "left_out": "left_out",
    "sensitivities": "sensitivities", "against": "against",
}  # fmt: skip
"""Entries of summary.json, with the field of an Outcome that makes each."""


def write_document(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def document(outcome: Outcome[Any]) -> dict[str, Any]:
    """The summary as JSON types: full precision, and null for what is not a finite number."""
    reader = import_module("scenes.free" if outcome.scene.kind == "free" else "scenes.loading")
    summary: dict[str, Any] = {
        "schema": SCHEMA,
        "command": outcome.request.command or None,
        "scene": reader.as_dict(outcome.scene),
        "plan": [asdict(step) for step in outcome.plan],
        "provenance": provenance(),
        **of(outcome.scene).entries(outcome),
    }
    if outcome.why is not None:
        from validate.report.analyses import budget

        summary["why"] = budget(outcome.why)
    if outcome.propagated is not None:
        from validate.report.analyses import entered

        entered(summary, outcome.propagated, outcome.sampled)
    analyses = {entry: getattr(outcome, name) for entry, name in _ANALYSES.items()}
    summary |= {entry: part.document() for entry, part in analyses.items() if part is not None}
    last = {"warnings": outcome.warnings, "files": outcome.files, "timing_s": outcome.timing}
    return as_json(summary | last)


def of_3d(result: Result, *details: str) -> dict[str, Any]:
    """Steady values with their errors, and some of the details of a 3D result."""
    named = {"dofs" if name == "unknowns" else name: result.details.get(name) for name in details}
    return {"steady": {key: {"value": e.value, "error": e.error} for key, e in result.steady.items()}, **named}


def provenance() -> dict[str, str]:
    """Versions of what computed the run: this program, Python and the libraries in use, and the kind of machine."""
    versions = {"validate": version(), "python": platform.python_version(), "machine": platform.machine()}
    loaded = {name: sys.modules[module] for module, name in _LIBRARIES.items() if module in sys.modules}
    return versions | {name: str(getattr(module, "__version__", "unknown")) for name, module in loaded.items()}


def version() -> str:
    """The version of this program, "unknown" where it runs without being installed."""
    from importlib import metadata

    try:
        return metadata.version("heated-microstructure-validation")
    except metadata.PackageNotFoundError:
        return "unknown"


def check_document(check: Check) -> dict[str, Any]:
    entry = asdict(check)
    time = entry.pop("time")
    for name in ("u_input", "u_data"):
        if entry[name] is None:
            del entry[name]
    return entry if time is None else entry | {"time_s": time}


def as_json(value: Any) -> Any:
    """Numpy's numbers and arrays as Python's; NaN and infinities, which JSON lacks, as ``None``."""
    if isinstance(value, dict):
        return {str(key): as_json(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [as_json(item) for item in value]
    if hasattr(value, "tolist"):
        return as_json(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
