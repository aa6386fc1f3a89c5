"""The sink: its quantities, the paper's model and the ladder of better ones, its own checks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from scenes.errors import BeyondLawError, NumericsError, RunawayError, SceneError, listed
from scenes.formats import sink_text
from scenes.model import AnyScene, Probe
from scenes.physics import nonlinear, refuse_terminals
from scenes.plan import Request, Step, noted
from scenes.sink import OF_A_SINK, Sink
from validate.run import of_boxes
from validate.run import plan as plans
from validate.run.kinds import inputs
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    import numpy as np

    from compare.against import Data
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.result import Result
    from validate.inputs.calibration import Modelled
    from validate.inputs.propagation import Estimates, Propagated, SlopesInUnits
    from validate.inputs.sensitivities import Sensitivities

PYTHON = "compare.run"
SHOWN = ("peak_rise_K", "end_rise_K", "current_A")
"""Quantities that a terminal and a figure have room for; the page and the summary have all."""
skipped_figures = plans.skipped_of_sink
text = sink_text


def plan(sink: Sink, request: Request, data: Data | None) -> tuple[Step, ...]:
    _refuse(sink, request)
    steps: tuple[Step, ...] = (plans.ONLY_1D,)
    if "fem3d" in request.models:
        from fem3d.runs.sink import plan as plan_3d

        steps = plan_3d(sink, request)
    return plans.of_sink(sink, request, steps, data)


def _refuse(sink: Sink, request: Request) -> None:
    """SceneError for a reduction, or sensitivities, that there are not of this sink."""
    from reduced1d.ladder import refuse

    if "reduced1d" in request.models and not request.model:
        refuse(sink, request.reduction)
    if request.model == "network":
        from reduced1d.network.sink import lines_of

        lines_of(sink)
    if inputs.differentiated(request) and request.transient:
        refuse_terminals(sink.scene(), "a sensitivity over time")
    if inputs.fitted(request) and (why := nonlinear(sink.scene(), True)):
        raise SceneError(f"{why}, and --calibrate then has no slopes of a sink's traces to fit by: leave it out")


def exportable(sink: Sink, request: Request) -> None:
    """SceneError for a sink that has no compact model."""
    of_boxes.check(_modelled(sink, request))


def exported(outcome: Outcome[Sink], say: Callable[[str], None]) -> dict[str, Any]:
    """The document of its compact model."""
    return of_boxes.document(_modelled(outcome.scene, outcome.request), outcome.request, say)


def _modelled(sink: Sink, request: Request) -> AnyScene:
    """What a compact model is of: the 3D problem, with the current as a probe too."""
    if sink.emissivity:
        raise SceneError("a compact model has no radiation: give environment.emissivity = 0, or leave it out")
    scene = sink.scene()
    inlet = next(b for b in scene.boundaries if b.kind == "voltage")
    current = Probe("current", inlet.lower, inlet.upper, "current")
    return replace(scene, probes=(*scene.probes, current), steady=not request.transient)


def answer(run: Run, data: Data | None) -> Outcome[Sink]:
    """Both models, the checks, with those of a user's own ``data``, and the answer."""
    from compare.blame import answered

    sink, request, clock = run.scene, run.request, run.clock
    _refuse(sink, request)
    run, fit = inputs.calibrated(run, data)
    sink = run.scene
    levels = _levels(sink, request)
    outcome = _compared(run, levels, data=data)
    with clock.stage("checks"):
        from validate.run import hottest

        hot = hottest.of_sink(sink, outcome.fem3d, None if outcome.own_model is not None else outcome.reduced1d)
    with clock.stage("answer"):
        said, reason = answered(sink, outcome.fem3d, outcome.reduced1d, outcome.checks, outcome.why, levels)
    steps = noted(outcome.plan, [Step(plans.BLAME, "skipped", reason)] if reason else [])
    outcome = replace(outcome, answer=said, plan=steps, warnings=(*outcome.warnings, *hot))
    if request.left_out:
        from validate.inputs.left_out import of_sink as left_out_of

        with clock.stage("left out"):
            left_out = left_out_of(sink, run.say)
        # What decides whether such a sink works at all comes before how far its models agree.
        outcome = replace(outcome, left_out=left_out, answer=f"{left_out.sentence} {outcome.answer}")
    return inputs.held_against(run, inputs.told(run, outcome), data, fit)


