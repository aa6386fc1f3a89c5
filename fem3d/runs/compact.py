"""Compact models of any scene: its 3D problem projected on as few fields as the accuracy requires.

Every boundary value, source and voltage is an input. The error is the distance from runs of the full model, for the
scene itself and for a step of each input alone, on meshes of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np

from fem3d.adaptivity import marched
from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.goal_errors import goal_row
from fem3d.problems.conductors import independent
from fem3d.problems.current import Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.results.outputs import Outputs
from fem3d.results.probes import reading
from fem3d.runs import probe_quantities, projection
from fem3d.runs import scene as scene_run
from fem3d.runs.probe_quantities import EARLY, LATE, OF_FLOW
from fem3d.runs.projection import Projection, Structure, project
from fem3d.solution import transient
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import NumericsError, SceneError, quoted
from scenes.model import DERIVED, AnyScene, MeshScene, Schedule, Value
from scenes.result import Result
from statespace.channels import OWN, Channel, apart, channels, driven, scenarios
from statespace.device_reduction import Reference, compare, leading, not_reached, reduce, worst
from statespace.document import scene_document
from statespace.runtime import CompactModel

FULL = "the full model"
TRUTH, SPACE = 0.5, 0.02
"""Parts of the accuracy: for the runs of the full model, and for the fields."""
LONGEST, ALWAYS = 7.0, 50.0
"""Time limit of a model: this multiple of the time of the 3D solution, or at least these seconds of processor time.
"""
MESH, FINER, TURNS = 3.0, 0.3, 4
"""Error of the first mesh over the accuracy, factor of the error for each further mesh, and number of meshes."""
INSTANTS = 60
"""Instants of each run at which a model is compared."""
# The step of each given temperature is this fraction of the previous step, with opposite sign: equal steps would
# cancel out.
LESS = 0.8
FARTHEST = 0.2  # a step of a temperature changes a resistivity by at most this fraction
MOST_PLACES, NEAR = 12, 1e-4
"""Places of an extreme at most, and the part of a run's scale by which a place may miss the extreme."""


