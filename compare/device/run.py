"""One run of the device: everything solved, checked and answered, and the folder that keeps it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from compare.clock import Clock
from compare.device import scope
from compare.device.outcome import DeviceOutcome
from compare.device.scope import DeviceRequest
from scenes.device import Device
from validate.report.folder import Folder
from validate.report.names import of_device


def run(
    device: Device, request: DeviceRequest, out: Path | None = None, progress: Callable[[str], None] | None = None
) -> DeviceOutcome:
    """Solve a device as asked, check what the paper says of it, and write the results folder.

    The folder is there, whole, when this returns, and as it was before when this raises. Raises SceneError for a folder
    that can't be used and for what the model refuses, and ArithmeticError where its numerics fail.
    """
    say = progress or (lambda _: None)
    clock = Clock()
    with Folder(out or of_device(device, request)) as folder:
        outcome = _solve(device, request, say, clock)
        say("writing the results")
        outcome = _write(outcome, folder.partial, clock)
    return replace(outcome, folder=folder.target, replaced=folder.replaced, timing=clock.all())


def answer(
    device: Device, request: DeviceRequest, progress: Callable[[str], None] | None = None
) -> DeviceOutcome:  # fmt: skip
    """The same without any file. Raises SceneError for what the model refuses, ArithmeticError where numerics fail."""
    clock = Clock()
    return replace(_solve(device, request, progress or (lambda _: None), clock), timing=clock.all())


def _solve(device: Device, request: DeviceRequest, say: Callable[[str], None], clock: Clock) -> DeviceOutcome:
    with clock.stage("imports"):
        from compare.device import checks, design, runs
    with clock.stage("device"):
        made = runs.make(device, request, say)
    with clock.stage("checks"):
        found = checks.evaluate(device, request, made)
    answers = None
    if not scope.design_reason(request):
        say("answering a designer's questions")
        with clock.stage("design"):
            answers = design.answer(device, request)
    from compare.device.hottest import too_hot

    warnings = too_hot(device, made.base.result)
    return DeviceOutcome(device, request, scope.plan(device, request), made, found, answers, warnings=warnings)


def _write(outcome: DeviceOutcome, folder: Path, clock: Clock) -> DeviceOutcome:
    from scenes.loop.result import QUANTITIES
    from validate.report.device.summary import document
    from validate.report.summary import write_document
    from validate.report.traces import write_columns

    result = outcome.runs.base.result
    columns = {"time_s": result.time_s, **{f"reduced1d_{name}": result.trace(name) for name in QUANTITIES}}
    with clock.stage("files"):
        names = [write_columns(folder / "traces.csv", columns)]
    drawn = scope.drawn_figures(outcome.device, outcome.request)
    if drawn:
        with clock.stage("figures"):
            from validate.report.device.figures import draw

            names += draw(outcome, drawn, folder)
    outcome = replace(outcome, files=(*names, "report.html", "summary.json"), timing=clock.all())
    found = document(outcome)
    with clock.stage("files"):
        _write_report(outcome, folder, found)
        write_document(folder / "summary.json", found)
    return outcome


def _write_report(outcome: DeviceOutcome, folder: Path, found: dict[str, Any]) -> None:
    from compare.checks import contradicts
    from compare.device.answer import answer
    from validate.report.html.page import write_report

    device = outcome.device
    contrary = [check for check in outcome.checks if contradicts(check, device, False)]
    said = answer(outcome, contrary, named=False)
    write_report(folder / "report.html", f"{device.name}: the whole sensor in 1D", said, found)
