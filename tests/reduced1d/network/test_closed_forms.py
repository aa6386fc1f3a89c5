"""The network against closed forms, to 1e-6 of the rise or the flow, and its stated errors against the true errors."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from reduced1d.network import solve
from reduced1d.network.lines import layout
from reduced1d.network.solution import places
from scenes.errors import RunawayError, SceneError
from scenes.model import AnyScene
from scenes.result import Result
from tests.reduced1d.network.scenes import COLD, LONG, RHO, THICK, WIDE, C, K, at, box, flat, material, over, scene

AREA = WIDE * THICK
NEAR = 1e-6
"""What the closed forms are met to: the network's own error is refined below 1e-8 of the rise, and stated."""

LEFT = (0, 0, 0), (0, WIDE, THICK)
RIGHT = (LONG, 0, 0), (LONG, WIDE, THICK)
BAR = (0, 0, 0), (LONG, WIDE, THICK)
TOP = (0, 0, THICK), (LONG, WIDE, THICK)


def rises(result: Result, **exact: float) -> None:
    """Compare steady rises and flows with exact values, and the stated errors against the differences."""
    for name, value in exact.items():
        estimate = result.steady[name.replace("_", " ")]
        found = estimate.value - (COLD if abs(estimate.value - COLD - value) < abs(estimate.value - value) else 0.0)
        assert found == pytest.approx(value, rel=NEAR), name
        # The stated error belongs to the coarser elements; rounding is a few parts in 1e12 of the temperature.
        assert abs(found - value) <= estimate.error + 1e-11 * max(abs(estimate.value), abs(value)), name


def test_a_bar_with_a_source():
    q = 1e13
    of = scene(
        [box(*BAR, heat_source=q)],
        [flat("left", *LEFT, temperature=COLD)],
        [at("tip", LONG, WIDE / 2, THICK / 2), over("mean", *BAR), over("in", *LEFT, quantity="heat_flow"),
         over("half", (LONG / 2, 0, 0), (LONG / 2, WIDE, THICK), quantity="heat_flow"),
         over("strip", (LONG / 4, 0, 0), (LONG / 4, WIDE / 2, THICK), quantity="heat_flow")],
    )  # fmt: skip
    power = q * AREA * LONG
    rises(
        solve(of), tip=q * LONG**2 / 2 / K, mean=q * LONG**2 / 3 / K, **{"in": -power}, half=-power / 2,
        strip=-power * 3 / 8,
    )  # fmt: skip


def test_a_fin_with_a_film():
    h = 2e6
    of = scene(
        [box(*BAR)],
        [flat("left", *LEFT, temperature=COLD + 100),
         flat("air", *TOP, convection={"coefficient": h, "ambient": COLD})],
        [at("tip", LONG, WIDE / 2, THICK / 2), over("in", *LEFT, quantity="heat_flow"),
         over("out", *TOP, quantity="heat_flow"),
         over("far half", (LONG / 2, 0, THICK), (LONG, WIDE, THICK), quantity="heat_flow"),
         at("surface", LONG, WIDE / 2, THICK)],
    )  # fmt: skip
    film = 1 / (1 / h + THICK / 2 / K)
    m = math.sqrt(film * WIDE / K / AREA)
    flow = 100 * math.sqrt(film * WIDE * K * AREA) * math.tanh(m * LONG)
    tip = 100 / math.cosh(m * LONG)
    far = film * WIDE * tip * math.sinh(m * LONG / 2) / m
    rises(solve(of), tip=tip, **{"in": flow}, out=-flow, far_half=-far, surface=tip * film / h)


def heated_wire(coefficient: float, **drive: float) -> AnyScene:
    """Held at both ends, between a ``drive`` and the ground."""
    return scene(
        [box(*BAR)],
        [flat("left", *LEFT, temperature=COLD), flat("right", *RIGHT, temperature=COLD),
         flat("plus", *LEFT, **drive), flat("minus", *RIGHT, voltage=0)],
        [at("middle", LONG / 2, WIDE / 2, THICK / 2), over("mean", *BAR), over("I", *LEFT, quantity="current"),
         at("quarter", LONG / 4, 0, 0, quantity="potential"), over("R", *LEFT, quantity="resistance"),
         over("P", *BAR, quantity="power"),
         over("eighth", (0, 0, 0), (LONG / 4, WIDE / 2, THICK), quantity="power")],
        [material(resistivity=1e-5, temperature_coefficient=coefficient, reference_temperature=COLD)],
    )  # fmt: skip


