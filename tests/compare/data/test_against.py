"""A user's traces against the 3D model: equal traces agree and moved traces show their shift, at any rows of time;
intervals of noisy traces hold the truth as often as stated."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from compare.against import Data, compare, comparisons
from compare.course import windows, worst
from compare.verdict import COVERS, Check, judged
from scenes.errors import SceneError
from scenes.result import Result
from scenes.sink import Sink
from validate.cli import main

KEYS = ("peak_K", "end_K", "mean_K", "current_A", "power_W")


def made(fem3d: Result, times: np.ndarray, factor: float = 1.0, later: float = 0.0) -> Data:
    """The 3D traces at other times, their changes times a factor, and later by a part of the time."""
    traces = fem3d.traces
    values = {}
    for key in KEYS:
        first = traces.values[key][0]
        values[key] = first + factor * (np.interp(times / (1 + later), traces.time, traces.values[key]) - first)
    return Data("mine.csv", times, values)


def evaluate(sink: Sink, data: Data, fem3d: Result) -> list[Check]:
    return [judged(name, check, sink) for name, check in comparisons(sink, data, fem3d).items()]


UNEVEN = np.concatenate([[0.0], np.geomspace(3e-6, 0.05, 300)])


@pytest.mark.parametrize("factor", [0.9, 1.1])
def test_a_curve_that_is_off_is_found_by_how_much(case, factor):
    found = {check.id: check for check in evaluate(case.sink, made(case.fem3d, UNEVEN, factor), case.fem3d)}
    assert list(found) == ["against_peak", "against_end", "against_mean", "against_current", "against_power"]
    for name in ("against_peak", "against_end", "against_mean", "against_current"):
        assert found[name].verdict == "differs"
        assert abs(found[name].difference) == pytest.approx(0.1, abs=0.005)
    # The current falls: with more of its change the data are below.
    assert found["against_current"].difference * (factor - 1) < 0


def test_a_result_beside_is_compared_where_the_first_one_is_furthest(case):
    """Data 1 K above in one row and 0.99 K below in another: 0.1 K more in 3D change the difference by 0.1 K."""
    data, traces = made(case.fem3d, np.linspace(0, 0.02, 201)), case.fem3d.over_time
    data.values["peak_K"][[100, 150]] += 1.0, -0.99
    warmer = replace(traces, values=traces.values | {"peak_K": traces.values["peak_K"] + 0.1})
    base = compare(case.sink, data, [case.fem3d], "peak_K")
    beside = compare(case.sink, data, [replace(case.fem3d, traces=warmer)], "peak_K", case.fem3d)
    assert beside.time == base.time
    assert beside.difference == pytest.approx(0.9 * base.difference)


def test_a_shift_in_time_is_a_difference(case):
    """Compared by rows, a curve with the same values at times 30 % later would agree."""
    found = compare(case.sink, made(case.fem3d, UNEVEN * 1.3, later=0.3), [case.fem3d], "peak_K")
    assert abs(found.difference) > 0.05
    assert 1e-4 < found.time < 0.02


@pytest.mark.parametrize("every", [0.5e-3, 2e-3, 4e-3])
def test_exact_values_agree_at_any_spacing(case, every):
    """3D's own values, at rows between which the curves bend by up to a quarter of their rise."""
    times = np.arange(0.0, 0.02 + 1e-9, every)
    for check in evaluate(case.sink, made(case.fem3d, times), case.fem3d):
        assert check.verdict == "agrees"
        assert check.difference == pytest.approx(0, abs=1e-12)
        assert check.u_num < 0.002


@pytest.mark.parametrize("key", ["peak_K", "end_K", "mean_K"])
def test_what_a_distance_may_be_between_rows(case, key):
    """The distance of a curve that is 30 % late rises and falls within a few rows: between them it is as large as the
    difference with its error has it, and the error shrinks with the rows' spacing."""

    def at(times: np.ndarray) -> tuple[float, float]:
        found = compare(case.sink, made(case.fem3d, times, later=0.3), [case.fem3d], key)
        return abs(found.difference), found.u_num

    largest, fine = at(np.linspace(0, 0.02, 2001))
    for rows in (21, 41, 81):
        distance, error = at(np.linspace(0, 0.02, rows))
        assert distance - fine <= largest <= distance + error
    assert at(np.linspace(0, 0.02, 21))[1] > 4 * at(np.linspace(0, 0.02, 161))[1]


