"""What a run says of how sure its inputs are, in the same way of a sink, a device and a free scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from compare.device_checks import evaluate
from compare.verdict import Models
from reduced1d.slopes import OF_DEVICE
from scenes.device import Device
from scenes.loop.result import Runs
from scenes.result import Estimate
from scenes.sink import Sink
from validate.inputs import propagation, sensitivities
from validate.inputs.propagation import Estimates
from validate.inputs.sensitivities import Sensitivities
from validate.run.outcome import Outcome


def added(outcome: Outcome[Any], simulated: Callable[[Device], Runs]) -> Outcome[Any]:
    """The outcome with how its quantities follow the scene's keys, where asked for, and what uncertain keys make of
    them and of the checks; ``simulated`` gives the runs of another device in 1D."""
    scene, request, uncertain = outcome.scene, outcome.request, outcome.request.uncertain
    found = _followed(outcome)
    checks, warnings = outcome.checks, (*outcome.warnings, *found.remarks())
    if uncertain is not None:
        propagated = propagation.propagated(uncertain, found, *_values(outcome, found))
        outcome = replace(outcome, propagated=propagated)
        if isinstance(scene, Device):

            def differences(other: Device) -> dict[str, float]:
                return {check.id: check.difference for check in evaluate(other, request, simulated(other))}

            checks = propagation.judged_device(checks, scene, propagated, differences)
        elif outcome.fem3d is not None and checks:
            models = Models(scene, outcome.fem3d, outcome.reduced1d, outcome.single)
            checks = propagation.judged(checks, models, uncertain, found)
        if outcome.reduced1d is not None and outcome.reduced1d.model == "paper":
            warnings += propagation.bent(scene, propagated)
    if request.sensitivities:
        made = sensitivities.checks(scene, found) if isinstance(scene, (Sink, Device)) else ()
        said = sensitivities.sentence(made) if isinstance(scene, Sink) else ""
        checks, answer = (*checks, *made), f"{outcome.answer} {said}".rstrip()
        outcome = replace(outcome, sensitivities=found, answer=answer)
    return replace(outcome, checks=checks, warnings=warnings)


def _followed(outcome: Outcome[Any]) -> Sensitivities:
    """How a run's quantities follow the keys of its scene."""
    scene, three = outcome.scene, outcome.fem3d
    if isinstance(scene, Device):
        return sensitivities.of_device(scene, None if outcome.device_3d is None else outcome.device_3d.model)
    if isinstance(scene, Sink):
        return sensitivities.of_sink(scene, three, outcome.reduced1d, outcome.request.uncertain is not None)
    return sensitivities.of_free(scene, outcome.solved)


def _values(outcome: Outcome[Any], found: Sensitivities) -> tuple[Estimates | None, Estimates | None]:
    """The steady values in 3D and in 1D, ``None`` of a model that was not asked for."""
    if not isinstance(outcome.scene, Device):
        three, one = (None if result is None else result.steady for result in (outcome.fem3d, outcome.reduced1d))
        return found.values or three, one
    solved, after = outcome.device_3d, outcome.runs.base.after
    in_1d = {q: Estimate(getattr(after, q), 0.0) for q in OF_DEVICE}
    if solved is None:
        return None, in_1d
    errors, after = solved.model.steady_errors(outcome.scene), solved.runs.base.after
    return {q: Estimate(getattr(after, q), errors[q]) for q in OF_DEVICE}, in_1d
