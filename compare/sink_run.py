"""A run of a sink: the 3D model, the 1D model at its times, checks, and the answer.

Nothing here imports numpy before it solves: the renderer's process, which takes the longest to get ready, is started
first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from compare.outcome import Clock, Outcome
from compare.plan import ONLY_1D, of_sink
from reduced1d.ladder import refuse
from scenes.plan import Request, Step

if TYPE_CHECKING:
    from pathlib import Path

    from compare.against import Data
    from compare.inputs.calibration import Fit
    from compare.inputs.sensitivities import Sensitivities
    from compare.row_checks import Varied
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.plan import Export
    from scenes.result import Result
    from scenes.sink import Sink
    from scenes.uncertain import Uncertain

FEW = 16
"""Instants at which a sink's temperatures are looked at: they grow evenly."""


def plan(sink: Sink, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `solve` will do, before it does it. Raises SceneError for what isn't made of a row of spans."""
    refuse(sink, request.reduction)
    if "fem3d" not in request.models:
        return of_sink(sink, request, (ONLY_1D,), data)
    from fem3d.run import plan as plan_3d

    return of_sink(sink, request, plan_3d(sink, request), data)


def solve(
    sink: Sink, request: Request, say: Callable[[str], None], clock: Clock, data: Data | None = None
) -> Outcome[Sink]:  # fmt: skip
    """Both models, the checks, with those of a user's own ``data``, and the answer. Raises RunawayError (of either
    model) and NumericsError, and SceneError as `plan` does."""
    refuse(sink, request.reduction)
    from compare.answer import answered

    found = None
    if request.calibrate and data is not None:
        found = _fitted(sink, request, data, say, clock)
        sink = found.scene
    levels = _levels(sink, request)
    outcome = _compared(sink, request, levels, say, clock, data=data)
    with clock.stage("checks"):
        warnings = (*outcome.warnings, *_too_hot(sink, outcome.fem3d, outcome.reduced1d))
    with clock.stage("answer"):
        outcome = answered(replace(outcome, warnings=warnings), levels)
    if request.air:
        from compare.air import of_sink as air_of

        with clock.stage("air"):
            air = air_of(sink, say, request.transient)
        outcome = replace(outcome, air=air, checks=(*outcome.checks, *air.checks))
    if request.sensitivities or request.uncertain is not None:
        say("sensitivities")
        with clock.stage("sensitivities"):
            outcome = _with_sensitivities(outcome)
    if data is None or outcome.fem3d is None:
        return outcome
    from compare.against import definitions, evaluate

    against = evaluate(sink, data, outcome.fem3d)
    if request.uncertain is not None and outcome.propagated is not None:
        from compare.inputs.propagation import judged

        followed = outcome.propagated.sensitivities
        against = judged(against, sink, outcome.fem3d, None, request.uncertain, followed, definitions(data))
    checks = (*outcome.checks, *against)
    warnings = (*outcome.warnings, *(f"{data.name}: {text}" for text in data.warnings))
    warnings = (*warnings, *(() if found is None else found.warnings()))
    outcome = replace(outcome, checks=checks, warnings=warnings, against=data, fit=found)
    if request.uncertain is None and not request.data_uncertainty:
        return outcome
    from compare.inputs import validation

    u_data = validation.data_uncertainty(sink, data, request.data_uncertainty)
    models = [(name, result) for name, result in (("3D", outcome.fem3d), ("1D", outcome.reduced1d)) if result]
    return replace(outcome, validation=validation.validate(sink, data, u_data, models, outcome.propagated))


def _fitted(sink: Sink, request: Request, data: Data, say: Callable[[str], None], clock: Clock) -> Fit:
    """The keys that are to be fitted to the data, in 3D."""
    from compare.inputs import calibration, validation

    say("fitting")
    with clock.stage("fit"):
        u_data = validation.data_uncertainty(sink, data, request.data_uncertainty)
        keys = calibration.asked(sink, request.calibrate, data)
        return calibration.fit(sink, data, u_data, keys, calibration.in_3d)


def _with_sensitivities(outcome: Outcome[Sink]) -> Outcome[Sink]:
    """With how the models follow the keys, where that is asked for, and what uncertain keys make of them."""
    from compare.inputs import sensitivities

    sink, request = outcome.scene, outcome.request
    found = sensitivities.of_sink(sink, outcome.fem3d, outcome.reduced1d)
    outcome = replace(outcome, warnings=(*outcome.warnings, *found.remarks()))
    if request.uncertain is not None:
        outcome = _with_uncertain(outcome, request.uncertain, found)
    if not request.sensitivities:
        return outcome
    made = sensitivities.checks(sink, found)
    said = f"{outcome.answer} {sensitivities.sentence(made)}".rstrip()
    return replace(outcome, sensitivities=found, checks=(*outcome.checks, *made), answer=said)


def _with_uncertain(outcome: Outcome[Sink], uncertain: Uncertain, found: Sensitivities) -> Outcome[Sink]:
    """With the u_input of quantities and checks."""
    from compare.inputs import propagation

    sink, three, one = outcome.scene, outcome.fem3d, outcome.reduced1d
    made = propagation.propagated(uncertain, found, three.steady if three else None, one.steady if one else None)
    checks = outcome.checks
    if three is not None:
        checks = propagation.judged(checks, sink, three, one, uncertain, found)
    bent = propagation.bent(sink, made) if one is not None and one.model == "paper" else ()
    return replace(outcome, propagated=made, checks=checks, warnings=(*outcome.warnings, *bent))


def compared(sink: Sink, request: Request, earlier: Result | None = None) -> Outcome[Sink]:
    """Both models and the checks alone: no answer in words, no warnings of what gets too hot. ``earlier`` is the 3D
    result of the same sink at another voltage, whose meshes and fields may serve again. Raises as `solve` does."""
    return _compared(sink, request, _levels(sink, request), lambda _: None, Clock(), earlier)


def _exported(
    sink: Sink, request: Request, asked: Export, levels: Levels, say: Callable[[str], None]
) -> tuple[str, Path]:
    """What has been written, and where: a compact model of the 3D problem with the current as an output too, or the
    reduction's few states."""
    if not asked.compact:
        from reduced1d.export import export
        from reduced1d.ladder import few_states_of

        return few_states_of(request.reduction), export(levels, request.reduction, asked.folder)
    from compare.free_run import exported
    from scenes.errors import SceneError
    from scenes.model import Probe

    if sink.spans > 1:
        raise SceneError(f"--states and --model-accuracy make a model of one span, and sink.spans = {sink.spans}")
    scene = sink.scene()
    inlet = next(b for b in scene.boundaries if b.kind == "voltage")
    current = Probe("current", inlet.lower, inlet.upper, "current")
    return exported(replace(scene, probes=(*scene.probes, current)), asked, say)


def _compared(
    sink: Sink,
    request: Request,
    levels: Levels | None,
    say: Callable[[str], None],
    clock: Clock,
    earlier: Result | None = None,
    data: Data | None = None,
) -> Outcome[Sink]:
    fem3d = reduced1d = single = why = exported = None
    runs: tuple[Varied, ...] = ()
    if request.export is not None and levels is not None:
        with clock.stage("export"):
            exported = _exported(sink, request, request.export, levels, say)
    checks: tuple[Check, ...] = ()
    solver_steps: tuple[Step, ...] = (ONLY_1D,)
    if "fem3d" in request.models:
        with clock.stage("imports"):
            from fem3d.errors import NumericsError, RunawayError
            from fem3d.run import solve as solve_3d
            from scenes.validity import cause
        say("solving in 3D")
        with clock.stage("fem3d"):
            try:
                fem3d = solve_3d(sink, request, say) if earlier is None else solve_3d(sink, request, say, earlier)
            except NumericsError as error:
                if isinstance(error, RunawayError):
                    raise
                raise NumericsError(
                    f"{error}{cause(sink, ', ask for less with --accuracy 1e-2, or see --only 1d')}"
                ) from None
        solver_steps = tuple(fem3d.details["plan"])
    if "reduced1d" in request.models:
        with clock.stage("reduced1d"):
            reduced1d = _reduction(sink, request, fem3d, levels)
    if fem3d is not None:
        from compare.checks import evaluate

        with clock.stage("checks"):
            if sink.spans > 1:
                single = solve_3d(replace(sink, spans=1), request, say)
            checks = evaluate(sink, request, fem3d, reduced1d, single)
    if request.why and fem3d is not None and levels is not None:
        from compare.budget import budget

        with clock.stage("why"):
            why = budget(sink, request.reduction, fem3d, levels, say)
            if single is not None:
                from compare.row_checks import varied

                runs = varied(sink, request.reduction, single, say)
    warnings = tuple(text for model in (fem3d, reduced1d) if model for text in model.details.get("warnings", ()))
    steps = of_sink(sink, request, solver_steps, data)
    return Outcome(sink, request, steps, fem3d, reduced1d, checks, warnings, why=why, exported=exported, varied=runs)


def _too_hot(sink: Sink, fem3d: Result | None, reduced1d: Result | None) -> tuple[str, ...]:
    """The materials that get hotter than they are valid to, in 3D where that is solved."""
    from compare import hottest

    materials = sink.silicon, sink.oxide
    if fem3d is not None:
        return tuple(hottest.past(materials, fem3d.details["fields"].distinct, hottest.moments(fem3d.traces, FEW)))
    if reduced1d is not None and sink.spans == 1:
        from reduced1d.painted import of_result

        reached = hottest.of_painted(of_result(sink, reduced1d))
    elif reduced1d is not None:
        hot = sink.room_temperature + reduced1d.steady["peak_rise_K"].value
        reached = {sink.silicon.name: hottest.Hottest(hot)}
    else:
        return ()
    return tuple(hottest.warnings(materials, reached))


def _levels(sink: Sink, request: Request) -> Levels | None:
    """The plate, where any of what is asked for stands on it; it is solved when first used."""
    if request.reduction == "paper" and not request.why and request.export is None:
        return None
    from reduced1d.ladder.levels import Levels

    return Levels(sink)


def _reduction(sink: Sink, request: Request, fem3d: Result | None, levels: Levels | None) -> Result:
    """The 1D model, at the times of the 3D model's traces where there are any."""
    from reduced1d.errors import RunawayError
    from reduced1d.ladder import solve as solve_1d

    times = fem3d.traces.time if fem3d is not None and fem3d.traces is not None else None
    try:
        return solve_1d(sink, request.reduction, steady_only=not request.transient, times=times, levels=levels)
    except RunawayError as error:
        if fem3d is None:
            raise
        raise RunawayError(f"in 1D (3D has a steady state, see --only 3d) {error}", error.limit_voltage) from None