@pytest.mark.parametrize("coefficient", [4e-3, -1e-3])
def test_a_heated_wire_with_resistance_feedback(coefficient):
    """k A T'' = -I^2 rho/A (1 + a T), held at both ends: cosines, or hyperbolic cosines where the resistance falls."""
    current = 0.6 * math.sqrt(K / 1e-5 / abs(coefficient)) * AREA / LONG
    b = current / AREA * math.sqrt(1e-5 * abs(coefficient) / K)
    cos, tan, sin = (math.cos, math.tan, math.sin) if coefficient > 0 else (math.cosh, math.tanh, math.sinh)
    voltage = current * 1e-5 / AREA * 2 / b * tan(b * LONG / 2)
    middle = (1 / cos(b * LONG / 2) - 1) / coefficient
    mean = (2 * tan(b * LONG / 2) / b / LONG - 1) / coefficient
    quarter = voltage / 2 + current * 1e-5 / AREA * sin(b * LONG / 4) / b / cos(b * LONG / 2)
    eighth = current * (voltage - quarter) / 2  # of the half of a quarter's cross-section
    power = {"R": voltage / current, "P": voltage * current, "eighth": eighth}
    exact = {"middle": middle, "mean": mean, "I": current, "quarter": quarter} | power
    ohm = 0.3 * voltage / current
    behind = {"voltage": voltage + ohm * current, "series_resistance": ohm}
    for drive in ({"voltage": voltage}, {"current": current}, behind):
        rises(solve(heated_wire(coefficient, **drive)), **exact)


def cooled_wire(coefficient: float, end_time: float | None = None, **drive: Any) -> AnyScene:
    """One of the same temperature throughout, cooled from above."""
    return scene(
        [box(*BAR)],
        [flat("air", *TOP, convection={"coefficient": 1e5, "ambient": COLD}),
         flat("plus", *LEFT, **drive), flat("minus", *RIGHT, voltage=0)],
        [at("middle", LONG / 2, WIDE / 2, THICK / 2), over("I", *RIGHT, quantity="current"),
         over("R", *RIGHT, quantity="resistance"), over("P", *BAR, quantity="power")],
        [material(resistivity=1e-5, temperature_coefficient=coefficient, reference_temperature=COLD)],
        end_time,
    )  # fmt: skip


OHM = 1e-5 * LONG / AREA
FILM = LONG * WIDE / (1 / 1e5 + THICK / 2 / K)


@pytest.mark.long
def test_runaway_is_named_with_its_voltage():
    """V^2 = R (1 - |a| T) G T is largest at half the rise at which the resistance vanishes."""
    limit = math.sqrt(OHM * FILM / 4 / 1e-3)
    with pytest.raises(RunawayError, match=f"the largest voltage with one is {limit:.4g} V") as caught:
        solve(cooled_wire(-1e-3, voltage=1.001 * limit))
    assert caught.value.limit == pytest.approx(limit, rel=NEAR)
    below = solve(cooled_wire(-1e-3, voltage=0.999 * limit))
    rise = brentq(lambda T: (1 - 1e-3 * T) * OHM * FILM * T - (0.999 * limit) ** 2, 0, 500, xtol=1e-12)
    # So near the fold the rise follows the voltage fifty times as strongly as far from it.
    assert below.steady["middle"].value - COLD == pytest.approx(rise, rel=50 * NEAR)


def test_a_t_of_three_bars():
    """The foot's heat enters the bar evenly over the foot's width, through half the bar's."""
    flux, foot = 1e9, 4e-6
    a, b = LONG / 2 - foot / 2, LONG / 2 + foot / 2
    of = scene(
        [box(*BAR), box((a, WIDE, 0), (b, WIDE + LONG / 2, THICK), "foot")],
        [flat("left", *LEFT, temperature=COLD), flat("right", *RIGHT, temperature=COLD),
         flat("heat", (a, WIDE + LONG / 2, 0), (b, WIDE + LONG / 2, THICK), heat_flux=flux)],
        [at("tip", LONG / 2, WIDE + LONG / 2, THICK / 2), at("middle", LONG / 2, WIDE / 2, THICK / 2),
         over("through", (a, WIDE, 0), (b, WIDE, THICK), quantity="heat_flow"),
         over("left flow", *LEFT, quantity="heat_flow"),
         over("across", (a, WIDE / 4, 0), (b, WIDE / 4, THICK), quantity="heat_flow")],
    )  # fmt: skip
    power = flux * foot * THICK
    edge = power / 2 * a / K / AREA
    tip = edge + power * foot / 12 / K / AREA + power / (foot * THICK * K) * (WIDE / 2 + LONG / 2)
    rises(
        solve(of), middle=edge + power * foot / 8 / K / AREA, tip=tip, through=-power, left_flow=-power / 2,
        across=-power / 4,
    )  # fmt: skip


