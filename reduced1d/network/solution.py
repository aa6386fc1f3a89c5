"""A scene's network solved with its error, the network of a sink's boxes, and probes of its links in a full model.

Everything is solved twice, on elements of two degrees (and over time on steps of two sizes); the distance is the error
bound of the finer one. Elements are refined until it is far below the scene's accuracy.

Along a line the flow is k A dT/ds, exactly, for the mean temperature over the cross-section. The error of a network of
lines is therefore in its links, in their resistances and in how the flow spreads over them: probes measure the mean
temperatures (or potentials) on both sides of each and the flow between.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from reduced1d.network.lines import Layout, Link, Touch, layout
from reduced1d.network.model import Model, build, scales
from reduced1d.network.readings import meet, read
from reduced1d.network.solvers import History, steady
from scenes import physics
from scenes.errors import NumericsError, SceneError
from scenes.model import AnyScene, Probe, Quantity
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink, face

BELOW = 1e-2
"""The part of the scene's accuracy that the network's own error may be, so that it hardly counts beside that of 3D."""
DEGREES, DEGREES_OVER_TIME = ((5, 7), (7, 9), (9, 11)), ((4, 5), (6, 7), (8, 9))
"""Of the coarse and the fine elements, turn by turn."""
GROWTHS = ((6.0, 4.0), (2.5, 2.0), (1.5, 1.3))
"""By what factor a step ends later than it begins, in the coarse and in the fine run over time, turn by turn: each turn
has an error some hundred times smaller (13th order), and the first serves accuracies of a per cent. The hot plate's
traces are then 5e-5, 6e-6; 4e-7, 2e-7 and below 1e-8 off, of which the elements make the last three."""
EARLY = 1e-3
"""For this part of the end time, after the start and after a jump, errors of traces are not judged; 3D has the same.
The first step, and the elements that follow it, are for a tenth of it."""
INTO_SUBSTRATE, THROUGH_END = "heat into ", "heat through the end"
"""Names of the probes of heat flows; a boundary's name follows the first."""


@dataclass(frozen=True)
class Place:
    """A link, by its ``key`` ("heat" | "current", number) and its name ``called``: the probes of either side (None for
    the value of a boundary, of number ``given``) and of the flow, and the ``sign`` of the flow out of the first side.
    """

    key: tuple[str, int]
    called: str
    one: Probe
    other: Probe | None
    given: int | None
    flow: Probe
    sign: float


def places(layout: Layout) -> list[Place]:
    """List every link that has a resistance, or may have one: no fluxes, and no electrodes of unknown potential."""
    kept, boundaries = [], layout.scene.boundaries
    for kind in ("heat", "current"):
        for number, link in enumerate(layout.links(kind == "current")):
            b = boundaries[link.boundary]
            if link.other or not (b.kind == "heat_flux" or (kind == "current" and b.series_resistance)):
                kept.append(_place(layout, (kind, number), link))
    return kept


def _place(layout: Layout, key: tuple[str, int], link: Link) -> Place:
    names = [layout.lines[t.line].name for t in link.touches]
    given, sign, other = None, 1.0, None
    if link.other is None:
        names.insert(0, layout.scene.boundaries[link.boundary].name)
        given, sign = link.boundary, _sign(layout, link.one)
    else:
        other = _side(layout, key, link.other, 1)
    called = " | ".join(names) + (", current" if key[0] == "current" else "")
    quantity: Quantity = "current" if key[0] == "current" else "heat_flow"
    flow = Probe(f"{key[0]} {key[1]} flow", link.one.lower, link.one.upper, quantity)
    return Place(key, called, _side(layout, key, link.one, 0), other, given, flow, sign)


def _sign(layout: Layout, touch: Touch) -> float:
    """Out of the line: a flow counts into the solid on its surface, along the axis inside."""
    line, n = layout.lines[touch.line], touch.normal
    beside = (other for other in layout.lines if other is not line and meet(touch, other))
    inside = any(touch.lower[n] in (other.lower[n], other.upper[n]) for other in beside)
    return -1.0 if not inside or line.lower[n] == touch.lower[n] else 1.0


def _side(layout: Layout, key: tuple[str, int], touch: Touch, number: int) -> Probe:
    """The mean over a line's cross-section where it is touched: over the whole end, or the length that is covered; on
    its own side of contacts, where there are any."""
    line = layout.lines[touch.line]
    lower, upper = list(line.lower), list(line.upper)
    lower[line.axis], upper[line.axis] = touch.start, touch.stop
    quantity: Quantity = "potential" if key[0] == "current" else "temperature"
    boxes = (line.box.name,) if any(link.contact for link in layout.heat) else ()
    (a, b, c), (d, e, f) = lower, upper
    return Probe(f"{key[0]} {key[1]} side {number}", (a, b, c), (d, e, f), quantity, boxes=boxes)


