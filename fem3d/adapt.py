"""Refining until every quantity is known well enough.

A level is four solutions on the same cells: the fine one, whose numbers are reported; a coarse one, of degrees lower
by one in x and y; a low one, of degrees lower by two, and a tall one that differs from it by degrees higher by one in
z. Degrees converge so fast that the difference of fine and coarse bounds the error in x and y with room to spare: over
sinks of all kinds that error came out between a tenth and a half of it. The difference of tall and low is the error in
z itself. Where a difference happens to vanish, the dual-weighted estimate of the fine solution alone takes over.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d import indicators, outputs, sink_quantities, steady
from fem3d.errors import NumericsError, RunawayError
from fem3d.indicators import Indicators
from fem3d.operators import assemble
from fem3d.sink_quantities import Quantities
from fem3d.steady import SteadyState
from fem3d.time_response import Response, respond
from meshes import grading
from meshes.bricks import BrickMesh
from meshes.grading import Features
from meshes.symmetry import Symmetry
from scenes.sink import Sink

IN_PLANE = 1.0  # the error in x and y over the difference of fine and coarse, at most
IN_DEPTH = 1.5  # the error in z over the difference of tall and low, at most
SHARPEN = 0.3  # of the difference in x and y: if that in z is larger, it is measured at the higher degrees
NEGLIGIBLE = 0.2  # part of the accuracy below which an error in z isn't worth refining
OF_LARGEST = 1.0  # every temperature may be off by the largest difference of any: what the anchors miss shifts all
OF_ESTIMATE = 1.0  # the error over its dual-weighted estimate, at most
CLEARLY = 2.0  # times the accuracy: estimates above it need no second solution to refine
SURELY = 3.0  # times the change of the runaway voltage from mesh to mesh by which a voltage must exceed it
MARKED = 0.9  # part of the estimated error whose intervals are refined
MOST_ENTRIES = 40_000_000  # of the stiffness matrix: some 10 GB with its factors

RISES = {"peak_rise_K": "peak", "end_rise_K": "end", "mean_rise_K": "mean"}


@dataclass(frozen=True, eq=False)
class Solution:
    """The steady state on one mesh and its quantities."""

    state: SteadyState
    quantities: Quantities


@dataclass(frozen=True, eq=False)
class Answer:
    """What the last level gives: its solutions, the steady errors by name, and the response over time."""

    fine: Solution
    errors: dict[str, float]
    response: Response | None
    levels: int


def solve(sink: Sink, symmetry: Symmetry, transient: bool, progress: Callable[[str], None] = lambda _: None) -> Answer:
    """Levels until every estimated error is within ``sink.accuracy``.

    Raises RunawayError where no steady state exists, NumericsError where the accuracy can't be reached.
    """
    accuracy = sink.accuracy
    features = grading.features(symmetry.scene)
    mesh = grading.first_mesh(symmetry.scene, accuracy)
    previous_limit = None
    for level in range(1, 40):
        if _entries(mesh) > MOST_ENTRIES:
            raise NumericsError(f"an accuracy of {accuracy:g} takes more memory in this scene than is sensible")
        try:
            fine = solution(sink, symmetry, mesh, reported=True)
        except RunawayError as runaway:
            # The voltage of the fold is a number of this mesh; it stands once another mesh agrees with it.
            known_to = np.inf if previous_limit is None else abs(runaway.limit - previous_limit)
            if abs(sink.voltage) - runaway.limit > SURELY * known_to or _entries(mesh) > MOST_ENTRIES / 8:
                raise
            previous_limit = runaway.limit
            mesh = mesh.with_degrees(1, 1, 1)
            continue
        size = fine.state.heat.size
        progress(f"level {level}: {size} unknowns")
        goals = _goals(fine, [], features)
        estimate = {name: goals[i].remaining for i, name in enumerate(RISES)}
        deep = True
        lesser = _lesser(sink, symmetry, mesh, fine) if max(estimate.values()) <= CLEARLY * accuracy else None
        if lesser is not None:
            coarse, low, tall = lesser
            depth = {q: IN_DEPTH * abs(float(tall.quantities[q] - low.quantities[q])) for q in low.quantities}
            deep = max(depth[q] / abs(float(fine.quantities[q])) for q in depth) > NEGLIGIBLE * accuracy
            if not deep:
                estimate = {name: goals[i].in_plane for i, name in enumerate(RISES)}
            errors = steady_errors(fine.quantities, coarse.quantities, depth, estimate)
            worst = max(e / abs(float(fine.quantities[q])) for q, e in errors.items())
            if worst <= accuracy:
                if not transient:
                    return Answer(fine, errors, None, level)
                progress("transient")
                # What hardly depends on the degree in z when steady doesn't depend on it more on the way there.
                in_z = (low.state, tall.state) if deep else None
                response = respond(sink, symmetry, fine.state, coarse.state, in_z, fine.quantities)
                if response.accepted:
                    return Answer(fine, errors, response, level)
                goals = _goals(fine, response.snapshots, features)
                deep = response.deep
        mesh = _refined(mesh, goals, features, deep)
    raise NumericsError(f"an accuracy of {accuracy:g} isn't reached in this scene")


def _entries(mesh: BrickMesh) -> int:
    """Entries of the stiffness matrix, before it is there."""
    return sum(int(np.prod([len(part.rows) for part in mesh.parts(block)])) for block in mesh.blocks)


def solution(sink: Sink, symmetry: Symmetry, mesh: BrickMesh, reported: bool = False) -> Solution:
    """The steady state on a mesh, with care for the heat balance where it will be reported."""
    state = steady.solve(assemble(symmetry.scene, mesh, reported), sink.voltage, sink.accuracy)
    return Solution(state, sink_quantities.steady(sink, outputs.of_steady(state, symmetry)))


def _lesser(
    sink: Sink, symmetry: Symmetry, mesh: BrickMesh, fine: Solution
) -> tuple[Solution, Solution, Solution] | None:
    """The coarse, the low and the tall solution; None where any has no steady state although the fine one has."""
    try:
        coarse = solution(sink, symmetry, mesh.with_degrees(-1, -1, 0))
        low_mesh = mesh.with_degrees(-2, -2, 0, least=2)
        same = all(
            (a.degrees == b.degrees).all() for a, b in zip(low_mesh.axes, coarse.state.heat.mesh.axes, strict=True)
        )
        low = coarse if same else solution(sink, symmetry, low_mesh)
        tall = solution(sink, symmetry, low_mesh.with_degrees(0, 0, 1))
        if not same and _apart(tall, low) > SHARPEN * _apart(fine, coarse):
            low, tall = coarse, solution(sink, symmetry, mesh.with_degrees(-1, -1, 1))
        return coarse, low, tall
    except NumericsError:
        return None


def _apart(a: Solution, b: Solution) -> float:
    """The largest relative difference of their rises."""
    return max(abs(float(a.quantities[q] / b.quantities[q]) - 1) for q in RISES)


def steady_errors(
    fine: Quantities, coarse: Quantities, depth: dict[str, float], estimate: dict[str, float]
) -> dict[str, float]:
    """Estimated error of each quantity of the fine solution, in its unit.

    ``depth`` are errors in z, in the quantities' units; ``estimate`` is the relative dual-weighted one of the rises.
    """
    difference = {name: abs(float(fine[name] - coarse[name])) for name in fine}
    largest = max(difference[name] for name in RISES)
    errors = {name: IN_PLANE * d for name, d in difference.items()}
    for name in RISES:
        errors[name] = max(errors[name], OF_ESTIMATE * estimate[name] * abs(float(fine[name])), OF_LARGEST * largest)
    resistance = "anchor_resistance_K_per_W"
    errors[resistance] = max(errors[resistance], OF_ESTIMATE * estimate["end_rise_K"] * abs(float(fine[resistance])))
    # Rounding in the solves; nothing is known better than that.
    return {name: e + depth[name] + 1e-10 * abs(float(fine[name])) for name, e in errors.items()}


def _goals(fine: Solution, snapshots: list[np.ndarray], features: Features) -> list[Indicators]:
    state = fine.state
    functionals = [state.heat.probes[name] for name in RISES.values()]
    return indicators.of_goals(state, [state.rise, *snapshots], functionals, features)


def _refined(mesh: BrickMesh, goals: list[Indicators], features: Features, deep: bool) -> BrickMesh:
    missing = [np.sum([g.missing[d] for g in goals], axis=0) for d in range(3)]
    if not deep:
        missing[2][:] = 0.0
    ordered = np.sort(np.concatenate(missing))[::-1]
    total = np.cumsum(ordered)
    cut = ordered[min(int(np.searchsorted(total, MARKED * total[-1])), len(ordered) - 1)]
    return grading.refine(mesh, [m >= max(cut, 1e-300) for m in missing], features)
