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

from validate import __version__
from validate.folder import SCHEMA

if TYPE_CHECKING:
    from compare.outcome import Outcome

_LIBRARIES = {"numpy": "numpy", "scipy": "scipy", "skfem": "scikit-fem", "matplotlib": "matplotlib"}


def write_document(path: Path, content: dict[str, Any]) -> None:
    path.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def document(outcome: Outcome[Any]) -> dict[str, Any]:
    """Return the summary as JSON types: full precision, and null for every number that is not finite."""
    from validate.report.views import document as document_of

    reader = import_module("scenes.free" if outcome.scene.kind == "free" else "scenes.loading")
    summary: dict[str, Any] = {
        "schema": SCHEMA,
        "command": outcome.options.command or None,
        "scene": reader.as_dict(outcome.scene),
        "plan": [asdict(step) for step in outcome.plan],
        "provenance": provenance(),
        **document_of(outcome),
    }
    last = {"warnings": (*outcome.alarms, *outcome.warnings), "files": outcome.files, "timing_s": outcome.timing}
    return as_json(summary | last)


def provenance() -> dict[str, str]:
    """Return the versions of this program, Python and the libraries in use, and the kind of machine."""
    versions = {"validate": __version__, "python": platform.python_version(), "machine": platform.machine()}
    loaded = {name: sys.modules[module] for module, name in _LIBRARIES.items() if module in sys.modules}
    return versions | {name: str(getattr(module, "__version__", "unknown")) for name, module in loaded.items()}


def version() -> str:
    """The version of this program."""
    return __version__


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
