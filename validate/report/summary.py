"""summary.json: everything about a run that a program may want, as plain numbers and texts."""

from __future__ import annotations

import json
import math
import platform
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.pipeline import kind
from validate.report import of
from validate.report.folder import SCHEMA

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from compare.verdict import Check

_LIBRARIES = {"numpy": "numpy", "scipy": "scipy", "skfem": "scikit-fem", "matplotlib": "matplotlib"}


def write_document(path: Path, found: dict[str, Any]) -> None:
    """Writes a summary."""
    path.write_text(json.dumps(found, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def document(outcome: Outcome[Any]) -> dict[str, Any]:
    """The summary as JSON types: full precision, and null for what is not a finite number."""
    found: dict[str, Any] = as_json(
        {
            "schema": SCHEMA,
            "command": outcome.request.command or None,
            "scene": _as_dict(outcome.scene),
            "plan": [asdict(step) for step in outcome.plan],
            "provenance": provenance(),
            **of(outcome.scene).entries(outcome),
            "warnings": list(outcome.warnings),
            "files": list(outcome.files),
            "timing_s": outcome.timing,
        }
    )
    return found


def _as_dict(scene: Any) -> dict[str, Any]:
    if kind(scene) == "free":
        from scenes.free import as_dict

        return as_dict(scene)
    from scenes.loading import as_dict as sink_or_device

    return sink_or_device(scene)


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


def check_document(check: Check) -> dict[str, Any]:
    """A check as the summary has it."""
    found = asdict(check)
    time = found.pop("time")
    if check.u_input is None:
        del found["u_input"]
    return found if time is None else found | {"time_s": time}


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
