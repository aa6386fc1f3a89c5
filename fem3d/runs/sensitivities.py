"""Sensitivities of a sink's quantities and of a free scene's probes to the numbers of their scenes.

A temperature is differentiated as a rise: of a sink above the room, of a free scene in the steady state above the mean
of the coldest given temperatures (the start's, where none is given), over time above the start.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from scipy import sparse

from fem3d.results.outputs import Outputs, Quantities, Study
from fem3d.runs import probe_quantities
from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from fem3d.runs.differences import STEP, Course, Sensitivities, Table, sensitivities
from fem3d.runs.motion import same_planes
from meshes import symmetry
from scenes import physics
from scenes.errors import SceneError, quoted
from scenes.model import ROUNDING, AnyScene, MeshScene, Probe, values
from scenes.result import Estimate, Result
from scenes.sink import Sink
from scenes.varied import neighbour, numbers

ENOUGH = 1e-2  # accuracy to which large scenes are solved again for slopes: two digits of an uncertainty (GUM 7.2.6)
LARGE = 20_000  # unknowns of a large scene; it is solved three times for each key, which takes a second or more
ZERO = "it is zero within its error, of which there is no percent"
AT_ONCE = "the currents follow the voltages at once: the steady state of each has its sensitivities"


def of_sink(sink: Sink, result: Result, keys: Sequence[str] | None = None, profile: bool = False) -> Sensitivities:
    """Differentiate the quantities of a sink in 3D and its traces by the logarithms of its keys.

    Parameters
    ----------
    sink, result : the sink, and its result by `fem3d.runs.sink.solve`
    keys : keys to differentiate by; None for all physical keys other than zero
    profile : whether to differentiate the rises (K) of the result's profile too, at places that move along

    Raises NumericsError if the sink itself cannot be solved again.
    """
    if sink.accuracy < ENOUGH and result.details["unknowns"] > LARGE:
        sink = replace(sink, accuracy=ENOUGH)
        result = sink_run.solve(sink, result.traces is not None)
    answer, left_out = result.details["answer"], dict[str, str]()
    if answer.response is not None and (why := physics.nonlinear(sink.scene(), True)):
        answer = replace(answer, response=None)
        left_out["the traces"] = f"{why}, and a sensitivity is then one of the steady state alone"

    def study(key: str = "", step: float = 0.0) -> Study:
        other = neighbour(sink, key, step) if key else sink
        made = sink_run.study(other, symmetry.reduce(other.scene()))
        room = other.room_temperature
        return replace(made, traces=lambda out: {n: v - room * n.endswith("_K") for n, v in made.traces(out).items()})

    domain, places = answer.heat.domain, result.details["profile"]["points_m"] if profile else ()
    sampled = [sparse.csr_array(domain.mean(Probe("", tuple(x), tuple(x)))[None]) for x in places]
    rows = sparse.vstack(sampled) if profile else None
    known = {name: e for name, e in result.steady.items() if name in answer.fine.quantities and e.value}
    chosen = {key: partial(study, key) for key in numbers(sink) if keys is None or key in keys}
    found = sensitivities(study(), answer, known, chosen, rows)
    return replace(found, left_out=left_out | found.left_out)


def of_scene(scene: AnyScene, result: Result, keys: Iterable[str] | None = None) -> Sensitivities:
    """Differentiate a scene's result by its numbers other than zero, or by some ``keys``; raises as `of_sink` does."""
    chosen = list(numbers(scene) if keys is None else keys)
    steady, whole = result.traces is None, need_whole(scene, chosen)
    if not steady and "transient" not in result.details:
        return Sensitivities({}, {}, left_out=dict.fromkeys(chosen, AT_ONCE))
    unknowns = result.details["unknowns"] * 2 ** (whole * len(result.details["planes"]))
    # The first mesh of a file is its coarsest.
    refined = not isinstance(scene, MeshScene) or result.details["levels"] > 1
    large = scene.accuracy < ENOUGH and unknowns > LARGE and refined
    if large or (whole and result.details["planes"]):
        scene = replace(scene, accuracy=ENOUGH) if large else scene
        result = scene_run.solve(scene, whole=whole)
    whole = not result.details["planes"]

    def study(key: str = "", step: float = 0.0) -> Study:
        other = neighbour(scene, key, step) if key else scene
        made = probe_quantities.study(other, scene_run.part_of(other, whole))
        floor = floor_of(scene, other) if steady else other.initial_temperature

        def rises(out: Outputs) -> Quantities:
            return {n: v - floor * (n in thermal) for n, v in made.steady(out).items()}

        return replace(made, steady=rises, traces=rises)

    thermal = [p.name for p in scene.probes if p.quantity == "temperature"]
    floor = floor_of(scene, scene)
    at_rest = result.steady if steady else {}
    estimates = {n: Estimate(e.value - floor * (n in thermal), e.error) for n, e in at_rest.items()}
    known, left_out = _known(estimates)
    beside = {key: partial(study, key) for key in chosen}
    found = sensitivities(study(), result.details["answer"], known, beside)
    if found.course is not None:
        return _of_largest(found, found.course, result.over_time.errors)
    return replace(found, left_out=left_out | found.left_out)


def need_whole(scene: AnyScene, keys: Iterable[str]) -> bool:
    """Whether one of the ``keys`` of a scene changes one side of a mirror plane alone."""
    part = scene_run.part_of(scene, False)
    for key in keys if part.planes else ():
        with suppress(SceneError):  # it has no slope
            if not same_planes(part, scene_run.part_of(neighbour(scene, key, STEP), False)):
                return True
    return False


def _of_largest(found: Sensitivities, course: Course, known: Mapping[str, float]) -> Sensitivities:
    """Differentiate the largest size of each trace; the ``known`` errors of traces count too."""
    at = {n: int(np.abs(v).argmax()) for n, v in course.traces.items()}
    values, left_out = _known({n: Estimate(float(v[at[n]]), known[n]) for n, v in course.traces.items()})
    table = Table()
    for key, by_name in course.values.items():
        table[key] = {}
        for n, value in values.items():
            error = course.errors[key][n].max() / abs(value.value)
            error += value.error / value.value**2 * np.abs(by_name[n]).max()
            table[key][n] = Estimate(float(by_name[n][at[n]]) / value.value, float(error))
    return replace(found, steady=table, values=values, left_out=left_out | found.left_out)


def _known(estimates: Mapping[str, Estimate]) -> tuple[dict[str, Estimate], dict[str, str]]:
    """Return the quantities that are not zero within their errors, and the reason why others have no slope."""
    known = {n: e for n, e in estimates.items() if abs(e.value) > e.error}
    return known, {f"probe {quoted(n)}": ZERO for n in estimates if n not in known}


def floor_of(scene: AnyScene, other: AnyScene) -> float:
    """Return the reference (K) of rises: the mean, in the other scene, of this scene's coldest given temperatures."""
    key = {"temperature": "value", "convection": "ambient"}
    both: Iterable[tuple[Any, Any]] = zip(scene.boundaries, other.boundaries, strict=True)
    pairs = [(getattr(a, key[a.kind]), getattr(b, key[a.kind])) for a, b in both if a.kind in key]
    if not pairs:
        return other.initial_temperature
    lowest = min(min(values(a)) for a, _ in pairs)
    return float(np.mean([min(values(b)) for a, b in pairs if min(values(a)) <= lowest * (1 + ROUNDING)]))
