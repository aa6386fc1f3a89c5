"""Compact models of a rich problem's first states, held against runs of the full model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from fem3d.adaptivity.goal_parts import goal_row
from fem3d.compact.tensors import Structure, Tensors, tensors
from fem3d.runs.probe_quantities import EARLY, LATE, OF_FLOW
from fem3d.solution.reduced import Reduced
from scenes import physics
from scenes.model import UNITS as PROBE_UNITS
from scenes.model import AnyScene, Schedule, Value
from scenes.result import Result
from statespace.channels import OWN, UNITS, Channel, channels
from statespace.facts import EQUATIONS
from statespace.runtime import CompactModel

INSTANTS = 60  # number of instants of each run at which a model is compared
# Places of an extreme at most, and by what fraction of a run's scale a place may miss the extreme.
MOST_PLACES, NEAR = 12, 1e-4


@dataclass(frozen=True, eq=False)
class Truth:
    """A run of the full model: the inputs that drive it, and its result over time and in the steady state (None where
    that isn't of the model, or isn't there)."""

    inputs: dict[str, Value]
    over_time: Result | None
    steady: Result | None

    @property
    def scales(self) -> dict[str, float]:
        """What errors of each probe are relative to."""
        known = self.steady or self.over_time
        assert known is not None
        scales: dict[str, float] = known.details["scales"]
        return scales


def rise_of(scene: AnyScene, truth: Truth) -> float:
    """The largest rise (K) of any probe in a run."""
    start = scene.initial_temperature
    thermal = [p.name for p in scene.probes if p.quantity == "temperature"]
    if truth.over_time is not None and truth.over_time.traces is not None:
        values = [truth.over_time.traces.values[n] for n in thermal]
    else:
        assert truth.steady is not None
        values = [np.array([truth.steady.steady[n].value]) for n in thermal]
    return max((float(np.abs(v - start).max()) for v in values), default=0.0)


def first_time(scene: AnyScene) -> float:
    """The time (s) from which on traces hold their accuracy."""
    instants = [t for t in scene.output_times if 0 < t <= scene.end_time]
    return min(*instants, LATE * scene.end_time) if instants else EARLY * scene.end_time


def instants(scene: AnyScene, times: np.ndarray, inputs: Mapping[str, Value] | None = None) -> np.ndarray:
    """Which times of a run under some inputs, by default the scene's own, are compared: some of those from the first on
    that its accuracy holds from, also after a jump."""
    first = first_time(scene)
    drives = {c.name: c.value for c in channels(scene)} if inputs is None else inputs
    given = [v for v in drives.values() if isinstance(v, Schedule)]
    jumps = [t for v in given for t, then in pairwise(v.times) if t == then and t > 0]
    waits = [(times >= jump) & (times < jump + first * (1 - 1e-12)) for jump in jumps]
    late = np.flatnonzero((times >= first * (1 - 1e-12)) & ~np.any([np.zeros(len(times), bool), *waits], axis=0))
    return late[np.unique(np.linspace(0, len(late) - 1, INSTANTS).astype(int))]


class Judge:
    """Models of a rich problem's first states, held against runs of the full model."""

    def __init__(
        self,
        scene: AnyScene,
        inputs: tuple[Channel, ...],
        truths: dict[str, Truth],
        structure: Structure,
        rich: Reduced,
    ) -> None:
        self.scene, self.channels, self.truths, self.structure, self.rich = scene, inputs, truths, structure, rich
        self._errors: dict[int, dict[str, Any]] = {}

    def model(self, count: int) -> tuple[CompactModel, Tensors]:
        """That of some states."""
        made = tensors(self.structure, self.rich.changed(np.eye(self.rich.states, count)))
        return CompactModel(self._described(made, {})), made

    def _described(
        self, made: Tensors, errors: dict[str, Any], estimated: dict[str, Any] | None = None
    ) -> dict[str, Any]:
        units = {p.name: PROBE_UNITS[p.quantity] for p in self.scene.probes}
        hottest = [m.valid_to for m in physics.materials(self.scene) if m.valid_to is not None]
        return {
            "schema": 1,
            "equations": EQUATIONS,
            "scene": self.scene.name,
            "steady_only": self.scene.steady,
            "initial_temperature_K": self.scene.initial_temperature,
            "states": made.basis.shape[1],
            "inputs": [
                {"name": c.name, "unit": UNITS[c.kind], "kind": c.kind, "of": c.item, "rest": c.rest, "step": c.step,
                 "range": list(c.range), "value": _plain(c.value), "port": port._asdict()}
                for c, port in zip(self.channels, made.ports, strict=True)
            ],
            "outputs": [
                {"name": name, "unit": units[name], "rows": rows, "reduce": how}
                for name, (rows, how) in made.outputs.items()
            ],
            "range": {
                "from_s": None if self.scene.steady else first_time(self.scene),
                "to_s": None if self.scene.steady else self.scene.end_time,
                "highest_temperature_K": min(hottest, default=None),
            },
            "error": errors,
            "estimated": estimated or {},
            "matrices": {
                name: {"shape": list(matrix.shape), "values": matrix.ravel().tolist()}
                for name, matrix in made.matrices.items()
            },
        }  # fmt: skip

    def errors(self, count: int) -> dict[str, Any]:
        """By run and quantity, the errors of a model of some states: the distance from the full model's run, with the
        error of that."""
        if count not in self._errors:
            model = self.model(count)[0]
            self._errors[count] = {name: self._apart(model, truth) for name, truth in self.truths.items()}
        return self._errors[count]

    def _apart(self, model: CompactModel, truth: Truth) -> dict[str, Any]:
        errors: dict[str, Any] = {}
        inputs = {name: _table(value) for name, value in truth.inputs.items()}
        # Where all is of one temperature no heat flows, and its error is relative to what such a rise makes otherwise.
        reference = self.truths[OWN]
        size = rise_of(self.scene, reference)
        rise = OF_FLOW * rise_of(self.scene, truth) / size if size else 0.0
        flows = [p.name for p in self.scene.probes if p.quantity == "heat_flow"]
        least = {name: rise * reference.scales[name] for name in flows}
        if truth.steady is not None:
            ours, scales = model.steady(inputs), truth.steady.details["scales"]
            errors["steady"] = {
                name: _both(abs(ours[name] - is_.value) + is_.error, max(scales[name], least.get(name, 0.0)))
                for name, is_ in truth.steady.steady.items()
            }
        if truth.over_time is not None and truth.over_time.traces is not None:
            traces, scales = truth.over_time.traces, truth.over_time.details["scales"]
            at = instants(self.scene, traces.time, truth.inputs)
            over = model.simulate(traces.time[at], inputs)
            errors["over time"] = {
                name: _both(
                    float(np.abs(over[name] - traces.values[name][at]).max()) + traces.errors[name],
                    max(scales[name], least.get(name, 0.0)),
                )
                for name in over
            }
        return errors

    def worst(self, count: int) -> float:
        """The largest relative error."""
        return max(e["relative"] for run in self.errors(count).values() for kind in run.values() for e in kind.values())

    def places(self) -> dict[str, np.ndarray]:
        """For each probe of an extreme the rows of where it is in the runs."""
        heat, found_in = self.structure.heat, self._rises()
        rises, places = np.array([rise for _, rise in found_in]), {}
        for probe in heat.domain.scene.probes:
            if probe.name in self.structure.places:
                rows = np.array([goal_row(heat, probe, u) for u in rises])
                near = np.array([NEAR * truth.scales[probe.name] for truth, _ in found_in])
                places[probe.name] = needed(rows @ rises.T * (1 if probe.reduce == "max" else -1), rows, near)
        return places

    def _rises(self) -> list[tuple[Truth, np.ndarray]]:
        """Rises (all nodes,) in each run, over time and in the steady state."""
        model, made = self.model(self.rich.states)
        rises = []
        for truth in self.truths.values():
            inputs = {name: _table(value) for name, value in truth.inputs.items()}
            states = []
            if truth.steady is not None:
                g = model.inputs_at(inputs, np.inf)
                states.append((g, model.rest(g)))
            if not self.scene.steady:
                times = np.geomspace(first_time(self.scene), self.scene.end_time, 6)
                drives = [model.inputs_at(inputs, t) for t in times.tolist()]
                states += zip(drives, model.march(times, inputs), strict=True)
            rises += [(truth, made.rise(self.structure.heat, g, b)) for g, b in states]
        return rises

    def document(self, count: int) -> dict[str, Any]:
        """The model of some states with its errors, and how they were found."""
        model, made = self.model(count)
        residual, rich = self._residual(model, made), self.worst(self.rich.states)
        text = [
            "Estimated: the distance from runs of the full 3D model for each of these inputs, on meshes of their own, "
            "with their errors.",
            f"With {self.rich.states} states it is {rich:.1e} at most; what the {count} states leave of the full "
            f"equations, solved for, is {residual:.1e} of the rise at most.",
        ]
        estimated = {"runs": len(self.truths), "more_states": self.rich.states, "with_more_states": rich,
                     "residual": residual, "text": text}  # fmt: skip
        return self._described(made, self.errors(count), estimated)

    def _residual(self, model: CompactModel, made: Tensors) -> float:
        """What the full equations of heat and current still want of the states at the end of each run, or in their
        steady state, over the rise, in the norm of the stored heat."""
        base, end = self.structure.base, self.scene.end_time
        heat, n, worst = base.heat, base.heat.free, 0.0
        for truth in self.truths.values():
            inputs = {name: _table(value) for name, value in truth.inputs.items()}
            g = model.inputs_at(inputs, np.inf if self.scene.steady else end)
            b = model.rest(g) if self.scene.steady else model.march([end], inputs)[0]
            rise = made.rise(heat, g, b)
            z = np.concatenate([[1.0], g])
            residual = (z @ heat.loads - heat.stiffness @ rise)[:n]
            if base.conductor is not None:
                electric = base.conductor.solve(rise, z @ base.conductor.voltages)
                residual += base.conductor.joule_load(electric.density, rise)[:n]
            if not self.scene.steady:
                residual -= heat.inner_mass @ (made.basis @ model.rates(g, b))
                missing = end * heat.solve_shifted(end)(residual)
            else:
                missing = heat.solve_steady(residual)
            size = float(np.sqrt(rise @ (heat.mass @ rise)))
            worst = max(worst, heat.norm(missing) / size) if size > 0 else worst
        return worst


def needed(values: np.ndarray, rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Those of some rows (places, nodes) whose largest value is that of all, of ``values`` (places, fields), or less by
    no more than ``near`` (fields,)."""
    tops = values.max(axis=0)
    kept: list[int] = []
    while len(kept) < MOST_PLACES:
        short = (tops - values[kept].max(axis=0) if kept else np.abs(tops)) / near
        worst = int(short.argmax())
        if kept and short[worst] <= 1:
            break
        kept.append(int(values[:, worst].argmax()))
    return rows[kept]


def _both(error: float, scale: float) -> dict[str, float]:
    return {"error": error, "relative": error / scale}


def _plain(value: Value) -> Any:
    if isinstance(value, Schedule):
        return {"times": list(value.times), "values": list(value.values)}
    return value


def _table(value: Value) -> Any:
    return (value.times, value.values) if isinstance(value, Schedule) else value
