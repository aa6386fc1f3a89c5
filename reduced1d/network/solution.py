"""A scene's network solved: every probe in the steady state and over time, with the error that its elements and steps
make.

Everything is solved twice, on elements of two degrees (and over time on steps of two sizes); the
distance is the error bound of the finer one. Elements are refined until it is far below the scene's accuracy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from reduced1d.network.flows import Flows
from reduced1d.network.lines import Layout, layout
from reduced1d.network.model import Model, build, remarks, scales
from reduced1d.network.readings import Reader
from reduced1d.network.steady import State, steady
from reduced1d.network.transient import History, history
from scenes import readouts
from scenes.errors import NumericsError
from scenes.model import AnyScene, Scene, Schedule
from scenes.result import Estimate, Result, Traces

BELOW = 1e-2
"""The part of the scene's accuracy that the network's own error may be, so that it hardly counts beside that of 3D."""

FINEST, FINEST_OVER_TIME = 1e-8, 1e-6
"""Relative: errors below these need no refinement however small an accuracy is asked for; rounding is near them."""

DEGREES, DEGREES_OVER_TIME = ((5, 7), (7, 9), (9, 11)), ((4, 5), (6, 7), (8, 9))
"""Of the coarse and the fine elements, turn by turn."""

GROWTHS = ((6.0, 4.0), (2.5, 2.0), (1.5, 1.3))
"""By what factor a step ends later than it begins, in the coarse and in the fine run over time, turn by turn: each turn
has an error some hundred times smaller (13th order), and the first serves accuracies of a per cent. The hot plate's
traces are then 5e-5, 6e-6; 4e-7, 2e-7 and below 1e-8 off, of which the elements make the last three."""

SETTLED = 1e-3
"""Of the error that is enough: how far a step's rises may still be from those that its Joule heat belongs to."""

EARLY = 1e-3
"""For this part of the end time, after the start and after a jump, errors of traces are not judged; 3D has the same."""

SOONEST = 0.1
"""Of the time from which on errors are judged: the first step, and what elements follow."""


def solve(scene: AnyScene, times: np.ndarray | Sequence[float] | None = None, steady_too: bool = True) -> Result:
    """The probes of a scene of boxes by the network of its lines, each with an estimated error of its discretization.

    In the steady state, at the last values of varying inputs; with ``times`` (s, ascending, not negative) over
    time too, from the scene's initial temperature, or, without ``steady_too``, over time alone. Steady keys and trace
    names are the probes' names, temperatures in K, potentials in V, flows in W, currents in A. A scene over time that
    has no steady state has none in its result.

    Raises SceneError for a scene on a mesh file or one that lines cannot have, scenes.errors.RunawayError where the
    heating runs away, NumericsError where the numerics fail.
    """
    return of_layout(layout(scene), times, steady_too)


def of_layout(shape: Layout, times: np.ndarray | Sequence[float] | None = None, steady_too: bool = True) -> Result:
    """The same of a scene's layout."""
    estimates: dict[str, Estimate] = {}
    over_time = None
    details: dict[str, Any] = {"warnings": []}
    try:
        if times is None or steady_too:
            estimates, model, state = _steady(shape)
            details |= {"model": model, "state": state, **remarks(model)}
    except NumericsError as error:
        if times is None:
            raise
        details["no_steady_state"] = str(error)
    if times is not None:
        over_time, model, steps = _over_time(shape, np.asarray(times, float))
        details = {"model": model, **remarks(model), **details, "steps": steps}
    return Result("network", estimates, over_time, details)


def refined(shape: Layout, turn: int, time: float | None = None) -> tuple[Model, Model]:
    """The coarse and the fine model of a layout, at a turn of the refinement, for changes within a ``time`` (s)."""
    sizes = [size / 2**turn for size in scales(shape, time)]
    coarse, fine = (build(shape, degree, sizes) for degree in (DEGREES_OVER_TIME if time else DEGREES)[turn])
    return coarse, fine


def _steady(shape: Layout) -> tuple[dict[str, Estimate], Model, State]:
    scene, enough = shape.scene, max(BELOW * shape.scene.accuracy, FINEST)
    for turn in range(len(DEGREES)):
        each = []
        for model in refined(shape, turn):
            x = model.inputs.at(np.inf)
            state = steady(model, x, spread(x[np.array(model.inputs.electric, bool)]))
            columns = (v[:, None] for v in (state.rise, state.potential, state.x))
            each.append((Readings(model).values(*columns), model, state))
        (coarse, _, _), (fine, model, state) = each
        errors = {name: float(np.abs(fine[name] - coarse[name]).max()) for name in fine}
        sizes = measures(model, fine)
        if all(errors[name] <= enough * sizes[name] for name in fine):
            break
    start = scene.initial_temperature
    kelvin = {p.name for p in scene.probes if p.quantity == "temperature"}
    estimates = {n: Estimate(float(v[0]) + (start if n in kelvin else 0.0), errors[n]) for n, v in fine.items()}
    return _finite(estimates), model, state


def _over_time(shape: Layout, times: np.ndarray) -> tuple[Traces, Model, int]:
    scene, enough = shape.scene, _enough(shape.scene)
    end = max(float(times[-1]) if len(times) else 0.0, 0.0 if scene.steady else scene.end_time)
    for turn in range(len(DEGREES)):
        coarse, fine = histories(shape, end, turn)
        # At a few instants both runs may agree by chance: they are compared in the middles of all steps, too.
        instants = np.union1d(times, (np.array(fine.marks[1:]) + fine.marks[:-1]) / 2)
        judged = _judged(shape, instants, end)
        one, other = (Readings(run.model).values(*run.at(instants), instants) for run in (coarse, fine))
        errors = {n: float(np.abs(other[n] - one[n])[judged].max(initial=0.0)) for n in other}
        sizes = measures(fine.model, other)
        if all(errors[name] <= enough * sizes[name] for name in other):
            break
    kelvin = {p.name: scene.initial_temperature for p in scene.probes if p.quantity == "temperature"}
    traces = {n: v[np.searchsorted(instants, times)] + kelvin.get(n, 0.0) for n, v in other.items()}
    if not all(np.isfinite(v).all() for v in traces.values()):
        raise NumericsError("the network's traces are not finite")
    return Traces(times, traces, errors), fine.model, len(fine.steps)


