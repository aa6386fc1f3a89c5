"""What leaving out the air does: limits that hold when solved at, and coefficients with their sources."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from fem3d.runs.sink import solve
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import Sink
from validate.inputs import air

SINK = Sink(accuracy=2e-2)
solved = cache(solve)


def cooled(coefficient: float, transient: bool = True) -> Result:
    sink = replace(SINK, convection_coefficient=coefficient)
    return solved(sink, Request(models=("fem3d",), transient=transient))


@pytest.fixture(scope="module", autouse=True)
def found() -> Iterator[air.Air]:
    """Of few coefficients, every sink solved once for all tests."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(air, "solve_3d", solved)
        patch.setattr(air, "COEFFICIENTS", (20.0, 100.0, 1000.0))
        yield air.of_sink(SINK, lambda _: None)
    solved.cache_clear()


@pytest.mark.long
def test_at_a_limit_the_difference_is_the_tolerance(found: air.Air) -> None:
    limit, tolerance = found.limits["mean"], SINK.tolerance("air_mean")
    assert limit is not None

    def off(h: float) -> float:
        return cooled(0.0).steady["mean_rise_K"].value / cooled(h, False).steady["mean_rise_K"].value - 1

    # The mean falls like 1 / (1 + h / h0): what the search leaves, and the twin's tenth.
    assert off(limit.value) == pytest.approx(tolerance, rel=2 * air.CLOSE)
    assert off(1.1 * limit.value) != pytest.approx(tolerance, rel=2 * air.CLOSE)
    assert limit.error < 0.05 * limit.value
    assert found.limits["current"] is None
    # A run of seven time constants is as long as the steady state: its limit is that.
    over_run = found.over_time and found.over_time.limits["mean"]
    assert over_run is not None
    assert over_run.value == pytest.approx(limit.value, rel=5e-3)


def test_until_then_the_air_may_be_left_out(found: air.Air) -> None:
    """At the time that is said the traces of two runs are apart by the tolerance, of the final rise."""
    assert found.over_time is not None
    bare, windy = cooled(0.0), cooled(1000.0)
    until = float(found.over_time.until["peak"][-1])
    for when, same in ((until, True), (2 * until, False)):
        at = [float(np.interp(when, r.traces.time, r.traces.values["peak_K"])) for r in (bare, windy) if r.traces]
        apart = (at[0] - at[1]) / windy.steady["peak_rise_K"].value
        # Rows are so dense that straight lines between them are within the accuracy.
        assert (abs(apart - SINK.tolerance("air_peak")) < 2 * SINK.accuracy) == same
    assert np.isinf(found.over_time.until["peak"][0])


def test_still_air_of_the_textbook_may_be_left_out_and_a_strong_wind_may_not(
    found: air.Air, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert [check.verdict for check in found.checks] == ["agrees"] * 4
    monkeypatch.setattr(air, "COEFFICIENTS", ())
    monkeypatch.setattr(air, "_limit", lambda *_: None)  # which is tested above
    wind = air.of_sink(replace(SINK, convection_coefficient=1000.0), lambda _: None, False).checks
    assert [check.verdict for check in wind] == ["differs"] * 3 + ["agrees"]
    assert "1000 W/(m2 K)" in wind[0].because


def test_the_lumped_term_is_nearer_than_none(found: air.Air) -> None:
    for name in ("peak", "mean", "end"):
        assert all(abs(found.lumped[name]) < abs(found.left_out[name]) / 3)


@pytest.mark.long
def test_a_row_of_spans_loses_heat_to_the_air_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(air, "COEFFICIENTS", (50.0, 200.0))
    monkeypatch.setattr(air, "QUANTITIES", {"mean": "mean_rise_K"})
    limit = air.of_sink(replace(SINK, spans=2), lambda _: None, False).limits["mean"]
    assert limit is not None
    assert limit.value == pytest.approx(100.0, rel=0.5)


def test_what_air_at_rest_conducts() -> None:
    """A strip of 1000 x 100 um: pi k / (w ln 40). Exactly an elliptic disc has 2 pi a / K(e) from one side, a = L /
    2: as slender as the beam it is within two percent."""
    from scipy.special import ellipkm1

    assert air.conduction(Sink()) == pytest.approx(math.pi * 0.0263 / (1e-4 * math.log(40)))
    for width, close in ((1e-4, 5e-3), (1e-5, 1e-4)):
        sink = Sink(width=width)
        exact = air.CONDUCTIVITY * math.pi * sink.length / float(ellipkm1((width / sink.length) ** 2))
        assert air.conduction(sink) * sink.length * width == pytest.approx(exact, rel=close)
