"""The answer of a run in a sentence: how far the 1D model is from 3D, where, and what in it is to blame.

What is to blame is asked of the ladder (``compare.budget``), and only where something differs beyond its tolerance.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from compare.outcome import Outcome
from compare.plan import BLAME
from compare.verdict import PAPERS, Verdict, judge, relative, spread
from scenes.formats import difference_text, percent, quantity, with_error
from scenes.plan import Step, noted

if TYPE_CHECKING:
    from compare.budget import Budget
    from reduced1d.ladder.levels import Levels
    from scenes.result import Estimate, Result
    from scenes.sink import Sink

_PLACES = {"peak": ("peak", "peak_rise_K", "fig4"), "end": ("ends", "end_rise_K", "fig6_end")}
"""Where, which steady rise there, and the check whose tolerance holds for it."""
_OVER_TIME = {"fig6_peak": "peak", "fig6_end": "end", "fig7_current": "current"}
_EXPLAINED = 2 / 3
"""The share of a difference from which on its causes are taken to explain it."""
_MORE = 1.1
"""How many times its steady value a difference over time must be to be told apart from it."""


@dataclass(frozen=True)
class Claim:
    """A difference, 1D less 3D, relative to the (final) 3D rise or the change of the current, and its numerical error;
    at its largest over time where it has a ``time`` (s), else in the steady state."""

    of: str
    difference: float
    error: float
    verdict: Verdict
    time: float | None = None

    @property
    def open(self) -> bool:
        """Whether the sign is not known."""
        return abs(self.difference) <= self.error

    @property
    def most(self) -> float:
        """A bound of its size."""
        return abs(self.difference) + self.error


def answered(outcome: Outcome[Sink], levels: Levels | None = None) -> Outcome[Sink]:
    """The outcome with its answer, and the plan as carried out; ``levels`` are the sink's where they exist already."""
    three, one = outcome.fem3d, outcome.reduced1d
    if one is None or three is None:
        return replace(outcome, answer=_of_one_model(three, one))
    if not three.steady["peak_rise_K"].value:
        return replace(outcome, answer="Nothing is heated, so that there is nothing to compare.")
    steady = _steady(outcome, three, one)
    over_time = [
        Claim(_OVER_TIME[check.id], check.difference, check.u_num, check.verdict, check.time)
        for check in outcome.checks
        if check.id in _OVER_TIME
    ]
    told = _told_apart(steady, over_time)
    wrong = [claim for claim in (*steady, *told) if claim.verdict == "differs"]
    budget, reason = outcome.why, ""
    if wrong and budget is None:
        budget, reason = _ladder(outcome, levels, any(claim.time is not None for claim in wrong))
    elif budget is None:
        reason = "the 1D model differs nowhere beyond its tolerances"
    said = f"{subject(one)} is {_steady_words(steady)} in the steady state{_blame(steady, budget)}"
    if told:
        said += f". On the way {_on_the_way(told)}{_blame(told, budget)}"
    elif over_time and all(claim.verdict == "agrees" for claim in (*steady, *over_time)):
        most = max(claim.most for claim in over_time if claim.of in _PLACES)
        farther = most > max(claim.most for claim in steady)
        said += f", and {f'within {_bound(most)} of the final rise' if farther else 'no farther'} on the way"
    plan = noted(outcome.plan, [Step(BLAME, "skipped", reason)] if reason else [])
    return replace(outcome, answer=f"{said}.", plan=plan)


def subject(one: Result) -> str:
    """The 1D model, at the start of a sentence."""
    return "The paper's 1D model" if one.model in PAPERS else f"The 1D model {one.model}"


def _of_one_model(three: Result | None, one: Result | None) -> str:
    found = three or one
    assert found is not None
    peak, end = (_value(found.steady[key]) for _, key, _ in _PLACES.values())
    who = "The 3D model" if one is None else subject(one)
    only = "no 1D model was run" if one is None else "no 3D model was run, so that nothing was compared"
    return f"{who} has its peak {peak} and its ends {end} above room in the steady state; {only}."


def _value(found: Estimate) -> str:
    """ "20.33 K", or with the error where that is among the digits."""
    value, error, shown, _, _ = with_error(found.value, found.error, "K")
    return quantity(found.value, "K") if 1e4 * found.error < abs(found.value) else f"{value} +- {error} {shown}"


