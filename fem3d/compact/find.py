"""A scene's compact model: as few states as an accuracy takes, its error known from runs of the full model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from fem3d.adaptivity import transient_base
from fem3d.adaptivity.goal_parts import goal_row
from fem3d.compact import fields
from fem3d.compact.judge import MOST_PLACES, Judge, Truth, first_time, rise_of
from fem3d.compact.mesh import problem
from fem3d.compact.tensors import Structure, tensors
from fem3d.problems.current_fields import independent
from fem3d.results.probes import reading
from fem3d.runs import scene as scene_run
from fem3d.solution import transient
from fem3d.solution.reduced import Reduced
from fem3d.solution.transient import Base
from scenes import physics
from scenes.errors import NumericsError, SceneError, quoted
from scenes.model import DERIVED, AnyScene, MeshScene, Schedule
from statespace.channels import OWN, Channel, channels, driven, scenarios
from statespace.truncation import fewest, leading

TRUTH, SPACE = 0.5, 0.02  # fractions of the accuracy: for the runs that a model is held against, and for its fields
# Times the accuracy, for which a mesh for all inputs at once is made first, as the runs tell what it is good for; by
# how much less where it isn't fine enough; and how many there are.
MESH, FINER, TURNS = 3.0, 0.3, 4
LONG = 20.0  # a steady state is reached after this many times the slowest response


def compact(
    scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """The document of a scene's model (`statespace.runtime`), of a given number of states or as many as an accuracy
    takes, relative as the scene's own.

    Raises SceneError for a scene that has none, NumericsError where the accuracy isn't reached.
    """
    check(scene)
    try:
        return _compact(scene, states, accuracy, say)
    except NumericsError:
        raise
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise NumericsError(f"no model of few states is found: {error}; leave out --export") from None


def _compact(scene: AnyScene, states: int | None, accuracy: float, say: Callable[[str], None]) -> dict[str, Any]:
    if not physics.heat(scene):
        # Currents alone follow the voltages at once: their steady state is all.
        largest = {c.name: c.largest for c in channels(scene)}
        scene = replace(driven(scene, largest), steady=True, output_times=())
    inputs = channels(scene)
    truths = {name: _truth(other, inputs, accuracy, say) for name, other in scenarios(scene, inputs).items()}
    reached = np.inf
    for turn in range(TURNS):
        say(f"compact model: mesh {turn + 1}")
        heat, conductor, part = problem(
            scene, inputs, MESH * FINER**turn * accuracy, rise_of(scene, truths[OWN]), truths[OWN].scales
        )
        structure, rich = _rich(scene, inputs, heat, conductor, part, accuracy)
        judge = Judge(scene, inputs, truths, structure, rich)
        if structure.places:
            structure = replace(structure, places=judge.places())
            judge = Judge(scene, inputs, truths, structure, rich)
        reached = judge.worst(rich.states)
        if reached <= accuracy or isinstance(scene, MeshScene):
            break
    if states is None and reached > accuracy:
        raise NumericsError(
            f"no model of few states is known to be within {accuracy:g} of the full one, only within {reached:.3g}: "
            "give a larger --model-accuracy"
        )
    say("compact model: states")
    count = fewest(rich.states, judge.worst, accuracy) if states is None else min(states, rich.states)
    return judge.document(count)


def check(scene: AnyScene) -> None:
    """SceneError for a scene that has no compact model."""
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


def _truth(scene: AnyScene, known: tuple[Channel, ...], accuracy: float, say: Callable[[str], None]) -> Truth:
    say("compact model: a run of the full model")
    finer = replace(scene, accuracy=max(TRUTH * accuracy, 1e-6))
    inputs = {c.name: c.value for c in channels_of(finer, known)}
    if scene.steady:
        return Truth(inputs, None, scene_run.solve(finer))
    settled = replace(finer, steady=True, output_times=())
    steady = None
    if not any(isinstance(v, Schedule) for v in inputs.values()):
        try:
            steady = scene_run.solve(settled)
        except (NumericsError, SceneError):
            steady = None  # there may be none, and over time there is no need for one
    return Truth(inputs, scene_run.solve(finer), steady)


def channels_of(scene: AnyScene, inputs: tuple[Channel, ...]) -> tuple[Channel, ...]:
    """The channels with what another scene of the same structure gives them; a source that is off has none of its
    own."""
    by_name = {c.name: c for c in channels(scene)}
    return tuple(by_name.get(c.name, replace(c, value=0.0)) for c in inputs)


def _rich(
    scene: AnyScene, inputs: tuple[Channel, ...], heat: Any, conductor: Any, part: Any, accuracy: float
) -> tuple[Structure, Reduced]:
    """What a model is made of, and its problem in more fields than are needed, those first that matter most."""
    if not physics.heat(scene):
        none = np.empty((heat.free, 0))
        cold = [conductor.solve(np.zeros(heat.size), v) for v in conductor.voltages if v.any()]
        alone = Base(heat, conductor, independent(conductor, cold), none, [])
        return Structure(alone, part, inputs, True, {}), alone.project(none)
    slow = fields.slowest(heat)
    end = LONG * slow if scene.steady else scene.end_time
    earliest = slow if scene.steady else first_time(scene)
    base: Base = transient_base.of(heat, conductor, transient.shift(min(slow, end), earliest), end, accuracy)
    steps = np.array([1.0, *(c.step for c in inputs)])
    loads, jumps = [*fields.loads_of(base, steps), *base.loads], fields.jumps_of(heat, steps)
    times = None if scene.steady else (earliest, min(slow, end))
    reduced = base.project(fields.rational(heat, [*loads, *jumps], times, SPACE * accuracy))
    structure = Structure(base, part, inputs, scene.steady, _guessed(heat, loads))
    made = tensors(structure, reduced)
    states = _responses(reduced, loads, jumps, times)
    rows = made.matrices["Y"][:, len(steps) :] @ np.linalg.pinv(made.basis) @ reduced.basis
    return structure, reduced.changed(leading(states, rows))


def _responses(
    reduced: Reduced, loads: list[np.ndarray], jumps: list[np.ndarray], times: tuple[float, float] | None
) -> np.ndarray:
    """(states, any): the reduced responses to loads, at rest and over time, and to jumps."""
    n = len(reduced.basis)
    rates, modes = np.linalg.eigh((reduced.stiffness + reduced.stiffness.T) / 2)
    rates = np.maximum(rates, 1e-12 * rates[-1])

    def inner(vectors: list[np.ndarray]) -> np.ndarray:
        kept = np.column_stack([v[:n] for v in vectors]) if vectors else np.empty((n, 0))
        product: np.ndarray = modes.T @ (reduced.basis.T @ kept)
        return product

    heating, decaying = inner(loads), inner(jumps)
    responses = [heating / rates[:, None]]
    for g in [] if times is None else np.geomspace(times[0] / fields.SOONER, max(times), 12):
        responses += [g * heating / (1 + g * rates)[:, None], decaying / (1 + g * rates)[:, None]]
    return np.asarray(modes @ np.column_stack(responses))


def _guessed(heat: Any, loads: list[np.ndarray]) -> dict[str, np.ndarray]:
    """For each probe of an extreme where it is in the steady response to each load."""
    rises = [heat.whole(heat.solve_steady(load[: heat.free])) for load in loads] + list(heat.lifts[1:])
    rows = {}
    for probe in heat.domain.scene.probes:
        if probe.quantity == "temperature" and reading(heat, probe).extreme is not None:
            rows[probe.name] = np.array([goal_row(heat, probe, u) for u in rises if u.any()][:MOST_PLACES])
    return rows
