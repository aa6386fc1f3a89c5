"""From a request to an outcome, for every kind of scene: plan, models, checks, answer. Nothing is written.

Nothing here imports numpy before it solves: the renderer's process, which takes the longest to get ready, is started
first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from scenes import physics
from scenes.device import Device
from scenes.errors import SceneError, listed
from scenes.model import AnyScene, GroupProbe, MeshScene, Probe, Schedule
from scenes.plan import Export, Request, Step, noted
from scenes.sink import Sink
from validate.run import plan as plans
from validate.run.outcome import Clock, Exported, Outcome

if TYPE_CHECKING:
    from compare.against import Data
    from reduced1d.ladder.levels import Levels
    from scenes.loop.result import Runs
    from scenes.result import Result
    from validate.models import Asked, Model


def kind(scene: Any) -> str:
    """What kind of run a scene is for: "sink", "device" or "free"."""
    return "sink" if isinstance(scene, Sink) else "device" if isinstance(scene, Device) else "free"


def plan(scene: Any, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `answer` will do, before it does it, and what is written then. Raises SceneError for what isn't made of a
    row of spans."""
    if isinstance(scene, Device):
        return plans.of_device(scene, request)
    if not isinstance(scene, Sink):
        from fem3d.runs import scene as scene_run

        return plans.of_free(scene, request, scene_run.plan(scene, whole=_followed(request)))
    from reduced1d.ladder import refuse

    refuse(scene, request.reduction)
    steps: tuple[Step, ...] = (plans.ONLY_1D,)
    if "fem3d" in request.models:
        from fem3d.runs.sink import plan as plan_3d

        steps = plan_3d(scene, request)
    return plans.of_sink(scene, request, steps, data)


def answer(
    scene: Any, request: Request, progress: Callable[[str], None] | None = None, data: Data | None = None,
    clock: Clock | None = None,
) -> Outcome[Any]:  # fmt: skip
    """Solve a scene as asked, compare, and answer. ``data`` are a user's own traces of a sink, checked against the 3D
    model's; they need its transient.

    Raises SceneError for what a model refuses, and ArithmeticError (RunawayError, NumericsError) where its numerics
    fail.
    """
    run = _Run(scene, request, progress or (lambda _: None), clock or Clock())
    ways: dict[str, Any] = {
        "sink": partial(_sink, data=data),
        "device": _device,
        "free": _free,
    }
    if request.export is not None:
        from fem3d.compact.find import check

        check(_modelled(scene, request))
    outcome: Outcome[Any] = ways[kind(scene)](run)
    if request.export is not None:
        with run.clock.stage("export"):
            exported = _exported(_modelled(outcome.scene, request), request.export, run.say)
        outcome = replace(outcome, exported=exported)
    return replace(outcome, timing=run.clock.all())


def _modelled(scene: Any, request: Request) -> AnyScene:
    """What a compact model is of: of a sink its 3D problem, with the current as a probe too."""
    if not isinstance(scene, Sink):
        return cast(AnyScene, scene)
    found = scene.scene()
    inlet = next(b for b in found.boundaries if b.kind == "voltage")
    current = Probe("current", inlet.lower, inlet.upper, "current")
    return replace(found, probes=(*found.probes, current), steady=not request.transient)


def _exported(scene: AnyScene, export: Export, say: Callable[[str], None]) -> Exported:
    """The compact model, and its own words."""
    from fem3d.compact.find import compact
    from scenes.compact import fmu
    from scenes.compact.facts import validity

    document = compact(scene, export.states, export.accuracy, say)
    without = "" if fmu.available() else f"; {fmu.MISSING}"
    return Exported(f"a compact model ({validity(document)}{without})", document, export.folder)


@dataclass(frozen=True)
class _Run:
    """What is solved, what is asked of it, who is told of the progress, and the clock of its stages."""

    scene: Any
    request: Request
    say: Callable[[str], None] = lambda _: None
    clock: Clock = field(default_factory=Clock)