def solve(
    scene: AnyScene | Layout, times: np.ndarray | Sequence[float] | None = None, steady_too: bool = True
) -> Result:
    """Solve a scene of boxes by the network of its lines.

    Parameters
    ----------
    scene : AnyScene
    times : (n,) array, optional
        Ascending times (s), not negative, at which the probes are read, from the initial temperature on.
    steady_too : bool
        Whether the steady state, at the last values of the inputs, is solved beside ``times``.

    Returns
    -------
    Result
        Keys are the names of the probes, temperatures in K, potentials in V, flows in W, currents in A, each with an
        error bound of the discretization. A scene over time that has no steady state has none in its result.

    Raises
    ------
    SceneError
        For a scene on a mesh file or one that lines cannot have.
    RunawayError, NumericsError
        Where the heating runs away, or the numerics fail.
    """
    shape = scene if isinstance(scene, Layout) else layout(scene)
    estimates: dict[str, Estimate] = {}
    traces, steps, model, details = None, {}, None, dict[str, Any](warnings=[])
    try:
        if times is None or steady_too:
            estimates, model = _steady(shape)
    except NumericsError as error:
        if times is None:
            raise
        details["no_steady_state"] = str(error)
    if times is not None:
        traces, last, count = _over_time(shape, np.asarray(times, float))
        model, steps = model or last, {"steps": count}
    assert model is not None
    unknowns, electric = (c.free.shape[1] if c else 0 for c in (model.heat, model.current))
    details |= {
        "model": model, "lines": len(shape.lines), "unknowns": unknowns, "electric_unknowns": electric,
        "degree": model.elements.degree, **steps,
    }  # fmt: skip
    return Result("network", estimates, traces, details)


def refined(shape: Layout, turn: int, time: float | None = None) -> tuple[Model, Model]:
    """Build the coarse and the fine model of a layout, for changes within a ``time`` (s), at a turn of refinement."""
    sizes = [size / 2**turn for size in scales(shape, time)]
    coarse, fine = (build(shape, degree, sizes) for degree in (DEGREES_OVER_TIME if time else DEGREES)[turn])
    return coarse, fine


def _steady(shape: Layout) -> tuple[dict[str, Estimate], Model]:
    enough = BELOW * shape.scene.accuracy
    for turn in range(len(DEGREES)):
        models = refined(shape, turn)
        coarse, fine = (read(model, *steady(model), np.zeros(1)) for model in models)
        errors = {name: float(np.abs(fine[name] - coarse[name]).max()) for name in fine}
        sizes = magnitudes(shape, fine)
        if all(errors[name] <= enough * sizes[name] for name in fine):
            break
    values = _absolute(shape, fine)
    return {name: Estimate(float(v[0]), errors[name]) for name, v in values.items()}, models[1]


def _over_time(shape: Layout, times: np.ndarray) -> tuple[Traces, Model, int]:
    scene, enough = shape.scene, _enough(shape)
    end = max(float(times[-1]) if len(times) else 0.0, 0.0 if scene.steady else scene.end_time)
    for turn in range(len(DEGREES)):
        runs = histories(shape, end, turn)
        # At a few instants both runs may agree by chance: they are compared in the middles of all steps, too.
        instants = np.union1d(times, runs[1].middles)
        judged = _judged(shape, instants, end)
        coarse, fine = (read(run.model, *run.at(instants), instants) for run in runs)
        errors = {n: float(np.abs(fine[n] - coarse[n])[judged].max(initial=0.0)) for n in fine}
        sizes = magnitudes(shape, fine)
        if all(errors[name] <= enough * sizes[name] for name in fine):
            break
    values = {n: v[np.searchsorted(instants, times)] for n, v in _absolute(shape, fine).items()}
    return Traces(times, values, errors), runs[1].model, len(runs[1].steps)


@lru_cache(maxsize=6)
def histories(shape: Layout, end: float, turn: int) -> tuple[History, History]:
    """The coarse and the fine run over time. Cached, for a comparison reads the same run at more times."""
    soonest = 0.1 * min(EARLY * end, *(t for t in shape.scene.output_times if t > 0), end)
    # Sweeps of a step end with a thousandth of the error that is enough.
    coarse, fine = (
        History(model, end, soonest, growth, 1e-3 * _enough(shape))
        for model, growth in zip(refined(shape, turn, soonest), GROWTHS[turn], strict=True)
    )
    return coarse, fine


