"""Traces over time with their errors: of space, of the reduced space, of time stepping and of the rows."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fem3d import bubbles, outputs, probes, rows, transient
from fem3d.heat import HeatSystem
from fem3d.outputs import Outputs
from fem3d.reduced import Reduced
from fem3d.study import Quantities, Study
from fem3d.transient import Base, Krylov, Transient

IN_PLANE, IN_DEPTH, NEGLIGIBLE = 1.0, 1.5, 0.2  # as for the steady state, with room for more than one instant
ROW_SHARE = 0.25  # part of the accuracy left to linear interpolation between rows
TIME_SHARE = 0.01  # part of the accuracy for time stepping
SPACE_SHARE = 0.1  # part of the accuracy for the reduced space
ROUNDING = 1e-10  # of the scale: nothing is known better
NOTHING = 1e-10  # of what would warm all from 0 K: less heat is none
FIELDS, DROPPED, MOST_FIELDS = 6, 2, 60  # generations of Krylov fields: the first trial, how many fewer, the most
LATE = (0.3, 1.0)  # of the end: instants at which what the next degrees would add is looked at
KNOTS = 12  # bends and jumps of the inputs after which errors are looked at closely


@dataclass(frozen=True, eq=False)
class Response:
    """Traces and their errors (in their units), the heat balance, and what refinement needs if they are too large."""

    times: np.ndarray
    traces: Quantities
    errors: dict[str, float]
    accepted: bool  # whether the errors are within the accuracy
    imbalance: float  # stored + lost - supplied heat over what passed, the largest over time
    transient: Transient
    reduced: Reduced
    snapshots: list[np.ndarray]
    deep: bool  # whether degrees across the layers matter
    scales: dict[str, float]
    generations: int  # of fields
    relative: dict[str, float] = field(default_factory=dict)  # errors without the rows' own, over their scales
    across: bool = True  # whether degrees in x and y matter
    local: dict[str, list[tuple[int, int, float]]] = field(default_factory=dict)  # as of `bubbles.at_goals`

    @property
    def slowest(self) -> float:
        """The time constant (s) of the slowest mode."""
        return float(1 / max(self.transient.trajectory.rates.min(), 1e-300))


def respond(
    study: Study,
    fine: Base,
    coarse: Base,
    in_z: tuple[Base, Base] | None,
    shift: float,
    steady_out: Outputs | None,
    generations: int = 0,
) -> Response:
    """The response of the fine mesh, its error estimated from the coarse one and, where z matters, from two that differ
    by their degrees in z. ``steady_out`` are the outputs that scales are taken from, or else those of the
    response itself; ``generations`` of fields is where to start."""
    accuracy, end = study.accuracy, study.end
    checked = instants(study, fine.heat)

    def traces(response: Transient) -> Quantities:
        return study.traces(outputs.of_transient(response, study.part, checked))

    space = Krylov(fine, shift)
    count = max(generations, FIELDS + int(max(0.0, -np.log10(accuracy) - 3) * 2))
    while True:
        reduced = fine.project(space.fields(count))
        answer = transient.march(fine, reduced, end, TIME_SHARE * accuracy)
        out = outputs.of_transient(answer, study.part, checked)
        there, scales = study.traces(out), study.trace_scales(steady_out or out)
        # One comparison for two errors: fewer fields and a looser step.
        dropped = space.dropped(count, DROPPED)
        if dropped >= reduced.states:
            # In so short a time hardly anything diffuses: all generations are one, and dropping some tells nothing.
            dropped = 0
        fewer = transient.march(fine, reduced, end, 10 * TIME_SHARE * accuracy, dropped)
        lost = _distance(there, traces(fewer))
        enough = max(lost[name] / scales[name] for name in lost) <= SPACE_SHARE * accuracy
        if enough or count >= MOST_FIELDS or not dropped:
            break
        count += 4

    def below(base: Base) -> Quantities:
        space = base.project(Krylov(base, shift).fields(count))
        return traces(transient.march(base, space, end, TIME_SHARE * accuracy))

    lesser = below(coarse)
    low, tall = (lesser, lesser) if in_z is None else (below(in_z[0]), below(in_z[1]))
    in_plane, in_depth = _distance(there, lesser), _distance(low, tall)
    caution = {n: study.caution.get(n, 1.0) for n in scales}
    errors = {n: caution[n] * (IN_PLANE * in_plane[n] + IN_DEPTH * in_depth[n] + lost[n]) for n in scales}
    late = bubbles.Instant.of(answer, end * np.array(LATE)) if steady_out is None else []
    local = bubbles.at_goals(study, fine.heat, fine.conductor, late) if late else {}
    for name, probe in study.goals.items():
        if name in errors:
            errors[name] = max(errors[name], sum(kelvin for _, _, kelvin in local.get(name, ())))
            errors[name] += float(np.max(out.get(f"doubt:{probe}", 0.0)))
    worst = max(errors[name] / scales[name] for name in errors)
    if worst > (1 - ROW_SHARE) * accuracy:
        # Refine for the instants at which the meshes differ most.
        at = {len(checked) - 1}
        worse = {}
        for which, apart, a, b in (("across", in_plane, there, lesser), ("deep", in_depth, low, tall)):
            worse[which] = [n for n in errors if IN_DEPTH * apart[n] / scales[n] > NEGLIGIBLE * accuracy]
            at |= {int(np.abs(a[n] - b[n]).argmax()) for n in worse[which] if n in (study.trace_rises or errors)}
        snapshots = list(answer.rises(checked[sorted(at)]))
        return Response(
            checked, there, errors, False, np.nan, answer, reduced, snapshots, bool(worse["deep"]), scales, count,
            across=bool(worse["across"]), local=local,
        )  # fmt: skip
    return _with_rows(study, answer, reduced, errors, scales, count)


def instants(study: Study, heat: HeatSystem) -> np.ndarray:
    """Times (s) at which meshes and spaces are compared: early and late, and after bends and jumps of the inputs; after
    a jump of a given temperature from the earliest time of interest on, as after the start."""
    end, first = study.end, min(study.earliest, study.end)
    knots = heat.inputs.knots(end)
    found = [np.geomspace(first, end, 40), np.linspace(0, end, 21)[1:]]
    found.append(np.array([t for t in study.instants if first <= t <= end]))
    few = knots if len(knots) <= KNOTS else knots[np.unique(np.linspace(0, len(knots) - 1, KNOTS).astype(int))]
    for knot in few:
        following = knots[knots > knot]
        gap = (following[0] if len(following) else end) - knot
        found.append(knot + np.geomspace(min(first, gap / 2), gap * (1 - 1e-9), 6))
    times = np.unique(np.concatenate(found))
    jumps = heat.jumps(end)
    for jump, gap in zip(jumps, np.diff(np.append(jumps, end)), strict=True):
        times = times[(times < jump) | (times >= jump + min(first, gap / 2) * (1 - 1e-9))]
    return times


def repeat(study: Study, fine: Base, reduced: Reduced, steady_out: Outputs, before: Response) -> Response:
    """The response at another voltage, in the reduced problem of an earlier one, which has the same relative errors."""
    scales = study.trace_scales(steady_out)
    answer = transient.march(fine, reduced, study.end, TIME_SHARE * study.accuracy)
    errors = {name: before.relative[name] * scale for name, scale in scales.items()}
    return _with_rows(study, answer, reduced, errors, scales, before.generations)


def _distance(a: Quantities, b: Quantities) -> dict[str, float]:
    return {name: float(np.abs(a[name] - b[name]).max()) for name in a}


def _with_rows(
    study: Study,
    answer: Transient,
    reduced: Reduced,
    errors: dict[str, float],
    scales: dict[str, float],
    generations: int,
) -> Response:
    """The response at as many rows as the accuracy takes; ``errors`` are those at any time without the rows' own."""

    def traces(times: np.ndarray) -> Quantities:
        return study.traces(outputs.of_transient(answer, study.part, times))

    allowed = {name: ROW_SHARE * study.accuracy * scale for name, scale in scales.items()}
    drive = answer.base.heat.inputs
    jumps = [float(t) for t in drive.knots(study.end) if drive.jump(float(t)).any()]
    times, found, between = rows.choose(answer.trajectory.steps, traces, allowed, jumps, study.instants)
    if answer.base.heat.lifts.any():
        _start(study, found)
    relative = {name: errors[name] / scales[name] for name in errors}
    errors = {name: errors[name] + between[name] + ROUNDING * scales[name] for name in errors}
    imbalance = _imbalance(study, answer)
    return Response(times, found, errors, True, imbalance, answer, reduced, [], False, scales, generations, relative)