def test_no_time_in_common(case):
    with pytest.raises(SceneError, match="no time to compare"):
        evaluate(case.sink, made(case.fem3d, np.array([1.0, 2.0, 3.0])), case.fem3d)


def test_a_declared_tolerance_holds(case):
    data = made(case.fem3d, UNEVEN, 1.1)
    loose = replace(case.sink, tolerances={"against_peak": 0.2})
    assert evaluate(loose, data, case.fem3d)[0].verdict == "agrees"


@pytest.mark.long
@pytest.mark.usefixtures("no_solver")
def test_the_command(case, monkeypatch, capsys, tmp_path):
    """In the table, the report and figure 6; its numbers and keys are of the contract."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("validate.report.figures.render.Renderer.start", lambda self: None)
    data = made(case.fem3d, UNEVEN, 1.1)
    # The scene declares every check that differs, and this one is not among them.
    Path("comsol.txt").write_text(
        "% Version: COMSOL 6.2\n% Time (ms)    Peak (degC)\n"
        + "\n".join(f"{1e3 * t:.9g}  {v - 273.15:.9g}" for t, v in zip(data.time, data.values["peak_K"], strict=True)),
        encoding="utf-8",
    )
    assert main(["sink", "--against", "comsol.txt"]) == 1
    out = capsys.readouterr().out
    assert "comsol.txt (COMSOL table, 301 rows, 0 s to 50.0 ms): time is" in out
    assert '"Peak (degC)"' in " ".join(out.split())
    assert "not as expected: against_peak" in out
    figure = Path("results/sink-1V-against-comsol.txt/figure6.svg").read_text(encoding="utf-8")
    assert "peak, comsol.txt" in figure
    assert "against_peak DIFFERS" in figure
    report = Path("results/sink-1V-against-comsol.txt/report.html").read_text(encoding="utf-8")
    assert "comsol.txt" in report
    assert "Peak (degC)" in report


def noisy(fem3d: Result, u: float, off: float = 0.0, seed: int = 0) -> Data:
    """The 3D traces at 2,001 even times with noise of the ends (K), which is their uncertainty."""
    data = made(fem3d, np.linspace(0, 0.02, 2001))
    drawn = np.random.default_rng(seed).normal(off, u, len(data.time))
    return replace(data, values={"end_K": data.values["end_K"] + drawn}, u={"end_K": np.full(len(drawn), u)})


def test_noise_that_is_known_is_no_difference(case):
    """The largest of 2,001 samples is 0.17 K off by chance, 5 % of the rise of the ends; the worst window is not. An
    offset of 0.3 K is detected, whatever the noise."""
    for seed in range(20):
        (check,) = evaluate(case.sink, noisy(case.fem3d, 0.05, seed=seed), case.fem3d)
        assert check.verdict == "agrees"
        assert check.u_data is not None
        # A window has 30 rows at least: three times 0.05 K over their root are 0.6 % of the rise.
        assert 0 < abs(check.difference) < 0.01
        assert check.known_to < 0.02
        (check,) = evaluate(case.sink, noisy(case.fem3d, 0.05, off=0.3, seed=seed), case.fem3d)
        assert check.verdict == "differs"
    bare = replace(noisy(case.fem3d, 0.05), u={})
    assert abs(evaluate(case.sink, bare, case.fem3d)[0].difference) > 0.04


def test_the_verdict_counts_what_the_data_are_known_to(case):
    """Data 0.1 K too high as a whole, 3 % of the rise: resolved with an uncertainty of 0.01 K, not with 0.5 K."""
    data = made(case.fem3d, UNEVEN)
    high = replace(data, values={"end_K": data.values["end_K"] + 0.1})
    for u, verdict in ((0.01, "agrees"), (0.5, "unresolved")):
        known = replace(high, u={"end_K": np.full(len(data.time), u)})
        (check,) = evaluate(case.sink, known, case.fem3d)
        assert check.verdict == verdict
        # All of u is shared by the rows: they do not scatter, and the mean of one of 16 windows is known to 2.95 u.
        assert check.u_data == pytest.approx(2.95 / 2 * u / case.fem3d.steady["end_rise_K"].value, rel=0.1)


@pytest.mark.usefixtures("no_solver")
def test_a_start_that_is_off_is_judged_against_what_the_data_are_known_to(case, capsys, monkeypatch, tmp_path):
    """0.6 K is 18 % of the ends' rise: refused of exact data, accepted with an uncertainty of 0.3 K."""
    monkeypatch.chdir(tmp_path)
    times = np.linspace(0, 0.02, 60)
    data = made(case.fem3d, times)
    rows = zip(times, data.values["end_K"] + np.where(times == 0, 0.6, 0.0), strict=True)
    Path("noisy.csv").write_text(
        "time (s),end (K)\n" + "\n".join(f"{t:.9g},{v:.9g}" for t, v in rows), encoding="utf-8"
    )
    assert main(["sink", "--against", "noisy.csv", "--no-figures"]) == 2
    assert "--data-uncertainty" in capsys.readouterr().err
    for u, said in (("0.3K", False), ("0.5K", False), ("0.25K", True)):
        assert main(["sink", "--against", "noisy.csv", "--data-uncertainty", u, "--no-figures"]) != 2
        captured = capsys.readouterr()
        assert ("room_temperature" in captured.out + captured.err) == said
    assert main(["sink", "--against", "noisy.csv", "--data-uncertainty", "0.1K", "--no-figures"]) == 2


