"""Compact models of any scene: its 3D problem projected on as few fields as the accuracy requires.

Every boundary value, source and voltage is an input. The error is the distance from runs of the full model, for the
scene itself and for a step of each input alone, on meshes of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache, partial
from threading import Lock
from time import thread_time
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from fem3d.adaptivity import responses
from fem3d.adaptivity.adapt import adapt
from fem3d.adaptivity.goal_errors import goal_row
from fem3d.adaptivity.nested import Problems
from fem3d.results.outputs import Outputs
from fem3d.results.probes import reading
from fem3d.runs import probe_quantities, projection
from fem3d.runs import scene as scene_run
from fem3d.runs.probe_quantities import OF_FLOW, earliest
from fem3d.runs.projection import Projection
from fem3d.solution import transient
from fem3d.solution.reduced import independent_currents
from fem3d.solution.transient import Base, Krylov
from meshes.symmetry import Symmetry
from scenes import physics
from scenes.errors import NumericsError, SceneError, quoted
from scenes.model import DERIVED, AnyScene, MeshScene, Schedule, Value
from scenes.result import Result, Traces
from statespace.channels import OWN, Channel, apart, channels, driven, scenarios
from statespace.document import scene_document
from statespace.reduction import SOONER, Reference, References, StateSpace, Times, not_reached, reduce, worst
from statespace.runtime import CompactModel

FULL = "the full model"
RUN_SHARE, ROUGH_SHARE = 0.5, 3.0
"""Parts of the accuracy: for the runs and the mesh of the compact model, and for a mesh that does not reach it."""
LONGEST, ALWAYS = 2.0, 30.0
"""Limit of all runs: this multiple of the processor time of the scene's own runs, or at least these seconds."""
MOST_PLACES = 12  # of an extreme that a model reads: a choice, as each is a row of its outputs


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None,
    seconds: float = 0.0, earlier: Result | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Make the document of a scene's compact model, as `statespace.runtime.CompactModel` takes it.

    Parameters
    ----------
    scene : scene of boxes or of a mesh file with probes, steady or over time
    states : number of states; None for as many as the accuracy takes
    accuracy : largest error, relative to the same scales as the scene's accuracy
    say : called with lines about the progress
    seconds, earlier : processor time (s) of an earlier 3D solution of the scene, and its result, which is one of the
        scene's own runs if it is accurate enough

    Returns
    -------
    The document, with "warnings" where the time or the memory ends before the accuracy is reached.

    Raises SceneError for a scene that has no compact model, and NumericsError where the scene has no solution.
    """
    refuse(scene)
    try:
        return _compact(scene, states, accuracy, say, seconds, earlier)
    except NumericsError:
        raise
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise NumericsError(f"no model of few states is found: {error}; leave out --export") from None


def _compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None],
    seconds: float, earlier: Result | None,
) -> dict[str, Any]:  # fmt: skip
    if not physics.heat(scene):
        # Currents alone follow the voltages at once: their steady state is all.
        largest = {c.name: c.largest for c in channels(scene)}
        scene, earlier = replace(driven(scene, largest), steady=True, output_times=()), None
    inputs, start = channels(scene), thread_time()
    result = _solve(replace(scene, accuracy=max(RUN_SHARE * accuracy, 1e-6)), earlier)
    tried, own = scenarios(scene, inputs), [_reference(scene, inputs, result)]
    # A step of the only drive may be the scene itself.
    references = {name: own for name, each in tried.items() if each == scene}
    alike, tried = [*references], {name: each for name, each in tried.items() if name not in references}
    tried |= {} if scene.steady else {OWN: scene}  # its steady state is left to solve
    budget = _Budget(seconds + thread_time() - start)
    looser = budget.looser(len(tried) * budget.spent)

    @lru_cache(1)
    def meshed(part: float) -> tuple[Problems, Symmetry, str]:
        try:
            return *_problem(scene, inputs, part * accuracy, own), ""
        except NumericsError as error:
            return *_problem(scene, inputs, ROUGH_SHARE * accuracy, own), f" ({error})"

    while True:
        before, share = budget.spent, RUN_SHARE * looser
        # The errors of a model on a mesh file are those of its mesh, which is kept. Else it is as accurate as the runs.
        part = ROUGH_SHARE if isinstance(scene, MeshScene) else min(share, ROUGH_SHARE)
        solve = partial(_references, known=inputs, accuracy=share * accuracy, say=say, own=own, solved=(scene, result))
        with threadpool_limits(1), ThreadPoolExecutor(2) as pool:  # two at once, which bounds the memory
            meshing = pool.submit(meshed, part)
            runs = pool.map(partial(budget.spend, solve), tried.values())
            references |= {name: run for name, run in zip(tried, runs, strict=True) if run}
            say("compact model: mesh and fields")
            problems, symmetric, because = meshing.result()
        tighter = budget.looser(looser * (budget.spent - before))
        if tighter > looser / 2:
            break
        looser = tighter
    references |= dict.fromkeys(alike, references[OWN])
    rich, times = _project(scene, inputs, problems, symmetric, looser * accuracy)
    space = rich.state_space(_places(scene, rich, references))
    say("compact model: states")
    order = space.leading(np.array([c.step for c in inputs]), np.array([c.rest for c in inputs]), times)
    made, reached = reduce(lambda count: _document(scene, inputs, space.within(order[:, :count])), space.states,
                           references, accuracy, states, FULL)  # fmt: skip
    if states is None and worst(made["error"]) > accuracy:
        because = because or f" (the runs took {LONGEST:g} times the time of the 3D solution)" * (looser > 1)
        made["warnings"] = [not_reached(accuracy, FULL, worst(made["error"]), because)]
    if left := [name for name in tried if name not in references]:
        made["warnings"].append(f"the compact model is not compared with the full one for a {', a '.join(left)}")
    text = (
        "Estimated: the distance from runs of the full 3D model for each of these inputs, on meshes of their own, with "
        f"their errors. With {space.states} states it is {reached:.1e} at most."
    )
    estimated = {"runs": len(references), "more_states": space.states, "with_more_states": reached, "text": [text]}
    return made | {"estimated": estimated}


class _Budget:
    """The processor time (s) of all runs, ``spent`` by the scene's own at first; `LONGEST` and `ALWAYS` limit it."""

    def __init__(self, own: float) -> None:
        self.spent, self._limit, self._lock = own, max(LONGEST * own, ALWAYS), Lock()

    def looser(self, seconds: float) -> float:
        """Return the factor on the tolerance of runs, which shortens them by as much from so many ``seconds``, with
        which they end within two thirds of the limit."""
        return max(1.0, seconds / max(self._limit * 2 / 3 - self.spent, 0.1 * self.spent, 1e-9))

    def spend(self, solve: Callable[[AnyScene], list[Reference]], scene: AnyScene) -> list[Reference] | None:
        """Return the runs of a scenario; None where the time is spent."""
        if self.spent >= self._limit:
            return None
        begun = thread_time()
        result = solve(scene)
        with self._lock:
            self.spent += thread_time() - begun
        return result


