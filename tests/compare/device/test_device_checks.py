"""The checks of Figures 9 to 14 on the paper's own scene: given numbers, by hand where there is a formula."""

from dataclasses import replace

import numpy as np
import pytest

from compare.device_checks import CHECKS
from compare.kinds.device import DeviceKind
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.slopes import device_1d
from compare.verdict import Check, judged, spread
from reduced1d.device.lumped import largest_eigenvalue, steady
from reduced1d.device.schemes import solve_accurate
from scenes.checks import DEVICE_TOLERANCES
from scenes.device import Control, Device, External
from scenes.keys import DEVICE
from scenes.loading import load
from scenes.result import Estimate, Result
from statespace.result import Run, Runs, sampled_slowly, settling
from validate.report.checks import claimed, off_by

SLOPE = 0.15 * 1e-3 * 100e-6 / 100e-6
METERS = ("meter_resistance", "meter_power", "meter_rate")


KIND = DeviceKind()


def solved(device: Device, options: Options) -> tuple[Runs, dict[str, Check]]:
    """The 1D runs and the checks by their ids."""
    outcome = Outcome(device, options, KIND.solve(device, options, Progress()))
    return outcome.runs, {check.id: check for check in KIND.checks(outcome)}


@pytest.fixture(scope="module")
def found():
    return solved(load("device", ["accuracy=1e-3"], scene_type=DEVICE), Options())[1]


def test_every_check_is_made_once_and_as_declared(found):
    assert tuple(found) == tuple(DEVICE_TOLERANCES)
    assert all(check.verdict == check.expected for check in found.values())
    assert all(check.u_num < check.tolerance / 10 for check in found.values())


def test_settling_power_slope_and_limit_by_hand(found):
    alpha, thickness = 0.15 / (970 * 1460), 100e-6
    time = np.log(2 / 0.01) * thickness**2 / (np.pi**2 * alpha)  # the polymer's slowest mode, at twice the step
    settling = found["fig9_settling"]
    assert settling.measured == pytest.approx(time, rel=0.01)
    assert (settling.sense, settling.verdict) == ("equal", "differs")
    for name in ("fig9_balance", "fig10_steady"):
        assert found[name].measured == pytest.approx(SLOPE * 37.5, rel=1e-10)
    assert found["fig13_slope"].measured == pytest.approx(-SLOPE, rel=1e-9)
    assert found["fig13_limit"].measured == pytest.approx(310.5, abs=1e-7)
    slow, same = found["fig11_slow"], found["fig12_same_time"]
    assert slow.measured > 4 * slow.predicted
    assert (slow.sense, slow.difference, slow.verdict) == ("at least", 0.0, "agrees")
    assert (claimed(slow), off_by(slow)) == ("at least 50.70 ms", "holds")
    # Only the step beyond the set point takes another time.
    assert same.predicted == pytest.approx(settling.measured, rel=1e-3)
    assert same.measured == pytest.approx(29.5e-3, abs=0.1e-3)


def test_a_step_that_changes_almost_nothing_is_held_to_the_change_from_cold():
    """The sink's voltage, which the outer step leaves as it is in 1D and moves by 0.1 % in 3D: its settling is alike in
    both, and not that into 1 % of almost nothing."""
    device = load("device", scene_type=DEVICE)
    result = solve_accurate(device)
    time = settling(device, result, "sink_V")[-1].time
    late = result.time_s > device.external.step_time
    for moved in (0.0, 1e-3, 9e-3):
        after = replace(result.after, sink_V=result.after.sink_V * (1 + moved))
        shifted = replace(result, after=after, sink_V=result.sink_V * np.where(late, 1 + moved, 1.0))
        assert settling(device, shifted, "sink_V")[-1].time == pytest.approx(time, rel=0.05)
        assert settling(device, shifted, "sink_V")[-1].band == pytest.approx(0.01 * after.sink_V)


def test_a_faster_loop_than_figure_11_is_needed_for_it_to_be_slower():
    slow = sampled_slowly(Device())
    slower = replace(slow, control=replace(slow.control, sink_gain=0.1, sensor_gain=0.01), end_time=1.5)
    request = Options(about=("figure11",))
    (check,) = solved(slower, request)[1].values()
    assert check.verdict == "differs"
    assert check.difference > 0.5


def test_what_is_not_needed_is_not_run():
    device = Device()
    assert KIND.made(device, Options(about=("figure11",))) == ("fig11_slow",)
    assert KIND.others(device, Options(about=("figure9",))) == (False, False)
    late = {k for k in DEVICE_TOLERANCES if k.startswith(("fig11", "fig12", "fig13"))}
    assert set(KIND.skipped(device, Options(scheme="paper"))) == late
    still = replace(device, external=External(293.0, 293.0))
    assert KIND.made(still, Options()) == ("fig12_same_time", "fig13_slope", "fig13_limit", *METERS)


@pytest.mark.long
def test_the_papers_scheme_is_checked_against_the_accurate_one():
    device, request = replace(Device(), end_time=0.08, external=External(step_time=0.01)), Options(scheme="paper")
    made, found = solved(device, request)
    assert set(found) == {"fig9_settling", "fig9_balance", "fig10_steady", *METERS}
    assert 1e-6 < found["fig9_settling"].u_num < 0.01
    assert "most of that is an error in space" in made.base.result.findings[0]


