"""Split the difference of a 1D model from 3D by assumption, and answer in a sentence how far it is off and why.

The models of the ladder stand between the 1D model and 3D, each with one assumption less than the one before. A part is
the difference of two neighbours, so that the parts add up to the whole difference. In another order the parts would
differ by their interaction. The ladder is solved only where a difference exceeds its tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from compare.against import from_first
from compare.verdict import PAPERS, Check, Verdict, judge, relative, spread
from scenes.checks import FIRST_TIME
from scenes.formats import difference_text, percent, quantity, signed, with_error
from scenes.sink import OF_A_SINK

if TYPE_CHECKING:
    from reduced1d.ladder.levels import Levels, Rung
    from scenes.result import Estimate, Result
    from scenes.sink import Sink

ITSELF = "current"
QUANTITIES = {name: OF_A_SINK[name] for name in ("peak", "end", "current")}
_PLACES = {"peak": ("peak", "peak_rise_K", "fig4"), "end": ("ends", "end_rise_K", "fig6_end")}
"""Where, which steady rise there, and the check whose tolerance holds for it."""
_OVER_TIME = {"fig6_peak": "peak", "fig6_end": "end", "fig7_current": "current"}
"""The quantity that each check of a trace is about."""
_EXPLAINED = 2 / 3
"""An assumption explains a difference where its part is at least this share of it."""
_MORE = 1.1
"""A difference over time larger than this many times the steady one has a cause of its own."""


@dataclass(frozen=True)
class Part:
    """The effect of one assumption on one quantity.

    ``value`` and its numerical ``error`` have the quantity's unit; ``largest`` is the largest effect from 10 us on, at
    ``when`` (s).
    """

    blame: str
    value: float
    error: float
    largest: float | None = None
    when: float | None = None


@dataclass(frozen=True)
class Split:
    """A difference, reduction less 3D, with its numerical ``error`` and its ``parts``.

    ``scale`` is the final rise, or the change of the current, with its sign; ``time`` (s) is None in the steady state.
    """

    quantity: str
    unit: str
    scale: float
    total: float
    error: float
    parts: tuple[Part, ...]
    time: float | None = None


@dataclass(frozen=True, eq=False)
class Budget:
    """The differences of the reduction ``start`` in parts.

    Attributes
    ----------
    steady : in the steady state
    transient : when each difference is largest, from 10 us on
    times, over_time : (n,) s; by quantity the parts (parts, n)
    sentence : names the largest part
    """

    start: str
    steady: tuple[Split, ...]
    transient: tuple[Split, ...]
    times: np.ndarray | None
    over_time: dict[str, np.ndarray]
    sentence: str


def budget(
    sink: Sink, start: str, fem3d: Result, levels: Levels, progress: Callable[[str], None] = lambda _: None
) -> Budget:
    """Compute the budget of the reduction ``start`` against a 3D result, at the times of its traces.

    Raises RunawayError where a model of the ladder has no steady state.
    """
    from reduced1d.ladder.levels import rungs, solve
    from scenes.errors import RunawayError

    ladder = rungs(levels, start)
    at = None if fem3d.traces is None else fem3d.traces.time
    results = []
    for rung in ladder:
        progress(f"solving the ladder: {rung.name}")
        try:
            results.append(solve(levels, rung, at is None, at))
        except RunawayError as error:
            raise RunawayError(
                f"on the ladder from {start} to 3D, in the model {rung.name} (see --why): {error}", error.limit
            ) from None
    results.append(fem3d)
    times, steady, transient, over_time = None, [], [], {}
    if fem3d.traces is not None and fem3d.traces.time[-1] > FIRST_TIME:
        times = from_first(fem3d.traces.time)
    for name, entry in QUANTITIES.items():
        scale = scale_of(sink, name, fem3d, levels)
        estimates = [result.steady[entry.steady] for result in results]
        values = np.array([[estimate.value] for estimate in estimates])
        steady.append(_split(name, scale, ladder, values, [estimate.error for estimate in estimates], None))
        if times is not None:
            traces = [result.traces for result in results if result.traces is not None]
            values = np.array([np.interp(times, t.time, t.values[entry.trace]) for t in traces])
            transient.append(_split(name, scale, ladder, values, [t.errors[entry.trace] for t in traces], times))
            over_time[name] = values[:-1] - values[1:]
    sentence = _sentence(ladder, (*steady, *transient), of_current(sink))
    return Budget(start, tuple(steady), tuple(transient), times, over_time, sentence)


def scale_of(sink: Sink, name: str, fem3d: Result, levels: Levels) -> float:
    """Return the scale of a quantity's differences: the final 3D rise, or the change of the 3D current from cold."""
    value = fem3d.steady[QUANTITIES[name].steady].value
    if name != "current" or of_current(sink) == ITSELF:
        return abs(value)
    if fem3d.traces is not None:
        return abs(value - float(fem3d.traces.values["current_A"][0]))
    return abs(value - float(sink.drive.through(levels.fine.plate.model.resistance)))


