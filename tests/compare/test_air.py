"""What leaving out the air does: limits that hold when solved at, and coefficients with their sources."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from compare import air
from fem3d.run import solve
from scenes.plan import Request
from scenes.sink import Sink

SINK = Sink(accuracy=1e-2)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(air, "COEFFICIENTS", (20.0, 100.0, 300.0, 1000.0))


def test_at_a_limit_the_difference_is_the_tolerance() -> None:
    found = air.of_sink(SINK, lambda _: None)
    limit = found.limits["mean"]
    assert limit is not None
    request = Request(models=("fem3d",), transient=False)
    cooled, bare = (solve(replace(SINK, convection_coefficient=h), request).steady["mean_rise_K"] for h in (limit, 0.0))
    # Between two coefficients the logarithms run straight to a hundredth.
    assert bare.value / cooled.value - 1 == pytest.approx(SINK.tolerance("air_mean"), rel=0.02)
    assert found.limits["current"] is None


def test_still_air_of_the_textbook_may_be_left_out_and_a_strong_wind_may_not() -> None:
    still, wind = (
        air.of_sink(replace(SINK, convection_coefficient=h), lambda _: None).checks for h in (0.0, 1000.0)
    )  # fmt: skip
    assert [check.verdict for check in still] == ["agrees"] * 4
    assert [check.verdict for check in wind] == ["differs"] * 3 + ["agrees"]
    assert "1000 W/(m2 K)" in wind[0].because


def test_the_lumped_term_is_nearer_than_none() -> None:
    found = air.of_sink(SINK, lambda _: None)
    for name in ("peak", "mean", "end"):
        assert all(abs(found.lumped[name]) < abs(found.left_out[name]) / 3)


def test_a_row_of_spans_loses_heat_to_the_air_too() -> None:
    found = air.of_sink(replace(SINK, spans=2), lambda _: None)
    assert [check.verdict for check in found.checks] == ["agrees"] * 4
    assert found.limits["mean"] == pytest.approx(100.0, rel=0.5)


def test_what_air_at_rest_conducts() -> None:
    """A strip of 1000 x 100 um: pi k / (w ln 40)."""
    assert air.conduction(Sink()) == pytest.approx(math.pi * 0.0263 / (1e-4 * math.log(40)))