def _start(study: Study, traces: Quantities) -> None:
    """Sets the first row of the mean temperatures that a jump of a given one at t = 0 leaves as they were.

    No mesh resolves the layer at that instant, and the fields of the transient hold it from later on only.
    """
    scene = study.part.scene
    for probe in scene.probes:
        mean = probe.quantity == "temperature" and (probe.lower == probe.upper or probe.reduce == "mean")
        if mean and probe.name in traces and probes.starts_free(scene, probe):
            traces[probe.name][0] = scene.initial_temperature


def _imbalance(study: Study, answer: Transient) -> float:
    """Largest |stored + lost - supplied| over the heat that came or went until then, whichever is more, from the
    earliest time of interest on.

    The integrals over time run over the steps by Gauss's rule, apart from how the steps were made; what is lost comes
    from the reactions of the full equations, so the figure sees the error of the reduced space too. Where a given
    temperature jumps, what its nodes store at that instant has entered there.
    Less heat than the rounding of the temperatures themselves counts as none.
    """
    points, weights = np.polynomial.legendre.leggauss(12)
    steps = answer.trajectory.steps
    # The loss starts like a power of t below any step: halve the first step's interval a few times.
    edges = np.concatenate([steps[0].length * 0.25 ** np.arange(8, 0, -1), [s.start + s.length for s in steps]])
    edges = np.concatenate([[0.0], edges])
    times = (edges[:-1, None] + np.diff(edges)[:, None] * (points + 1) / 2).ravel()
    out = outputs.of_transient(answer, study.part, times)
    flows = [v for name, v in out.items() if name.startswith("flow:")]
    entered = out["power"] + out["generated"] + sum(flows, np.zeros(len(times)))
    entering, leaving = outputs.passing(out)
    per_step = np.diff(edges) / 2

    def until(rate: np.ndarray) -> np.ndarray:
        found: np.ndarray = np.cumsum(per_step * (rate.reshape(-1, len(points)) @ weights))
        return found

    passed = np.maximum(until(entering), until(leaving))
    just_before = np.maximum(edges[1:] * (1 - 1e-12), edges[:-1])
    stored = outputs.stored_heat(answer, study.part, just_before)
    jumped = outputs.stored_heat(answer, study.part, edges[:-1]) - np.concatenate([[0.0], stored[:-1]])
    gap = np.abs(stored - until(entered) - np.cumsum(jumped * _jumps(answer, edges[:-1])))
    late = edges[1:] >= min(study.earliest, edges[-1])
    heat = answer.base.heat
    none = NOTHING * study.part.copies * float(heat.mass.sum()) * max(heat.scene.initial_temperature, 1.0)
    return float((gap / np.maximum(passed + np.cumsum(np.abs(jumped)), none))[late].max())


def _jumps(answer: Transient, edges: np.ndarray) -> np.ndarray:
    """Which edges an input jumps at, the start among them."""
    drive = answer.base.heat.inputs
    return np.array([i == 0 or bool(drive.jump(float(t)).any()) for i, t in enumerate(edges)])
