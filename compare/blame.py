"""Split the difference of a 1D model from 3D by assumption, and state the answer of a run in a sentence.

One assumption is replaced after the other. The results between the model and 3D have one assumption less each. A part
is the difference of two neighbours, so that the parts add up to the whole difference. In another order the parts would
differ by their interaction. For a sink the results are the ladder of models; for a network of lines the resistances
that 3D has at its joints replace the network's one after the other. Such a resistance is the difference of the mean
temperatures over the joined cross-sections, or to the given temperature, divided by the flow. The remainder is the
spread of flows over joints, and resistivities at the local temperature.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.verdict import Check, part, share
from scenes.checks import FIRST_TIME
from scenes.formats import difference_text, percent, quantity, signed
from scenes.model import UNITS, Scene
from scenes.result import Estimate, Result
from scenes.sink import OF_A_SINK

if TYPE_CHECKING:
    from reduced1d.ladder.levels import Levels
    from reduced1d.network.solution import Place


WHERE = {"the peak": "peak", "the ends": "end", "the current": "current"}
"""The quantities by their words in an answer."""
REST = "what lines cannot say"


def answer(who: str, claims: Sequence[Check], why: Callable[[Sequence[Check]], str] = lambda _: "") -> str:
    """Return the sentences about a model ``who``; ``why`` names the causes of some claims.

    A claim is a check with its place in a sentence as the title, and a detail, or nothing, as ``because``. A difference
    over time that is the steady one again is not repeated.
    """
    steady, course = ([each for each in claims if (each.time is None) is at_rest] for at_rest in (True, False))
    more = [each for each in course if each.verdict != "agrees" and not repeats(each, steady)]
    if steady:
        said = f"{who} is {_list(steady)} in the steady state{why(steady)}."
        said += f" On the way it is up to {_list(more)}, relative to the final rise{why(more)}." * bool(more)
    else:
        said = f"{who} is up to {_list(more)}{why(more)}." if more else f"{who} is {_list(course)} over time."
    return said.replace("up to within", "within")


def repeats(claim: Check, steady: Sequence[Check]) -> bool:
    """Return whether a difference over time is the steady one again, and not a tenth more, as of a cause of its own."""
    rest = next((other for other in steady if other.title == claim.title), None)
    if rest is None or claim.difference * rest.difference < 0:
        return False
    return abs(claim.difference) <= 1.1 * abs(rest.difference) + claim.u_num + rest.u_num


def _list(claims: Sequence[Check]) -> str:
    """The three largest claims that exceed their errors, with a detail, and the bound of the others; no open ones."""
    claims = [each for each in claims if each.u_num < 1] or claims
    largest = sorted((c for c in claims if abs(c.difference) > c.u_num), key=lambda c: -abs(c.difference))[:3]
    shown, others = ([each for each in claims if (each in largest) is wanted] for wanted in (True, False))
    said = [_size(each) for each in shown]
    if others:
        limit = bound(max(abs(each.difference) + each.u_num for each in others))
        many = f"{len(others)} {'others' if shown else 'quantities'}"
        places = " and ".join(each.title for each in others) if len(others) <= 3 else many
        said.append(f"within {limit} of 3D at {places}")
    joined = " and ".join(filter(None, (", ".join(said[:-1]), *said[-1:])))
    return joined + next((f": {each.because}" for each in shown if each.because), "")


def _size(claim: Check) -> str:
    """Return "6.6 % low at the peak", with the error where that matters."""
    when = "" if claim.time is None else f" (at {quantity(claim.time, 's', 3)})"
    size, u_num = abs(claim.difference), claim.u_num
    text = difference_text(size, u_num, "give or take").removeprefix("+") if 10 * u_num > size else percent(size)
    return f"{text} {'low' if claim.difference < 0 else 'high'} at {claim.title}{when}"


def bound(ratio: float) -> str:
    """Return a ratio in percent, rounded up to two digits."""
    if not 0 < ratio < math.inf:
        return percent(ratio)
    step = 10.0 ** (math.floor(math.log10(ratio)) - 1)
    return percent(math.ceil(ratio / step - 1e-9) * step)


@dataclass(frozen=True)
class Part:
    """The effect of one assumption on one quantity: ``value`` and its numerical ``error`` in the quantity's unit."""

    assumption: str
    value: float
    error: float


