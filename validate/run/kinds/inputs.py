"""What a run says of how sure its inputs are, and of a user's own data, in the same way of every kind of scene."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError
from scenes.plan import Request
from validate.run import kinds
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    from compare.against import Data
    from validate.inputs.calibration import Fit

OF_MODEL = "model.parameters."
"""How keys of a 1D model's own parameters begin."""


def followed(request: Request) -> bool:
    """Whether keys are followed: the scene is then solved whole, as a key of one side changes that side alone."""
    return request.sensitivities or request.uncertain is not None


def differentiated(request: Request) -> bool:
    """Whether 3D is asked for its derivatives by numbers of the scene: where these are followed, or fitted to data."""
    return followed(request) or fitted(request)


def fitted(request: Request) -> bool:
    """Whether numbers of the scene are fitted to data in 3D."""
    return bool(request.calibrate) and not of_model(request.calibrate)


def told(run: Run, outcome: Outcome[Any]) -> Outcome[Any]:
    """The outcome with its sensitivities, where asked for, and what uncertain keys make of quantities and checks."""
    request, uncertain = run.request, run.request.uncertain
    if not followed(request):
        return outcome
    run.say("sensitivities")
    with run.clock.stage("sensitivities"):
        from validate.inputs import propagation, sensitivities

        kind = kinds.of(outcome.scene)
        slopes = kind.sensitivities(
            outcome, None if request.sensitivities or uncertain is None else list(uncertain.relative)
        )
        outcome = replace(outcome, warnings=(*outcome.warnings, *slopes.remarks()))
        if uncertain is not None:
            propagated = propagation.propagated(uncertain, slopes, *kind.steady(outcome, slopes))
            outcome = replace(outcome, propagated=propagated)
            checks, warnings = kind.judged(outcome, propagated, run)
            outcome = replace(outcome, checks=checks, warnings=(*outcome.warnings, *warnings))
        if request.sensitivities:
            called = {name: called for name, (called, _) in kind.quantities(outcome).items()}
            made = sensitivities.checks(outcome.scene, slopes, called)
            # Where there is an answer, how the model follows the keys is a part of it.
            said = sensitivities.sentence(made) if outcome.answer else ""
            answer = f"{outcome.answer} {said}".rstrip()
            outcome = replace(outcome, sensitivities=slopes, answer=answer, checks=(*outcome.checks, *made))
    return outcome


def calibrated(run: Run, data: Data | None) -> tuple[Run, Fit | None]:
    """The run of the scene whose keys, or whose 1D model's parameters, are fitted to the data, where that is asked for.
    Raises SceneError for keys that can't be fitted."""
    keys = run.request.calibrate
    if not keys or data is None:
        return run, None
    from validate.inputs import calibration

    run.say("fitting")
    with run.clock.stage("fit"):
        kind = kinds.of(run.scene)
        if of_model(keys):
            fit = kind.fitted_model(run, keys, data)
        else:
            paths = calibration.keys_of(run.scene, keys, data)
            fit = calibration.fit(run.scene, data, paths, kind.in_3d, kind.checked)
    return replace(run, scene=fit.scene), fit


def of_model(keys: tuple[str, ...]) -> bool:
    """Whether keys that are to be fitted are a 1D model's own. Raises SceneError for some of both kinds."""
    flags = [key.startswith(OF_MODEL) for key in keys]
    if any(flags) and not all(flags):
        raise SceneError(
            f"--calibrate fits keys of the scene in 3D, or with {OF_MODEL}NAME those of the 1D model: give one kind in "
            "a run"
        )
    return any(flags)


def held_against(run: Run, outcome: Outcome[Any], data: Data | None, fit: Fit | None) -> Outcome[Any]:
    """The outcome with what the data say of 3D, and of a 1D model: their checks and, where something is said of what
    data or inputs are known to, the validation."""
    if data is None or outcome.fem3d is None:
        return outcome
    from compare import quantities
    from compare.against import evaluate
    from validate.inputs import propagation, validation

    scene, three, uncertain = outcome.scene, outcome.fem3d, run.request.uncertain
    checks, kind = evaluate(scene, data, three), kinds.of(outcome.scene)
    slopes: dict[str, Any] = {}
    if uncertain is not None and outcome.propagated is not None and data.curve is None:
        sensitivities = outcome.propagated.sensitivities
        slopes = kind.slopes(outcome, sensitivities)
        beside = kind.beside(outcome, sensitivities)
        checks = propagation.judged_against(checks, scene, data, three, uncertain, beside)
    warnings = (*(f"{data.name}: {text}" for text in data.warnings), *(fit.warnings() if fit else ()))
    sure = quantities.of(scene, three).sure(data.time)
    if 2 * sure.sum() < len(sure):
        compared = f"{sure.sum()} of {len(sure)} rows are compared"
        why = "the others are outside of the run, too soon after its start or a jump of a drive, or at one"
        warnings = (*warnings, f"{data.name}: {compared}: {why}")
    outcome = replace(
        outcome, checks=(*outcome.checks, *checks), warnings=(*outcome.warnings, *warnings), against=data, fit=fit
    )
    if data.curve is not None or (uncertain is None and not data.u):
        return outcome
    models = [
        (name, result, propagation.u_input(uncertain, slopes[name]) if uncertain is not None else None)
        for name, result in kind.models(outcome).items()
    ]
    return replace(outcome, validation=validation.validate(scene, data, models))
