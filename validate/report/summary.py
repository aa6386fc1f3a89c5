"""summary.json: everything about a run that a program may want, as plain numbers and texts."""

from __future__ import annotations

import json
import math
import platform
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.scope import OF_THE_REDUCTION
from scenes.loading import as_dict
from validate.report.folder import SCHEMA

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from compare.verdict import Check
    from compare.why import Budget
    from scenes.result import Result

_LIBRARIES = {"numpy": "numpy", "scipy": "scipy", "skfem": "scikit-fem", "matplotlib": "matplotlib"}


def write_document(path: Path, found: dict[str, Any]) -> None:
    """Writes a summary."""
    path.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def document(outcome: Outcome) -> dict[str, Any]:
    """The summary as JSON types: full precision, and null for what is not a finite number."""
    found = plain(
        {
            "schema": SCHEMA,
            "command": outcome.request.command or None,
            "scene": as_dict(outcome.sink),
            "plan": [asdict(step) for step in outcome.plan],
            "provenance": provenance(),
            "fem3d": None if outcome.fem3d is None else _fem3d(outcome.fem3d),
            "reduced1d": None if outcome.reduced1d is None else _reduced1d(outcome.reduced1d),
            "answer": outcome.answer,
            "checks": [check_document(check) | _model(check, outcome) for check in outcome.checks],
            **({} if outcome.why is None else {"why": _why(outcome.why)}),
            "warnings": list(outcome.warnings),
            "files": list(outcome.files),
            "timing_s": outcome.timing,
        }
    )
    assert isinstance(found, dict)
    if outcome.against is not None:
        found["against"] = plain(outcome.against.document())
    return found


def provenance() -> dict[str, str]:
    """Versions of what computed the run: this program, Python and the libraries in use, and the kind of machine."""
    versions = {"validate": version(), "python": platform.python_version(), "machine": platform.machine()}
    for module, name in _LIBRARIES.items():
        if module in sys.modules:
            versions[name] = str(getattr(sys.modules[module], "__version__", "unknown"))
    return versions


def version() -> str:
    """The version of this program, "unknown" where it runs without being installed."""
    from importlib import metadata

    try:
        return metadata.version("heated-microstructure-validation")
    except metadata.PackageNotFoundError:
        return "unknown"


def _fem3d(result: Result) -> dict[str, Any]:
    details = result.details
    found = {
        "steady": {key: {"value": e.value, "error": e.error} for key, e in result.steady.items()},
        "energy_imbalance": details["energy_imbalance"],
        "dofs": details["unknowns"],
        "steps": details["steps"],
        "symmetry": details.get("symmetry"),
        "mesh": details.get("mesh"),
    }
    if result.traces is not None:
        found["transient"] = {"errors": result.traces.errors, "imbalance": details.get("transient_imbalance")}
    return found


def _reduced1d(result: Result) -> dict[str, Any]:
    found = {"name": result.model, "steady": {key: {"value": e.value} for key, e in result.steady.items()}}
    return {**found, "details": result.details}


def _model(check: Check, outcome: Outcome) -> dict[str, str]:
    """The reduction that a check is of; the others are of the paper's equations, whichever was chosen."""
    if outcome.reduced1d is None or check.id not in OF_THE_REDUCTION:
        return {}
    return {"model": outcome.reduced1d.model}


def _why(budget: Budget) -> dict[str, Any]:
    from validate.report.why_text import document

    return document(budget)


def check_document(check: Check) -> dict[str, Any]:
    """A check as the summary has it."""
    found = asdict(check)
    time = found.pop("time")
    return found if time is None else found | {"time_s": time}


def plain(value: Any) -> Any:
    """Numpy's numbers and arrays as Python's; NaN and infinities, which JSON lacks, as ``None``."""
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
