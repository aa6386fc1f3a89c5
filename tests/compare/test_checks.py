"""Each check's definition on made-up results, with a twin of a given error that must be caught; and the checks of a row
of spans, whose reasons are true."""

import math
from dataclasses import replace

import numpy as np
import pytest

from compare.course import overshoot
from compare.options import Options
from compare.outcome import Outcome
from compare.pipeline import solve as answer
from compare.verdict import Check, judge
from fem3d.runs import sink as sink_run
from scenes.result import Estimate, Result, Traces
from scenes.sink import Sink
from tests.conftest import RESISTANCE, Case, judged, stand_in

PRINTED = 50e-6 / (130 * 150e-6 * 2e-6) + 2e-6 / (1.38 * 50e-6 * 50e-6)


def checks_of(case: Case) -> dict[str, Check]:
    return judged(case.sink, case.fem3d, case.reduced1d)


def value(case: Case, key: str) -> float:
    return case.fem3d.steady[key].value


def test_equations_by_hand(case):
    found = checks_of(case)
    peak, end, mean = (value(case, f"{q}_rise_K") for q in ("peak", "end", "mean"))
    current, power = value(case, "current_A"), value(case, "power_W")
    dT0 = peak - end
    predicted = {
        "eq12": current**2 * 300 * (1 + 5e-4 * (2 / 3 * dT0 + end)),
        "eq13": 2 / 3 * dT0 + end,
        "eq14": PRINTED,
        "eq16": 4 * 130 * 200e-12 * dT0 / 1e-3,
        "eq18": mean / (1 + 1e-3 / (6 * 130 * 200e-12 * PRINTED)),
        "eq18_measured": mean / (1 + 1e-3 / (6 * 130 * 200e-12 * RESISTANCE)),
    }
    measured = {
        "eq12": power, "eq13": mean, "eq14": RESISTANCE, "eq16": end / RESISTANCE, "eq18": end, "eq18_measured": end,
    }  # fmt: skip
    for name, formula in predicted.items():
        assert found[name].predicted == pytest.approx(formula, rel=1e-12)
        assert found[name].measured == pytest.approx(measured[name], rel=1e-12)
        assert found[name].difference == pytest.approx(formula / measured[name] - 1, abs=1e-12)
    assert abs(PRINTED - 1861.76) < 0.005


def test_fig5_is_the_distance_from_the_parabola(case):
    L = case.sink.length
    y = np.linspace(0.0, L, 401)
    parabola = 5.0 + 16.0 * (1 - 4 * (y / L - 0.5) ** 2)
    bump = np.sin(2 * np.pi * y / L)  # vanishes at the ends and the middle; its RMS is 1/sqrt 2
    for size in (0.0, 1.2):
        fem3d = replace(
            case.fem3d, details={**case.fem3d.details, "profile": {"y_m": y, "rise_K": parabola + size * bump}}
        )
        found = checks_of(replace(case, fem3d=fem3d))["fig5"]
        assert found.difference == pytest.approx(size / math.sqrt(2) / 16.0, rel=1e-4, abs=1e-12)
        assert found.measured == pytest.approx(size / math.sqrt(2), rel=1e-4, abs=1e-12)
        assert found.verdict == ("differs" if size else "agrees")


def _over_time(case: Case, key: str, bump: np.ndarray) -> Case:
    """The 1D traces equal to 3D except for a bump of one quantity."""
    solution = case.fem3d.traces
    values = {**solution.values, key: solution.values[key] + bump}
    return replace(
        case, reduced1d=replace(case.reduced1d, traces=Traces(solution.time, values, dict.fromkeys(values, 0.0)))
    )


@pytest.mark.parametrize(("name", "key", "steady"), [
    ("fig6_peak", "peak_K", "peak_rise_K"), ("fig6_end", "end_K", "end_rise_K"),
    ("fig7_current", "current_A", "current_A"),
])  # fmt: skip
def test_largest_distance_over_time(name, key, steady, case):
    time = case.fem3d.traces.time
    final = value(case, steady) - (1 / 300 if key == "current_A" else 0.0)
    i = int(np.searchsorted(time, 1e-3))
    early = np.where(time < 9e-6, 10.0, 0.0)  # before 10 us: not compared
    for part in (0.02, -0.2):
        bump = np.where(np.arange(len(time)) == i, part * abs(final), 0.0) + early
        found = checks_of(_over_time(case, key, bump))[name]
        assert found.difference == pytest.approx(part, rel=1e-6)
        assert found.time == time[i]
        assert found.verdict == ("agrees" if part == 0.02 else "differs")
        # An isolated maximum is no more certain than its neighbours allow; the 3D errors come on top.
        assert found.u_num >= case.fem3d.traces.errors[key] / abs(final)