def of_current(sink: Sink) -> str:
    """Name the scale of the current: itself where it does not change, is given, or passes a row's islands."""
    changes = sink.silicon.warms and sink.spans == 1 and sink.current is None
    return "change of the current" if changes else ITSELF


def _split(
    name: str, scale: float, ladder: Sequence[Rung], values: np.ndarray, errors: Sequence[float],
    times: np.ndarray | None,
) -> Split:  # fmt: skip
    i = int(np.argmax(np.abs(values[0] - values[-1])))
    drops = values[:-1] - values[1:]
    parts = [Part(rung.blame, float(drops[n, i]), errors[n] + errors[n + 1]) for n, rung in enumerate(ladder)]
    if times is not None:
        worst = np.argmax(np.abs(drops), axis=1)
        parts = [
            replace(part, largest=float(drops[n, at]), when=float(times[at]))
            for n, (part, at) in enumerate(zip(parts, worst, strict=True))
        ]
    total, when = float(values[0, i] - values[-1, i]), None if times is None else float(times[i])
    return Split(name, QUANTITIES[name].unit, scale, total, errors[0] + errors[-1], tuple(parts), when)


def _sentence(ladder: Sequence[Rung], splits: Sequence[Split], of_current: str) -> str:
    """The largest part, relative to its scale, in plain English."""
    split, n = max(
        ((split, n) for split in splits for n in range(len(ladder)) if split.scale),
        key=lambda pair: abs(pair[0].parts[pair[1]].value) / pair[0].scale,
    )
    part, unit = split.parts[n], split.unit
    whole = of_current if split.quantity == "current" else f"final {split.quantity} rise"
    when = "in the steady state" if split.time is None else f"at {quantity(split.time, 's', 3)}"
    rest = split.total - part.value
    does = f"puts the current {signed(part.value, unit)} off"
    if split.quantity != "current":
        what = {"peak": "peak", "end": "ends"}[split.quantity]
        does = f"makes the {what} {quantity(abs(part.value), unit, 3)} too {'hot' if part.value > 0 else 'cold'}"
    if abs(part.value) <= part.error:
        return (
            "nothing is to blame: no part of the difference is larger than its numerical error, "
            f"{percent(part.error / split.scale)} of the {whole}"
        )
    return (
        f"the largest part is the {part.blame}: {ladder[n].says}, which alone {does} {when}, "
        f"{percent(abs(part.value) / split.scale)} of the {whole}; all the rest together makes {signed(rest, unit)}"
    )


@dataclass(frozen=True)
class Claim:
    """A difference, 1D less 3D, relative to the 3D rise or the change of the current, with its numerical error.

    ``time`` (s) is that of the largest difference, None in the steady state.
    """

    quantity: str
    difference: float
    error: float
    verdict: Verdict
    time: float | None = None

    @property
    def open(self) -> bool:
        """Whether the error leaves the sign open."""
        return abs(self.difference) <= self.error

    @property
    def most(self) -> float:
        """A bound of its size."""
        return abs(self.difference) + self.error


