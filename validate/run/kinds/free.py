"""A scene of boxes, or on a mesh: its probes, and a 1D model of the user's own where one is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scenes import physics
from scenes.errors import NumericsError, RunawayInTimeError, SceneError, listed
from scenes.model import UNITS, AnyScene, Schedule
from scenes.plan import Request, Step
from validate.run import of_boxes
from validate.run import plan as plans
from validate.run.kinds import inputs
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    import numpy as np

    from compare.against import Data
    from compare.models import Model, Question
    from compare.probes import Both
    from compare.verdict import Check
    from scenes.result import Estimate, Result
    from validate.inputs.calibration import Fit, Modelled
    from validate.inputs.propagation import Estimates, Propagated, SlopesInUnits
    from validate.inputs.sensitivities import Sensitivities

PYTHON = "compare.solve"
SHOWN = ()
"""None in particular: all that there is room for."""
skipped_figures = plans.skipped_of_free


def text(scene: AnyScene) -> str:
    return scene.name


def plan(scene: AnyScene, request: Request, data: Data | None) -> tuple[Step, ...]:
    from fem3d.runs import scene as scene_run

    _refuse(scene, request)
    return plans.of_free(scene, request, scene_run.plan(scene, whole=inputs.followed(request)), data)


def _refuse(scene: AnyScene, request: Request) -> None:
    """SceneError for sensitivities, or a network, that there are not of this scene."""
    if (plans.own_model(scene, request) or ("",))[0] == "network":
        from reduced1d.network.lines import layout

        layout(scene)
    if inputs.differentiated(request):
        if not scene.steady and (why := physics.nonlinear(scene, True)):
            raise SceneError(f"{why}, and a sensitivity is then one of the steady state alone: add --steady")
        if not scene.steady:
            physics.refuse_terminals(scene, "a sensitivity over time")


def exportable(scene: AnyScene, request: Request) -> None:
    """SceneError for a scene that has no compact model."""
    of_boxes.check(scene)


def exported(outcome: Outcome[AnyScene], say: Callable[[str], None]) -> dict[str, Any]:
    """The document of its compact model."""
    return of_boxes.document(outcome.scene, outcome.request, say)


def answer(run: Run, data: Data | None) -> Outcome[AnyScene]:
    """The probes, the warnings, also of what gets too hot, and the time whose field is drawn."""
    from validate.run import hottest

    _refuse(run.scene, run.request)
    run, fit = inputs.calibrated(run, data)
    scene, request, clock = run.scene, run.request, run.clock
    with clock.stage("imports"):
        from fem3d.runs import scene as scene_run
    model = _opened(scene, request)
    run.say("solving in 3D")
    with clock.stage("fem3d"):
        runs_away = ""
        try:
            result: Result = scene_run.solve(scene, run.say, whole=inputs.followed(request))
        except RunawayInTimeError as error:
            if request.export is not None or model is not None:
                raise
            from fem3d.runs.runaway import until

            scene, result, runs_away = until(scene, error, run.say, whole=inputs.followed(request))
        if model is not None and not scene.steady and not varies(scene):
            result = replace(result, steady=at_rest(scene, run.say))
    shown, warnings = None, tuple(filter(None, (runs_away, *result.details.get("warnings", ()))))
    with clock.stage("checks"):
        if physics.heat(scene):
            fields, times = result.details["fields"], hottest.moments(result.traces)
            warnings += hottest.past(physics.materials(scene), fields, times) + hottest.impossible(scene, result)
            if result.traces is not None and "field" not in skipped_figures(scene, request):
                shown = hottest.farthest(fields, times, scene.initial_temperature)
    steps = plans.of_free(scene, request, tuple(result.details["plan"]), data)
    if model is None and scene.model is not None and scene.model.file:
        warnings += (f"the scene's model, {scene.model.file}, is a program, and runs only with --model scene",)
    outcome = Outcome(scene, request, steps, result, warnings=warnings, shown=shown, runs_away=runs_away)
    outcome = inputs.told(run, outcome if model is None else _judged(run, outcome, *model))
    return inputs.held_against(run, outcome, data, fit)


def _opened(scene: AnyScene, request: Request) -> tuple[Model, Question] | None:
    """The user's own model, and what it is asked; ``None`` where there is none to run."""
    given = plans.own_model(scene, request)
    if given is None:
        return None
    from compare.models import open_model
    from compare.models.sampling import make_question

    return open_model(*given), make_question(scene)


def _judged(run: Run, outcome: Outcome[AnyScene], model: Model, question: Question) -> Outcome[AnyScene]:
    """With the user's own model held against 3D; where that is interrupted or fails, what 3D found as it is."""
    from compare.probe_answer import answered

    scene, three = outcome.scene, outcome.solved
    try:
        with run.clock.stage("reduced1d"):
            both = held(scene, three, model, question, run.say)
    except (NumericsError, SceneError) as error:
        return outcome.without_model(model.name, error)
    except KeyboardInterrupt:
        return outcome.without_model(model.name)
    with run.clock.stage("checks"):
        from compare.probes import evaluate

        reduced1d, checks = both.model, evaluate(scene, both)
        said = answered(both, checks)
    if run.request.why and not three.steady:
        said_of_why = "--why is of the steady state, and there is none, as a drive varies in time: give --steady"
        outcome = replace(outcome, warnings=(*outcome.warnings, said_of_why))
    elif run.request.why:
        from compare.network_blame import blame

        with run.clock.stage("why"):
            run.say("solving in 3D with the joints of the network")
            try:
                outcome = replace(outcome, why=blame(scene, three, reduced1d))
            except NumericsError as error:
                said_of_why = f"which joint is to blame is not known: {error}"
                outcome = replace(outcome, warnings=(*outcome.warnings, said_of_why))
    silent = reduced1d.details["silent"]
    omissions = (f"{model.name} says nothing of {listed(silent)}: no check is made of that",) if silent else ()
    warnings = (*outcome.warnings, *omissions)
    return replace(outcome, reduced1d=reduced1d, own_model=model, checks=checks, answer=said, warnings=warnings)