def _steady(outcome: Outcome[Sink], three: Result, one: Result) -> list[Claim]:
    found = []
    for place, (_, key, check) in _PLACES.items():
        inputs = {"predicted": one.steady[key], "measured": three.steady[key]}
        difference, error = relative(*(estimate.value for estimate in inputs.values())), spread(relative, inputs)
        found.append(Claim(place, difference, error, judge(difference, outcome.scene.tolerance(check), error)))
    return found


def _told_apart(steady: Sequence[Claim], over_time: Iterable[Claim]) -> list[Claim]:
    """What over time is beyond its tolerance and not the steady difference over again. The current only where nothing
    is said of the rises, which it follows."""
    at_rest = {claim.of: claim for claim in steady}
    found: list[Claim] = []
    for claim in over_time:
        rest = at_rest.get(claim.of)
        if claim.verdict == "agrees" or (rest is None and (found or any(c.verdict != "agrees" for c in steady))):
            continue
        again = (
            rest is not None
            and claim.difference * rest.difference >= 0
            and abs(claim.difference) <= (_MORE * abs(rest.difference) + claim.error + rest.error)
        )
        found += [] if again else [claim]
    return found


def _ladder(outcome: Outcome[Sink], levels: Levels | None, transient: bool) -> tuple[Budget | None, str]:
    """The ladder's parts, and why there are none; its coarser models will do to tell which part is largest."""
    from compare.budget import budget
    from reduced1d.ladder.levels import Levels as Rough

    assert outcome.reduced1d is not None
    sink, name = outcome.scene, outcome.reduced1d.model
    fem3d = outcome.solved if transient else replace(outcome.solved, traces=None)
    try:
        return budget(sink, "paper" if name in PAPERS else name, fem3d, levels or Rough(sink, rough=True)), ""
    except ArithmeticError as error:
        return None, str(error)


def _off(claim: Claim) -> str:
    """ "6.6 % low"; with its error where that matters; as a bound where it has no sign."""
    if claim.open:
        known = ", all that 3D is known to," if claim.verdict == "unresolved" else ""
        return f"within {_bound(claim.most)}{known} of 3D"
    size = percent(abs(claim.difference))
    if 10 * claim.error > abs(claim.difference):
        size = difference_text(abs(claim.difference), claim.error, "give or take").removeprefix("+")
    return f"{size} {'low' if claim.difference < 0 else 'high'}"


def _steady_words(steady: Sequence[Claim]) -> str:
    if all(claim.open and claim.verdict == "agrees" for claim in steady):
        return f"within {_bound(max(claim.most for claim in steady))} of 3D at the peak and the ends"
    return " and ".join(f"{_off(claim)} at the {_PLACES[claim.of][0]}" for claim in steady)


def _on_the_way(told: Sequence[Claim]) -> str:
    rises = [claim for claim in told if claim.of in _PLACES]
    when = {claim.of: quantity(claim.time or 0.0, "s", 3) for claim in told}
    parts = [f"{_off(claim)} at the {_PLACES[claim.of][0]} (at {when[claim.of]})" for claim in rises]
    if rises:
        return f"it is up to {' and '.join(parts)}, relative to the final rise"
    return f"its current is up to {_off(told[0])} (at {when[told[0].of]}), relative to its change"


def _blame(claims: Sequence[Claim], budget: Budget | None) -> str:
    """What is to blame for those that differ, at once where it is the same for all."""
    causes: dict[str, list[str]] = {}
    for claim in claims:
        if claim.verdict == "differs" and budget is not None:
            where = _PLACES[claim.of][0] if claim.of in _PLACES else "current"
            causes.setdefault(_cause(claim, budget), []).append(f"the {where}")
    if len(causes) == 1 and len(claims) == len(*causes.values()):
        return f"; {next(iter(causes))} to blame"
    found = [f"{cause} to blame for {' and '.join(places)}" for cause, places in causes.items()]
    return "".join(f"{', ' if n else '; '}{text}" for n, text in enumerate(found))


def _cause(claim: Claim, budget: Budget) -> str:
    """The largest parts of a difference, as many as make it up but for a third."""
    from reduced1d.ladder.levels import AT_FAULT

    splits = budget.steady if claim.time is None else budget.transient
    split = next(split for split in splits if split.quantity == claim.of)
    left, chosen = split.total, []
    for part in sorted(split.parts, key=lambda part: -abs(part.value)):
        if abs(left) <= (1 - _EXPLAINED) * abs(split.total):
            break
        chosen.append(part)
        left -= part.value
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
