"""How far a model of any scene is from 3D, and where, in a sentence: the first line of a run."""

from __future__ import annotations

from collections.abc import Sequence

from compare.course import told_apart
from compare.probes import Both
from compare.quantities import called
from compare.verdict import Check
from scenes.formats import difference_text, percent, quantity
from scenes.model import OVER_TIME


def answered(both: Both, checks: Sequence[Check]) -> str:
    """Say how far a model is off and where: "lumped.py is 31 % high at the heater in the steady state; ..."."""
    name = both.model.model
    by_id = {check.id: check for check in checks}
    worst = [c for c in sorted(checks, key=lambda c: -abs(c.difference)) if c.verdict == "differs"]
    if not checks:
        return f"{name} and 3D have no quantity in common."
    if not worst:
        return f"{name} is {_agreeing(checks)}."
    first = worst[0].id.removesuffix(OVER_TIME)
    rest, course = by_id.get(first), by_id.get(f"{first}{OVER_TIME}")
    said = f"{name} is {_both(first, rest, course)}"
    if course is not None and course.verdict == "differs":
        apart = told_apart(both.course(first), abs((course.predicted - course.measured) / course.difference))
        said += f": {apart.said()}" if apart is not None and apart.told else ""
    others = [c for c in worst if c.id.removesuffix(OVER_TIME) != first]
    if others:
        # Of each other quantity what is worst of it.
        kinds = list({c.id.removesuffix(OVER_TIME): c for c in reversed(others)}.values())[::-1]
        parts = [f"its {called(c.id.removesuffix(OVER_TIME))} is {_off(c)}{_when(c)}" for c in kinds[:2]]
        said += f"; {', '.join(parts)}" + (f", and {len(kinds) - 2} more differ" if len(kinds) > 2 else "")
    fine = [
        c
        for c in checks
        if c.verdict != "differs" and c.id.removesuffix(OVER_TIME) not in {w.id.removesuffix(OVER_TIME) for w in worst}
    ]
    return f"{said}{f'; the rest is {_agreeing(fine)}' if fine else ''}."


def _both(name: str, rest: Check | None, course: Check | None) -> str:
    """ "31 % high at the heater in the steady state and 44 % at its worst, at 0.3 ms"."""
    if rest is None or course is None:
        only = course or rest
        assert only is not None
        return f"{_off(only)} at {called(name)}{_when(only)}"
    at_rest = f"{_off(rest)} at {called(name)} in the steady state"
    again = abs(course.difference) <= 1.1 * abs(rest.difference) + course.u_num + rest.u_num
    same = rest.difference * course.difference > 0
    if again and same:
        return f"{at_rest}, and no farther on the way" if rest.verdict == "differs" else at_rest
    worst = _off(course)
    worst = worst.rpartition(" ")[0] if same and rest.verdict == "differs" else worst
    return f"{at_rest} and {worst} at its worst, at {quantity(course.time or 0.0, 's', 3)}"


def _off(check: Check) -> str:
    """ "31 % high", with its error where that matters, and as a bound where it has no sign."""
    if abs(check.difference) <= check.u_num:
        return f"within {percent(abs(check.difference) + check.u_num)} of 3D"
    size = percent(abs(check.difference))
    if 10 * check.u_num > abs(check.difference):
        size = difference_text(abs(check.difference), check.u_num, "give or take").removeprefix("+")
    return f"{size} {'low' if check.difference < 0 else 'high'}"


def _when(check: Check) -> str:
    return " in the steady state" if check.time is None else f" at {quantity(check.time, 's', 3)}"


def _agreeing(checks: Sequence[Check]) -> str:
    open_ = [c for c in checks if c.verdict == "unresolved"]
    near = [c for c in checks if c.verdict == "agrees"]
    said = []
    if near:
        most = max(abs(c.difference) + c.u_num for c in near)
        names = list(dict.fromkeys(c.id.removesuffix(OVER_TIME) for c in near))
        where = f"at {' and '.join(map(called, names))}" if len(names) < 3 else f"at {len(names)} probes"
        over_time = [c.time is not None for c in near]
        when = "over time" if all(over_time) else "in the steady state and over time"
        when = when if any(over_time) else "in the steady state"
        said.append(f"within {percent(most)} of 3D {where} {when}")
    if open_:
        said.append(f"too near its tolerance to tell in {len(open_)} of {len(checks)} checks")
    return " and ".join(said)