def held(scene: AnyScene, fem3d: Result, model: Model, question: Question, say: Callable[[str], None]) -> Both:
    """A model beside the 3D result of a scene."""
    from compare import quantities
    from compare.models import sampling
    from compare.probes import Both

    reduced1d = sampling.solve(model, question, fem3d, scene.accuracy, bool(fem3d.steady), say)
    return Both(quantities.of(scene, fem3d), fem3d, reduced1d)


def at_rest(scene: AnyScene, say: Callable[[str], None]) -> dict[str, Estimate]:
    """The steady state of a scene over time, whose drives do not vary."""
    from fem3d.runs import scene as scene_run

    return scene_run.solve(replace(scene, steady=True, output_times=()), say).steady


def varies(scene: AnyScene) -> bool:
    """Whether anything that drives a scene varies in time, so that it has no one steady state."""
    return any(isinstance(value, Schedule) for value in physics.driving(scene))


def reported(scene: AnyScene, request: Request) -> AnyScene:
    """The scene with something to report: where it has no probes and field files are asked for, every box's mean
    temperature (on a mesh that of every material's groups), which then also says how accurate the fields are. Raises
    SceneError for a run that reports nothing."""
    if scene.probes:
        return scene
    if plans.fields_reason(request, "" if physics.heat(scene) else "no temperature"):
        raise SceneError("the scene has no [[probe]], so there is nothing to report: add one, or give --fields")
    probes: Any = scene.means()
    return replace(scene, probes=probes)


def quantities(outcome: Outcome[AnyScene]) -> dict[str, tuple[str, str]]:
    """What is followed and uncertain, by name: what it is called, and its unit."""
    return {probe.name: (probe.name, UNITS[probe.quantity]) for probe in outcome.scene.probes}


def sensitivities(outcome: Outcome[AnyScene], keys: Sequence[str] | None) -> Sensitivities:
    from validate.inputs.sensitivities import of_free

    derivatives = of_free(outcome.scene, outcome.solved, keys)
    if outcome.own_model is None or outcome.reduced1d is None:
        return derivatives
    from validate.inputs.own_model import beside

    return beside(derivatives, outcome.scene, outcome.solved, outcome.own_model, outcome.reduced1d, outcome.checks)


def steady(outcome: Outcome[AnyScene], derivatives: Sensitivities) -> tuple[Estimates | None, Estimates | None]:
    """The steady values that the slopes belong to, temperatures as rises: in 3D and of the user's own model."""
    return derivatives.values or outcome.solved.steady, derivatives.of_model or None


def judged(outcome: Outcome[AnyScene], propagated: Propagated, run: Run) -> tuple[tuple[Check, ...], tuple[str, ...]]:
    """The checks with their u_input, and what it leaves out."""
    if outcome.own_model is None:
        return outcome.checks, ()
    from validate.inputs.own_model import judged

    return judged(outcome.checks, propagated), ()


def models(outcome: Outcome[AnyScene]) -> dict[str, Result]:
    """The results by what they are called beside data."""
    reduced1d = outcome.reduced1d
    return {"3D": outcome.solved, **({"1D": reduced1d} if reduced1d is not None else {})}


def slopes(outcome: Outcome[AnyScene], derivatives: Sensitivities) -> dict[str, SlopesInUnits]:
    """How the probes follow a key by each model, in their units."""
    from validate.inputs import probe_traces

    by_model = {"3D": probe_traces.of_3d(outcome.scene, derivatives)}
    if outcome.own_model is not None and outcome.reduced1d is not None:
        by_model["1D"] = probe_traces.of_model(outcome.scene, outcome.own_model)
    return by_model


def beside(outcome: Outcome[AnyScene], derivatives: Sensitivities) -> Callable[[str, float], Result]:
    """What 3D is, to first order, with a key larger by a relative step."""
    from validate.inputs import probe_traces

    in_units = probe_traces.of_3d(outcome.scene, derivatives)
    return lambda key, step: probe_traces.moved(outcome.scene, outcome.solved, in_units, key, step)


def in_3d(scene: AnyScene, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """The probes in 3D at some times (s), or at rest, and their derivatives by keys."""
    from validate.inputs.probe_traces import in_3d as modelled

    return modelled(scene, keys, times)


def checked(scene: AnyScene) -> AnyScene:
    """A scene that can be built. Raises SceneError."""
    from scenes.free import check

    given: Any = scene
    # A mesh is held against its scene when it is read.
    return check(given) if scene.parts == "boxes" else scene


def fitted_model(run: Run, keys: Sequence[str], data: Data) -> Fit:
    """The user's model with parameters fitted to the data. SceneError where the scene lacks such a parameter."""
    from validate.inputs.model_fit import fitted

    given = plans.own_model(run.scene, run.request)
    if given is None:
        raise SceneError(f"--calibrate {keys[0]} is of a 1D model: give one with --model, too")
    return fitted(run.scene, *given, [key.removeprefix(inputs.OF_MODEL) for key in keys], data)
