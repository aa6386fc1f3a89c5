"""Exact cases: bodies that conduct in two and three dimensions, and conductors of a known resistance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Value
from scenes.sink import SILICON
from validate.verify import series
from validate.verify.manufactured import face
from validate.verify.report import ACCURACY, Expected, Row, rows

FAMILY, ROOM = "exact", 293.0


def brick() -> Iterator[Row]:
    """A brick whose six faces take another temperature at once: the product of three slabs."""
    half, material = (1.0, 1.6, 2.0), Material("unit", 1.0, 1.0, 1.0)
    lower = (-1.0, -1.6, -2.0)
    faces = tuple(
        Boundary(f"face {d}{side}", "temperature", *face(lower, half, d, side), 2.0)
        for d, side in product(range(3), (0, 1))
    )
    probes = {"centre O": (0.0, 0.0, 0.0), "point H": (0.5, 0.8, 1.0)}
    times = (0.1, 0.3, 1.0)
    points = tuple(Probe(name, at, at) for name, at in probes.items())
    box = Box("brick", material, lower, half)
    scene = Scene("brick", (box,), faces, points, 1.0, 1.0, ACCURACY, False, times)

    def exact(at: Point, t: float) -> Any:
        return 2.0 - np.prod([series.cooling(c / size, t / size**2) for c, size in zip(at, half, strict=True)])

    yield from rows(FAMILY, "brick, step of all faces", scene, [
        Expected(name, "K", np.array([exact(at, t) for t in times]), 1.0) for name, at in probes.items()
    ], "product of series; the brick of Code_Aster's test TTLV301 (V4.25.301)")  # fmt: skip


def joule_bar() -> Iterator[Row]:
    """A bar heated by its own current, its resistivity rising, constant or falling with temperature."""
    for volts, coefficient in ((7.0, 5e-4), (7.0, -5e-4), (1.0, 0.0)):
        material = replace(SILICON, temperature_coefficient=coefficient)
        upper = (20e-6, 1000e-6, 2e-6)
        peak, mean, current = heated_bar(material, upper[1], upper[0] * upper[2], volts)
        ends = [((0.0, y, 0.0), (upper[0], y, upper[2])) for y in (0.0, upper[1])]
        middle = (10e-6, upper[1] / 2, 1e-6)
        probes = (
            Probe("middle", middle, middle), Probe("mean", (0.0, 0.0, 0.0), upper),
            Probe("hottest", (0.0, 0.0, 0.0), upper, "temperature", "max"),
            Probe("current", *ends[0], "current"), Probe("heat", *ends[1], "heat_flow"),
        )  # fmt: skip
        scene = Scene("bar", (Box("bar", material, (0.0, 0.0, 0.0), upper),), cold_electrodes(ends, volts), probes,
                      accuracy=ACCURACY, steady=True)  # fmt: skip
        power = volts * current
        yield from rows(FAMILY, f"Joule-heated bar, TCR {coefficient:g} 1/K, {volts:g} V", scene, [
            Expected("middle", "K", ROOM + peak, peak), Expected("hottest", "K", ROOM + peak, peak),
            Expected("mean", "K", ROOM + mean, peak), Expected("current", "A", current, current),
            Expected("heat", "W", -power / 2, power, name="heat into the far end"),
        ], "closed solution of the fin; V^2/8 = integral of k rho dT")  # fmt: skip


def cold_electrodes(ends: Sequence[tuple[Point, Point]], volts: Value) -> tuple[Boundary, ...]:
    """Two ends at room temperature, the first at a voltage and the other grounded."""
    cold = (Boundary(f"cold {i}", "temperature", *at, ROOM) for i, at in enumerate(ends))
    return (*cold, Boundary("plus", "voltage", *ends[0], volts), Boundary("minus", "voltage", *ends[1], 0.0))


def heated_bar(material: Material, length: float, area: float, volts: float) -> tuple[float, float, float]:
    """Peak and mean rise (K) and current (A) of a bar between cold ends, its resistivity known at their temperature.

    1 + a T is the peak's times the cosine of sqrt(a rho I^2/k)/A from the middle on, which is 1 at the ends (for a < 0
    a hyperbolic one); the peak is that of ``hottest``.
    """
    assert material.resistivity is not None
    k, rho, a = material.thermal_conductivity, material.resistivity, material.temperature_coefficient
    peak, cold = hottest(k, rho, a, volts), volts * area / (rho * length)
    if a == 0:
        return peak, 2 / 3 * peak, cold
    angle = np.emath.arccos(1 / (1 + a * peak))
    current = float((angle * np.emath.sqrt(k / (a * rho))).real) * 2 * area / length
    return peak, (cold / current - 1) / a, current


def bend() -> Iterator[Row]:
    """An L of wire: a square corner counts 1 - (2/pi) ln 2 = 0.5587 squares, and where the ends have one temperature
    the diagonal, at half the voltage, is the hottest.

    The corner by the map z = (2/pi) (artanh s - arctan s) of a half plane onto an L of infinite arms; with arms of four
    widths the ends are felt as e^(-8 pi). The hottest place by Kohlrausch's theorem: the integral of k rho dT is V^2/8.
    """
    w, t, arms, volts = 10e-6, 1e-6, 4.0, 3.0
    squares = 2 * arms + 1 - 2 * np.log(2) / np.pi
    far = w * (1 + arms)
    ends = [((far, 0.0, 0.0), (far, w, t)), ((0.0, far, 0.0), (w, far, t))]
    outer = (0.0, 0.0, t / 2)
    inner = (w, w, t / 2)
    for coefficient in (0.0, 1e-3, -1e-3):
        material = replace(SILICON, temperature_coefficient=coefficient)
        boxes = (Box("along x", material, (0.0, 0.0, 0.0), (far, w, t)),
                 Box("along y", material, (0.0, w, 0.0), (w, far, t)))  # fmt: skip
        probes = (
            Probe("current", *ends[0], "current"), Probe("outer corner", outer, outer),
            Probe("inner corner", inner, inner), Probe("half way", outer, outer, "potential"),
            Probe("hottest", (0.0, 0.0, 0.0), (far, far, t), "temperature", "max"),
        )  # fmt: skip
        scene = Scene("bend", boxes, cold_electrodes(ends, volts), probes, accuracy=ACCURACY, steady=True)
        assert SILICON.resistivity is not None
        peak = hottest(SILICON.thermal_conductivity, SILICON.resistivity, coefficient, volts)
        expected = [Expected(name, "K", ROOM + peak, peak) for name in ("outer corner", "inner corner", "hottest")]
        if coefficient == 0:
            current = volts * t / SILICON.resistivity / squares
            expected += [Expected("current", "A", current, current),
                         Expected("half way", "V", volts / 2, volts, name="potential of the outer corner")]  # fmt: skip
        yield from rows(FAMILY, f"L-shaped conductor, TCR {coefficient:g} 1/K", scene, expected,
                        "conformal map (0.5587 squares a corner); Kohlrausch's theorem")  # fmt: skip


def hottest(conductivity: float, resistivity: float, coefficient: float, volts: float) -> float:
    """The largest rise (K) between ends of one temperature: k rho_0 (T + a T^2/2) = V^2/8, for any shape."""
    cold = volts**2 / (8 * conductivity * resistivity)
    return 2 * cold / (1 + np.sqrt(1 + 2 * coefficient * cold))


def partial_electrodes() -> Iterator[Row]:
    """A sheet with one electrode along its lower edge and one along a part of its upper edge; and the same for heat.

    With sn the sheet is mapped to a half plane, and back to a sheet with electrodes on whole edges: the resistance is
    rho/t K(1 - m1)/K(m1), m1 = m sn^2(c K(m)/w | m), where K(1 - m)/K(m) is the sheet's height over its width.
    """
    w, height, t, c, volts, rise = 40e-6, 30e-6, 2e-6, 15e-6, 1.0, 10.0
    m = float(brentq(lambda m: ellipk(1 - m) / ellipk(m) - height / w, 1e-12, 1 - 1e-12, xtol=1e-15))
    m1 = m * float(ellipj(c * ellipk(m) / w, m)[0]) ** 2
    shape = float(ellipk(m1) / ellipk(1 - m1))  # conductance over the sheet conductance
    lower, upper = ((0.0, 0.0, 0.0), (w, 0.0, t)), ((0.0, height, 0.0), (c, height, t))
    material = replace(SILICON, temperature_coefficient=0.0)
    probes = (Probe("current", *upper, "current"), Probe("heat", *upper, "heat_flow"))
    boundaries = (
        Boundary("ground", "voltage", *lower, 0.0), Boundary("contact", "voltage", *upper, volts),
        Boundary("cold", "temperature", *lower, ROOM), Boundary("warm", "temperature", *upper, ROOM + rise),
    )  # fmt: skip
    box = Box("sheet", material, (0.0, 0.0, 0.0), (w, height, t))
    assert material.resistivity is not None
    current = volts * t / material.resistivity * shape
    scene = Scene("sheet", (box,), boundaries[:2] + boundaries[2:3], probes[:1], accuracy=ACCURACY, steady=True)
    note = "conformal map by Jacobi's sn"
    yield from rows(FAMILY, "sheet with a partial electrode", scene, [Expected("current", "A", current, current)], note)
    flow = rise * t * material.thermal_conductivity * shape
    scene = replace(scene, boundaries=boundaries[2:], probes=probes[1:])
    yield from rows(FAMILY, "sheet warmed along a part of an edge", scene, [Expected("heat", "W", flow, flow)], note)
