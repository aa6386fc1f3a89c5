"""A run of the device: what the 1D model says, the paper's claims checked, a designer's questions answered."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from compare.outcome import Clock, Outcome
from compare.plan import design_reason, drawn_figures, needs, of_device
from scenes.plan import Request, Step

if TYPE_CHECKING:
    from fem3d.device.runs import Solved
    from scenes.device import Device
    from scenes.loop.result import DeviceResult
    from scenes.loop.runs import Runs


def plan(device: Device, request: Request, data: None = None) -> tuple[Step, ...]:
    """What `solve` will do, before it does it."""
    return of_device(device, request)


def solve(
    device: Device, request: Request, say: Callable[[str], None], clock: Clock, data: None = None
) -> Outcome[Device]:  # fmt: skip
    """The runs, the checks and the designer's answers. Raises SceneError for what the model refuses, ArithmeticError
    where its numerics fail."""
    with clock.stage("imports"):
        from compare import device_checks
        from reduced1d.device import design
    with clock.stage("device"):
        made = simulated(device, request, say)
    solved = None
    if request.in_3d:
        from compare.device_3d_checks import evaluate_3d

        with clock.stage("device in 3D"):
            solved = solved_in_3d(device, request, say)
    with clock.stage("checks"):
        found = device_checks.evaluate(device, request, made)
        if solved is not None:
            found += evaluate_3d(device, request, made, solved)
    answers = None
    if not design_reason(request):
        say("answering a designer's questions")
        with clock.stage("design"):
            answers = design.answer(device, request.largest_voltage, request.largest_power)
    followed = None
    if request.sensitivities:
        from compare.inputs import sensitivities

        with clock.stage("sensitivities"):
            followed = sensitivities.of_device(device)
    warnings = _too_hot(device, made.base.result)
    lines = of_device(device, request)
    return Outcome(
        device,
        request,
        lines,
        checks=found,
        warnings=warnings,
        simulated=made,
        device_3d=solved,
        design=answers,
        sensitivities=followed,
    )


def simulated(device: Device, request: Request, say: Callable[[str], None] = lambda _: None) -> Runs:
    """Every run that a request needs."""
    from reduced1d.device import runs

    slow, steps = needs(device, request, "figure11"), needs(device, request, "figure12", "figure13")
    return runs.make(device, request.scheme, request.meter, slow, steps, say)


def solved_in_3d(device: Device, request: Request, say: Callable[[str], None] = lambda _: None) -> Solved:
    """Every run in 3D that a request needs."""
    from fem3d.device.runs import make
    from reduced1d.device.meters import METERS, in_the_loop

    meter = METERS[request.meter] if request.meter else None
    rounded = in_the_loop(device, meter, device.external.initial_temperature) if meter else (0.0, 0.0)
    drawn = drawn_figures(request)
    slow, steps = "figure11" in drawn, "figure12" in drawn or "figure13" in drawn
    return make(device, rounded, slow, steps, say)


def _too_hot(device: Device, result: DeviceResult) -> tuple[str, ...]:
    """The materials that get past their ``valid_to``; the beam's middle is above its equivalent temperature, by eqs 13
    and 18."""
    import numpy as np

    from compare import hottest
    from reduced1d.equations import end_rise_from_equivalent
    from reduced1d.painted import Reduction
    from reduced1d.sink import anchor_series_resistance

    sink, times = device.sink, result.time_s
    mean = result.sink_K - sink.room_temperature
    resistance = anchor_series_resistance(sink)
    end = end_rise_from_equivalent(
        mean, resistance, sink.silicon.thermal_conductivity, sink.cross_section, sink.length
    )  # fmt: skip
    peak = end + 1.5 * (mean - end)
    hot = int(np.argmax(peak))
    beam = hottest.of_painted(Reduction(sink, (float(end[hot]), float(peak[hot])), *[np.empty(0)] * 3))
    reached = {name: hottest.Hottest(found.temperature, float(times[hot])) for name, found in beam.items()}
    external = device.external
    outside = np.where(times < external.step_time, external.initial_temperature, external.final_temperature)
    for name, trace in (
        (device.gold.name, result.sensor_K),
        (device.pdms.name, np.maximum(np.maximum(result.sink_K, result.sensor_K), outside)),
    ):
        k = int(np.argmax(trace))
        reached[name] = hottest.Hottest(float(trace[k]), float(times[k]))
    return tuple(hottest.warnings((sink.silicon, sink.oxide, device.gold, device.pdms), reached))
