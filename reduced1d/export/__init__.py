"""The few-state model of a sink for use elsewhere: as JSON, as a Python function and as a SPICE subcircuit."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scenes.errors import SceneError, quoted, reason

if TYPE_CHECKING:
    from reduced1d.ladder.levels import Levels


def export(levels: Levels, reduction: str, folder: Path) -> Path:
    """Writes sink_model.json, sink_model.py and sink_model.cir into a folder, made where it isn't there; returns it.

    The model is the reduction where that has few states (moments:N), else moments:4. Raises SceneError where the folder
    can't be written, RunawayError where the sink has no steady state.
    """
    from reduced1d.export.as_json import as_json
    from reduced1d.export.as_python import as_python
    from reduced1d.export.as_spice import as_spice
    from reduced1d.export.circuit import circuit_of
    from reduced1d.ladder import few_states_of
    from scenes.compact.python import write_module

    circuit = circuit_of(levels, few_states_of(reduction))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "sink_model.json").write_text(as_json(circuit), encoding="utf-8")
        (folder / "sink_model.cir").write_text(as_spice(circuit), encoding="utf-8")
        write_module(folder / "sink_model.py", as_python(circuit))
    except OSError as error:
        raise SceneError(
            f"export folder {quoted(folder)} cannot be written ({reason(error)}): give another with --export"
        ) from None
    return folder.resolve()