def compared(sink: Sink, request: Request, earlier: Result | None = None) -> Outcome[Sink]:
    """Both models and the checks alone: no answer in words, no warnings of what gets too hot. ``earlier`` is the 3D
    result of the same sink at another voltage, whose meshes and fields may serve again. Raises as `answer` does."""
    return _compared(Run(sink, request), _levels(sink, request), earlier)


def _say_beside(extreme: str, say: Callable[[str], None], text: str) -> None:
    say(f"{extreme} than usual; {text}")


def _compared(
    run: Run, levels: Levels | None, earlier: Result | None = None, data: Data | None = None
) -> Outcome[Sink]:  # fmt: skip
    sink, request, clock, say = run.scene, run.request, run.clock, run.say
    solver_steps: tuple[Step, ...] = (plans.ONLY_1D,)
    outcome = Outcome(sink, request, ())
    fem3d = reduced1d = single = model = None
    if request.model:
        from compare.models import open_model, sampling

        model = open_model(request.model)
    if "fem3d" in request.models:
        with clock.stage("imports"):
            from fem3d.runs.sink import solve as solve_3d
            from scenes.validity import cause, farthest
        if extreme := farthest(sink):
            # Such a run may take minutes: its lines of progress say why.
            say = partial(_say_beside, extreme[0], run.say)
        say("solving in 3D")
        with clock.stage("fem3d"):
            try:
                fem3d = solve_3d(sink, request, say) if earlier is None else solve_3d(sink, request, say, earlier)
            except (RunawayError, BeyondLawError):
                raise
            except NumericsError as error:
                hint = cause(sink, ", ask for less with --accuracy 1e-2, or see --only 1d")
                raise NumericsError(f"{error}{hint}") from None
        solver_steps = tuple(fem3d.details["plan"])
    if "reduced1d" in request.models:
        with clock.stage("reduced1d"):
            if model is None:
                reduced1d = _reduction(sink, request, fem3d, levels)
            elif fem3d is not None:
                try:
                    reduced1d = sampling.solve(model, sampling.make_question(sink, fem3d), fem3d, 0.0, True, say)
                except (KeyboardInterrupt, NumericsError, SceneError) as error:
                    request = replace(request, models=("fem3d",), model="")
                    why = None if isinstance(error, KeyboardInterrupt) else error
                    outcome, model = replace(outcome, request=request).without_model(model.name, why), None
    if fem3d is not None:
        from compare.checks import evaluate, varied

        with clock.stage("checks"):
            if sink.spans > 1:
                single = solve_3d(replace(sink, spans=1), request, say)
            outcome = replace(outcome, checks=evaluate(sink, request, fem3d, reduced1d, single), single=single)
        if request.why and levels is not None:
            from compare.blame import budget

            with clock.stage("why"):
                outcome = replace(outcome, why=budget(sink, request.reduction, fem3d, levels, say))
                if single is not None:
                    outcome = replace(outcome, varied=varied(sink, request.reduction, single, say))
    told = tuple(text for result in (fem3d, reduced1d) if result for text in result.details.get("warnings", ()))
    warnings = (*outcome.warnings, *told)
    if model is not None and fem3d is not None:
        from compare.made import made_checks

        made = {check.id for check in outcome.checks}
        if unchecked := [check for check in made_checks(sink, request) if check not in made]:
            warnings += (f"not checked, as {model.name} leaves out what it is of: {listed(unchecked)}",)
    steps = plans.of_sink(sink, request, solver_steps, data)
    return replace(outcome, plan=steps, fem3d=fem3d, reduced1d=reduced1d, warnings=warnings, own_model=model)


