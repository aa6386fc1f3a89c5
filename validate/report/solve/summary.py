"""summary.json of a free scene: everything about a run that a program may want, as plain numbers and texts."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.solve.scope import UNITS
from scenes.free import as_dict
from validate.report.folder import SCHEMA
from validate.report.solve.traces import at
from validate.report.summary import plain, provenance

if TYPE_CHECKING:
    from compare.solve.outcome import SolveOutcome


def document(outcome: SolveOutcome) -> dict[str, Any]:
    """The summary as JSON types: full precision, and null for what is not a finite number."""
    found = plain(
        {
            "schema": SCHEMA,
            "command": outcome.request.command or None,
            "scene": as_dict(outcome.scene),
            "plan": [asdict(step) for step in outcome.plan],
            "provenance": provenance(),
            "fem3d": _fem3d(outcome),
            "warnings": list(outcome.warnings),
            "files": list(outcome.files),
            "timing_s": outcome.timing,
        }
    )
    assert isinstance(found, dict)
    return found


def _fem3d(outcome: SolveOutcome) -> dict[str, Any]:
    """Steady values of the probes with their errors, and that of the field at its worst node over its largest rise,
    null where it isn't known; of a transient the errors, the values at the times asked for and
    the last one, and the range that each probe passes through."""
    scene, result, details = outcome.scene, outcome.result, outcome.result.details
    found: dict[str, Any] = {
        "units": {probe.name: UNITS[probe.quantity] for probe in scene.probes},
        "steady": {name: {"value": e.value, "error": e.error} for name, e in result.steady.items()},
        "field_error": details.get("field_error"),
        "energy_imbalance": details["energy_imbalance"],
        "dofs": details["unknowns"],
        "steps": details["steps"],
        "levels": details["levels"],
        "symmetry": details["symmetry"],
        "mesh": details["mesh"],
    }
    if result.traces is not None:
        times = np.array(sorted({*scene.output_times, scene.end_time}))
        found["transient"] = {
            "errors": result.traces.errors,
            "accurate_from_s": details.get("accurate_from_s"),
            "jumps": details.get("jumps", 0),
            "imbalance": details.get("transient_imbalance"),
            "time_s": times,
            "values": {probe.name: at(result.traces, probe.name, times) for probe in scene.probes},
            "range": {
                name: {"end": values[-1], "least": values.min(), "largest": values.max()}
                for name, values in result.traces.values.items()
            },
        }
    return found
