"""The paper's own scheme: its error, its stability limit, and its equations."""

import numpy as np
import pytest

from reduced1d.device.design import solve
from reduced1d.device.lumped import lump
from reduced1d.device.schemes import (
    PaperScheme,
    UnstableStepError,
    runge_kutta_step,
    solve_paper,
    spectral_radius,
    stability_limit,
)
from scenes.device import Device, External

LATE_STEP = Device(end_time=0.08, external=External(293, 273, 0.055))


@pytest.fixture(scope="module")
def start():
    return solve(LATE_STEP, scheme="paper")


def test_known_error_of_the_start(start):
    assert start.errors["sink_K"] == pytest.approx(1.4, abs=0.05)
    assert start.errors["sensor_K"] == pytest.approx(1.75, abs=0.03)
    accurate = solve(LATE_STEP)
    late = start.time_s >= 0.05
    off = max(np.abs(start.trace(q) - accurate.trace(q))[late].max() for q in ("sink_K", "sensor_K"))
    assert 5e-4 < off < 5e-3
    assert "1.42 K (sink, at 0.0041 s) and 1.75 K (sensor, at 0.0006 s)" in start.findings[0]


def test_its_error_is_mostly_in_space():
    device = Device(end_time=0.002)

    def error(scheme):
        return solve_paper(device, scheme).errors["sensor_K"]

    assert error(PaperScheme(2.5e-7)) > 0.9 * error(PaperScheme())
    assert error(PaperScheme(nx=45)) < 0.7 * error(PaperScheme())


def test_it_converges_to_the_accurate_scheme():
    device = Device(end_time=0.001, external=External(293, 293, 1.0))
    errors = [solve_paper(device, PaperScheme(1.5e-5 / n, n)).errors["sensor_K"] for n in (15, 30, 45)]
    assert errors[0] > 1.7 * errors[1] > 1.7 * 1.35 * errors[2]


def test_stability_limits():
    assert stability_limit(Device()) == pytest.approx(6.2e-6, rel=0.02)
    assert stability_limit(Device(sensor_thickness=50e-9)) == pytest.approx(0.77e-6, rel=0.02)


def test_the_limit_is_where_the_scheme_blows_up(monkeypatch):
    device = Device(end_time=0.02)
    limit = stability_limit(device)
    for factor, stable in ((0.95, True), (1.1, False)):
        steps = round(1e-4 / (factor * limit))
        scheme = PaperScheme(1e-4 / steps)
        assert (spectral_radius(lump(device), scheme) <= 1 + 1e-12) is stable
    monkeypatch.setattr("reduced1d.device.schemes.spectral_radius", lambda *_: 1.0)
    monkeypatch.setattr("reduced1d.device.schemes.stability_limit", lambda *_: limit)
    assert solve_paper(device, PaperScheme(1e-4 / 17)).sink_K.max() < 330
    with np.errstate(all="ignore"):
        wild = solve_paper(device, PaperScheme(1e-4 / 14))
    assert not wild.sensor_K.max() < 330


def test_refusal_names_the_limit():
    with pytest.raises(UnstableStepError, match=r"time step of 1 us: it is stable only up to 0\.765 us"):
        solve(Device(sensor_thickness=50e-9), scheme="paper")


def test_runge_kutta_is_of_fourth_order():
    def end(n):
        T = 1.0
        for _ in range(n):
            T = runge_kutta_step(T, 2.0, 3.0, 5.0, 0.1, 1.0 / n)
        return T

    exact = end(400)
    errors = [abs(end(n) - exact) for n in (4, 8, 16)]
    assert np.log2(errors[1] / errors[2]) == pytest.approx(4, abs=0.3)