def test_a_stack_crossed_by_heat():
    """Slabs of three thicknesses and materials, lines that run differently among them: each its whole thickness."""
    flux, ks, ts = 1e7, (100.0, 1.0, 20.0), (2e-6, 1e-6, 5e-6)
    side, z = 50e-6, np.cumsum([0, *ts])
    boxes = [box((0, 0, z[i]), (side, side, z[i + 1]), f"slab {i}", material=f"m{i}") for i in range(3)]
    of = scene(
        boxes,
        [flat("bottom", (0, 0, 0), (side, side, 0), temperature=COLD),
         flat("top", (0, 0, z[3]), (side, side, z[3]), heat_flux=flux)],
        [at(f"at {i}", side / 3, side / 2, z[i]) for i in range(4)]
        + [over("slab", (0, 0, z[1]), (side, side, z[2])), over("top face", (0, 0, z[3]), (side, side / 2, z[3])),
           over("down", (0, 0, z[2]), (side, side, z[2]), quantity="heat_flow")],
        [material(f"m{i}") | {"thermal_conductivity": k} for i, k in enumerate(ks)],
    )  # fmt: skip
    face = np.cumsum([0, *(flux * t / k for t, k in zip(ts, ks, strict=True))])
    found = solve(of)
    rises(found, at_1=face[1], at_2=face[2], at_3=face[3], slab=(face[1] + face[2]) / 2, top_face=face[3],
          down=-flux * side**2)  # fmt: skip
    assert found.steady["at 0"].value == pytest.approx(COLD, abs=1e-9)


def test_lines_that_run_differently_exchange_their_means():
    """A bar across a plate that is cooled evenly from below: both have one temperature."""
    flux = 1e7
    of = scene(
        [box((0, 0, 0), (LONG, LONG / 2, THICK), "plate"),
         box((LONG / 2, 0, THICK), (LONG / 2 + WIDE, LONG / 2, 2 * THICK), "bar")],
        [flat("bottom", (0, 0, 0), (LONG, LONG / 2, 0), temperature=COLD),
         flat("top", (LONG / 2, 0, 2 * THICK), (LONG / 2 + WIDE, LONG / 2, 2 * THICK), heat_flux=flux)],
        [at("bar", LONG / 2, LONG / 4, 1.5 * THICK), over("plate", (0, 0, 0), (LONG, LONG / 2, THICK)),
         over("down", (0, 0, 0), (LONG, LONG / 2, 0), quantity="heat_flow")],
    )  # fmt: skip
    found = solve(of)
    assert [link.kind for link in found.details["model"].layout.heat if link.other] == ["means"]
    power = flux * WIDE * LONG / 2
    mean = power * THICK / 2 / K / (LONG * LONG / 2)  # of the plate: half its thickness above what is held
    rises(found, plate=mean, down=-power)
    # The plate's rise under the bar, from its fin equation over an interval heated evenly, ends clear of its ends.
    m = math.sqrt(2) / THICK
    under = mean * LONG / WIDE * (1 - (1 - math.exp(-m * WIDE)) / (m * WIDE))
    rises(found, bar=under + power * THICK / K / (WIDE * LONG / 2))


TIMES = np.concatenate([[0.0], np.geomspace(2e-7, 2e-4, 60)])


def over_time(result: Result, name: str, exact: np.ndarray, start: float = COLD, after: float = 0.0) -> None:
    traces = result.over_time
    scale = float(np.abs(exact).max())
    late = traces.time >= after
    off = np.abs(traces.values[name] - start - exact)[late].max()
    assert off <= NEAR * scale
    assert off <= traces.errors[name] + 1e-10 * scale