def _sink(run: _Run, data: Data | None) -> Outcome[Sink]:
    """Both models, the checks, with those of a user's own ``data``, and the answer."""
    from compare.blame import answered
    from reduced1d.ladder import refuse

    sink, request, clock = run.scene, run.request, run.clock
    refuse(sink, request.reduction)
    fit = None
    if request.calibrate and data is not None:
        from validate.inputs import calibration

        run.say("fitting")
        with clock.stage("fit"):
            keys = calibration.keys_of(sink, request.calibrate, data)
            fit = calibration.fit(sink, data, keys, calibration.in_3d)
        sink = fit.scene
        run = replace(run, scene=sink)
    levels = _levels(sink, request)
    outcome = _compared(run, levels, data=data)
    with clock.stage("checks"):
        from validate.run import hottest

        hot = hottest.of_sink(sink, outcome.fem3d, outcome.reduced1d)
    with clock.stage("answer"):
        said, reason = answered(sink, outcome.fem3d, outcome.reduced1d, outcome.checks, outcome.why, levels)
    steps = noted(outcome.plan, [Step(plans.BLAME, "skipped", reason)] if reason else [])
    outcome = replace(outcome, answer=said, plan=steps, warnings=(*outcome.warnings, *hot))
    if request.air:
        from validate.inputs.air import of_sink as air_of

        with clock.stage("air"):
            air = air_of(sink, run.say, request.transient)
        outcome = replace(outcome, air=air, checks=(*outcome.checks, *air.checks))
    outcome = _with_inputs(run, outcome)
    if data is None or outcome.fem3d is None:
        return outcome
    from compare.against import definitions, evaluate

    against = evaluate(sink, data, outcome.fem3d)
    if request.uncertain is not None and outcome.propagated is not None:
        from compare.verdict import Models
        from validate.inputs.propagation import judged

        followed = outcome.propagated.sensitivities
        held = Models(sink, outcome.fem3d, None)
        against = judged(against, held, request.uncertain, followed, definitions(data, outcome.fem3d))
    of_data = (f"{data.name}: {text}" for text in data.warnings)
    warnings = (*outcome.warnings, *of_data, *(fit.warnings() if fit else ()))
    outcome = replace(outcome, checks=(*outcome.checks, *against), warnings=warnings, against=data, fit=fit)
    if request.uncertain is None and not data.u:
        return outcome
    from validate.inputs import validation

    models = [(name, result) for name, result in (("3D", outcome.fem3d), ("1D", outcome.reduced1d)) if result]
    return replace(outcome, validation=validation.validate(sink, data, models, outcome.propagated))


def compared(sink: Sink, request: Request, earlier: Result | None = None) -> Outcome[Sink]:
    """Both models and the checks alone: no answer in words, no warnings of what gets too hot. ``earlier`` is the 3D
    result of the same sink at another voltage, whose meshes and fields may serve again. Raises as `answer` does."""
    return _compared(_Run(sink, request), _levels(sink, request), earlier)


def _compared(
    run: _Run, levels: Levels | None, earlier: Result | None = None, data: Data | None = None
) -> Outcome[Sink]:  # fmt: skip
    sink, request, clock, say = run.scene, run.request, run.clock, run.say
    solver_steps: tuple[Step, ...] = (plans.ONLY_1D,)
    outcome = Outcome(sink, request, ())
    fem3d = reduced1d = single = None
    if "fem3d" in request.models:
        with clock.stage("imports"):
            from fem3d.runs.sink import solve as solve_3d
            from scenes.errors import NumericsError, RunawayError
            from scenes.validity import cause
        say("solving in 3D")
        with clock.stage("fem3d"):
            try:
                fem3d = solve_3d(sink, request, say) if earlier is None else solve_3d(sink, request, say, earlier)
            except NumericsError as error:
                if isinstance(error, RunawayError):
                    raise
                hint = cause(sink, ", ask for less with --accuracy 1e-2, or see --only 1d")
                raise NumericsError(f"{error}{hint}") from None
        solver_steps = tuple(fem3d.details["plan"])
    if "reduced1d" in request.models:
        with clock.stage("reduced1d"):
            reduced1d = _reduction(sink, request, fem3d, levels)
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
    warnings = tuple(text for model in (fem3d, reduced1d) if model for text in model.details.get("warnings", ()))
    steps = plans.of_sink(sink, request, solver_steps, data)
    return replace(outcome, plan=steps, fem3d=fem3d, reduced1d=reduced1d, warnings=warnings)


