"""The checks of the paper's reduction of the sink against the 3D solution of the same sink, by id."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from compare import equation_checks, figure_checks, row_checks
from compare.plan import made_checks
from compare.verdict import PAPERS, Check, Comparison, Models, judged
from scenes.checks import OF_THE_PAPER, OF_THE_SPANS
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
    **row_checks.DEFINITIONS,
}


def evaluate(
    sink: Sink, request: Request, fem3d: Result, reduced1d: Result | None, single: Result | None = None
) -> tuple[Check, ...]:
    """The checks that the run allows (``compare.plan``), in its order.

    ``fem3d`` has the steady state, and the traces if the request is for the transient; ``reduced1d``, ``None`` where
    it was not asked for, has its traces at the same times. ``single`` is the 3D result of one span alone, for a
    row of them; without it the check of that is left out.
    """
    models = Models(sink, fem3d, reduced1d, single)
    # What a row's checks find is told whether they agree or not: two faults may offset each other.
    found = [
        judged(name, DEFINITIONS[name](models), sink, name in row_checks.DEFINITIONS)
        for name in made_checks(sink, request)
        if single is not None or name not in OF_THE_SPANS
    ]
    another = reduced1d is not None and reduced1d.model not in PAPERS
    return tuple(replace(check, own=not (another and check.id in OF_THE_PAPER)) for check in found)
