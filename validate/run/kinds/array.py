"""Rows of sinks on one substrate: every element's steady state in 3D, and what a driven one does to the others."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scenes.array import SinkArray
from scenes.errors import NumericsError
from scenes.formats import sink_text
from scenes.physics import refuse_laws
from scenes.plan import Request, Step, step
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    from compare.against import Data

PYTHON = "fem3d.runs.array.solve"
SHOWN = ()
FIGURE = "array"


def text(sink: SinkArray) -> str:
    rows = f" x {sink.rows}" if sink.rows > 1 else ""
    return f"{sink_text(sink)}, {sink.columns}{rows} on a substrate"


def plan(sink: SinkArray, request: Request, data: Data | None) -> tuple[Step, ...]:
    from fem3d.runs.array import plan as plan_3d

    _refuse(sink)
    return _planned(plan_3d(sink), request)


def _planned(solver: tuple[Step, ...], request: Request) -> tuple[Step, ...]:
    return (
        *solver,
        Step("1D model", "skipped", "the paper's has no neighbours"),
        step(FIGURE, "what one driven element does to the others, and how that falls with the pitch",
             "" if request.figures else "no figures were asked for"),
    )  # fmt: skip


def skipped_figures(scene: Any, request: Request) -> dict[str, str]:
    """The figures that a run doesn't draw, each with the reason."""
    return {} if request.figures else {FIGURE: "no figures were asked for"}


def _refuse(sink: SinkArray) -> None:
    alternative = ", or array.columns = 1 and array.rows = 1"
    refuse_laws((sink.silicon, sink.oxide, sink.substrate), "an array of sinks", alternative)


def answer(run: Run, data: Data | None) -> Outcome[SinkArray]:
    """The elements and their warnings."""
    sink, request, clock = run.scene, run.request, run.clock
    _refuse(sink)
    with clock.stage("imports"):
        from fem3d.runs import array
        from scenes.validity import cause
        from validate.run import hottest
    run.say("solving one element in 3D")
    with clock.stage("fem3d"):
        try:
            result = array.solve(sink, run.say)
        except NumericsError as error:
            if hasattr(error, "limit"):
                raise
            raise NumericsError(f"{error}{cause(sink.element, ', ask for less with --accuracy 1e-2')}") from None
    single = result.details["one"]
    warnings = (*result.details["warnings"], *hottest.of_sink(sink.element, single, None))
    outcome = Outcome(sink, request, _planned(tuple(result.details["plan"]), request), fem3d=result, warnings=warnings)
    return replace(outcome, answer=answered(outcome))


def answered(outcome: Outcome[SinkArray]) -> str:
    """How warm driven and idle elements get."""
    from scenes.formats import quantity

    result = outcome.solved
    on = set(result.details["driven"])
    means = {k: result.steady[f"sink{k}_mean_rise_K"] for k in range(1, outcome.scene.count + 1)}
    warm, idle = ([k for k in means if (k in on) == driven] for driven in (True, False))
    hottest = max(warm, key=lambda k: means[k].value)
    peak = quantity(result.steady[f"sink{hottest}_peak_rise_K"].value, "K", 5)
    said = f"{text(outcome.scene)}: {_named(warm)} driven, at most {peak} above room at the peak (element {hottest})"
    if idle:
        most = max(idle, key=lambda k: means[k].value)
        part = means[most].value / means[hottest].value
        rise = quantity(means[most].value, "K", 3, prefixed=True)
        said += f"; idle ones at most {rise} (element {most}), {part:.2g} of a driven one's mean"
    return f"{said}."


def _named(elements: list[int]) -> str:
    if len(elements) > 3:
        return f"{len(elements)} elements are"
    return f"element{'s' * (len(elements) > 1)} {', '.join(map(str, elements))} {'is' if len(elements) == 1 else 'are'}"