def refuse(scene: AnyScene) -> None:
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


def _solve(scene: AnyScene, earlier: Result | None) -> Result:
    """Solve a scene, unless an ``earlier`` result of it is accurate enough."""
    if earlier is not None and scene.steady == (earlier.traces is None):
        found = Reference.of_result({}, earlier, earlier.details["scales"])
        if all(error <= scene.accuracy * found.scales[name] for name, error in found.errors.items()):
            return earlier
    return scene_run.solve(scene)


def _references(
    scene: AnyScene, known: tuple[Channel, ...], accuracy: float, say: Callable[[str], None], own: list[Reference],
    solved: tuple[AnyScene, Result],
) -> list[Reference]:  # fmt: skip
    """Solve a scenario over time and in the steady state; ``own`` are the runs of the scene that is ``solved``."""
    say("compact model: a run of the full model")
    finer, results = replace(scene, accuracy=max(accuracy, 1e-6)), []
    if scene.steady or not any(isinstance(c.value, Schedule) for c in channels(scene)):
        try:
            results.append(scene_run.solve(replace(finer, steady=True, output_times=())))
        except (NumericsError, SceneError):  # over time there is no need for a steady state
            if scene.steady:
                raise
    if not scene.steady:
        results.append(solved[1] if scene == solved[0] else scene_run.solve(finer))
    runs = [_reference(scene, known, result) for result in results]
    # Where all is of one temperature no heat flows, and its error is relative to the flow that such a rise makes.
    size, flows = _rise(scene, own), [p.name for p in scene.probes if p.quantity == "heat_flow"]
    part = OF_FLOW * _rise(scene, runs) / size if size else 0.0
    least = {name: part * own[0].scales[name] for name in flows}
    return [replace(run, scales={n: max(s, least.get(n, 0.0)) for n, s in run.scales.items()}) for run in runs]