def test_an_rc_step_and_ramps():
    """A bar of one temperature, cooled from above: C dT/dt = P - G T; its source jumps, falls evenly, and jumps."""
    capacity = RHO * C * AREA * LONG
    tau = capacity / FILM
    t1, t2 = 0.5 * tau, 1.25 * tau
    source = {"times": [0, t1, t2, t2], "values": [1e13, 1e13, 5e12, 2e12]}
    times = np.unique(np.concatenate([np.linspace(0, 3 * tau, 41), [t1, t2]]))
    of = scene(
        [box(*BAR, heat_source=source)],
        [flat("air", *TOP, convection={"coefficient": 1e5, "ambient": COLD})], [at("middle", LONG / 2, 0, THICK / 2)],
        end_time=3 * tau,
    )  # fmt: skip
    one = AREA * LONG / FILM  # the steady rise of 1 W/m3
    slope = -5e12 / (t2 - t1)
    first = 1e13 * one * -np.expm1(-times / tau)
    at_1 = 1e13 * one * -math.expm1(-t1 / tau)

    def ramp(t: np.ndarray) -> np.ndarray:
        s = t - t1
        inner = 1e13 * one + slope * one * (s - tau)
        return inner + (at_1 - 1e13 * one + slope * one * tau) * np.exp(-s / tau)

    at_2 = ramp(np.array(t2))
    last = 2e12 * one + (at_2 - 2e12 * one) * np.exp(-(times - t2) / tau)
    found = solve(of, times)
    over_time(found, "middle", np.where(times <= t1, first, np.where(times <= t2, ramp(times), last)))
    assert found.steady["middle"].value - COLD == pytest.approx(2e12 * one, rel=NEAR)


def test_a_bar_with_a_source_over_time():
    q = 1e13
    of = scene(
        [box(*BAR, heat_source=q)], [flat("left", *LEFT, temperature=COLD)],
        [at("tip", LONG, WIDE / 2, THICK / 2), over("in", *LEFT, quantity="heat_flow")], end_time=2e-4,
    )  # fmt: skip
    n = np.arange(2000)[:, None]
    b = (n + 0.5) * np.pi / LONG
    decay = np.exp(-K / RHO / C * b**2 * TIMES)
    tip = q * LONG**2 / 2 / K - (2 * q / K / LONG * (-1.0) ** n / b**3 * decay).sum(axis=0)
    flow = -q * AREA * LONG + (2 * q * AREA / LONG / b**2 * decay).sum(axis=0)
    found = solve(of, TIMES)
    over_time(found, "tip", tip)
    # The series of the flow is cut where its terms are 1e-4 at the start, and nothing from a hundredth of 2e-7 s on.
    over_time(found, "in", flow, start=0.0, after=2e-7)


def test_a_bar_whose_end_is_heated_at_once():
    of = scene(
        [box(*BAR)], [flat("left", *LEFT, temperature={"times": [0, 1e-5, 1e-5], "values": [COLD, COLD, COLD + 100]})],
        [at("quarter", LONG / 4, WIDE / 2, THICK / 2), over("in", *LEFT, quantity="heat_flow")], end_time=2e-4,
    )  # fmt: skip
    times = np.concatenate([[0.0, 1e-5], 1e-5 + np.geomspace(2e-6, 1.9e-4, 40)])
    since = np.maximum(times - 1e-5, 1e-30)
    b = (np.arange(400)[:, None] + 0.5) * np.pi / LONG
    decay = np.exp(-K / RHO / C * b**2 * since)
    rise = 100 - 100 * (2 / LONG / b * np.sin(b * LONG / 4) * decay).sum(axis=0)
    flow = K * AREA * 100 * (2 / LONG * decay).sum(axis=0)
    found = solve(of, times)
    before = since < 1e-20
    over_time(found, "quarter", np.where(before, 0.0, rise))
    inside = times > 1e-5
    off = np.abs(found.over_time.values["in"] - flow)[inside]
    assert (off <= 1e-5 * flow[inside]).all()  # a slope has a digit less than a value


