"""The exact fin against a boundary-value solver, the paper's parabola, balances and its differential equation."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_bvp

from reduced1d.equations import parabola
from reduced1d.fin import fin_runaway_voltage, solve_fin
from reduced1d.roots import increasing_root
from reduced1d.sink import anchor_series_resistance, solve
from scenes.sink import SILICON, Sink
from tests.reduced1d import relative

NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def silicon(a):
    return dataclasses.replace(SILICON, temperature_coefficient=a)


def quadrature(fin, function):
    """The integral of a function of the rise over the beam's halves, where the profile is smooth."""
    y = fin.length / 4 * (1 + NODES)
    return 2 * float(np.sum(fin.length / 4 * WEIGHTS * function(fin.rise(y))))


def solved_by_collocation(sink, anchor_resistance):
    """Peak, end, mean rise and current from scipy: the half beam with the current as an unknown parameter, the mean
    rise as a third equation. The rise is scaled to be of order 1, the coordinate by the half length."""
    k, A_c, half = sink.silicon.thermal_conductivity, sink.cross_section, sink.length / 2
    rho, a = sink.silicon.resistivity, sink.silicon.temperature_coefficient
    air = sink.convection_coefficient * sink.width
    unit = sink.voltage**2 / (4 * k * rho)
    cold = sink.voltage / (rho * sink.length / A_c)

    def slopes(x, y, q):
        current = q[0] * cold
        heat = current**2 * rho / A_c * (1 + a * unit * y[0])
        return np.array([y[1], -(half**2) * (heat / unit - air * y[0]) / (k * A_c), y[0]])

    def ends(left, right, q):
        biot = half / (anchor_resistance * k * A_c)
        return np.array([left[1] - biot * left[0], right[1], left[2], q[0] * (1 + a * unit * right[2]) - 1])

    x = np.linspace(0, 1, 11)
    guess = np.array([np.full_like(x, 0.5), 1 - x, 0.5 * x])
    found = solve_bvp(slopes, ends, x, guess, p=[1.0], tol=1e-9, max_nodes=20000)
    assert found.success
    return unit * found.y[0, -1], unit * found.y[0, 0], unit * found.y[2, -1], found.p[0] * cold


def test_default_sink_with_the_anchor_resistance_of_three_dimensions():
    fin = solve_fin(Sink(), 2663.0)
    # Independently known to the digits given.
    assert fin.peak_rise == pytest.approx(20.33, abs=0.005)
    assert fin.end_rise == pytest.approx(4.405, abs=0.0005)
    assert fin.mean_rise == pytest.approx(15.02, abs=0.005)
    assert fin.current == pytest.approx(3.3085e-3, abs=5e-8)


@pytest.mark.parametrize(
    ("voltage", "a", "h"),
    [(1.0, 5e-4, 0.0), (15.0, 5e-4, 0.0), (5.0, 5e-4, 800.0), (3.0, 5e-4, 2e4), (6.0, -5e-4, 0.0), (6.0, -5e-4, 3e3)],
)  # fmt: skip
def test_fin_agrees_with_a_boundary_value_solver(voltage, a, h):
    sink = Sink(voltage=voltage, silicon=silicon(a), convection_coefficient=h)
    fin = solve_fin(sink, 2663.0)
    reference = solved_by_collocation(sink, 2663.0)
    # The solver bounds its relative residual by 1e-9, and the problem amplifies it by the feedback, here below 10.
    assert (fin.peak_rise, fin.end_rise, fin.mean_rise, fin.current) == relative(reference, 1e-8)
    # The check sees a change of 1e-5 in the anchor resistance.
    other = solve_fin(sink, 2663.0 * (1 + 1e-5))
    assert other.end_rise != relative(reference[1], 1e-8)


def test_without_feedback_and_air_the_fin_is_the_paper_s_parabola():
    sink = Sink(silicon=silicon(0.0))
    R = anchor_series_resistance(sink)
    fin, paper = solve_fin(sink, R), solve(sink, steady_only=True).steady
    y = np.linspace(0, sink.length, 11)
    dT0 = fin.peak_rise - fin.end_rise
    assert fin.rise(y) == relative(parabola(y, dT0, fin.end_rise, sink.length), 1e-13)
    for key, value in (("peak_rise_K", fin.peak_rise), ("end_rise_K", fin.end_rise), ("mean_rise_K", fin.mean_rise)):
        assert value == relative(paper[key].value, 1e-13)
    # With feedback the profile is a cosine, and the paper's parabola is no longer exact.
    assert solve_fin(Sink(), R).peak_rise != pytest.approx(solve(Sink(), steady_only=True).steady["peak_rise_K"].value)


def test_nothing_jumps_where_the_cosine_turns_hyperbolic():
    # z = a Q - H changes sign at h = a I^2 rho0 / (A w); steps of 1e-9 in h move the rise by some 1e-9, not more.
    sink = Sink(voltage=5.0)
    free = solve_fin(sink, 2663.0)
    switch = 5e-4 * free.current**2 * 6e-5 / (sink.cross_section * sink.width)
    for _ in range(30):
        fin = solve_fin(dataclasses.replace(sink, convection_coefficient=switch), 2663.0)
        switch = 5e-4 * fin.current**2 * 6e-5 / (sink.cross_section * sink.width)
    around = [
        solve_fin(dataclasses.replace(sink, convection_coefficient=switch * (1 + d)), 2663.0)
        for d in np.linspace(-1, 1, 9) * 1e-6
    ]
    assert around[0].z > 0 > around[-1].z
    peaks = np.array([fin.peak_rise for fin in around])
    steps = np.diff(peaks) / peaks[0]
    assert steps == pytest.approx(steps.mean(), abs=1e-13)
    assert -1e-6 < steps.mean() < -1e-9


