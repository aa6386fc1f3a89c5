"""The files of a compact model."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scenes.errors import SceneError, quoted, reason


def check(folder: Path) -> None:
    """SceneError for a folder that can't be written, before anything is computed."""
    there = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
    if not there.is_dir():
        raise SceneError(f"export folder {quoted(folder)} cannot be written ({quoted(there)} is a file): give another "
                         "with --export")  # fmt: skip


def write(document: Mapping[str, Any], folder: Path, name: str = "model") -> Path:
    """Writes the files, called ``name`` with their endings, into a folder, made where it isn't there; returns it. The
    FMU is left out where pythonfmu isn't installed. Raises SceneError where it can't be written."""
    from scenes.compact import fmu
    from scenes.compact.python import as_python, write_module
    from scenes.compact.spice import as_spice

    each = (f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in document.items())
    text = "{\n" + ",\n".join(each) + "\n}\n"
    code, circuit = as_python(document), as_spice(document)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{name}.json").write_text(text, encoding="utf-8")
        (folder / f"{name}.cir").write_text(circuit, encoding="utf-8")
        write_module(folder / f"{name}.py", code)
        if fmu.available():
            fmu.write_fmu(document, folder / f"{name}.fmu")
    except OSError as error:
        raise SceneError(
            f"export folder {quoted(folder)} cannot be written ({reason(error)}): give another with --export"
        ) from None
    return folder.resolve()