U = 0.05


def share_that_holds(
    rows: int, truth: float, shared: float, other: float = 0.0, slack: float = 1.0, count: int = 200,
    follows: float = 0.0,
) -> tuple[float, float, float]:  # fmt: skip
    """Return how often the intervals of the worst window (times ``slack``) and of the last window hold, and how often
    the worst is detected. Noise U: a shared part for all rows, the rest ``follows`` the row before in part; another
    uncertainty is shared by all."""
    time = np.linspace(1e-4, 0.02, rows)
    curve = 1 - np.exp(-time / 3e-3)
    drawn, held = np.random.default_rng(7), np.zeros((count, 3))
    for n in range(count):
        common, new = drawn.normal(), drawn.normal(size=rows)
        new[1:] *= np.sqrt(1 - follows**2)
        noise = shared * common + np.sqrt(1 - shared**2) * lfilter([1.0], [1.0, -follows], new)
        off = truth + U * noise + other * drawn.normal()
        found = windows(time, off, np.full(rows, U), curve)
        i, k = worst(found, [other] * len(found))
        half, end = slack * k * np.hypot(found[i].u_data, other), COVERS * np.hypot(found[-1].u_data, other)
        held[n] = (
            abs(found[i].distance - truth) <= half,
            abs(found[-1].distance - truth) <= end,
            (abs(found[i].distance) > half),
        )
    worst_held, end_held, seen = held.mean(axis=0)
    return float(worst_held), float(end_held), float(seen)


@pytest.mark.long
@pytest.mark.parametrize(("rows", "shared", "other", "follows"), [
    (2001, 0.0, 0.0, 0.0), (200, 0.0, 0.0, 0.0), (40, 0.0, 0.0, 0.0), (2001, 1.0, 0.0, 0.0), (2001, 0.5, 0.0, 0.0),
    (2001, 0.0, 0.01, 0.0), (60, 0.0, 0.0, 0.9), (200, 0.0, 0.0, 0.2), (200, 0.0, 0.0, 0.9), (60, 0.0, 0.0, 0.3),
    (60, 0.5, 0.0, 0.0),
])  # fmt: skip
def test_the_truth_is_within_in_95_of_100(rows, shared, other, follows):
    """93 % of 800 repetitions at least, as chance has it; noise that neighbouring rows share makes wider intervals."""
    worst_held, end_held, _ = share_that_holds(rows, 0.0, shared, other, count=800, follows=follows)
    assert worst_held >= 0.93
    assert end_held >= 0.93


def test_half_an_interval_is_caught():
    worst_held, _, _ = share_that_holds(2001, 0.0, 0.0, slack=0.6)
    assert worst_held < 0.75


@pytest.mark.long
def test_an_offset_is_found():
    """Twice the noise of one row: detected in every repetition, and in 5 of 100 a false offset."""
    assert share_that_holds(2001, 0.1, 0.0)[2] == 1.0
    assert share_that_holds(2001, 0.0, 0.0)[2] < 0.07
    # If all noise is shared, 2 u is no more than chance.
    assert share_that_holds(2001, 0.1, 1.0)[2] < 0.75
