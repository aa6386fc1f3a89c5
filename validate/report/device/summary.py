"""summary.json of the device: everything about a run that a program may want, as plain numbers and texts."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.device.runs import Run
from reduced1d.device.steady import steady
from scenes.loading import as_dict
from scenes.loop.result import QUANTITIES, Steady
from scenes.loop.settling import settling
from validate.report.folder import SCHEMA
from validate.report.summary import check_document, plain, provenance

if TYPE_CHECKING:
    from compare.device.outcome import DeviceOutcome

FRACTIONS = (0.05, 0.01, 1e-3, 1e-4)


def document(outcome: DeviceOutcome) -> dict[str, Any]:
    """The summary as JSON types: full precision, and null for what is not a finite number."""
    found = plain(
        {
            "schema": SCHEMA,
            "command": outcome.request.command or None,
            "scene": as_dict(outcome.device),
            "plan": [asdict(step) for step in outcome.plan],
            "provenance": provenance(),
            "fem3d": None,
            "reduced1d": _reduced1d(outcome.runs.base),
            "checks": [check_document(check) for check in outcome.checks],
            "findings": list(outcome.runs.base.result.findings),
            "design": None if outcome.design is None else asdict(outcome.design),
            "warnings": list(outcome.warnings),
            "files": list(outcome.files),
            "timing_s": outcome.timing,
        }
    )
    assert isinstance(found, dict)
    return found


def peaks(run: Run) -> dict[str, dict[str, float]]:
    """The largest value of each quantity over the run, and when (s)."""
    result = run.result
    found = {}
    for name in QUANTITIES:
        values = result.trace(name)
        at = int(np.argmax(values))
        found[name] = {"value": float(values[at]), "time_s": float(result.time_s[at])}
    return found


def _reduced1d(run: Run) -> dict[str, Any]:
    device, result = run.device, run.result
    external = device.external
    settled = [
        {
            "quantity": s.quantity,
            "after_s": s.start,
            "target": s.target,
            "band": s.band,
            "fraction": f,
            "time_s": s.time,
        }
        for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W", "polymer_flux_W")
        for f in FRACTIONS
        for s in settling(device, result, name, f)
    ]
    return {
        "scheme": result.scheme,
        "steady": _steady(steady(device, external.final_temperature)),
        "steady_before": _steady(steady(device, external.initial_temperature)),
        "peaks": peaks(run),
        "settling": settled,
        "errors": result.errors,
        "error_parts": result.error_parts,
        "details": _details(result.details),
    }


def _steady(state: Steady) -> dict[str, dict[str, float]]:
    return {name: {"value": getattr(state, name)} for name in QUANTITIES}


def _details(details: dict[str, Any]) -> dict[str, Any]:
    return {k: asdict(v) if hasattr(v, "__dataclass_fields__") else v for k, v in details.items()}