@dataclass(frozen=True, eq=False)
class Run:
    """Runs of the full model for the same inputs: over time and in the steady state, None where not of the model."""

    inputs: dict[str, Value]
    over_time: Result | None
    steady: Result | None

    @property
    def tables(self) -> dict[str, Any]:
        """The inputs as `statespace.runtime` takes them."""
        return {n: (v.times, v.values) if isinstance(v, Schedule) else v for n, v in self.inputs.items()}

    @property
    def scales(self) -> dict[str, float]:
        """The scale of each probe's errors."""
        known = self.steady or self.over_time
        assert known is not None
        scales: dict[str, float] = known.details["scales"]
        return scales

    def rise(self, scene: AnyScene) -> float:
        """The largest rise (K) of any probe."""
        thermal = [p.name for p in scene.probes if p.quantity == "temperature"]
        if self.over_time is not None and self.over_time.traces is not None:
            values = [self.over_time.traces.values[n] for n in thermal]
        else:
            assert self.steady is not None
            values = [np.array([self.steady.steady[n].value]) for n in thermal]
        return max((float(np.abs(v - scene.initial_temperature).max()) for v in values), default=0.0)


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None,
    seconds: float | None = None, rough: Result | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Make the document of a scene's compact model.

    Parameters
    ----------
    scene : AnyScene
        A scene of boxes or on a mesh file.
    states : int or None
        Number of states; None for as many as the accuracy takes.
    accuracy : float
        Largest error, relative to the same scales as the scene's accuracy.
    say : callable
        Takes progress messages.
    seconds : float, optional
        Processor time of an earlier 3D solution; by default the time of the first run.
    rough : Result, optional
        The earlier 3D solution, whose mesh the first run over time begins with.

    Returns
    -------
    dict
        The document of `statespace.runtime.CompactModel`. It has "warnings" where the time or the memory ends before
        the accuracy is reached.

    Raises
    ------
    SceneError
        For a scene that has no compact model.
    NumericsError
        Where the scene has no solution.
    """
    check(scene)
    try:
        return _compact(scene, states, accuracy, say, seconds, rough)
    except NumericsError:
        raise
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise NumericsError(f"no model of few states is found: {error}; leave out --export") from None


def _compact(
    scene: AnyScene,
    states: int | None,
    accuracy: float,
    say: Callable[[str], None],
    seconds: float | None,
    rough: Result | None,
) -> dict[str, Any]:
    if not physics.heat(scene):
        # Currents alone follow the voltages at once: their steady state is all.
        largest = {c.name: c.largest for c in channels(scene)}
        scene = replace(driven(scene, largest), steady=True, output_times=())
    inputs, start = channels(scene), process_time()
    tried = scenarios(scene, inputs)
    own = _run(tried.pop(OWN), inputs, TRUTH * accuracy, say, rough)
    # A step of the only drive may be the scene itself.
    runs = {OWN: own} | {name: own for name, each in tried.items() if each == scene}
    tried = {name: each for name, each in tried.items() if name not in runs}
    first = process_time() - start
    limit = start + max(LONGEST * first if seconds is None else (LONGEST - 1) * seconds, ALWAYS)
    # Where the runs of all inputs would take more than two thirds of the time, later runs are less accurate.
    room = max((limit - start) * 2 / 3 - first, 0.1 * first)
    truth = TRUTH * max(1.0, len(tried) * first / room)
    because, last = "", 0.0
    while tried and process_time() + last < limit:
        begun, name = process_time(), next(iter(tried))
        runs[name] = _run(tried.pop(name), inputs, truth * accuracy, say)
        last = process_time() - begun
    references = {name: _references(scene, run, runs[OWN]) for name, run in runs.items()}
    uncertain = max(run.errors[n] / run.scales[n] for each in references.values() for run in each for n in run.errors)
    for turn in range(TURNS):
        begun = process_time()
        say(f"compact model: mesh {turn + 1}")
        try:
            heat, conductor, part = _problem(
                scene, inputs, MESH * FINER**turn * accuracy, runs[OWN].rise(scene), runs[OWN].scales
            )
        except NumericsError as error:
            if not turn:
                raise
            because = f" ({error})"
            break
        structure, rich = _rich(scene, inputs, heat, conductor, part, accuracy)
        if structure.places:
            structure = replace(structure, places=_places(scene, structure, rich, runs))
        document = partial(_document, scene, structure, rich)
        reached = worst(compare(CompactModel(document(rich.states)), references))
        # No mesh brings a model closer to the full one than its runs are.
        if reached <= max(accuracy, uncertain / TRUTH) or isinstance(scene, MeshScene):
            break
        if process_time() + (process_time() - begun) / FINER > limit:
            truth = np.inf
            break
    say("compact model: states")
    made = reduce(document, rich.states, references, accuracy, states, FULL)
    if made["warnings"]:
        because = because or f" ({LONGEST:g} times the time of the 3D solution are spent)" * (truth > TRUTH)
        made["warnings"] = [not_reached(accuracy, FULL, worst(made["error"]), because)]
    if tried:
        made["warnings"].append(f"the compact model is not compared with the full one for a {', a '.join(tried)}")
    text = [
        "Estimated: the distance from runs of the full 3D model for each of these inputs, on meshes of their own, with "
        f"their errors. With {rich.states} states it is {reached:.1e} at most.",
    ]
    estimated = {"runs": len(runs), "more_states": rich.states, "with_more_states": reached, "text": text}
    return made | {"estimated": estimated}


def check(scene: AnyScene) -> None:
    """Raise SceneError for a scene that has no compact model."""
    physics.refuse_laws(physics.materials(scene), "a compact model")
    physics.refuse_terminals(scene, "a compact model")
    physics.refuse_faces(scene, "a compact model")
    if not scene.probes:
        raise SceneError("--export writes a model of the scene's probes, and it has none: add a [[probe]]")
    for probe in scene.probes:
        if probe.quantity in DERIVED:
            raise SceneError(
                f"probe {quoted(probe.name)} asks for a {probe.quantity}, and a compact model reads what is linear in "
                "its states: leave the probe out, and ask for currents and potentials"
            )
        if probe.quantity == "potential" and probe.reduce != "mean":
            raise SceneError(
                f"probe {quoted(probe.name)}.reduce asks for an extreme potential, which a model of few states doesn't "
                'have: give reduce = "mean", or a point'
            )


def _run(
    scene: AnyScene, known: tuple[Channel, ...], accuracy: float, say: Callable[[str], None],
    rough: Result | None = None,
) -> Run:  # fmt: skip
    """Solve the full model of a scenario."""
    say("compact model: a run of the full model")
    finer = replace(scene, accuracy=max(accuracy, 1e-6))
    by_name = {c.name: c.value for c in channels(finer)}
    inputs = {c.name: by_name.get(c.name, 0.0) for c in known}  # a source that is off has no channel
    if scene.steady:
        return Run(inputs, None, scene_run.solve(finer))
    steady = None
    if not any(isinstance(v, Schedule) for v in inputs.values()):
        try:
            steady = scene_run.solve(replace(finer, steady=True, output_times=()))
        except (NumericsError, SceneError):
            steady = None  # over time there is no need for a steady state
    return Run(inputs, scene_run.solve(finer, rough=rough), steady)


def _references(scene: AnyScene, run: Run, own: Run) -> list[Reference]:
    # Where all is of one temperature no heat flows, and its error is relative to the flow that such a rise makes.
    size = own.rise(scene)
    part = OF_FLOW * run.rise(scene) / size if size else 0.0
    least = {p.name: part * own.scales[p.name] for p in scene.probes if p.quantity == "heat_flow"}
    references = []
    if run.steady is not None:
        steady, scales = run.steady.steady, run.steady.details["scales"]
        references.append(Reference(
            run.tables, None, {n: np.array(e.value) for n, e in steady.items()},
            {n: e.error for n, e in steady.items()}, {n: max(scales[n], least.get(n, 0.0)) for n in steady},
        ))  # fmt: skip
    if run.over_time is not None and run.over_time.traces is not None:
        traces, scales = run.over_time.traces, run.over_time.details["scales"]
        at = instants(scene, traces.time, run.inputs)
        references.append(Reference(
            run.tables, traces.time[at], {n: v[at] for n, v in traces.values.items()}, traces.errors,
            {n: max(scales[n], least.get(n, 0.0)) for n in traces.values},
        ))  # fmt: skip
    return references


def first_time(scene: AnyScene) -> float:
    """Return the earliest time (s) at which the accuracy of traces holds."""
    instants = [t for t in scene.output_times if 0 < t <= scene.end_time]
    return min(*instants, LATE * scene.end_time) if instants else EARLY * scene.end_time


def instants(scene: AnyScene, times: np.ndarray, inputs: Mapping[str, Value] | None = None) -> np.ndarray:
    """Choose times for the comparison of a model, where the accuracy holds, also after a jump."""
    first = first_time(scene)
    drives = {c.name: c.value for c in channels(scene)} if inputs is None else inputs
    given = [v for v in drives.values() if isinstance(v, Schedule)]
    jumps = [t for v in given for t, then in pairwise(v.times) if t == then and t > 0]
    waits = [(times >= jump) & (times < jump + first * (1 - 1e-12)) for jump in jumps]
    late = np.flatnonzero((times >= first * (1 - 1e-12)) & ~np.any([np.zeros(len(times), bool), *waits], axis=0))
    return late[np.unique(np.linspace(0, len(late) - 1, INSTANTS).astype(int))]


def _problem(
    scene: AnyScene, inputs: tuple[Channel, ...], accuracy: float, rise: float, scales: dict[str, float]
) -> tuple[HeatProblem, Conductor | None, Symmetry]:
    """The heat problem and the conductor with a channel for each input, where they hold ``accuracy`` for inputs that
    together make rises of the size ``rise`` (K), relative to ``scales`` or more, as such rises may cancel out in a
    probe; and the part that is solved."""
    named = apart(scene, inputs)
    start, mixed = None, _mixed(scene, inputs, rise)
    if isinstance(named, MeshScene):
        part, start = scene_run.part_of(named, True), scene_run.on_file(named)
        start = start.with_scene(replace(driven(named, mixed), accuracy=accuracy))
    else:
        start = scene_run.start(replace(driven(named, mixed), accuracy=accuracy))[1]
        start = start if start.whole else None
        part = scene_run.part_of(named, start is not None)
    mixed_scene = replace(driven(scene, mixed), accuracy=accuracy)
    mixed_part = replace(part, scene=replace(driven(part.scene, mixed), accuracy=accuracy))

    def largest(out: Outputs) -> dict[str, float]:
        return {name: max(scale, scales[name]) for name, scale in probe_quantities.scales(mixed_scene, out, {}).items()}

    study = replace(
        probe_quantities.study(mixed_scene, mixed_part),
        field=None,
        extrapolated=False,
        steady_scales=largest,
        trace_scales=largest,
    )
    mesh: Any = adapt(study, not scene.steady, mesh=start, with_steady=scene.steady).mesh
    given = mesh.with_scene(replace(part.scene, accuracy=accuracy)).problems()
    return given.heat, given.conductor, part


def _mixed(scene: AnyScene, inputs: tuple[Channel, ...], rise: float) -> dict[str, Value]:
    """Return a value for each input: voltages, sources and fluxes of the scene, and distinct temperatures."""
    conductors = (m for m in physics.materials(scene) if m.resistivity is not None)
    steepest = max((abs(m.temperature_coefficient) for m in conductors), default=0.0)
    size = min(max(rise, 1.0), FARTHEST / max(steepest, 1e-300))
    values: dict[str, Value] = {}
    for c in inputs:
        if c.kind in ("temperature", "ambient"):
            values[c.name] = c.rest + size
            size *= -LESS
        else:
            values[c.name] = c.largest
    return values


def _rich(
    scene: AnyScene, inputs: tuple[Channel, ...], heat: Any, conductor: Any, part: Any, accuracy: float
) -> tuple[Structure, Reduced]:
    """Project the problem on more fields than are needed, in the order of their effect."""
    if not physics.heat(scene):
        none = np.empty((heat.free, 0))
        cold = [conductor.solve(np.zeros(heat.size), v) for v in conductor.voltages if v.any()]
        alone = Base(heat, conductor, independent(conductor, cold), none, [])
        return Structure(alone, part, inputs, True, {}), alone.project(none)
    slow = projection.slowest(heat)
    end = 20 * slow if scene.steady else scene.end_time  # exp(-20) is left of the slowest response
    earliest = slow if scene.steady else first_time(scene)
    shift = transient.shift(min(slow, end), earliest)
    base, _ = marched.searched(heat, conductor, shift, end, accuracy)
    steps = np.array([1.0, *(c.step for c in inputs)])
    loads, jumps = [*projection.loads_of(base, steps), *base.loads], projection.jumps_of(heat, steps)
    times = None if scene.steady else (earliest, min(slow, end))
    reduced = base.project(projection.rational(heat, [*loads, *jumps], times, SPACE * accuracy))
    structure = Structure(base, part, inputs, scene.steady, _guessed(heat, loads))
    made = project(structure, reduced)
    states = projection.responses(reduced, loads, jumps, times)
    rows = made.matrices["Y"][:, len(steps) :] @ np.linalg.pinv(made.basis) @ reduced.basis
    return structure, reduced.changed(leading(states, rows))


def _document(scene: AnyScene, structure: Structure, rich: Reduced, states: int) -> dict[str, Any]:
    made = project(structure, rich.changed(np.eye(rich.states, states)))
    return scene_document(scene, scene.name, structure.channels, made, first_time(scene))


def _guessed(heat: Any, loads: list[np.ndarray]) -> dict[str, np.ndarray]:
    """For each probe of an extreme the rows of its places in the steady response to each load."""
    rises = [heat.whole(heat.solve_steady(load[: heat.free])) for load in loads] + list(heat.lifts[1:])
    rows = {}
    for probe in heat.domain.scene.probes:
        if probe.quantity == "temperature" and reading(heat, probe).extreme is not None:
            rows[probe.name] = np.array([goal_row(heat, probe, u) for u in rises if u.any()][:MOST_PLACES])
    return rows


def _places(scene: AnyScene, structure: Structure, rich: Reduced, runs: dict[str, Run]) -> dict[str, np.ndarray]:
    """For each probe of an extreme the rows of its places in the runs."""
    model, made = CompactModel(_document(scene, structure, rich, rich.states)), project(structure, rich)
    heat, places = structure.heat, {}
    by_run = [(run, rise) for run in runs.values() for rise in _rises(scene, model, made, heat, run)]
    rises = np.array([rise for _, rise in by_run])
    for probe in heat.domain.scene.probes:
        if probe.name in structure.places:
            rows = np.array([goal_row(heat, probe, u) for u in rises])
            near = np.array([NEAR * run.scales[probe.name] for run, _ in by_run])
            places[probe.name] = needed(rows @ rises.T * (1 if probe.reduce == "max" else -1), rows, near)
    return places


def _rises(scene: AnyScene, model: CompactModel, made: Projection, heat: Any, run: Run) -> list[np.ndarray]:
    """Rises (all nodes,) in the steady state and at some times of a run, by a model."""
    states = []
    if run.steady is not None:
        g = model.inputs_at(run.tables, np.inf)
        states.append((g, model.rest(g)))
    if not scene.steady:
        times = np.geomspace(first_time(scene), scene.end_time, 6)
        drives = [model.inputs_at(run.tables, t) for t in times.tolist()]
        states += zip(drives, model.march(times, run.tables), strict=True)
    return [made.rise(heat, g, b) for g, b in states]


def needed(values: np.ndarray, rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Choose few rows whose largest value equals the largest value of all rows within ``near``.

    Parameters
    ----------
    values : (places, fields) array
        Value of each field at each place.
    rows : (places, nodes) array
        Row that reads each place.
    near : (fields,) array
        Largest allowed deficit of the chosen rows' largest value.
    """
    tops = values.max(axis=0)
    kept: list[int] = []
    while len(kept) < MOST_PLACES:
        short = (tops - values[kept].max(axis=0) if kept else np.abs(tops)) / near
        field = int(short.argmax())
        if kept and short[field] <= 1:
            break
        kept.append(int(values[:, field].argmax()))
    return rows[kept]