def answered(
    sink: Sink, fem3d: Result | None, reduced1d: Result | None, checks: Iterable[Check], split: Budget | None = None,
    levels: Levels | None = None,
) -> tuple[str, str]:  # fmt: skip
    """Return the answer, and why the ladder was not solved (empty where it was).

    ``split`` and ``levels`` are results of earlier analyses that serve again.
    """
    if reduced1d is None or fem3d is None:
        return _of_one_model(fem3d, reduced1d), ""
    if not fem3d.steady["peak_rise_K"].value:
        return "Nothing is heated, so that there is nothing to compare.", ""
    steady = _steady(sink, fem3d, reduced1d)
    over_time = [
        Claim(_OVER_TIME[check.id], check.difference, check.u_num, check.verdict, check.time)
        for check in checks
        if check.id in _OVER_TIME
    ]
    claims = _told_apart(steady, over_time)
    wrong, reason = [claim for claim in (*steady, *claims) if claim.verdict == "differs"], ""
    if wrong and split is None:
        fem3d = fem3d if any(claim.time is not None for claim in wrong) else replace(fem3d, traces=None)
        split, reason = _ladder(sink, fem3d, reduced1d.model, levels)
    elif split is None:
        reason = "the 1D model differs nowhere beyond its tolerances"
    said = f"{subject(reduced1d)} says nothing of the peak and the ends in the steady state"
    if steady:
        said = f"{subject(reduced1d)} is {_steady_words(steady)} in the steady state{_blame(steady, split)}"
    if claims:
        said += f". On the way {_on_the_way(claims)}{_blame(claims, split)}"
    elif over_time and all(claim.verdict == "agrees" for claim in (*steady, *over_time)):
        most = max((claim.most for claim in over_time if claim.quantity in _PLACES), default=0.0)
        farther = most > max((claim.most for claim in steady), default=0.0)
        said += f", and {f'within {_bound(most)} of the final rise' if farther else 'no farther'} on the way"
    return f"{said}.", reason


def subject(reduced1d: Result) -> str:
    """The 1D model, at the start of a sentence."""
    return "The paper's 1D model" if reduced1d.model in PAPERS else f"The 1D model {reduced1d.model}"


def _of_one_model(fem3d: Result | None, reduced1d: Result | None) -> str:
    model = fem3d or reduced1d
    assert model is not None
    peak, end = (_value(model.steady[key]) for _, key, _ in _PLACES.values())
    who = "The 3D model" if reduced1d is None else subject(reduced1d)
    only = "no 1D model was run" if reduced1d is None else "no 3D model was run, so that nothing was compared"
    return f"{who} has its peak {peak} and its ends {end} above room in the steady state; {only}."


def _value(rise: Estimate) -> str:
    """ "20.33 K", or with the error where that is among the digits."""
    value, error, shown, _, _ = with_error(rise.value, rise.error, "K")
    return quantity(rise.value, "K") if 1e4 * rise.error < abs(rise.value) else f"{value} +- {error} {shown}"


def _steady(sink: Sink, fem3d: Result, reduced1d: Result) -> list[Claim]:
    claims = []
    for place, (_, key, check) in _PLACES.items():
        if key not in reduced1d.steady:
            continue
        inputs = {"predicted": reduced1d.steady[key], "measured": fem3d.steady[key]}
        difference, error = relative(*(estimate.value for estimate in inputs.values())), spread(relative, inputs)
        claims.append(Claim(place, difference, error, judge(difference, sink.tolerance(check), error)))
    return claims


def _told_apart(steady: Sequence[Claim], over_time: Iterable[Claim]) -> list[Claim]:
    at_rest = {claim.quantity: claim for claim in steady}
    claims: list[Claim] = []
    for claim in over_time:
        rest = at_rest.get(claim.quantity)
        if claim.verdict == "agrees" or (rest is None and (claims or any(c.verdict != "agrees" for c in steady))):
            continue
        again = (
            rest is not None
            and claim.difference * rest.difference >= 0
            and abs(claim.difference) <= (_MORE * abs(rest.difference) + claim.error + rest.error)
        )
        claims += [] if again else [claim]
    return claims