def _levels(sink: Sink, request: Request) -> Levels | None:
    """The plate, where any of what is asked for stands on it; it is solved when first used."""
    if request.reduction == "paper" and not request.why:
        return None
    from reduced1d.ladder.levels import Levels

    return Levels(sink)


def _reduction(sink: Sink, request: Request, fem3d: Result | None, levels: Levels | None) -> Result:
    """The 1D model, at the times of the 3D model's traces where there are any."""
    from reduced1d.ladder import solve as solve_1d
    from scenes.errors import RunawayError

    times = fem3d.traces.time if fem3d is not None and fem3d.traces is not None else None
    try:
        return solve_1d(sink, request.reduction, steady_only=not request.transient, times=times, levels=levels)
    except RunawayError as error:
        if fem3d is None:
            raise
        raise RunawayError(f"in 1D (3D has a steady state, see --only 3d) {error}", error.limit) from None


def _with_inputs(run: _Run, outcome: Outcome[Any]) -> Outcome[Any]:
    """With how sure the inputs are, where that is asked for."""
    if not _followed(run.request):
        return outcome
    run.say("sensitivities")
    with run.clock.stage("sensitivities"):
        from validate.run.inputs import added

        return added(outcome, lambda other: simulated(other, run.request, run.say))


def _device(run: _Run) -> Outcome[Device]:
    """What the 1D model says, the paper's claims checked, a designer's questions answered."""
    device, request, clock = run.scene, run.request, run.clock
    with clock.stage("imports"):
        from compare import device_checks
        from reduced1d.device import design
        from validate.run import hottest
    with clock.stage("device"):
        made = simulated(device, request, run.say)
    solved = answers = None
    if request.in_3d:
        from compare.device_3d_checks import evaluate_3d
        from fem3d.device.runs import make

        with clock.stage("device in 3D"):
            meter, start = request.meter, device.external.initial_temperature
            rounded = design.in_the_loop(device, design.METERS[meter], start) if meter else (0.0, 0.0)
            slow, steps = plans.drawn(device, request, "figure11"), plans.drawn(device, request, "figure12", "figure13")
            solved = make(device, rounded, slow, steps, run.say)
    with clock.stage("checks"):
        found = device_checks.evaluate(device, request, made)
        if solved is not None:
            found += evaluate_3d(device, request, made, solved)
    if not plans.design_reason(request):
        run.say("answering a designer's questions")
        with clock.stage("design"):
            answers = design.answer(device, request.largest_voltage, request.largest_power)
    outcome = Outcome(
        device, request, plans.of_device(device, request), checks=found, simulated=made, device_3d=solved,
        warnings=hottest.of_device(device, made.base.result), design=answers,
    )  # fmt: skip
    return _with_inputs(run, outcome)


def simulated(device: Device, request: Request, say: Callable[[str], None] = lambda _: None) -> Runs:
    from reduced1d.device import runs

    slow, steps = plans.needs(device, request, "figure11"), plans.needs(device, request, "figure12", "figure13")
    return runs.make(device, request.scheme, request.meter, slow, steps, say)


