"""The checks of Figures 9 to 13 on the paper's own scene: known numbers, by hand where there is a formula."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compare.device import checks, runs
from compare.device.scope import DeviceRequest, made_checks, needs, skipped_checks
from compare.verdict import Check
from scenes.checks import DEVICE_TOLERANCES
from scenes.device import Device, External
from scenes.loading import load
from scenes.types import DEVICE

SLOPE = 0.15 * 1e-3 * 100e-6 / 100e-6


@pytest.fixture(scope="module")
def found() -> dict[str, Check]:
    device, request = load("device", of=DEVICE), DeviceRequest()
    return {c.id: c for c in checks.evaluate(device, request, runs.make(device, request, lambda _: None))}


def test_every_check_is_made_once_and_as_declared(found: dict[str, Check]) -> None:
    assert tuple(found) == tuple(checks.DEFINITIONS) == tuple(DEVICE_TOLERANCES)
    assert all(check.verdict == check.expected for check in found.values())
    assert all(check.u_num < check.tolerance / 10 for check in found.values())


def test_settling_is_that_of_the_polymer(found: dict[str, Check]) -> None:
    alpha, thickness = 0.15 / (970 * 1460), 100e-6
    time = np.log(2 / 0.01) * thickness**2 / (np.pi**2 * alpha)  # its slowest mode, at twice the step
    assert found["fig9_settling"].measured == pytest.approx(time, rel=0.01)
    assert found["fig9_settling"].verdict == "differs"


def test_steady_power_and_flow(found: dict[str, Check]) -> None:
    for name in ("fig9_balance", "fig10_steady"):
        assert found[name].measured == pytest.approx(SLOPE * 37.5, rel=1e-10)


def test_slope_and_limit(found: dict[str, Check]) -> None:
    assert found["fig13_slope"].measured == pytest.approx(-SLOPE, rel=1e-9)
    assert found["fig13_limit"].measured == pytest.approx(310.5, abs=1e-7)
    assert "the power is 0 W" in found["fig13_limit"].because


def test_slow_sampling_is_slower(found: dict[str, Check]) -> None:
    assert found["fig11_slow"].measured > 4 * found["fig11_slow"].predicted


def test_only_the_step_beyond_the_set_point_takes_another_time(found: dict[str, Check]) -> None:
    same = found["fig12_same_time"]
    assert same.predicted == pytest.approx(found["fig9_settling"].measured, rel=1e-3)
    assert same.measured == pytest.approx(29.5e-3, abs=0.1e-3)


def test_a_faster_loop_than_figure_11_is_needed_for_it_to_be_slower() -> None:
    slow = runs.sampled_slowly(Device())
    slower = replace(slow, control=replace(slow.control, sink_gain=0.1, sensor_gain=0.01), end_time=1.5)
    request = DeviceRequest(about=("figure11",))
    made = runs.make(slower, request, lambda _: None)
    (check,) = checks.evaluate(slower, request, made)
    assert check.verdict == "differs"
    assert check.difference > 0.5


def test_what_is_not_needed_is_not_run() -> None:
    device = Device()
    assert made_checks(device, DeviceRequest(about=("figure11",))) == ("fig11_slow",)
    assert not needs(device, DeviceRequest(about=("figure9",)), "figure11", "figure12", "figure13")
    assert set(skipped_checks(device, DeviceRequest("paper"))) == {k for k in DEVICE_TOLERANCES if k > "fig11"} - {
        "fig9_settling", "fig9_balance",
    }  # fmt: skip
    still = replace(device, external=External(293.0, 293.0))
    assert made_checks(still, DeviceRequest()) == ("fig12_same_time", "fig13_slope", "fig13_limit")


def test_the_papers_scheme_is_checked_against_the_accurate_one() -> None:
    device, request = replace(Device(), end_time=0.08, external=External(step_time=0.01)), DeviceRequest("paper")
    made = runs.make(device, request, lambda _: None)
    found = {check.id: check for check in checks.evaluate(device, request, made)}
    assert set(found) == {"fig9_settling", "fig9_balance", "fig10_steady"}
    assert 1e-6 < found["fig9_settling"].u_num < 0.01
    assert "most of that is an error in space" in made.base.result.findings[0]
