"""The paper's own scheme: its error, its stability limit, its equations, and its layers against a series.

Eq 3 in one layer: Crank-Nicolson (Appendix B) against the series of Appendix A, and B.3 and B.4 as printed. Appendix A
corrected: T = u + w, with u = T1 + (T2 - T1) x/L (A.9) and w = sum_n b_n sin(n pi x/L) exp(-alpha n^2 pi^2 t'/L^2)
(A.14). When the end temperatures change, b_n changes by the sine coefficients of a straight line.
"""

import numpy as np
import pytest

from reduced1d.device.lumped import Slab, lump
from reduced1d.device.schemes import (
    PaperScheme,
    UnstableStepError,
    layer_step,
    mesh_ratio,
    solve_accurate,
    solve_paper,
    spectral_radius,
    stability_limit,
)
from scenes.device import Device, External

LATE_STEP = Device(end_time=0.08, external=External(293, 273, 0.055))


@pytest.fixture(scope="module")
def start():
    return solve_paper(LATE_STEP)


def test_known_error_of_the_start(start):
    assert start.errors["sink_K"] == pytest.approx(1.4, abs=0.05)
    assert start.errors["sensor_K"] == pytest.approx(1.75, abs=0.03)
    accurate = solve_accurate(LATE_STEP)
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


def test_stability_limits():
    assert stability_limit(Device()) == pytest.approx(6.2e-6, rel=0.02)
    assert stability_limit(Device(sensor_thickness=50e-9)) == pytest.approx(0.77e-6, rel=0.02)


def test_the_limit_is_where_the_spectral_radius_passes_one():
    device = Device()
    limit = stability_limit(device)
    for factor, stable in ((0.95, True), (1.1, False)):
        steps = round(1e-4 / (factor * limit))
        scheme = PaperScheme(1e-4 / steps)
        assert (spectral_radius(lump(device), scheme) <= 1 + 1e-12) is stable


def test_refusal_names_the_limit():
    with pytest.raises(UnstableStepError, match=r"time step of 1 us: it is stable only up to 0\.765 us"):
        solve_paper(Device(sensor_thickness=50e-9))


SLAB = Slab(thickness=10e-6, area=1e-7, conductivity=0.15, heat_capacity=970.0 * 1460.0)
TIME = SLAB.thickness**2 / SLAB.diffusivity
HISTORY = ((5.0, 1.0), (9.0, -2.0), (3.0, 3.5))


def exact(x, modes=400, each=0.02 * TIME):
    """T at the heights x after a history of end temperatures, each held for the same time."""
    n = np.arange(1, modes + 1)
    decay = np.exp(-SLAB.diffusivity * (n * np.pi / SLAB.thickness) ** 2 * each)
    T1, T2, b = 0.0, 0.0, np.zeros(modes)
    for new1, new2 in HISTORY:
        line = 2 / (n * np.pi) * ((T1 - new1) - (T2 - new2) * (-1.0) ** n)
        T1, T2, b = new1, new2, (b + line) * decay
    s = x / SLAB.thickness
    return T1 + (T2 - T1) * s + np.sin(np.pi * np.multiply.outer(s, n)) @ b


def by_crank_nicolson(nx, nt, each=0.02 * TIME, gamma=None):
    x = np.linspace(0, SLAB.thickness, nx + 1)
    inner = np.zeros(nx - 1)
    step, by_ends = layer_step(mesh_ratio(SLAB, nx, each / nt) if gamma is None else gamma, nx, nt)
    for ends in HISTORY:
        inner = step @ inner + by_ends @ ends
    return x, np.r_[HISTORY[-1][0], inner, HISTORY[-1][1]]


def test_appendix_b_agrees_with_appendix_a():
    x, T = by_crank_nicolson(nx=200, nt=400)
    assert np.abs(T - exact(x)).max() < 2e-3
    x, T = by_crank_nicolson(nx=25, nt=400)
    assert np.abs(T - exact(x)).max() > 2e-3  # the tolerance sees a grid eight times coarser


def test_b3_and_b4_as_printed_have_the_wrong_diffusivity():
    nx, nt, each = 100, 100, 0.02 * TIME
    oracle = exact(np.linspace(0, SLAB.thickness, nx + 1))
    assert np.abs(by_crank_nicolson(nx, nt)[1] - oracle).max() < 0.02
    printed = each / nt / (SLAB.diffusivity * (SLAB.thickness / nx) ** 2)
    assert np.abs(by_crank_nicolson(nx, nt, gamma=printed)[1] - oracle).max() > 1
