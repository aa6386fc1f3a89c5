"""A scene's compact model: as few states as an accuracy takes, its error known from runs of the full model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fem3d import solve_mesh, solve_scene, start, transient
from fem3d.compact import fields
from fem3d.compact.channels import UNITS, Channel, channels, scenarios
from fem3d.compact.mesh import problem
from fem3d.compact.tensors import Structure, Tensors, tensors
from fem3d.errors import NumericsError
from fem3d.level import goal_row
from fem3d.probes import reading
from fem3d.reduced import Reduced
from fem3d.transient import Base
from scenes import physics
from scenes.compact.runtime import CompactModel
from scenes.errors import SceneError, quoted
from scenes.model import UNITS as PROBE_UNITS
from scenes.model import AnyScene, MeshScene, Schedule, Value
from scenes.result import Result

TRUTH, MESH, SPACE = 0.5, 0.5, 0.02  # parts of the accuracy: of the runs it is held against, the mesh, the fields
FINER, TURNS = 0.3, 3  # by how much the mesh is made for less where it isn't fine enough, and how often
INSTANTS = 60  # of each run that is compared
LONG = 20.0  # times the slowest response: when a steady state is reached
MOST_PLACES, NEAR = 12, 1e-4  # of an extreme, and of its rise that others may miss
EQUATIONS = [
    "z = (1, inputs g, states b), b = 0 at t = 0; (A z) c = S z for the current fields c",
    "db/dt = F z + sum over pairs i <= j of c_i c_j Q_ij z (twice for i < j); 0 where steady_only",
    "rows = Y z + W dg/dt + sum_i c_i U_i z + sum over pairs of c_i c_j P_ij z; an output is the max, min or mean",
]


@dataclass(frozen=True, eq=False)
class Truth:
    """A run of the full model: the inputs that drive it, and its result over time and in the steady state (None where
    that isn't of the model, or isn't there)."""

    inputs: dict[str, Value]
    over_time: Result | None
    steady: Result | None


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """The document of a scene's model (`scenes.compact.runtime`), of a given number of states or as many as an accuracy
    takes, relative as the scene's own.

    Raises SceneError for a scene that has none, NumericsError where the accuracy isn't reached.
    """
    check(scene)
    found = channels(scene)
    truths = {name: _truth(other, found, accuracy, say) for name, other in scenarios(scene, found).items()}
    reached = np.inf
    for turn in range(TURNS):
        say(f"compact model: mesh {turn + 1}")
        heat, conductor, part = problem(scene, found, MESH * FINER**turn * accuracy, _rise(scene, truths))
        structure, rich = _rich(scene, found, heat, conductor, part, accuracy)
        judge = _Judge(scene, found, truths, structure, rich)
        structure = replace(structure, places=judge.places())
        judge = _Judge(scene, found, truths, structure, rich)
        reached = judge.worst(rich.states)
        if reached <= accuracy or isinstance(scene, MeshScene):
            break
    if states is None and reached > accuracy:
        raise NumericsError(
            f"no model of few states is known to be within {accuracy:g} of the full one, only within {reached:.2g}: "
            "give a larger --model-accuracy"
        )
    say("compact model: states")
    count = judge.fewest(accuracy) if states is None else min(states, rich.states)
    return judge.document(count)


def check(scene: AnyScene) -> None:
    """SceneError for a scene that has no compact model."""
    if not scene.probes:
        raise SceneError("--export writes a model of the scene's probes, and it has none: add a [[probe]]")
    for probe in scene.probes:
        if probe.quantity == "potential" and probe.reduce != "mean":
            raise SceneError(
                f"probe {quoted(probe.name)}.reduce asks for an extreme potential, which a model of few states doesn't "
                'have: give reduce = "mean", or a point'
            )
    if not physics.heat(scene):
        raise SceneError(
            "--export writes a model of heat, and nothing thermal is asked for: add a probe of a temperature and what "
            "it needs, or leave out --export"
        )


def _solve(scene: AnyScene) -> Result:
    model: Any = solve_mesh if isinstance(scene, MeshScene) else solve_scene
    result: Result = model.solve(scene)
    return result


def _truth(scene: AnyScene, found: tuple[Channel, ...], accuracy: float, say: Callable[[str], None]) -> Truth:
    say("compact model: a run of the full model")
    there = replace(scene, accuracy=max(TRUTH * accuracy, 1e-6))
    inputs = {c.name: c.own for c in channels_of(there, found)}
    if scene.steady:
        return Truth(inputs, None, _solve(there))
    settled = replace(there, steady=True, output_times=())
    steady = None
    if not any(isinstance(v, Schedule) for v in inputs.values()):
        try:
            steady = _solve(settled)
        except (NumericsError, SceneError):
            steady = None  # there may be none, and over time there is no need for one
    return Truth(inputs, _solve(there), steady)


def channels_of(scene: AnyScene, found: tuple[Channel, ...]) -> tuple[Channel, ...]:
    """The channels with what another scene of the same structure gives them; a source that is off has none of its
    own."""
    own = {c.name: c for c in channels(scene)}
    return tuple(own.get(c.name, replace(c, own=0.0)) for c in found)


def _rise(scene: AnyScene, truths: dict[str, Truth]) -> float:
    """The largest rise (K) of any probe in the scene itself."""
    start = scene.initial_temperature
    of = truths["the scene"]
    thermal = [p.name for p in scene.probes if p.quantity == "temperature"]
    if of.over_time is not None and of.over_time.traces is not None:
        values = [of.over_time.traces.values[n] for n in thermal]
    else:
        assert of.steady is not None
        values = [np.array([of.steady.steady[n].value]) for n in thermal]
    return max((float(np.abs(v - start).max()) for v in values), default=0.0)


def _rich(
    scene: AnyScene, found: tuple[Channel, ...], heat: Any, conductor: Any, part: Any, accuracy: float
) -> tuple[Structure, Reduced]:
    """What a model is made of, and its problem in more fields than are needed, those first that matter most."""
    slow = fields.slowest(heat)
    end = LONG * slow if scene.steady else scene.end_time
    earliest = slow if scene.steady else first_time(scene)
    base: Base = start.of(heat, conductor, transient.shift(min(slow, end), earliest), end, accuracy)
    steps = np.array([1.0, *(c.step for c in found)])
    loads, jumps = [*fields.loads_of(base, steps), *base.loads], fields.jumps_of(heat, steps)
    times = None if scene.steady else (earliest, min(slow, end))
    reduced = base.project(fields.rational(heat, [*loads, *jumps], times, SPACE * accuracy))
    structure = Structure(base, part, found, scene.steady, _guessed(heat, loads))
    made = tensors(structure, reduced)
    states = _responses(reduced, loads, jumps, times)
    rows = made.matrices["Y"][:, len(steps) :] @ np.linalg.pinv(made.basis) @ reduced.basis
    return structure, reduced.changed(fields.leading(states, rows))


def first_time(scene: AnyScene) -> float:
    """The time (s) from which on traces hold their accuracy."""
    from fem3d.probe_quantities import EARLY, LATE

    instants = [t for t in scene.output_times if 0 < t <= scene.end_time]
    return min(*instants, LATE * scene.end_time) if instants else EARLY * scene.end_time


def _responses(
    reduced: Reduced, loads: list[np.ndarray], jumps: list[np.ndarray], times: tuple[float, float] | None
) -> np.ndarray:
    """(states, any): the reduced responses to loads, at rest and over time, and to jumps."""
    n = len(reduced.basis)
    rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
    rates = np.maximum(rates, 1e-12 * rates[-1])

    def inner(of: list[np.ndarray]) -> np.ndarray:
        kept = np.column_stack([v[:n] for v in of]) if of else np.empty((n, 0))
        found: np.ndarray = modes.T @ (reduced.basis.T @ kept)
        return found

    heating, decaying = inner(loads), inner(jumps)
    found = [heating / rates[:, None]]
    for g in [] if times is None else np.geomspace(times[0] / fields.SOONER, max(times), 12):
        found += [g * heating / (1 + g * rates)[:, None], decaying / (1 + g * rates)[:, None]]
    return np.asarray(modes @ np.column_stack(found))


def _guessed(heat: Any, loads: list[np.ndarray]) -> dict[str, np.ndarray]:
    """For each probe of an extreme where it is in the steady response to each load."""
    rises = [heat.whole(heat.solve_steady(load[: heat.free])) for load in loads] + list(heat.lifts[1:])
    found = {}
    for probe in heat.domain.scene.probes:
        if probe.quantity == "temperature" and reading(heat, probe).extreme is not None:
            found[probe.name] = np.array([goal_row(heat, probe, u) for u in rises if u.any()][:MOST_PLACES])
    return found


class _Judge:
    """Models of a rich problem's first states, held against runs of the full model."""

    def __init__(
        self, scene: AnyScene, found: tuple[Channel, ...], truths: dict[str, Truth], structure: Structure, rich: Reduced
    ) -> None:
        self.scene, self.channels, self.truths, self.structure, self.rich = scene, found, truths, structure, rich
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
                 "range": list(c.range), "value": _plain(c.own), "port": port._asdict()}
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
        found: dict[str, Any] = {}
        inputs = {name: _table(value) for name, value in truth.inputs.items()}
        if truth.steady is not None:
            ours, scales = model.steady(inputs), truth.steady.details["scales"]
            found["steady"] = {
                name: _both(abs(ours[name] - is_.value) + is_.error, scales[name])
                for name, is_ in truth.steady.steady.items()
            }
        if truth.over_time is not None and truth.over_time.traces is not None:
            traces, scales = truth.over_time.traces, truth.over_time.details["scales"]
            at = self._instants(traces.time)
            over = model.simulate(traces.time[at], inputs)
            found["over time"] = {
                name: _both(
                    float(np.abs(over[name] - traces.values[name][at]).max()) + traces.errors[name], scales[name]
                )
                for name in over
            }
        return found

    def _instants(self, times: np.ndarray) -> np.ndarray:
        late = np.flatnonzero(times >= first_time(self.scene) * (1 - 1e-12))
        return late[np.unique(np.linspace(0, len(late) - 1, INSTANTS).astype(int))]

    def worst(self, count: int) -> float:
        """The largest relative error."""
        return max(e["relative"] for run in self.errors(count).values() for kind in run.values() for e in kind.values())

    def fewest(self, accuracy: float) -> int:
        """The smallest number of states that is found to hold an accuracy."""
        low, high = 0, 1
        while high < self.rich.states and self._exceeds(high, accuracy):
            low, high = high, min(2 * high, self.rich.states)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if self._exceeds(middle, accuracy) else (low, middle)
        return high

    def _exceeds(self, count: int, accuracy: float) -> bool:
        try:
            return self.worst(count) > accuracy
        except (ArithmeticError, np.linalg.LinAlgError):
            return True

    def places(self) -> dict[str, np.ndarray]:
        """For each probe of an extreme the rows of where it is in the runs."""
        if not self.structure.places:
            return {}
        heat, rises = self.structure.heat, self._rises()
        found = {}
        for probe in heat.domain.scene.probes:
            if probe.name in self.structure.places:
                rows = np.array([goal_row(heat, probe, u) for u in rises])
                found[probe.name] = needed(rows @ np.array(rises).T * (1 if probe.reduce == "max" else -1), rows)
        return found

    def _rises(self) -> list[np.ndarray]:
        model, made = self.model(self.rich.states)
        rises = []
        for truth in self.truths.values():
            inputs = {name: _table(value) for name, value in truth.inputs.items()}
            if self.scene.steady:
                g = model.inputs_at(inputs, np.inf)
                rises.append(made.rise(self.structure.heat, g, model.rest(g)))
            else:
                times = np.geomspace(first_time(self.scene), self.scene.end_time, 6)
                for t, b in zip(times.tolist(), model.march(times, inputs), strict=True):
                    rises.append(made.rise(self.structure.heat, model.inputs_at(inputs, t), b))
        return rises

    def document(self, count: int) -> dict[str, Any]:
        """The model of some states with its errors, and how they were found."""
        model, made = self.model(count)
        left, rich = self._residual(model, made), self.worst(self.rich.states)
        text = [
            "Estimated: the distance from runs of the full 3D model for each of these inputs, on meshes of their own, "
            "with their errors.",
            f"With {self.rich.states} states it is {rich:.1e} at most; what the {count} states leave of the full "
            f"equations, solved for, is {left:.1e} of the rise at most.",
        ]
        estimated = {"runs": len(self.truths), "more_states": self.rich.states, "with_more_states": rich,
                     "residual": left, "text": text}  # fmt: skip
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
            left = (z @ heat.loads - heat.stiffness @ rise)[:n]
            if base.conductor is not None:
                found = base.conductor.solve(rise, z @ base.conductor.voltages)
                left += base.conductor.joule_load(found.density, rise)[:n]
            if not self.scene.steady:
                left -= heat.inner_mass @ (made.basis @ model.rates(g, b))
                missing = end * heat.solve_shifted(end)(left)
            else:
                missing = heat.solve_steady(left)
            size = float(np.sqrt(rise @ (heat.mass @ rise)))
            worst = max(worst, heat.norm(missing) / size) if size > 0 else worst
        return worst


def needed(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Those of some rows (places, nodes) whose largest value is that of all, of ``values`` (places, fields)."""
    tops, size = values.max(axis=0), float(np.abs(values).max()) or 1.0
    kept: list[int] = []
    while len(kept) < MOST_PLACES:
        short = tops - (values[kept].max(axis=0) if kept else -np.inf)
        worst = int(short.argmax()) if kept else int(np.abs(tops).argmax())
        if kept and short[worst] <= NEAR * size:
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
