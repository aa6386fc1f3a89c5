"""The answer in a sentence: on a stand-in with given deviations, and on real sinks with different faults."""

from dataclasses import replace

import numpy as np
import pytest

import compare
from compare import blame
from compare.kinds import KINDS
from compare.options import Options
from compare.outcome import Outcome
from compare.verdict import Check
from reduced1d.ladder.levels import Levels
from scenes.result import Estimate, Result, Traces, step
from scenes.sink import Sink
from tests.conftest import Case


def told(sink: Sink, fem3d: Result | None, reduced1d: Result | None, options: Options | None = None) -> str:
    """The answer to results."""
    given = {"fem3d": fem3d, "reduced1d": reduced1d}
    results = {name: result for name, result in given.items() if result is not None}
    outcome = Outcome(sink, options or Options(), results, plan=(step("blame", "by the ladder"),))
    outcome.checks = KINDS["sink"].checks(outcome)
    return KINDS["sink"].answer(outcome)


def bent(case: Case, peak: float = 1.0, end: float = 1.0, bump: float = 0.0) -> Result:
    """A reduction that is the 3D stand-in but for factors of its rises, and a part of the final peak rise that its
    peak is too hot on the way."""
    steady = dict(case.fem3d.steady)
    for key, factor in (("peak_rise_K", peak), ("end_rise_K", end)):
        steady[key] = Estimate(factor * steady[key].value, 0.0)
    traces = case.fem3d.traces
    values = dict(traces.values)
    for key, factor in (("peak_K", peak), ("end_K", end)):
        values[key] = 293.0 + factor * (values[key] - 293.0)
    shape = np.exp(-(np.log(np.maximum(traces.time, 1e-9) / 1e-3) ** 2))
    values["peak_K"] = values["peak_K"] + bump * case.fem3d.steady["peak_rise_K"].value * shape
    return Result("paper", steady, Traces(traces.time, values, dict.fromkeys(values, 0.0)))


def test_what_agrees_is_bounded_and_nobody_is_blamed(case):
    found = told(case.sink, case.fem3d, bent(case))
    assert found.startswith("The paper's 1D model is within 0.011 % of 3D at the peak and the ends")
    assert "blame" not in found


def test_three_places_are_a_list():
    claims = [Check(place, 1.0, 1.0, "K", off, 0.0) for place, off in (("a", 0.2), ("b", -0.3), ("c", 0.4), ("d", 0.1))]
    assert blame.answer("It", claims[:2]) == "It is 20 % high at a and 30 % low at b in the steady state."
    listed = "20 % high at a, 30 % low at b, 40 % high at c and within 10 % of 3D at d"
    assert blame.answer("It", claims) == f"It is {listed} in the steady state."
    unknown = Check("e", 1.0, 1.0, "K", 0.02, 1.03)
    assert blame.answer("It", [*claims, unknown]) == f"It is {listed} in the steady state."


@pytest.mark.parametrize(("peak", "end", "said"), [
    (0.9, 1.2, "10 % low at the peak and 20 % high at the ends"),
    (1.02, 1.0, "2.0 % high at the peak and within 0.011 % of 3D at the ends"),
])  # fmt: skip
def test_steady_differences_have_their_size_and_sign(case, peak, end, said):
    assert said in told(case.sink, case.fem3d, bent(case, peak, end))


def test_an_error_that_matters_is_said(case):
    """With an error of 3D of 2 %, 10 % is 10 give or take 2; with an error of 20 %, it may be zero."""
    loose = case.errors(2e-2)
    assert "give or take" in told(loose.sink, loose.fem3d, bent(case, peak=0.9, end=0.9))
    looser = case.errors(0.2)
    found = told(looser.sink, looser.fem3d, bent(case))
    assert "% of 3D at the peak and the ends in the steady state" in found
    assert blame.answer("m", [Check("mid", 1.0, 1.0, "K", 0.1, 0.2, time=1.0)]) == "m is within 30 % of 3D at mid."
    assert "blame" not in found


def test_on_the_way_is_told_apart_from_the_steady_state(case):
    found = told(case.sink, case.fem3d, bent(case, bump=0.2))
    assert "On the way it is up to 20 % high at the peak (at " in found
    # A constant difference is not repeated.
    assert "On the way" not in told(case.sink, case.fem3d, bent(case, peak=0.9, end=0.9))
    steady = told(case.sink, case.fem3d, bent(case, bump=0.2), Options(steady=True))
    assert "way" not in steady


def test_one_model_alone(case):
    assert "The paper's 1D model alone was run" in told(case.sink, None, case.reduced1d, Options(only="1d"))
    three = told(case.sink, case.fem3d, None, Options(only="3d"))
    assert "20." in three
    assert "The 3D model alone was run" in three


BLAMED = {
    (): ["the anchor resistance (eq 14) is to blame."],
    ("sink.width=20um",): [
        "the anchor resistance (eq 14) is to blame for the ends.", "the fixed parabola (eq 9) is to blame",
    ],
    ("drive.electrodes=pad-edge",): ["the missing current in the pads is to blame for the peak"],
    ("anchor.oxide_thickness=200um", "run.end_time=1s"): ["the oxide's missing heat capacity is to blame."],
    ("environment.convection_coefficient=20000",): ["the fixed parabola (eq 9) is to blame."],
}  # fmt: skip


@pytest.mark.parametrize("settings", BLAMED)
def test_who_is_to_blame_is_computed(settings):
    found = compare.run("sink", overrides=settings, accuracy=1e-2).answer
    for said in BLAMED[settings]:
        assert said in found
    # Nobody else is.
    assert found.count("to blame") == len(BLAMED[settings]) + ("pad-edge" in str(settings)) * 2


def test_the_rough_ladder_finds_the_parts_of_the_fine_one(case):
    """To a hundredth of the difference: far below the third that decides who is to blame."""
    steady = replace(case.fem3d, traces=None)
    fine, rough = (blame.budget("paper", steady, Levels(case.sink, rough=rough)) for rough in (False, True))
    for a, b in zip(fine.steady, rough.steady, strict=True):
        for part, other in zip(a.parts, b.parts, strict=True):
            assert abs(part.value - other.value) < 0.01 * abs(a.difference.value)