def _reference(scene: AnyScene, known: tuple[Channel, ...], result: Result) -> Reference:
    """The result of a scene as a run, with the values of ``known`` inputs."""
    off = {c.name: 0.0 for c in known}  # a source that is off has no channel
    at: Any = slice(None) if result.traces is None else comparison_rows(result.traces)
    return Reference.of_result(off | {c.name: c.value for c in channels(scene)}, result, result.details["scales"], at)


def _rise(scene: AnyScene, runs: list[Reference]) -> float:
    """Return the largest rise (K) of any probe in some runs."""
    thermal = [p.name for p in scene.probes if p.quantity == "temperature"]
    rises = (float(np.abs(run.values[n] - scene.initial_temperature).max()) for run in runs for n in thermal)
    return max(rises, default=0.0)


def comparison_rows(traces: Traces) -> np.ndarray:
    """Choose up to 60 rows for the comparison of a model, where the errors of the traces hold."""
    return responses.thin_out(np.flatnonzero(traces.sure(traces.time)), 60)


def _problem(
    scene: AnyScene, inputs: tuple[Channel, ...], accuracy: float, own: list[Reference]
) -> tuple[Problems, Symmetry]:
    """The problems with a channel for each input, and the part that is solved. They hold ``accuracy`` for inputs that
    together make rises like the scene's ``own``, relative to its scales or more, as rises may cancel out."""
    scales, named, mixed = own[0].scales, apart(scene, inputs), _mixed_inputs(scene, inputs, _rise(scene, own))

    def with_mixed(scene: Any) -> Any:
        return replace(driven(scene, mixed), accuracy=accuracy)

    start = scene_run.start(with_mixed(named))[1]
    part, alike = scene_run.part_of(named, start.whole), with_mixed(scene)

    def largest(out: Outputs) -> dict[str, float]:
        return {name: max(scale, scales[name]) for name, scale in probe_quantities.scales(alike, out, {}).items()}

    study = probe_quantities.study(alike, replace(part, scene=with_mixed(part.scene)))
    study = replace(study, field_accuracy=None, extrapolated=False, steady_scales=largest, trace_scales=largest)
    mesh: Any = adapt(study, not scene.steady, mesh=start if start.whole else None, with_steady=scene.steady).mesh
    return mesh.with_scene(replace(part.scene, accuracy=accuracy)).problems(), part


def _mixed_inputs(scene: AnyScene, inputs: tuple[Channel, ...], rise: float) -> dict[str, Value]:
    """Return a value for each input: voltages, sources and fluxes of the scene, and distinct temperatures."""
    conductors = (m for m in physics.materials(scene) if m.resistivity is not None)
    steepest = max((abs(m.temperature_coefficient) for m in conductors), default=0.0)
    size = min(max(rise, 1.0), 0.2 / max(steepest, 1e-300))  # changes a resistivity by a fifth at most
    values: dict[str, Value] = {}
    for c in inputs:
        if c.kind in ("temperature", "ambient"):
            values[c.name] = c.rest + size
            size *= -0.8  # equal steps would cancel out
        else:
            values[c.name] = c.largest
    return values