@st.composite
def fins(draw):
    a = draw(st.sampled_from([-2e-3, -1e-4, 0.0, 5e-4, 4e-3]))
    sink = Sink(
        length=draw(st.floats(50e-6, 5e-3)),
        thickness=draw(st.floats(0.2e-6, 20e-6)),
        silicon=silicon(a),
        convection_coefficient=draw(st.sampled_from([0.0, 10.0, 3e3, 1e6])),
    )
    R = draw(st.sampled_from([0.0, 1.0, 2663.0, 1e6]))
    limit = fin_runaway_voltage(sink, R)
    return dataclasses.replace(sink, voltage=round(draw(st.floats(-0.999, 0.999)), 9) * min(limit, 50.0)), R


@given(fins())
@settings(max_examples=60, deadline=None, derandomize=True)
def test_balances_of_a_fin(case):
    sink, R = case
    fin = solve_fin(sink, R)
    rho, a, A_c = sink.silicon.resistivity, sink.silicon.temperature_coefficient, sink.cross_section
    # The quadrature's 40 points resolve the profile to rounding, but for the strongest cooling: there the ends' layers
    # are down to a few um thick (the healing length is sqrt(k t / h)), between points up to 100 um apart.
    loose = 1e-13 if sink.convection_coefficient < 1e6 else 1e-3
    mean = quadrature(fin, lambda rise: rise) / fin.length
    assert mean == relative(fin.mean_rise, loose)
    voltage = fin.current * quadrature(fin, lambda rise: rho / A_c * (1 + a * rise))
    # Near runaway the two currents draw together and lose digits, sqrt(1 - 0.999) of them here.
    assert voltage == relative(sink.voltage, max(loose, 1e-11))
    anchors = 2 * fin.end_rise / R if R else None
    air = sink.convection_coefficient * sink.width * sink.length * fin.mean_rise
    if anchors is not None:
        assert anchors + air == relative(fin.power, 1e-11)
    assert fin.power == fin.current * sink.voltage
    profile = fin.rise(np.array([0.0, fin.length / 2, fin.length]))
    assert profile == relative([fin.end_rise, fin.peak_rise, fin.end_rise], 1e-13)
    assert fin.peak_rise >= fin.mean_rise >= fin.end_rise >= 0


@pytest.mark.parametrize(("voltage", "a", "h"), [(12.0, 5e-4, 0.0), (5.0, -5e-4, 0.0), (5.0, 5e-4, 5e3)])
def test_profile_satisfies_the_differential_equation_and_its_end_condition(voltage, a, h):
    sink, R = Sink(voltage=voltage, silicon=silicon(a), convection_coefficient=h), 2663.0
    fin = solve_fin(sink, R)
    k, A_c, step = 130.0, sink.cross_section, sink.length / 200
    y = np.linspace(0.1, 0.4, 7) * sink.length
    # Sixth-order central difference: its error is (step / L)^6 times a factor below 10^3, rounding eps (L / step)^2.
    stencil = np.array([2, -27, 270, -490, 270, -27, 2]) / 180
    second = sum(w * fin.rise(y + i * step) for i, w in zip(range(-3, 4), stencil, strict=True)) / step**2
    heat = fin.current**2 * 6e-5 / A_c * (1 + a * fin.rise(y))
    residual = k * A_c * second - h * sink.width * fin.rise(y) + heat
    assert np.max(np.abs(residual)) < 1e-9 * np.max(heat)
    ahead = fin.rise(np.arange(7) * step)
    slope = np.dot([-147, 360, -450, 400, -225, 72, -10], ahead) / (60 * step)
    assert k * A_c * slope == relative(fin.end_rise / R, 1e-8)


def test_strong_drive_does_not_run_away_when_resistance_rises():
    fin = solve_fin(Sink(voltage=1e5), 2663.0)
    assert 0 < fin.z < math.pi**2 / 4
    assert fin.current * 300 * (1 + 5e-4 * fin.mean_rise) == relative(1e5, 1e-9)


@pytest.mark.parametrize(("voltage", "a", "h"), [(5.0, 5e-4, 800.0), (15.0, 5e-4, 0.0), (6.0, -5e-4, 3e3)])
def test_newton_s_slope_is_the_derivative(monkeypatch, voltage, a, h):
    # A wrong slope would cost iterations and nothing else, so no result can show it.
    seen = []

    def checked(function, lower, upper):
        y = (lower + upper) / 2
        slope = function(y)[1]
        difference = (function(y + 1e-5)[0] - function(y - 1e-5)[0]) / 2e-5
        seen.append((float(slope), float(difference)))
        return increasing_root(function, lower, upper)

    monkeypatch.setattr("reduced1d.fin.increasing_root", checked)
    solve_fin(Sink(voltage=voltage, silicon=silicon(a), convection_coefficient=h), 2663.0)
    # The central difference: step^2 = 1e-10 of the third derivative, and rounding eps / step = 2e-11.
    assert seen[0][0] == relative(seen[0][1], 1e-7)


def test_signs_and_limits_of_the_input():
    forward, backward = solve_fin(Sink(voltage=2.0), 2663.0), solve_fin(Sink(voltage=-2.0), 2663.0)
    assert (backward.current, backward.power, backward.peak_rise) == (
        -forward.current,
        forward.power,
        forward.peak_rise,
    )
    nothing = solve_fin(Sink(voltage=0.0), 2663.0)
    assert (nothing.peak_rise, nothing.current, nothing.power) == (0, 0, 0)
    with pytest.raises(ValueError, match="must not be negative"):
        solve_fin(Sink(), -1.0)
