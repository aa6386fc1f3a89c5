"""The files of a compact model."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write(document: Mapping[str, Any], folder: Path) -> None:
    """Writes model.json, .cir, .py and .fmu into a folder, made where it isn't there; no FMU without
    pythonfmu. Raises OSError where they can't be written."""
    from scenes.compact import fmu, names
    from scenes.compact.python import as_python
    from scenes.compact.spice import as_spice

    document = {**document, "names": names.listed(document)}
    each = (f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in document.items())
    texts = {"json": "{\n" + ",\n".join(each) + "\n}\n", "cir": as_spice(document), "py": as_python(document)}
    folder.mkdir(parents=True, exist_ok=True)
    for ending, text in texts.items():
        (folder / f"model.{ending}").write_text(text, encoding="utf-8")
    if fmu.available():
        fmu.write_fmu(document, folder / "model.fmu")
