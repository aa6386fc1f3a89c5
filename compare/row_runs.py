"""How the differences of a row of spans run with the number of spans and with an island's length: other rows, solved
in the steady state by both models."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from compare.row_checks import DEFINITIONS
from compare.verdict import Models
from fem3d.run import solve as solve_3d
from reduced1d import ladder
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import Sink

CHECKS = {
    "islands_peak_inner": "inner peak", "islands_peak_outer": "outer peak", "islands_mean": "mean",
    "islands_current": "current", "islands_equivalent": "spans alike",
}  # fmt: skip
"""The checks that are followed, and what a curve of one is called."""
SPANS = (2, 3, 5, 10, 30, 100)
LENGTHS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Times the sink's own island; those longer than a span are left out."""


@dataclass(frozen=True)
class Varied:
    """The difference of each check (by id) for some ``values`` of a ``key``, of which ``own`` is the sink's."""

    key: str
    own: float
    values: tuple[float, ...]
    differences: tuple[dict[str, float], ...]


def varied(sink: Sink, reduction: str, single: Result, say: Callable[[str], None]) -> tuple[Varied, Varied]:
    """With the number of spans, and with the length of an island. Raises RunawayError where a row has no steady
    state."""
    request = Request(transient=False)

    def differences(other: Sink) -> dict[str, float]:
        say(f"{other.spans} spans with islands of {other.island * 1e6:.4g} um")
        models = Models(
            other, solve_3d(other, request), ladder.solve(other, reduction, steady_only=True), single
        )  # fmt: skip
        kept = [c for c in CHECKS if other.spans > 2 or c != "islands_peak_inner"]
        return {check: DEFINITIONS[check](models).difference for check in kept}

    lengths = tuple(factor * sink.island for factor in LENGTHS if factor * sink.island <= sink.length)
    return (
        Varied("sink.spans", sink.spans, SPANS, tuple(differences(replace(sink, spans=n)) for n in SPANS)),
        Varied(
            "sink.island_length", sink.island, lengths,
            tuple(differences(replace(sink, island_length=length)) for length in lengths),
        ),
    )  # fmt: skip
