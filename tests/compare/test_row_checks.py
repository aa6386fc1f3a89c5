"""The checks of a row of spans: their differences, and that their reasons are true."""

from dataclasses import replace

import numpy as np
import pytest

from compare.options import Options
from compare.outcome import Outcome
from compare.pipeline import solve as answer
from compare.verdict import Check
from fem3d.runs import sink as sink_run
from scenes.checks import ISLAND_TOLERANCES
from scenes.errors import SceneError
from scenes.result import Estimate, Result
from scenes.sink import Sink
from tests.conftest import judged

ROW = Sink(spans=3, accuracy=1e-2)


@pytest.fixture(scope="module")
def outcome():
    return answer(ROW, Options(figures=False))


def named(checks: tuple[Check, ...]) -> dict[str, Check]:
    return {check.id: check for check in checks}


def evaluated(outcome: Outcome[Sink], fem3d: Result, single: Result) -> dict[str, Check]:
    return judged(ROW, fem3d, outcome.reduced1d, outcome.options, single)


def test_a_row_has_the_checks_of_rows(outcome):
    assert [check.id for check in outcome.checks] == [*ISLAND_TOLERANCES, "fig4", "energy"]


def test_the_current_is_off_by_what_is_left_out_of_the_circuit(outcome):
    """Two islands of 50 um in a row of 3100 um; the spans' rises change the resistance by less than a thousandth."""
    found = named(outcome.checks)
    assert found["islands_current"].difference == pytest.approx(3100 / 3000 - 1, abs=1e-3)


def test_one_sink_alone_is_compared_with_each_span(outcome):
    """The twin: a single sink that is like the spans agrees."""
    assert named(outcome.checks)["islands_equivalent"].verdict == "differs"
    steady = outcome.solved.steady
    alike = {name: e for name, e in steady.items() if name.startswith("span1")}
    same = {name.replace("span1", f"span{k}"): e for name, e in alike.items() for k in (1, 2)}
    other = replace(outcome.solved, steady={**steady, **same})
    one = replace(outcome.solved, steady={f"{w}_rise_K": alike[f"span1_{w}_rise_K"] for w in ("peak", "mean")})
    assert evaluated(outcome, other, one)["islands_equivalent"].verdict == "agrees"


def test_spans_are_apart_over_time_as_their_traces_are(outcome):
    """At the stated time, against the traces themselves; the twin: the row's own peak for the single one's."""
    found = named(outcome.checks)["islands_equivalent_over_time"]
    single = sink_run.solve(replace(ROW, spans=1))
    assert "one sink alone" in found.because
    assert found.measured is not None
    at = []
    for result, name in ((single, "mean_K"), (outcome.solved, "span2_mean_K")):
        at.append(float(np.interp(found.time, result.traces.time, result.traces.values[name])))
    apart = (at[0] - at[1]) / outcome.solved.steady["span2_mean_rise_K"].value
    assert found.difference == pytest.approx(apart, rel=1e-9)
    assert found.verdict == "differs"
    own = evaluated(outcome, outcome.solved, outcome.solved)[found.id]
    assert abs(own.difference) < abs(found.difference) / 2


def test_a_wrong_inner_peak_is_seen(outcome):
    steady = outcome.solved.steady
    moved = Estimate(1.1 * steady["span2_peak_rise_K"].value, 0.0)
    other = replace(outcome.solved, steady={**steady, "span2_peak_rise_K": moved})
    assert evaluated(outcome, other, outcome.solved)["islands_peak_inner"].verdict == "differs"


def test_two_spans_have_no_inner_one():
    found = answer(replace(ROW, spans=2), Options(figures=False, steady=True))
    assert not [check.id for check in found.checks if "inner" in check.id]


def test_what_is_made_of_one_span_is_refused_before_anything_is_solved():
    with pytest.raises(SceneError, match="made for one span"):
        answer(ROW, Options(reduction="plate"))


@pytest.mark.long
def test_a_long_rows_fin_is_cheap_and_told_from_that_of_a_short_one():
    request = Options(figures=False, steady=True, reduction="fin", only="1d")
    long, short = (answer(replace(ROW, spans=n), request).reduced1d for n in (60, 8))
    assert long.details["states"] < 500
    # Seven islands between eight spans, 59 between sixty: the current shows their share of the row.
    current = [row.steady["current_A"].value for row in (long, short)]
    assert current[0] / current[1] == pytest.approx((8000 + 7 * 50) / 8 / ((60_000 + 59 * 50) / 60), rel=2e-4)