def _free(run: _Run) -> Outcome[AnyScene]:
    """The probes, the warnings, also of what gets too hot, and the time whose field is drawn."""
    from validate.run import hottest

    scene, request, clock = run.scene, run.request, run.clock
    with clock.stage("imports"):
        from fem3d.runs import scene as scene_run
    model = _opened(scene, request)
    run.say("solving in 3D")
    with clock.stage("fem3d"):
        result: Result = scene_run.solve(scene, run.say, whole=_followed(request))
        if model is not None and not scene.steady and not _varies(scene):
            still = replace(scene, steady=True, output_times=())
            result = replace(result, steady=scene_run.solve(still, run.say).steady)
    shown, warnings = None, tuple(result.details.get("warnings", ()))
    with clock.stage("checks"):
        if physics.heat(scene):
            fields, times = result.details["fields"], hottest.moments(result.traces)
            warnings += hottest.past(physics.materials(scene), fields, times)
            if result.traces is not None and "field" not in plans.skipped_figures(scene, request):
                shown = hottest.farthest(fields, times, scene.initial_temperature)
    steps = plans.of_free(scene, request, tuple(result.details["plan"]))
    if model is None and scene.model is not None and scene.model.file:
        warnings += (f"the scene's model, {scene.model.file}, is a program, and runs only with --model scene",)
    outcome = Outcome(scene, request, steps, result, warnings=warnings, shown=shown)
    return _with_inputs(run, outcome if model is None else _judged(run, outcome, *model))


def _opened(scene: AnyScene, request: Request) -> tuple[Model, Asked] | None:
    """The user's own model, and what it is asked; ``None`` where there is none to run."""
    given = plans.own_model(scene, request)
    if given is None:
        return None
    from validate import models
    from validate.models.asked import of_scene

    return models.opened(*given), of_scene(scene)


def _judged(run: _Run, outcome: Outcome[AnyScene], model: Model, asked: Asked) -> Outcome[AnyScene]:
    """With the user's own model held against 3D; where that is interrupted, what 3D found as it is."""
    from compare.probe_answer import answered
    from compare.probes import Both, Quantities, evaluate
    from validate.models import asked as of_model

    scene, three = outcome.scene, outcome.solved
    try:
        with run.clock.stage("reduced1d"):
            one = of_model.solve(model, asked, three, scene.accuracy, bool(three.steady), run.say)
    except KeyboardInterrupt:
        said = f"{model.name} was interrupted: what 3D found is kept, and nothing is compared with it"
        return replace(outcome, warnings=(*outcome.warnings, said), interrupted=True)
    with run.clock.stage("checks"):
        start = three.details.get("accurate_from_s", 0.0)
        jumps, edges = physics.temperature_jumps(scene), physics.jumps(physics.driving(scene))
        of = Quantities(asked.over_time, scene.initial_temperature, start, jumps, edges)
        both = Both(of, three, one)
        checks = evaluate(scene, both)
        said = answered(both, checks)
    if run.request.why and three.steady:
        from compare.network_blame import blame

        with run.clock.stage("why"):
            run.say("solving in 3D with the joints of the network")
            outcome = replace(outcome, why=blame(scene, three, one))
    silent = one.details["silent"]
    left = (f"{model.name} says nothing of {listed(silent)}: no check is made of that",) if silent else ()
    return replace(outcome, reduced1d=one, checks=checks, answer=said, warnings=(*outcome.warnings, *left))


def _varies(scene: AnyScene) -> bool:
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
    if isinstance(scene, MeshScene):
        groups = dict.fromkeys(group for body in scene.bodies for group in body.groups)
        return replace(scene, probes=tuple(GroupProbe(f"mean {name}", group=name) for name in groups))
    return replace(scene, probes=tuple(Probe(f"mean {b.name}", b.lower, b.upper) for b in scene.boxes))


def _followed(request: Request) -> bool:
    """Whether numbers of the scene are followed: it is solved whole then, for one of one side changes that side
    alone."""
    return request.sensitivities or request.uncertain is not None