def _enough(shape: Layout) -> float:
    """The relative error of traces that needs no refinement, however small the accuracy."""
    return max(BELOW * shape.scene.accuracy, 1e-6)


def _judged(shape: Layout, times: np.ndarray, end: float) -> np.ndarray:
    """(times,): which are not right after the start or a jump."""
    early = np.zeros(len(times), bool)
    for jump in (0.0, *physics.jumps(physics.driving(shape.scene))):
        early |= (times >= jump) & (times < jump + EARLY * end)
    return ~early if not early.all() else np.ones(len(times), bool)


def _absolute(shape: Layout, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The values with temperatures in place of rises; NumericsError where one is not finite."""
    start = {p.name: shape.scene.initial_temperature for p in shape.scene.probes if p.quantity == "temperature"}
    for name, value in values.items():
        if not np.isfinite(value).all():
            raise NumericsError(f"the network's value of probe {name!r} is not finite")
    return {name: value + start.get(name, 0.0) for name, value in values.items()}


def magnitudes(shape: Layout, values: dict[str, np.ndarray]) -> dict[str, float]:
    """Compute the scale of each probe's error: its own largest value (of a temperature its rise), but no less than a
    hundredth of the largest of its kind."""
    kinds = {p.name: p.quantity for p in shape.scene.probes}
    largest = {name: float(np.abs(v).max(initial=0.0)) for name, v in values.items()}
    by_kind = {kind: max(v for name, v in largest.items() if kinds[name] == kind) for kind in set(kinds.values())}
    return {name: max(v, 0.01 * by_kind[kinds[name]]) or 1.0 for name, v in largest.items()}


def lines_of(sink: Sink) -> Layout:
    """The lines of a sink of one span, with probes of its current and of the heat into the substrate and through the
    beam's end. Raises SceneError for a row of spans, and for scenes that lines don't take."""
    if sink.spans > 1:
        raise SceneError(
            f"--reduction network has the quantities of one span, and sink.spans is {sink.spans}: give sink.spans = 1, "
            "or another reduction"
        )
    scene = sink.scene()
    physics.refuse_terminals(scene, "--reduction network")
    beam = next(box for box in scene.boxes if box.name == "beam")
    inlet = next(b for b in scene.boundaries if b.name == "electrode-0")
    bottoms = (b for b in scene.boundaries if b.name.startswith("substrate"))
    flows = [
        *(Probe(INTO_SUBSTRATE + b.name, b.lower, b.upper, "heat_flow") for b in bottoms),
        Probe(THROUGH_END, *face(beam, 1, 0), "heat_flow"), Probe("current", inlet.lower, inlet.upper, "current"),
    ]  # fmt: skip
    return layout(replace(scene, probes=(*scene.probes, *flows)))


def solve_sink(sink: Sink, times: np.ndarray | None = None) -> Result:
    """A sink's quantities by its network: the steady state, or with ``times`` (s, ascending) the traces alone, each
    with the error of its elements and steps.

    Raises SceneError for a sink that lines can't have, RunawayError where the heating runs away, NumericsError."""
    result, voltage = solve(lines_of(sink), times, steady_too=False), sink.drive.value
    if times is not None:
        traces = result.over_time
        names = {"peak_K": "peak", "end_K": "end", "mean_K": "mean", "current_A": "current"}
        values = {name: traces.values[probe] for name, probe in names.items()}
        errors = {name: traces.errors[probe] for name, probe in names.items()}
        values["power_W"], errors["power_W"] = voltage * values["current_A"], voltage * errors["current_A"]
        return replace(result, steady={}, traces=replace(traces, values=values, errors=errors))
    probes = result.steady
    steady = {
        f"{name}_rise_K": Estimate(probes[name].value - sink.room_temperature, probes[name].error)
        for name in ("peak", "end", "mean")
    }
    steady["current_A"] = current = probes["current"]
    steady["power_W"] = Estimate(voltage * current.value, voltage * current.error)
    bottoms = [given for name, given in probes.items() if name.startswith(INTO_SUBSTRATE)]
    steady["heat_out_W"] = Estimate(-sum(e.value for e in bottoms), sum(e.error for e in bottoms))
    rise, heat = steady["end_rise_K"], probes[THROUGH_END]
    if heat.value:
        # Heat is counted along the beam, which at its first end it leaves against that direction.
        value = -rise.value / heat.value
        error = abs(value) * (rise.error / abs(rise.value) + heat.error / abs(heat.value)) if rise.value else 0.0
        steady["anchor_resistance_K_per_W"] = Estimate(value, error)
    return replace(result, steady=steady)