def _levels(sink: Sink, request: Request) -> Levels | None:
    """The plate, where any of what is asked for stands on it; it is solved when first used."""
    if request.model or (request.reduction == "paper" and not request.why):
        return None
    from reduced1d.ladder.levels import Levels

    return Levels(sink)


def _reduction(sink: Sink, request: Request, fem3d: Result | None, levels: Levels | None) -> Result:
    """The 1D model, at the times of the 3D model's traces where there are any."""
    from reduced1d.ladder import solve as solve_1d

    times = fem3d.traces.time if fem3d is not None and fem3d.traces is not None else None
    try:
        return solve_1d(sink, request.reduction, steady_only=not request.transient, times=times, levels=levels)
    except RunawayError as error:
        if fem3d is None:
            raise
        raise RunawayError(f"in 1D (3D has a steady state, see --only 3d) {error}", error.limit) from None


def quantities(outcome: Outcome[Sink]) -> dict[str, tuple[str, str]]:
    """What is followed and uncertain, by name: what it is called, and its unit."""
    return {entry.steady: (entry.called, entry.unit) for entry in OF_A_SINK.values()}


def sensitivities(outcome: Outcome[Sink], keys: Sequence[str] | None) -> Sensitivities:
    from validate.inputs.sensitivities import of_sink

    with_profile = outcome.request.uncertain is not None
    return of_sink(outcome.scene, outcome.fem3d, outcome.reduced1d, with_profile, outcome.own_model)


def steady(outcome: Outcome[Sink], derivatives: Sensitivities) -> tuple[Estimates | None, Estimates | None]:
    """The steady values in 3D and in 1D, ``None`` of a model that was not asked for."""
    fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
    return (fem3d.steady if fem3d is not None else None), (reduced1d.steady if reduced1d is not None else None)


def judged(outcome: Outcome[Sink], propagated: Propagated, run: Run) -> tuple[tuple[Check, ...], tuple[str, ...]]:
    """The checks with their u_input, and the keys whose uncertainty is too large for it."""
    from compare.verdict import Models
    from validate.inputs import propagation

    checks, warnings = outcome.checks, tuple[str, ...]()
    if outcome.fem3d is not None and checks:
        models = Models(outcome.scene, outcome.fem3d, outcome.reduced1d, outcome.single)
        checks = propagation.judged(checks, models, propagated.uncertain, propagated.sensitivities)
    if outcome.reduced1d is not None and outcome.reduced1d.model == "paper":
        warnings = propagation.bent(outcome.scene, propagated)
    return checks, warnings


def models(outcome: Outcome[Sink]) -> dict[str, Result]:
    """The results by what they are called beside data."""
    both = {"3D": outcome.fem3d, "1D": outcome.reduced1d}
    return {name: result for name, result in both.items() if result is not None}


def slopes(outcome: Outcome[Sink], derivatives: Sensitivities) -> dict[str, SlopesInUnits]:
    """How the traces of each model follow a key, in their units."""
    from validate.inputs.propagation import in_units

    called = {"3D": "fem3d", "1D": "reduced1d"}
    return {name: in_units(outcome.scene, derivatives, model) for name, model in called.items()}


def beside(outcome: Outcome[Sink], derivatives: Sensitivities) -> Callable[[str, float], Result]:
    """What 3D is, to first order, with a key larger by a relative step."""
    from validate.inputs.propagation import moved

    return lambda key, step: moved(outcome.solved, outcome.scene, derivatives, key, step)


def in_3d(sink: Sink, keys: Sequence[str], times: np.ndarray) -> Modelled:
    """The traces in 3D at some times (s), and their derivatives by keys."""
    from validate.inputs.sink_traces import in_3d as modelled

    return modelled(sink, keys, times)


def checked(sink: Sink) -> Sink:
    """A sink that can be built. Raises SceneError."""
    from scenes.validity import check

    return check(sink)
