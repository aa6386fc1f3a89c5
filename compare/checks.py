"""The checks of the paper's reduction of the sink against the 3D solution of the same sink, by id."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from compare import equation_checks, figure_checks
from compare.comparison import Comparison, Models
from compare.scope import OF_THE_PAPER, PAPERS, made_checks
from compare.verdict import Check, Verdict, judge
from compare.words import difference_text, percent
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import Sink

DEFINITIONS: dict[str, Callable[[Models], Comparison]] = {
    "eq12": equation_checks.eq12,
    "eq13": equation_checks.eq13,
    "eq14": equation_checks.eq14,
    "eq16": equation_checks.eq16,
    "eq18": equation_checks.eq18,
    "eq18_measured": equation_checks.eq18_measured,
    "fig4": figure_checks.fig4,
    "fig5": figure_checks.fig5,
    "fig6_peak": figure_checks.fig6_peak,
    "fig6_end": figure_checks.fig6_end,
    "fig7_current": figure_checks.fig7_current,
    "energy": equation_checks.energy,
}


def evaluate(sink: Sink, request: Request, fem3d: Result, reduced1d: Result | None) -> tuple[Check, ...]:
    """The checks that the run allows (``compare.scope``), in the order of ``DEFINITIONS``.

    ``fem3d`` has the steady state, and the traces if the request is for the transient; ``reduced1d``, ``None`` where
    it was not asked for, has its traces at the same times.
    """
    models = Models(sink, fem3d, reduced1d)
    found = [judged(name, DEFINITIONS[name](models), sink) for name in made_checks(sink, request)]
    another = reduced1d is not None and reduced1d.model not in PAPERS
    return tuple(replace(check, own=not (another and check.id in OF_THE_PAPER)) for check in found)


class Declaring(Protocol):
    """A scene of any type, as far as it says what is expected of its checks."""

    @property
    def tolerances(self) -> dict[str, float]: ...
    @property
    def expected_to_differ(self) -> tuple[str, ...] | None: ...
    def tolerance(self, check: str) -> float: ...


def expected(scene: Declaring, check: str) -> Verdict | None:
    """The verdict that a scene declares. Its list of checks that differ is complete: those not in it agree."""
    if scene.expected_to_differ is None:
        return None
    return "differs" if check in scene.expected_to_differ else "agrees"


def judged(name: str, found: Comparison, scene: Declaring, always: bool = False) -> Check:
    """What was found, with its verdict; ``always`` gives the reason whatever the verdict is."""
    tolerance = scene.tolerance(name)
    verdict = judge(found.difference, tolerance, found.u_num)
    because = ""
    if verdict == "differs" or always:
        because = found.reason()
    if verdict == "unresolved" and not always:
        doubt = (
            f"{difference_text(found.difference, found.u_num, 'give or take')} may be on either side of the "
            f"tolerance of {percent(tolerance)}"
        )
        because = f"{doubt}: ask for a smaller accuracy"
    return Check(
        name, found.title, found.predicted, found.measured, found.unit, found.difference, tolerance, found.u_num,
        verdict, expected(scene, name), because, found.time, found.sense, found.relative_to,
    )  # fmt: skip


def contradicts(check: Check, scene: Declaring, strict: bool) -> bool:
    """Whether a check came out other than the scene declares.

    Only what is declared can be contradicted: a verdict that is the opposite of the declared one, or a difference
    beyond a tolerance that the scene itself sets. ``strict`` takes every check without a declaration as expected to
    agree, and takes "unresolved" for a contradiction of either. An equation that is not the chosen model's
    contradicts nothing.
    """
    if not check.own:
        return False
    if strict:
        return check.verdict != (check.expected or "agrees")
    if check.verdict == "unresolved":
        return False
    if check.expected is not None:
        return check.verdict != check.expected
    return check.id in scene.tolerances and check.verdict == "differs"
