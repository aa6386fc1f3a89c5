"""The plan of a comparison: the 3D model's own lines, then the 1D model, checks and files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from compare import scope
from compare.asked import whole
from scenes.plan import Request, Step
from scenes.sink import Sink

if TYPE_CHECKING:
    from compare.against.data import Data


def plan(sink: Sink, request: Request) -> tuple[Step, ...]:
    """What ``compare.sink_run.run`` will do, before it does it."""
    if "fem3d" not in request.models:
        return assemble(sink, request, (Step("3D model", "skipped", "only the 1D model was asked for"),))
    from fem3d.run import plan as plan_3d

    return assemble(sink, request, plan_3d(sink, request))


def assemble(sink: Sink, request: Request, solver_steps: tuple[Step, ...]) -> tuple[Step, ...]:
    """The whole plan around the 3D model's lines."""
    steps = [*solver_steps, _reduction(request)]
    made = scope.made_checks(sink, request)
    if made:
        steps.append(Step("checks", "done", ", ".join(made)))
    steps += _grouped("check", scope.skipped_checks(sink, request))
    skipped = scope.skipped_figures(request)
    for name, what in scope.FIGURES.items():
        if name not in skipped:
            steps.append(Step(name, "done", what))
    steps += _grouped("figure", skipped)
    if request.transient:
        steps.append(Step("traces.csv", "done", "every quantity against time"))
    else:
        steps.append(Step("traces.csv", "skipped", "only the steady state was asked for"))
    why = scope.fields_reason(request)
    steps += _asked(request)
    files = "fem3d.pvd with its .vtu files, and fem3d.vtkhdf where VTK can"
    steps.append(Step("field files", "skipped" if why else "done", why or files))
    turned = "" if "figure4" in skipped else ", with the field to turn"
    steps.append(Step("report.html", "done", f"everything on one page{turned}"))
    return tuple(steps)


def data_step(data: Data) -> Step:
    """The line of a user's own traces."""
    said = data.said().partition(": ")[2].rstrip(".")
    return Step(f"against {data.name}", "done", f"{said}; interpolated in time")


def _reduction(request: Request) -> Step:
    if "reduced1d" not in request.models:
        return Step("1D model", "skipped", "only the 3D model was asked for")
    when = "steady and at the 3D model's times" if "fem3d" in request.models else "steady and over time"
    from reduced1d.ladder import describe

    name = whole(request).reduction
    model = describe(name) if name == "paper" else f"{name}, {describe(name)}"
    return Step("1D model", "done", f"{model}, {when if request.transient else 'steady only'}")


def _asked(request: Request) -> list[Step]:
    """What is done only when asked for, and so has no line where it isn't."""
    asked, steps = whole(request), []
    if asked.why:
        steps.append(Step("why", "done", f"the ladder of models between {asked.reduction} and 3D, one assumption each"))
    elif request.models == Request().models:
        steps.append(Step(scope.BLAME, "done", "by the ladder between the models, where the 1D model differs"))
    if asked.export is not None:
        from reduced1d.ladder import few_states_of

        steps.append(Step("export", "done", f"{few_states_of(asked.reduction)} as JSON, Python and SPICE"))
    return steps


def _grouped(kind: str, skipped: Mapping[str, str]) -> list[Step]:
    """One line for all that is skipped for the same reason."""
    lines = []
    for reason in dict.fromkeys(skipped.values()):
        names = [name for name, why in skipped.items() if why == reason]
        lines.append(Step(f"{kind}s {', '.join(names)}", "skipped", reason))
    return lines