@dataclass(frozen=True)
class Split:
    """A difference, reduction less 3D, and its ``parts``, of one quantity.

    ``scale`` is the steady 3D rise or value; ``time_s`` is None in the steady state.
    """

    quantity: str
    unit: str
    scale: float
    difference: Estimate
    parts: tuple[Part, ...]
    time_s: float | None = None


@dataclass(frozen=True, eq=False)
class Budget:
    """The differences of the reduction ``start`` in parts.

    Attributes
    ----------
    steady : in the steady state
    transient : when each difference is largest, from 10 us on
    sentence : names the largest part
    """

    start: str
    steady: tuple[Split, ...]
    transient: tuple[Split, ...]
    sentence: str


def split(
    name: str, unit: str, scale: float, assumptions: Sequence[str], values: np.ndarray, errors: Sequence[float],
    times: np.ndarray | None = None, unsure: Sequence[float] = (),
) -> Split:  # fmt: skip
    """Split one quantity, where its difference is largest.

    Parameters
    ----------
    values : (assumptions + 1, n), of the reduction, of each result without one more assumption, and of 3D as the last
    errors : the error bound of each
    times : (n,) s, None in the steady state
    unsure : relative error of each part but the last due to its replacement; the last part bears all of them
    """
    i = int(np.argmax(np.abs(values[0] - values[-1])))
    drops, bounds = values[:-1, i] - values[1:, i], np.array(errors[:-1]) + errors[1:]
    if len(unsure):
        replaced = np.abs(drops[:-1]) * unsure
        bounds += np.append(replaced, replaced.sum())
    parts = tuple(map(Part, assumptions, drops.tolist(), bounds.tolist()))
    whole = Estimate(float(values[0, i] - values[-1, i]), errors[0] + errors[-1])
    return Split(name, unit, scale, whole, parts, None if times is None else float(times[i]))


def sentence(phrases: Mapping[str, str], splits: Sequence[Split]) -> str:
    """Name the largest part, relative to its scale, by the ``phrases`` of assumptions."""
    sure = [(one, each) for each in splits for one in each.parts if each.scale and abs(one.value) > one.error]
    if not sure:
        return "nothing is to blame: no part of the difference is larger than its numerical error"
    largest, worst = max(sure, key=lambda pair: abs(pair[0].value / pair[1].scale))
    when = "in the steady state" if worst.time_s is None else f"at {quantity(worst.time_s, 's', 3)}"
    rest = signed(worst.difference.value - largest.value, worst.unit)
    size, scale = percent(abs(largest.value / worst.scale)), "rise" if worst.unit == "K" else "value"
    return (
        f"the largest part is {phrases[largest.assumption]}: {signed(largest.value, worst.unit)} of the "
        f"{worst.quantity} {when}, {size} of the steady 3D {scale}; all the rest together makes {rest}"
    )


def budget(start: str, fem3d: Result, levels: Levels, progress: Callable[[str], None] = lambda _: None) -> Budget:
    """Compute the budget of the reduction ``start`` against a 3D result, at the times of its traces.

    Raises RunawayError where a model of the ladder has no steady state.
    """
    from reduced1d.ladder.levels import rungs, solve

    at, ladder, results = None if fem3d.traces is None else fem3d.traces.time, rungs(levels, start), []
    for rung in ladder:
        progress(f"solving the ladder: {rung.name}")
        results.append(solve(levels, rung, at is None, at))
    results.append(fem3d)
    phrases = {rung.blame: f"the {rung.blame}, as {rung.says}" for rung in ladder}
    times = None if at is None or at[-1] <= FIRST_TIME else np.unique(np.maximum(at, FIRST_TIME))
    steady, transient = [], []
    for name in WHERE.values():
        entry, estimates = OF_A_SINK[name], [result.steady[OF_A_SINK[name].steady] for result in results]
        shared = name, entry.unit, abs(estimates[-1].value), [*phrases]
        steady.append(split(*shared, np.array([[e.value] for e in estimates]), [e.error for e in estimates]))
        if times is not None:
            traces = [result.over_time for result in results]
            values = np.array([np.interp(times, t.time, t.values[entry.trace]) for t in traces])
            transient.append(split(*shared, values, [t.errors[entry.trace] for t in traces], times))
    return Budget(start, tuple(steady), tuple(transient), sentence(phrases, (*steady, *transient)))


