"""What a run can compare and draw, and why it leaves out the rest: the one place that decides it."""

from __future__ import annotations

from scenes.checks import DEFAULT_TOLERANCES
from scenes.plan import Request
from scenes.sink import Sink

FIRST_TIME = 10e-6
"""The time (s) from which on traces are compared: before it, the step's first instants would decide."""

FIGURES = {
    "figure4": "the steady 3D temperature field, rendered off screen",
    "figure5": "the rise along the beam and eq 9's parabola",
    "figure6": "rises against time",
    "figure7": "current against time",
}

OVER_TIME = ("fig6_peak", "fig6_end", "fig7_current")
"""The checks that need the transient."""
OF_THE_REDUCTION = ("fig4", *OVER_TIME)
"""The checks of the 1D model that was chosen."""
OF_THE_PAPER = ("eq12", "eq13", "eq14", "eq16", "eq18", "eq18_measured", "fig5")
"""The checks of the paper's equations, with 3D numbers put in, whichever 1D model was chosen."""
PAPERS = ("paper", "reduced1d")
"""What the paper's own model is called as a result."""
BLAME = "blame"
"""The plan's line of what is to blame."""


def skipped_checks(sink: Sink, request: Request) -> dict[str, str]:
    """The checks that a run can't make, each with the reason."""
    if "fem3d" not in request.models:
        return dict.fromkeys(DEFAULT_TOLERANCES, "they need the 3D model")
    skipped: dict[str, str] = {}
    if not request.transient:
        skipped |= dict.fromkeys(OVER_TIME, "they need the transient")
    elif sink.end_time <= FIRST_TIME:
        skipped |= dict.fromkeys(OVER_TIME, "they compare from 10 us on, and the run ends before")
    if "reduced1d" not in request.models:
        skipped |= dict.fromkeys(OF_THE_REDUCTION, "they need the 1D model")
    return {check: skipped[check] for check in DEFAULT_TOLERANCES if check in skipped}


def made_checks(sink: Sink, request: Request) -> tuple[str, ...]:
    """The checks that a run makes, in the order in which they are reported."""
    skipped = skipped_checks(sink, request)
    return tuple(check for check in DEFAULT_TOLERANCES if check not in skipped)


def skipped_figures(request: Request) -> dict[str, str]:
    """The figures that a run doesn't draw, each with the reason."""
    if not request.figures:
        return dict.fromkeys(FIGURES, "no figures were asked for")
    skipped: dict[str, str] = {}
    if "fem3d" not in request.models:
        skipped |= dict.fromkeys(("figure4", "figure5"), "there is no 3D field")
    if not request.transient:
        skipped |= dict.fromkeys(("figure6", "figure7"), "only the steady state was asked for")
    return skipped


def fields_reason(request: Request) -> str:
    """Why no field files are written; empty where they are."""
    if not request.fields:
        return "not asked for (--fields)"
    return "" if "fem3d" in request.models else "there is no 3D field"
