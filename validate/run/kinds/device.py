"""The device: the whole sensor with its controllers, in 1D and in 3D, and what the paper claims of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from scenes.device import Device
from scenes.plan import Request, Step
from validate.run import plan as plans
from validate.run.kinds import inputs
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    from compare.verdict import Check
    from statespace.result import Runs
    from validate.inputs.propagation import Estimates, Propagated
    from validate.inputs.sensitivities import Sensitivities

PYTHON = "compare.device"
SHOWN = ("sink_power_W", "sensor_power_W", "sensor_V")
skipped_figures = plans.skipped_of_device


def text(device: Device) -> str:
    return device.name


def plan(device: Device, request: Request, data: object) -> tuple[Step, ...]:
    return plans.of_device(device, request)


def answer(run: Run, data: object) -> Outcome[Device]:
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
        checks = device_checks.evaluate(device, request, made)
        if solved is not None:
            checks += evaluate_3d(device, request, made, solved)
    if not plans.design_reason(request):
        run.say("answering a designer's questions")
        with clock.stage("design"):
            answers = design.answer(device, request.largest_voltage, request.largest_power)
    left_out = None
    if request.left_out:
        from validate.inputs.left_out import of_device as left_out_of

        with clock.stage("left out"):
            left_out = left_out_of(device, run.say)
    outcome = Outcome(
        device, request, plans.of_device(device, request), checks=checks, simulated=made, device_3d=solved,
        warnings=hottest.of_device(device, made.base.result), design=answers,
        left_out=left_out,
    )  # fmt: skip
    return inputs.told(run, outcome)


def simulated(device: Device, request: Request, say: Callable[[str], None] = lambda _: None) -> Runs:
    from reduced1d.device import runs

    slow, steps = plans.needs(device, request, "figure11"), plans.needs(device, request, "figure12", "figure13")
    return runs.make(device, request.scheme, request.meter, slow, steps, say)


def exportable(device: Device, request: Request) -> None:
    """All are that a run takes."""


def exported(outcome: Outcome[Device], say: Callable[[str], None]) -> dict[str, Any]:
    """The document of its compact model: of the 3D one where that was asked for, else of the 1D one."""
    from reduced1d.device import runs
    from statespace.device_reduction import compact

    export, solved = outcome.request.export, outcome.device_3d
    assert export is not None
    whole = runs.exported(outcome.runs.base) if solved is None else solved.exported
    return compact(whole, export.states, export.accuracy, say)


def quantities(outcome: Outcome[Device]) -> dict[str, tuple[str, str]]:
    """What is followed and uncertain, by name: what it is called, and its unit."""
    from compare.verdict import unit_of
    from reduced1d.slopes import OF_DEVICE

    return {name: (called, unit_of(name)) for name, called in OF_DEVICE.items()}


def sensitivities(outcome: Outcome[Device], keys: object) -> Sensitivities:
    from validate.inputs.sensitivities import of_device

    return of_device(outcome.scene, None if outcome.device_3d is None else outcome.device_3d.model)


def steady(outcome: Outcome[Device], slopes: Sensitivities) -> tuple[Estimates | None, Estimates | None]:
    """The steady values in 3D and in 1D, ``None`` of a model that was not asked for."""
    from reduced1d.slopes import OF_DEVICE
    from scenes.result import Estimate

    solved, after = outcome.device_3d, outcome.runs.base.after
    in_1d = {q: Estimate(getattr(after, q), 0.0) for q in OF_DEVICE}
    if solved is None:
        return None, in_1d
    errors, after = solved.model.steady_errors(outcome.scene), solved.runs.base.after
    return {q: Estimate(getattr(after, q), errors[q]) for q in OF_DEVICE}, in_1d


def judged(outcome: Outcome[Device], propagated: Propagated, run: Run) -> tuple[tuple[Check, ...], tuple[str, ...]]:
    """The checks with their u_input."""
    from compare.device_checks import evaluate
    from validate.inputs.propagation import judged_device

    def differences(changed: Device) -> dict[str, float]:
        made = evaluate(changed, run.request, simulated(changed, run.request, run.say))
        return {check.id: check.difference for check in made}

    return judged_device(outcome.checks, outcome.scene, propagated, differences), ()