def causes(claims: Sequence[Check], budget: Budget | None) -> str:
    """Return who is to blame for the claims that differ, in one phrase where all have the same cause.

    The cause of a difference is the assumption with the largest part of its sign.
    """
    from reduced1d.ladder.levels import AT_FAULT

    by_cause: dict[str, list[str]] = {}
    for claim in claims:
        if claim.verdict == "differs" and budget is not None:
            splits = budget.steady if claim.time is None else budget.transient
            whole = next(each for each in splits if each.quantity == WHERE[claim.title])
            largest = max(whole.parts, key=lambda each: each.value * whole.difference.value)
            by_cause.setdefault(AT_FAULT[largest.assumption], []).append(claim.title)
    if len(by_cause) == 1 and len(claims) == len(*by_cause.values()):
        return f"; {next(iter(by_cause))} is to blame"
    phrases = [f"{cause} is to blame for {' and '.join(places)}" for cause, places in by_cause.items()]
    return f"; {', '.join(phrases)}" if phrases else ""


def network_budget(given: Scene, fem3d: Result, network: Result) -> Budget:
    """Compute the budget of a network's steady differences from 3D.

    3D is solved once more on its first mesh, with probes of the mean temperatures and flows at all joints.
    """
    from fem3d.runs.scene import on_first_mesh
    from reduced1d.network.lines import layout
    from reduced1d.network.solution import places, solve

    scene = replace(given, steady=True, output_times=())
    shape = layout(scene)
    joints = places(shape)
    probes = {p.name: p for place in joints for p in (place.one, place.other, place.flow) if p is not None}
    probed = replace(shape, scene=replace(shape.scene, probes=(*shape.scene.probes, *probes.values())))
    in_3d = on_first_mesh(replace(scene, probes=(*scene.probes, *probes.values())))
    felt = _felt(scene, joints, in_3d, solve(probed).steady)
    measured = [(place.key, resistance) for place, resistance, _ in felt]
    between = [solve(replace(shape, measured=tuple(measured[: n + 1]))).steady for n in range(len(felt))]
    results, unsure = [network.steady, *between, fem3d.steady], [doubt for *_, doubt in felt]
    phrases = {place.called: f"the joint {place.called}, by 3D's resistance in its place" for place, *_ in felt}
    phrases[REST] = f"{REST}, after all joints"
    quantities, splits = {probe.name: probe.quantity for probe in scene.probes}, []
    for name in network.steady:
        unit, names = UNITS[quantities[name]], [*(place.called for place, *_ in felt), REST]
        values, errors = np.array([[steady[name].value] for steady in results]), [s[name].error for s in results]
        scale = fem3d.steady[name].value - scene.initial_temperature * (unit == "K")
        splits.append(split(name, unit, scale, names, values, errors, None, unsure))
    return Budget(network.model, tuple(splits), (), sentence(phrases, splits))


def _felt(
    scene: Scene, joints: Sequence[Place], in_3d: Mapping[str, Estimate], by_hand: Mapping[str, Estimate]
) -> list[tuple[Place, float, float]]:
    """The joints with a change of flow times drop above a thousandth of the largest flow times rise (or potential), the
    largest first: 3D's resistance (K/W or ohm), and its error over its change, at most 1."""
    base, largest = {"temperature": scene.initial_temperature, "potential": 0.0}, dict[str, float]()
    rows = list[tuple[float, "Place", float, float]]()
    for place in joints:
        kind, flow = place.one.quantity, in_3d[place.flow.name].value
        largest[kind] = max(abs(flow * (in_3d[place.one.name].value - base[kind])), largest.get(kind, 0.0))
        measured, drawn = (_resistance(scene, place, steady) for steady in (in_3d, by_hand))
        change = abs(measured.value - drawn.value)
        if change and math.isfinite(change + measured.error):
            rows.append((change * flow**2, place, place.sign * measured.value, min(measured.error / change, 1.0)))
    felt = [(part(row[0], largest[row[1].one.quantity]), *row[1:]) for row in rows]
    return [row[1:] for row in sorted(felt, key=lambda row: -row[0]) if row[0] > 1e-3]


def _resistance(scene: Scene, place: Place, steady: Mapping[str, Estimate]) -> Estimate:
    """The difference of the temperatures or potentials on both sides of a joint over its flow, with its error."""
    one, other = steady[place.one.name], Estimate(0.0, 0.0)
    if place.other is not None:
        other = steady[place.other.name]
    elif place.given is not None:
        boundary = scene.boundaries[place.given]
        value: Any = boundary.ambient if boundary.kind == "convection" else boundary.value
        other = Estimate(float(value), 0.0)
    return share(Estimate(one.value - other.value, one.error + other.error), steady[place.flow.name])
