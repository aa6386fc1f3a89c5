"""Several whole sensors on one substrate: what the others at work, and a step outside of one, do to a sensor's reading,
with the loops closed and with all sinks off."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scenes.array import DeviceArray
from scenes.physics import refuse_laws
from scenes.plan import Request, Step, step
from validate.run.kinds.array import FIGURE, skipped_figures
from validate.run.outcome import Outcome, Run

if TYPE_CHECKING:
    from compare.against import Data
    from compare.verdict import Check
    from fem3d.device.array import Solved
    from reduced1d.device.array import Beside

PYTHON = "fem3d.device.array.solve"
SHOWN = ()
CHECK = "dev3d_array"
_DRAWN = "how much warmer the others make the plate, and what a step outside of one does to its neighbour's sensor"


def text(array: DeviceArray) -> str:
    rows = f" x {array.sink.rows}" if array.sink.rows > 1 else ""
    return f"{array.name}, {array.sink.columns}{rows} on a substrate"


def plan(array: DeviceArray, request: Request, data: Data | None) -> tuple[Step, ...]:
    refuse_laws((array.sink.substrate,), "an array of devices")
    sink = array.sink
    names = f"{sink.count} elements" if sink.rows == 1 else f"{sink.columns} x {sink.rows} elements"
    return (
        step("3D model", f"a few states of one element on the substrate, known to {array.accuracy_3d:g}"),
        step(names, "coupled by the substrate's own solution for heat at a footprint, at rest and over time"),
        step("1D model", "each on the plate that all warm as in 3D: the paper's has no neighbours, and no substrate"),
        step(f"checks {CHECK}", "what the others at work change of a sensor's power"),
        step(FIGURE, _DRAWN, skipped_figures(array, request).get(FIGURE, "")),
    )


def answer(run: Run, data: Data | None) -> Outcome[DeviceArray]:
    """The elements, the check and the answer."""
    array, request, clock = run.scene, run.request, run.clock
    refuse_laws((array.sink.substrate,), "an array of devices")
    with clock.stage("imports"):
        from fem3d.device.array import solve
        from reduced1d.device.array import beside
        from scenes.result import Estimate, Result
    run.say("solving one element in 3D")
    with clock.stage("fem3d"):
        solved = solve(array, run.say)
    with clock.stage("reduced1d"):
        in_1d = beside(array, solved.plate.value, solved.paths)
    steady = {}
    base, known = solved.base
    for k, at_work in enumerate(solved.at_work):
        change, rise = solved.closed.power_change, solved.closed.plate_rise
        steady[f"plate{k + 1}_rise_K"] = Estimate(float(rise.value[k]), float(rise.error[k]))
        if at_work:
            power = base + float(change.value[k])
            steady[f"sensor{k + 1}_power_W"] = Estimate(power, known + float(change.error[k]))
    details = {"array": solved, "unknowns": solved.model.details["unknowns"]}
    outcome = Outcome(
        array, request, plan(array, request, data), fem3d=Result("fem3d", steady, None, details),
        reduced1d=Result("reduced1d", {}, None, {"array": in_1d}), checks=(_check(solved, in_1d),),
        warnings=warnings_of(solved),
    )  # fmt: skip
    return replace(outcome, answer=answered(outcome))


def warnings_of(solved: Solved) -> tuple[str, ...]:
    """Films without power at the initial outer temperature, about which everything is told, and an unstable loop."""
    element = solved.array.element
    outer = element.external.initial_temperature
    state, eigenvalue = solved.model.steady(element, outer), solved.model.largest_eigenvalue(element, outer)
    idle = [film for film in ("sink", "sensor") if getattr(state, f"{film}_saturated")]
    said = [f"at {outer:g} K outside, about which all is told, the {film} of an element has no power" for film in idle]
    if abs(eigenvalue) >= 1:
        said.append(
            f"the loop of an element is unstable, its largest eigenvalue per sample {abs(eigenvalue):.4g} in size: "
            "over time neighbours change the power of a sensor that swings"
        )
    return tuple(said)


def _check(solved: Solved, in_1d: Beside) -> Check:
    """The paper: the sensor is blind to the substrate, and so to what its neighbours do to that."""
    from compare.verdict import Comparison, judged
    from scenes.formats import quantity

    k = solved.most_moved
    closed, off = (each.power_change for each in (solved.closed, solved.sinks_off))
    change, size = float(closed.value[k]), abs(float(off.value[k])) or 1.0
    warmer = quantity(float(solved.closed.plate_rise.value[k]), "K", 3, prefixed=True)
    said = (
        f"paper: the sensor loses nothing to the substrate; the others make the plate under element {k + 1} "
        f"{warmer} warmer, which changes its sensor's power by "
        f"{quantity(change, 'W', 2)} to within {quantity(float(closed.error[k]), 'W', 1)}, with all sinks off by "
        f"{quantity(float(off.value[k]), 'W', 3)}; in 1D it is {quantity(float(in_1d.closed.power_change[k]), 'W', 2)} "
        f"and {quantity(float(in_1d.sinks_off.power_change[k]), 'W', 3)}"
    )
    comparison = Comparison(
        "neighbours at work", 0.0, change, "W", -change / size, float(closed.error[k]) / size, said,
        relative_to="what it is with all sinks off",
    )  # fmt: skip
    return judged(CHECK, comparison, solved.array, always=True)


def answered(outcome: Outcome[DeviceArray]) -> str:
    """What the neighbours change of a reading, with the sinks on and off."""
    from scenes.formats import milliseconds, quantity

    solved: Solved = outcome.solved.details["array"]
    k, external = solved.most_moved, outcome.scene.external
    warmer = quantity(float(solved.closed.plate_rise.value[k]), "K", 3, prefixed=True)
    changes = [quantity(float(each.power_change.value[k]), "W", 2) for each in (solved.closed, solved.sinks_off)]
    said = (
        f"{text(outcome.scene)}: the others make the plate under element {k + 1} {warmer} warmer, which "
        f"changes its sensor's power by {changes[0]}, with all sinks off by {changes[1]}"
    )
    if not solved.over_time:
        return f"{said}."
    closed, off = solved.over_time
    height = external.final_temperature - external.initial_temperature
    at_rest = [
        quantity(height * float(each.per_outside.value[closed.read, closed.stepped]), "W", 2)
        for each in (solved.closed, solved.sinks_off)
    ]
    (per_kelvin, when), known = closed.largest, abs(height) * closed.error
    most = abs(height * per_kelvin)
    on_the_way = (
        f"at most by {quantity(height * per_kelvin, 'W', 2)} to within {quantity(known, 'W', 1)}, {milliseconds(when)} "
        "after the step"
        if known < most else f"by less than {quantity(most + known, 'W', 2)} on the way"
    )  # fmt: skip
    return (
        f"{said}; {height:+g} K outside of element {closed.stepped + 1} changes the sensor's power of element "
        f"{closed.read + 1} by {at_rest[0]} at rest and {on_the_way}; with all sinks off by {at_rest[1]} and "
        f"{quantity(height * off.largest[0], 'W', 2)}."
    )
