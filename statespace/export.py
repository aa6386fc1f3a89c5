"""The files of a compact model."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write(document: Mapping[str, Any], folder: Path) -> None:
    """Writes model.json, .cir, .py and .fmu into a folder, made where it isn't there, and of a device with controllers
    controllers.py and .fmu; no FMU without pythonfmu. Raises OSError where they can't be written."""
    from statespace import fmu
    from statespace.document import names
    from statespace.python import as_python, controllers_as_python
    from statespace.spice import as_spice

    document = {**document, "names": names(document)}
    each = (f"{json.dumps(key)}: {json.dumps(value, allow_nan=False)}" for key, value in document.items())
    texts = {
        "model.json": "{\n" + ",\n".join(each) + "\n}\n",
        "model.cir": as_spice(document),
        "model.py": as_python(document),
    }
    units = {"model.fmu": fmu.write_fmu}
    if "controllers" in document:
        texts["controllers.py"] = controllers_as_python(document)
        units["controllers.fmu"] = fmu.write_controllers
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    for name, write_unit in units.items() if fmu.available() else ():
        write_unit(document, folder / name)