@lru_cache(maxsize=6)
def histories(shape: Layout, end: float, turn: int) -> tuple[History, History]:
    """The coarse and the fine run over time. Cached, for a comparison reads the same run at more times."""
    times = [t for t in shape.scene.output_times if t > 0]
    soonest = SOONEST * min(EARLY * end, *times, end)
    coarse, fine = (
        history(model, end, soonest, growth, SETTLED * _enough(shape.scene))
        for model, growth in zip(refined(shape, turn, soonest), GROWTHS[turn], strict=True)
    )
    return coarse, fine


def _enough(scene: Scene) -> float:
    """The relative error of traces that needs no refinement."""
    return max(BELOW * scene.accuracy, FINEST_OVER_TIME)


def _judged(shape: Layout, times: np.ndarray, end: float) -> np.ndarray:
    """(times,): which are not right after the start or a jump."""
    drives = [v for b in shape.scene.boundaries for v in (b.value, b.ambient)]
    schedules = [v for v in (*drives, *(b.heat_source for b in shape.scene.boxes)) if isinstance(v, Schedule)]
    jumps = [0.0, *(t for s in schedules for t, after in pairwise(s.times) if t == after)]
    early = np.zeros(len(times), bool)
    for jump in jumps:
        early |= (times >= jump) & (times < jump + EARLY * end)
    return ~early if not early.all() else np.ones(len(times), bool)


def _finite(estimates: dict[str, Estimate]) -> dict[str, Estimate]:
    for name, estimate in estimates.items():
        if not np.isfinite(estimate.value):
            raise NumericsError(f"the network's value of probe {name!r} is not finite")
    return estimates


@dataclass(frozen=True, eq=False)
class Readings:
    """All that is read off a model."""

    model: Model

    def values(
        self, rises: np.ndarray, potentials: np.ndarray, x: np.ndarray, times: np.ndarray | None = None
    ) -> dict[str, np.ndarray]:
        """(times,) of each probe: rises, potentials, flows, currents, powers and resistances."""
        model, values = self.model, dict[str, np.ndarray]()
        for electric, u in ((False, rises), (True, potentials)):
            kinds = ("potential", "current") if electric else ("temperature", "heat_flow")
            probes = tuple(p for p in model.layout.scene.probes if p.quantity in kinds)
            circuit = model.current if electric else model.heat
            if not probes:
                continue
            if circuit is None:
                values |= {p.name: np.zeros(u.shape[1]) for p in probes}
                continue
            reader = Reader(model, electric)
            passing = tuple(p for p in probes if p.quantity == kinds[1])
            flows = Flows(model, electric, passing)
            each = flows.at(rises, u, x) if passing else None
            for p in probes:
                if each is not None and p.quantity == kinds[1]:
                    row, given = flows.through(p)
                    values[p.name] = row @ each + given @ x
                else:
                    values[p.name] = reader.reading(p).value(u, x)
        values |= self._derived(rises, potentials, x, np.zeros(1) if times is None else times)
        return {p.name: values[p.name] for p in model.layout.scene.probes}

    def _derived(
        self, rises: np.ndarray, potentials: np.ndarray, x: np.ndarray, times: np.ndarray
    ) -> dict[str, np.ndarray]:
        """(times,) of each probe of a power or a resistance."""
        model, values = self.model, dict[str, np.ndarray]()
        powers = [p for p in model.layout.scene.probes if p.quantity == "power"]
        if model.current is None or not (powers or model.layout.pairs):
            return {p.name: np.zeros(x.shape[1]) for p in powers}
        halves, resistance = model.resistances(rises)
        through = model.currents(resistance, potentials, x)
        heat, reader = through[model.current.branch] ** 2 * halves, Reader(model, True)
        values |= {p.name: reader.power(p, heat) for p in powers}
        flows = Flows(model, True, ())
        each = flows.at(rises, potentials, x)
        for name, electrode, other in model.layout.pairs:
            row, given = flows.entering(electrode)
            between = self._potential(electrode, potentials, x) - self._potential(other, potentials, x)
            values[name] = readouts.resistance(between, row @ each + given @ x, times)
        return values

    def _potential(self, boundary: int, potentials: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(times,) of an electrode."""
        terminal = self.model.elements.terminals.get(boundary)
        return np.asarray(x[boundary] if terminal is None else potentials[terminal])


def spread(values: np.ndarray) -> float:
    return float(np.ptp(values)) if len(values) else 0.0


def measures(model: Model, values: dict[str, np.ndarray]) -> dict[str, float]:
    """The scale of each probe's error: its own largest value (of a temperature its rise), but no less than a
    hundredth of the largest of its kind."""
    kinds = {p.name: p.quantity for p in model.layout.scene.probes}
    largest = {name: float(np.abs(v).max(initial=0.0)) for name, v in values.items()}
    of_kind = {kind: max(v for name, v in largest.items() if kinds[name] == kind) for kind in set(kinds.values())}
    return {name: max(v, 0.01 * of_kind[kinds[name]]) or 1.0 for name, v in largest.items()}