def _ladder(sink: Sink, fem3d: Result, name: str, levels: Levels | None) -> tuple[Budget | None, str]:
    """The ladder's parts, and why there are none; its coarser models will do to tell which part is largest."""
    from reduced1d.ladder import is_one
    from reduced1d.ladder.levels import Levels as Rough

    if name not in PAPERS and not is_one(name):
        return None, "the ladder of assumptions is between this program's own 1D models and 3D"
    try:
        return budget(sink, "paper" if name in PAPERS else name, fem3d, levels or Rough(sink, rough=True)), ""
    except ArithmeticError as error:
        return None, str(error)


def _off(claim: Claim) -> str:
    """ "6.6 % low"; with its error where that matters; as a bound where it has no sign."""
    if claim.open:
        limit = ", all that 3D is known to," if claim.verdict == "unresolved" else ""
        return f"within {_bound(claim.most)}{limit} of 3D"
    size = percent(abs(claim.difference))
    if 10 * claim.error > abs(claim.difference):
        size = difference_text(abs(claim.difference), claim.error, "give or take").removeprefix("+")
    return f"{size} {'low' if claim.difference < 0 else 'high'}"


def _steady_words(steady: Sequence[Claim]) -> str:
    if all(claim.open and claim.verdict == "agrees" for claim in steady):
        return f"within {_bound(max(claim.most for claim in steady))} of 3D at the peak and the ends"
    return " and ".join(f"{_off(claim)} at the {_PLACES[claim.quantity][0]}" for claim in steady)


def _on_the_way(claims: Sequence[Claim]) -> str:
    rises = [claim for claim in claims if claim.quantity in _PLACES]
    when = {claim.quantity: quantity(claim.time or 0.0, "s", 3) for claim in claims}
    parts = [f"{_off(claim)} at the {_PLACES[claim.quantity][0]} (at {when[claim.quantity]})" for claim in rises]
    if rises:
        return f"it is up to {' and '.join(parts)}, relative to the final rise"
    return f"its current is up to {_off(claims[0])} (at {when[claims[0].quantity]}), relative to its change"


def _blame(claims: Sequence[Claim], budget: Budget | None) -> str:
    """The causes of the claims that differ, in one phrase where all have the same cause."""
    causes: dict[str, list[str]] = {}
    for claim in claims:
        if claim.verdict == "differs" and budget is not None:
            where = _PLACES[claim.quantity][0] if claim.quantity in _PLACES else "current"
            causes.setdefault(_cause(claim, budget), []).append(f"the {where}")
    if len(causes) == 1 and len(claims) == len(*causes.values()):
        return f"; {next(iter(causes))} to blame"
    phrases = [f"{cause} to blame for {' and '.join(places)}" for cause, places in causes.items()]
    return "".join(f"{', ' if n else '; '}{text}" for n, text in enumerate(phrases))


def _cause(claim: Claim, budget: Budget) -> str:
    from reduced1d.ladder.levels import AT_FAULT

    splits = budget.steady if claim.time is None else budget.transient
    split = next(split for split in splits if split.quantity == claim.quantity)
    remainder, chosen = split.total, []
    for part in sorted(split.parts, key=lambda part: -abs(part.value)):
        if abs(remainder) <= (1 - _EXPLAINED) * abs(split.total):
            break
        chosen.append(part)
        remainder -= part.value
    guilty = [AT_FAULT[part.blame] for part in chosen if part.value * split.total > 0]
    against = [AT_FAULT[part.blame] for part in chosen if part.value * split.total < 0]
    offset = f", offset in part by {' and '.join(against)}," if against else ""
    return f"{' and '.join(guilty)}{offset} {'is' if len(guilty) == 1 else 'are'}"


def _bound(ratio: float) -> str:
    """In percent, rounded up to two digits."""
    if not 0 < ratio < math.inf:
        return percent(ratio)
    step = 10.0 ** (math.floor(math.log10(ratio)) - 1)
    return percent(math.ceil(ratio / step - 1e-9) * step)