def evaluated(device: Device, *figures: str) -> dict[str, Check]:
    return solved(device, Options(about=figures))[1]


def meters(device: Device) -> dict[str, Check]:
    """The meters' checks alone, which need no run but the scene's."""
    base = Run(device, solve_accurate(replace(device, end_time=2 * device.control.sample_time)), largest_eigenvalue)
    outcome = Outcome(device, results={"reduced1d": Result("reduced1d", {}, None, {"runs": Runs(base, None, ())})})
    made = {name: CHECKS[name][0](outcome) for name in METERS}
    return {name: judged(name, comparison, device) for name, comparison in made.items() if comparison}


def test_the_papers_sentence_on_meters_by_hand(found):
    # R = 1.115 ohm (1 + 17.5 a) takes P = 150 uW/K 37.5 K; on 100 mV to 100 nV and 200 mA to 100 nA.
    R, P = 1.115 * (1 + 3.768e-3 * 17.5), SLOPE * 37.5
    V, current = np.sqrt(P * R), np.sqrt(P / R)
    assert found["meter_resistance"].measured == pytest.approx(R * 1e-7 * (1 / V + 1 / current), rel=1e-9)
    assert found["meter_power"].measured == pytest.approx(1e-7 * (V + current), rel=1e-9)
    # The paper's own 60 uohm and 23 nW: its ranges at their ends, as a root of squares, and their rounding.
    assert 50 * np.hypot(1e-6, 5e-7) == pytest.approx(found["meter_resistance"].predicted, rel=0.1)
    assert 20e-3 * np.hypot(1e-6, 5e-7) == pytest.approx(found["meter_power"].predicted, rel=0.05)
    assert found["meter_rate"].measured == pytest.approx(1e4)
    assert found["meter_rate"].verdict == "differs"


def test_a_meter_fails_a_thin_film_and_suffices_for_a_slow_loop():
    thin, slow = meters(Device(sensor_thickness=1e-9)), meters(Device(control=Control(0.25)))
    assert [thin[name].verdict for name in METERS] == ["differs"] * 3
    assert [slow[name].verdict for name in METERS] == ["agrees"] * 3
    without = meters(Device(control=Control(sensor_gain=0.0)))
    assert without["meter_power"].measured == np.inf
    assert "power is zero" in without["meter_power"].because


def test_nothing_is_judged_by_a_run_that_ends_too_early():
    short = replace(Device(), control=Control(1e-3, 0.5), external=External(step_time=0.1), end_time=0.11)
    early = evaluated(short, "figure9", "figure10")
    assert {check.verdict for check in early.values()} == {"unresolved"}
    assert all("give a longer run.end_time" in early[name].because for name in ("fig9_balance", "fig10_steady"))
    late = evaluated(replace(short, end_time=0.4), "figure9", "figure10")
    assert [check.verdict for check in late.values()] == ["differs", "agrees", "agrees"]


def test_a_time_that_does_not_come_is_at_least_as_long_as_was_watched():
    slow = replace(Device(), control=Control(50e-3))
    check = evaluated(slow, "figure9")["fig9_settling"]
    assert check.measured == np.inf
    assert check.difference + check.u_num == pytest.approx(0.1 / 0.25 - 1)
    assert check.difference - check.u_num == pytest.approx(-1)
    assert check.verdict == "differs"
    assert evaluated(replace(Device(), end_time=0.2501), "figure12")["fig12_same_time"].verdict == "unresolved"
    assert spread(lambda x: x, {"x": Estimate(np.inf, np.inf)}) == np.inf


@pytest.mark.long
def test_an_unstable_loop_settles_nothing():
    device = replace(Device(), control=Control(5e-3, 1.0, 2.0))
    found = evaluated(device)
    assert found["fig9_settling"].verdict == found["fig12_same_time"].verdict == "differs"
    assert found["fig13_slope"].verdict == found["fig9_balance"].verdict == "unresolved"
    assert "the run does not end at rest" in found["fig12_same_time"].because


def test_the_sensor_pays_for_the_polymer_alone():
    """With both elements at the set temperature the sensor's power is k A / t (T_set - T_outside)."""
    device = Device()
    state = steady(device)
    result = Result("reduced1d", {name: Estimate(getattr(state, name), 0.0) for name in ("sensor_power_W", "sensor_V")})
    found = device_1d(device, result).relative
    power = {key: of["sensor_power_W"].value for key, of in found.items()}
    outside = device.external.final_temperature
    expected = {
        "materials.pdms.thermal_conductivity": 1.0, "device.polymer_thickness": -1.0, "sink.length": 1.0,
        "sink.width": 1.0, "materials.gold.thermal_conductivity": 0.0,
        "external.final_temperature": -outside / (device.control.set_temperature - outside),
    }  # fmt: skip
    assert {key: power[key] for key in expected} == pytest.approx(expected, abs=1e-6)
    # V is the root of power times resistance, and that is as long as the film.
    voltage = found["sink.length"]["sensor_V"].value
    assert voltage == pytest.approx(1.0, abs=1e-6)