@pytest.mark.parametrize("coefficient", [3e-3, -5e-4])
def test_a_wire_over_time_with_resistance_feedback(coefficient):
    voltage, capacity = 0.5 * math.sqrt(OHM * FILM / 4 / 5e-4), RHO * C * AREA * LONG
    times = np.linspace(0, 4 * capacity / FILM, 33)
    of = cooled_wire(coefficient, float(times[-1]), voltage=voltage)

    def rate(_: float, T: np.ndarray) -> np.ndarray:
        return (voltage**2 / OHM / (1 + coefficient * T) - FILM * T) / capacity

    exact = solve_ivp(rate, (0, times[-1]), [0.0], "DOP853", times, rtol=1e-12, atol=1e-10).y[0]
    found = solve(of, times)
    over_time(found, "middle", exact)
    current = voltage / OHM / (1 + coefficient * exact)
    over_time(found, "I", -current, start=0.0)
    over_time(found, "R", voltage / current, start=0.0)
    over_time(found, "P", voltage * current, start=0.0)


def test_a_perturbed_conductivity_is_caught():
    """The twin of all of the above: a part in 1e5 is ten times the tolerance."""
    of = scene(
        [box(*BAR, heat_source=1e13)], [flat("left", *LEFT, temperature=COLD)], [at("tip", LONG, 0, 0)],
        [material() | {"thermal_conductivity": K * (1 + 1e-5)}],
    )  # fmt: skip
    with pytest.raises(AssertionError):
        rises(solve(of), tip=1e13 * LONG**2 / 2 / K)


CONTACT = 3e-7  # m2 K/W


def test_ends_that_meet_at_a_contact():
    flux, copper = 1e8, 400.0
    of = scene(
        [box(*BAR), box((LONG, 0, 0), (3 * LONG, WIDE / 2, THICK), "thin", material="copper")],
        [flat("left", *LEFT, temperature=COLD),
         flat("heat", (3 * LONG, 0, 0), (3 * LONG, WIDE, THICK), heat_flux=flux)],
        [at("tip", 3 * LONG, 0, 0), at("near", LONG, WIDE / 4, THICK / 2, box="bar"),
         at("beyond", LONG, WIDE / 4, THICK / 2, box="thin"),
         over("through", (LONG, 0, 0), (LONG, WIDE / 2, THICK), quantity="heat_flow")],
        [material(), material("copper") | {"thermal_conductivity": copper}],
        contact=[{"name": "joint", "between": ["bar", "thin"], "thermal_resistance": CONTACT}],
    )  # fmt: skip
    power = flux * AREA / 2
    near = power * LONG / K / AREA
    beyond = near + power * CONTACT / (AREA / 2)
    rises(solve(of), near=near, beyond=beyond, tip=beyond + power * 2 * LONG / copper / (AREA / 2), through=-power)
    (joint,) = (p for p in places(layout(of)) if p.other)
    # In 3D the temperature has a value on either side.
    assert (joint.one.boxes, joint.other.boxes) == (("bar",), ("thin",))


def test_a_potential_that_jumps_is_refused():
    contact = {"name": "joint", "between": ["bar", "thin"], "electrical_resistance": 1e-9}
    of = scene(
        [box(*BAR), box((LONG, 0, 0), (3 * LONG, WIDE / 2, THICK), "thin")],
        [flat("left", *LEFT, voltage=1.0), flat("right", (3 * LONG, 0, 0), (3 * LONG, WIDE, THICK), voltage=0.0),
         flat("cold", *LEFT, temperature=COLD)],
        [at("tip", LONG / 2, 0, 0)], [material(resistivity=1e-4)], contact=[contact],
    )  # fmt: skip
    with pytest.raises(SceneError, match=r'leave contact "joint"\.electrical_resistance out'):
        layout(of)


def test_sides_that_touch_at_a_contact():
    """A slab of two bars that run alike, crossed by heat."""
    flux = 1e8
    upper = (0, 0, THICK), (LONG, WIDE, 2 * THICK)
    of = scene(
        [box(*BAR), box(*upper, "upper")],
        [flat("cold", (0, 0, 0), (LONG, WIDE, 0), temperature=COLD),
         flat("heat", (0, 0, 2 * THICK), (LONG, WIDE, 2 * THICK), heat_flux=flux)],
        [over("top", (0, 0, 2 * THICK), (LONG, WIDE, 2 * THICK)), over("near", *TOP, box="bar"),
         over("beyond", *TOP, box="upper")],
        contact=[{"name": "joint", "between": ["bar", "upper"], "thermal_resistance": CONTACT}],
    )  # fmt: skip
    near = flux * THICK / K
    rises(solve(of), near=near, beyond=near + flux * CONTACT, top=2 * near + flux * CONTACT)