def test_a_maximum_between_two_times_is_bounded():
    """Of a parabola whose top lies between the times the bound covers it, and is h^2/8 |y''|."""
    time = np.array([1e-5, 1e-3, 2e-3, 3e-3])
    off = 3 - ((time - 1.7e-3) / 1e-3) ** 2
    i = int(off.argmax())
    assert off[i] + overshoot(time, off)[i] >= 3.0
    assert overshoot(time, off)[i] == pytest.approx(1 / 4, rel=1e-12)


def test_current_that_does_not_change():
    sink = Sink(silicon=replace(Sink().silicon, temperature_coefficient=0.0))
    fem3d = stand_in(sink)
    off = replace(fem3d.traces, values={k: 1.1 * v if k == "current_A" else v for k, v in fem3d.traces.values.items()})
    for traces, difference in ((fem3d.traces, 0.0), (off, 0.1)):
        found = checks_of(Case(sink, fem3d, Result("paper", fem3d.steady, traces)))["fig7_current"]
        assert found.difference == pytest.approx(difference, abs=1e-12)
        assert "of itself" in found.title


def test_large_errors_leave_a_check_unresolved(case):
    exact, rough = checks_of(case.errors(0.0)), checks_of(case.errors(0.05))
    assert exact["eq13"].u_num == 0.0
    assert exact["eq13"].verdict == "agrees"
    assert rough["eq13"].verdict == "unresolved"
    assert "smaller accuracy" in rough["eq13"].because
    # The peak's error counts 2/3, the end's 1/3 and the mean's whole: for eq 13 with equal relative errors e about 2 e.
    assert rough["eq13"].u_num == pytest.approx(0.1, rel=0.06)
    peak = Case(
        case.sink, replace(case.fem3d, steady={**case.fem3d.steady, "peak_rise_K": Estimate(20.0, 0.2)}), case.reduced1d
    )
    assert checks_of(peak)["fig4"].u_num == pytest.approx(19.0 / 19.8 - 19.0 / 20.0, rel=1e-3)


def test_reference_temperature_other_than_room():
    """Eq 12's slope is about room temperature, whatever the material's coefficient refers to."""
    silicon = replace(Sink().silicon, reference_temperature=350.0)
    sink = replace(Sink(), silicon=silicon)
    fem3d = stand_in(sink)
    found = judged(sink, fem3d, None, Options(steady=True, only="3d"))
    assert abs(found["eq12"].difference) < 1e-4


@pytest.mark.parametrize(
    ("difference", "u_num", "verdict"),
    [
        (0.01, 0.005, "agrees"), (-0.01, 0.005, "agrees"), (0.03, 0.005, "differs"), (-0.03, 0.005, "differs"),
        (0.02, 0.0, "agrees"), (0.0200001, 0.0, "differs"), (0.018, 0.005, "unresolved"), (0.022, 0.005, "unresolved"),
        (0.0, 0.03, "unresolved"), (float("inf"), 0.0, "differs"), (float("nan"), 0.0, "unresolved"),
        (float("inf"), float("inf"), "unresolved"),
    ],
)  # fmt: skip
def test_judge(difference, u_num, verdict):
    assert judge(difference, 0.02, u_num) == verdict


ROW = Sink(spans=3, accuracy=1e-2)


@pytest.fixture(scope="module")
def outcome():
    return answer(ROW, Options(figures=False))


def named(checks: tuple[Check, ...]) -> dict[str, Check]:
    return {check.id: check for check in checks}


def evaluated(outcome: Outcome[Sink], fem3d: Result, single: Result) -> dict[str, Check]:
    return judged(ROW, fem3d, outcome.reduced1d, outcome.options, single)


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