def _project(
    scene: AnyScene, inputs: tuple[Channel, ...], problems: Problems, part: Symmetry, accuracy: float
) -> tuple[Projection, Times]:
    """Project the problem on more fields than are needed, for some times (s)."""
    heat, conductor = problems.heat, problems.conductor
    if not physics.heat(scene):
        none = np.empty((heat.free, 0))
        assert conductor is not None
        cold = [conductor.solve(np.zeros(heat.size), v) for v in conductor.voltages if v.any()]
        alone = Base(heat, conductor, independent_currents(conductor, cold), none, [])
        return Projection(alone, alone.project(none), part, inputs, True), None
    slow = transient.slowest(heat)
    end = 20 * slow if scene.steady else scene.end_time  # exp(-20) is left of the slowest response
    first = slow if scene.steady else earliest(scene)
    shift = transient.shift(min(slow, end), first)
    _, hot = responses.search_hot_states(problems.heats[-2], problems.conductors[-2], shift, first, end, accuracy)
    base = responses.make_base(heat, conductor, hot)
    loads, times = [*base.loads, *projection.joule_loads(base)], None if scene.steady else (first, min(slow, end))
    fields = heat.solve_steady(np.array([load[: heat.free] for load in loads]).reshape(-1, heat.free)).T
    if times is not None:
        shifts = np.geomspace(times[0] / SOONER, times[1], 4).tolist()
        # Every shift once: on a hot plate of 22 boxes more fields change traces by 3e-8.
        fields = Krylov(replace(base, fields=fields, loads=loads), *shifts).fields(len(shifts))
    return Projection(base, base.project(fields), part, inputs, scene.steady), times


def _document(scene: AnyScene, inputs: tuple[Channel, ...], space: StateSpace) -> dict[str, Any]:
    return scene_document(scene, scene.name, inputs, space, earliest(scene))


def _places(scene: AnyScene, rich: Projection, references: References) -> dict[str, np.ndarray]:
    """For each probe of an extreme the rows of its places in the runs."""
    heat, places = rich.heat, dict[str, np.ndarray]()
    thermal = [p for p in heat.domain.scene.probes if p.quantity == "temperature"]
    extremes = [probe for probe in thermal if reading(heat, probe).extreme is not None]
    if not extremes:
        return places
    space = rich.state_space(places)
    model, drives, states, scales = CompactModel(_document(scene, rich.channels, space)), [], list[np.ndarray](), []
    for run in (run for runs in references.values() for run in runs):
        times = [np.inf] if run.times is None else np.geomspace(earliest(scene), scene.end_time, 6).tolist()
        drives += [model.inputs_at(run.inputs, t) for t in times]
        states += [model.rest(drives[-1])] if run.times is None else [*model.march(times, run.inputs)]
        scales += [run.scales] * len(times)
    rises = rich.rises(space.amplitudes(np.array(states), np.array(drives)), np.array(drives))
    for probe in extremes:
        rows = np.array([goal_row(heat, probe, u) for u in rises])
        near = np.array([1e-4 * scale[probe.name] for scale in scales])  # by which a place may miss the extreme
        places[probe.name] = choose_places(rows @ rises.T * (1 if probe.reduce == "max" else -1), rows, near)
    return places


def choose_places(values: np.ndarray, rows: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Choose few of the ``rows`` (places, dofs) whose largest of the ``values`` (places, fields) equals the largest of
    all within ``near`` (fields,)."""
    tops = values.max(axis=0)
    kept: list[int] = []
    while len(kept) < MOST_PLACES:
        short = (tops - values[kept].max(axis=0) if kept else np.abs(tops)) / near
        field = int(short.argmax())
        if kept and short[field] <= 1:
            break
        kept.append(int(values[:, field].argmax()))
    return rows[kept]
