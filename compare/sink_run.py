"""One comparison: plan, 3D model, 1D model at its times, checks, and the folder that keeps them.

Nothing here imports numpy before the renderer's process has been started, which takes the longest to get ready.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from compare.asked import SinkRequest, whole
from compare.clock import Clock
from compare.outcome import Outcome
from compare.plan import assemble, data_step
from scenes.plan import Request, Step
from validate.report import output
from validate.report.folder import Folder
from validate.report.names import of_sink

if TYPE_CHECKING:
    from compare.against.data import Data
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.result import Result
    from scenes.sink import Sink

FEW = 16
"""Instants at which a sink's temperatures are looked at: they grow evenly."""


def run(
    sink: Sink,
    request: Request,
    out: Path | None = None,
    progress: Callable[[str], None] | None = None,
    against: Data | None = None,
) -> Outcome:
    """Solve a sink as asked, compare the models, and write the results folder (``out``, or one named after the sink).

    ``against`` are a user's own traces, checked against the 3D model's; they need its transient.
    The folder is there, whole, when this returns, and as it was before when this raises. Raises SceneError for a folder
    that can't be used (before anything is solved), RunawayError (of either model) and NumericsError.
    """
    say = progress or (lambda _: None)
    clock = Clock()
    asked = whole(request)
    with Folder(out or of_sink(sink, asked)) as folder:
        drawing = output.prepare(request)
        try:
            outcome = _with_data(_solve(sink, asked, say, clock), against)
            say("writing the results")
            outcome = output.write(outcome, folder, drawing, clock)
        finally:
            drawing.close()
    return replace(outcome, folder=folder.target, replaced=folder.replaced, timing=clock.all())


def answer(
    sink: Sink,
    request: Request,
    progress: Callable[[str], None] | None = None,
    against: Data | None = None,
) -> Outcome:
    """The same without any file: solved and compared. Raises RunawayError and NumericsError."""
    clock = Clock()
    solved = _solve(sink, whole(request), progress or (lambda _: None), clock)
    return replace(_with_data(solved, against), timing=clock.all())


def compared(sink: Sink, request: Request, earlier: Result | None = None) -> Outcome:
    """Both models and the checks alone: no answer in words, no warnings of what gets too hot. ``earlier`` is the 3D
    result of the same sink at another voltage, whose meshes and fields may serve again. Raises as `answer` does."""
    asked = whole(request)
    return _compared(sink, asked, _levels(sink, asked), lambda _: None, Clock(), earlier)


def _with_data(outcome: Outcome, against: Data | None) -> Outcome:
    """With the checks of a user's own traces."""
    if against is None or outcome.fem3d is None:
        return outcome
    from compare.against.checks import evaluate

    checks = (*outcome.checks, *evaluate(outcome.sink, against, outcome.fem3d))
    warnings = (*outcome.warnings, *(f"{against.name}: {text}" for text in against.warnings))
    plan = (*outcome.plan, data_step(against))
    return replace(outcome, checks=checks, plan=plan, warnings=warnings, against=against)


def _solve(sink: Sink, request: SinkRequest, say: Callable[[str], None], clock: Clock) -> Outcome:
    """Both models, the checks and the answer, without any file."""
    from compare.answer import answered

    levels = _levels(sink, request)
    outcome = _compared(sink, request, levels, say, clock)
    with clock.stage("checks"):
        warnings = (*outcome.warnings, *_too_hot(sink, outcome.fem3d, outcome.reduced1d))
    with clock.stage("answer"):
        return answered(replace(outcome, warnings=warnings), levels)


def _compared(
    sink: Sink,
    request: SinkRequest,
    levels: Levels | None,
    say: Callable[[str], None],
    clock: Clock,
    earlier: Result | None = None,
) -> Outcome:
    fem3d = reduced1d = why = exported = None
    if request.export is not None and levels is not None:
        from reduced1d.export import export

        with clock.stage("export"):
            exported = export(levels, request.reduction, request.export)
    checks: tuple[Check, ...] = ()
    solver_steps: tuple[Step, ...] = (Step("3D model", "skipped", "only the 1D model was asked for"),)
    if "fem3d" in request.models:
        with clock.stage("imports"):
            from compare.extremes import cause
            from fem3d.errors import NumericsError, RunawayError
            from fem3d.run import solve as solve_3d
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
            checks = evaluate(sink, request, fem3d, reduced1d)
    if request.why and fem3d is not None and levels is not None:
        from compare.why import budget

        with clock.stage("why"):
            why = budget(sink, request.reduction, fem3d, levels, say)
    warnings = tuple(text for model in (fem3d, reduced1d) if model for text in model.details.get("warnings", ()))
    plan = assemble(sink, request, solver_steps)
    return Outcome(sink, request, plan, fem3d, reduced1d, checks, warnings, why=why, exported=exported)


def _too_hot(sink: Sink, fem3d: Result | None, reduced1d: Result | None) -> tuple[str, ...]:
    """The materials that get hotter than they are valid to, in 3D where that is solved."""
    from compare import hottest

    if fem3d is not None:
        reached = hottest.by_material(fem3d.details["fields"], hottest.moments(fem3d.traces, FEW))
    elif reduced1d is not None:
        from compare.painted import of_result

        reached = of_result(sink, reduced1d).hottest()
    else:
        return ()
    return tuple(hottest.warnings((sink.silicon, sink.oxide), reached))


def _levels(sink: Sink, request: SinkRequest) -> Levels | None:
    """The plate, where any of what is asked for stands on it; it is solved when first used."""
    if request.reduction == "paper" and not request.why and request.export is None:
        return None
    from reduced1d.ladder.levels import Levels

    return Levels(sink)


def _reduction(sink: Sink, request: SinkRequest, fem3d: Result | None, levels: Levels | None) -> Result:
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
