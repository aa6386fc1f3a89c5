"""Exact cases: walls of one layer and of two along y, solved in 3D, steady and transient; bodies that conduct in two
and three dimensions, and conductors with a closed form of their resistance.

Series of conduction problems (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed.).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any, Literal

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipj, ellipk

from benchmarks import bars
from benchmarks.bars import ENDS, LENGTH, MIDDLE, ROOM, SLOW, cold_electrodes
from benchmarks.rows import Row
from benchmarks.walls import HELD, INVERSION, Layer, step_response
from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Schedule, Value
from scenes.sink import OXIDE, SILICON, face
from validate.verify.expected import ACCURACY, Expected, rows

TERMS = 400
FAMILY = "exact solutions"
ONE = Layer(LENGTH, SILICON.thermal_conductivity, SILICON.heat_capacity)
TIMES = tuple((SLOW * np.array([0.005, 0.02, 0.1, 0.4, 1.0])).tolist())
INSTANTS = np.array(TIMES)
NUMBERS = INSTANTS * 4 / SLOW  # alpha t/l^2 of half the length


@cache
def film_roots(biot: float, count: int) -> np.ndarray:
    """The positive roots of b tan b = biot."""
    return np.array([
        # pi/2 as a double is below the root for the largest numbers.
        brentq(lambda b: b * np.sin(b) - biot * np.cos(b), n * np.pi, n * np.pi + 1.6, xtol=1e-15)
        for n in range(count)
    ])  # fmt: skip


def cooling(position: float, number: float, biot: float = HELD) -> float:
    """Return the missing part of a step of the air's temperature at ``position`` (-1 to 1) in a slab between films.

    ``number`` is the Fourier number alpha t/l^2 of the half thickness, ``biot`` is h l/k (3.11, eq 10); by default the
    faces take the temperature at once (3.3, eq 8).
    """
    b = film_roots(biot, TERMS)
    amplitudes = 2 * np.sin(b) / (b + np.sin(b) * np.cos(b))
    return float((amplitudes * np.exp(-(b**2) * number) * np.cos(b * position)).sum())


def heated_middle(number: np.ndarray) -> np.ndarray:
    """The rise in the middle of a slab with heat q between faces held cold, over q l^2/(2 k) (3.14, eq 7)."""
    n = np.arange(TERMS)
    a = (2 * n + 1) * np.pi / 2
    return 1 - 4 * ((-1.0) ** n / a**3 * np.exp(-np.multiply.outer(number, a**2))).sum(axis=-1)


def mean_cooling(number: float) -> float:
    """The mean of `cooling` over the slab."""
    a = (2 * np.arange(TERMS) + 1) * np.pi / 2
    return float((2 / a**2 * np.exp(-(a**2) * number)).sum())


def ramped(fraction: float, diffusion_time: float, times: np.ndarray, values: np.ndarray, time: float) -> float:
    """Return the rise at ``fraction`` of a slab, 0 at its near face, whose far face follows straight lines between
    ``values`` at some ``times`` (s); ``diffusion_time`` is L^2/alpha (s). By Duhamel's theorem (3.5)."""
    n = np.arange(1, 4 * TERMS + 1)
    rate = n**2 * np.pi**2 / diffusion_time
    lag = np.zeros(len(n))
    for a, b, slope in zip(times[:-1], times[1:], np.diff(values) / np.diff(times), strict=True):
        if a < time:
            lag += slope * (np.exp(-rate * (time - min(b, time))) - np.exp(-rate * (time - a))) / rate
    terms = 2 * (-1.0) ** n / (n * np.pi) * np.sin(n * np.pi * fraction) * lag
    return float(fraction * np.interp(time, times, values) + terms.sum())


def convective_rectangle(
    width: float, height: float, conductivity: float, coefficient: float, x: float, y: float
) -> float:  # fmt: skip
    """The temperature in a rectangle, 1 along y = 0, adiabatic at x = 0, films to 0 at x = width and y = height."""
    b = film_roots(coefficient * width / conductivity, 200) / width
    start = 2 * np.sin(b * width) / (b * width + np.sin(b * width) * np.cos(b * width))
    h = coefficient / (conductivity * b)

    def falling(distance: float) -> np.ndarray:
        """cosh(b d) + h sinh(b d) over e^(b height)."""
        e, shrink = np.exp(b * (distance - height)), np.exp(-b * (distance + height))
        return ((1 + h) * e + (1 - h) * shrink) / 2

    return float((start * np.cos(b * x) * falling(height - y) / falling(height)).sum())


WIDTH, _, DEPTH = BAR = bars.SIZE


def slab_step() -> Iterator[Row]:
    """Both faces of a slab take another temperature at once."""
    values = {"middle": [1 - cooling(0.0, n) for n in NUMBERS],
              "mean": [1 - mean_cooling(n) for n in NUMBERS]}  # fmt: skip
    mean = Probe("mean", (0.0, 0.0, 0.0), flat(LENGTH)[1])
    return _slab("slab, step of both faces", _both("temperature", ROOM + 10.0), values, 10.0,
                 "Carslaw and Jaeger 3.3", [MIDDLE, mean])  # fmt: skip


def slab_film() -> Iterator[Row]:
    """The air on both sides of a slab takes another temperature at once; Biot number 2."""
    biot = 2.0
    faces = _both("convection", biot * SILICON.thermal_conductivity / (LENGTH / 2), ROOM + 10.0)
    values = {name: [1 - cooling(x, n, biot) for n in NUMBERS] for name, x in (("middle", 0.0), ("face 0", 1.0))}
    return _slab("slab between films", faces, values, 10.0, "Carslaw and Jaeger 3.11")


def heated_slab() -> Iterator[Row]:
    """A slab with heat inside, from t = 0 on or for a while, between faces held cold."""
    peak, faces = 20.0, _both("temperature", ROOM)
    q, stop = peak * 8 * SILICON.thermal_conductivity / LENGTH**2, 0.1 * SLOW
    rise = heated_middle(NUMBERS)
    yield from _slab("heated slab", faces, {"middle": rise}, peak, "Carslaw and Jaeger 3.14", heat_source=q)
    pulse = Schedule((0.0, stop, stop, 2 * SLOW), (q, q, 0.0, 0.0))
    late = np.maximum(INSTANTS - stop, 0.0)
    rise = rise - np.where(late > 0, heated_middle(late * 4 / SLOW), 0.0)
    yield from _slab("slab heated for a while", faces, {"middle": rise}, peak,
                     "Carslaw and Jaeger 3.14, superposed", heat_source=pulse)  # fmt: skip


def ramped_slab() -> Iterator[Row]:
    """One face of a slab follows straight lines up and down, the other is held."""
    times, values = np.array([0.0, 0.1, 0.4, 1.5]) * SLOW, np.array([0.0, 1.0, 0.5, 0.5])
    ramp = Schedule(tuple(times.tolist()), tuple((ROOM + 10.0 * values).tolist()))
    temperatures = [ramped(0.6, SLOW, times, values, t) for t in TIMES]
    at = (WIDTH / 2, 0.6 * LENGTH, DEPTH / 2)
    faces = [end("temperature", 0.0, ROOM), end("temperature", LENGTH, ramp)]
    return _slab("slab, ramps of one face", faces, {"probe": temperatures}, 10.0,
                 "Duhamel's theorem, Carslaw and Jaeger 3.5", [Probe("probe", at, at)])  # fmt: skip


def _both(kind: Any, value: float, ambient: float = ROOM) -> list[Boundary]:
    return [end(kind, y, value, ambient) for y in (0.0, LENGTH)]


def _slab(
    case: str, faces: list[Boundary], values: dict[str, Any], size: float, note: str,
    probes: Sequence[Probe] = (MIDDLE,), heat_source: Value = 0.0,
) -> Iterator[Row]:  # fmt: skip
    """The rows of one layer of silicon whose rises at TIMES should be these parts of a size (K)."""
    scene = wall(case, [ONE], faces, TIMES, probes, heat_source=heat_source)
    expected = [Expected(name, ROOM + size * np.array(part), size) for name, part in values.items()]
    return rows(FAMILY, case, scene, expected, note)


def layers_steady() -> Iterator[Row]:
    """Two layers in series between a flux and a film."""
    flux, h, air = 1e5, 2e4, 303.0
    a, b = Layer(0.3e-3, SILICON.thermal_conductivity, 1.0), Layer(0.1e-3, OXIDE.thermal_conductivity, 1.0)
    far = a.thickness + b.thickness
    scene = wall("two layers", [a, b], [end("heat_flux", 0.0, flux), end("convection", far, h, air)],
                 probes=[Probe("heat", *flat(far), "heat_flow")])  # fmt: skip
    resistances = [1 / h, *(layer.thickness / layer.conductivity for layer in (b, a))]
    expected = (air + flux * np.cumsum(resistances)).tolist()
    size, section = expected[-1] - ROOM, scene.boxes[0].upper
    flow = -flux * section[0] * section[2]
    yield from rows(FAMILY, "two layers, steady", scene, [
        *(Expected(f"face {i}", value, size) for i, value in enumerate(reversed(expected))),
        Expected("heat", flow, name="heat into the far face"),
    ], "resistances in series")  # fmt: skip


def layers_transient() -> Iterator[Row]:
    """Two layers after a step of the face temperature, of the flux and of the air's temperature."""
    a = Layer(0.3e-3, SILICON.thermal_conductivity, SILICON.heat_capacity)
    b = Layer(0.05e-3, OXIDE.thermal_conductivity, OXIDE.heat_capacity)
    far = a.thickness + b.thickness
    slow = (a.thickness * a.heat_capacity + b.thickness * b.heat_capacity) * b.thickness / b.conductivity
    times = tuple((slow * np.array([0.02, 0.1, 0.5, 2.0])).tolist())
    held = end("temperature", far, ROOM)
    cases = {
        "temperature": (end("temperature", 0.0, ROOM + 10.0), 10.0, 0.0, 10.0),
        "flux": (end("heat_flux", 0.0, 1e5), 1e5, 0.0, 1e5 * (b.thickness / b.conductivity)),
        "film": (end("convection", 0.0, 3e4, ROOM + 10.0), 10.0, 3e4, 10.0),
    }
    for kind, (drive, size, coefficient, scale) in cases.items():
        rise = step_response([a, b], kind, size, HELD, np.array(times), coefficient)  # type: ignore[arg-type]
        chosen = (1,) if kind == "temperature" else (0, 1)
        yield from rows(FAMILY, f"two layers, step of the {kind}", wall("two layers", [a, b], [drive, held], times), [
            Expected(f"face {i}", ROOM + rise[:, i], scale, INVERSION * scale) for i in chosen
        ], "Laplace domain, inverted")  # fmt: skip


def thin_layer() -> Iterator[Row]:
    """A film of oxide of 0.1 um beside silicon of 250 um, steady and transient."""
    a = Layer(250e-6, SILICON.thermal_conductivity, SILICON.heat_capacity)
    b = Layer(0.1e-6, OXIDE.thermal_conductivity, OXIDE.heat_capacity)
    far, flux = a.thickness + b.thickness, 1e6
    boundaries = [end("heat_flux", 0.0, flux), end("temperature", far, ROOM)]
    drops = [flux * layer.thickness / layer.conductivity for layer in (a, b)]
    yield from rows(FAMILY, "0.1 um of oxide on 250 um of silicon, steady", wall("thin", [a, b], boundaries), [
        Expected("face 0", ROOM + sum(drops), sum(drops)), Expected("face 1", ROOM + drops[1], sum(drops)),
    ], "resistances in series")  # fmt: skip
    slow = a.thickness**2 * a.heat_capacity / a.conductivity
    times = tuple((slow * np.array([0.05, 0.2, 1.0])).tolist())
    rise = step_response([a, b], "flux", flux, HELD, np.array(times))
    scene = wall("thin", [a, b], boundaries, times)
    yield from rows(FAMILY, "0.1 um of oxide on 250 um of silicon, transient", scene, [
        Expected(f"face {i}", ROOM + rise[:, i], sum(drops), INVERSION * sum(drops)) for i in (0, 1)
    ], "Laplace domain, inverted")  # fmt: skip


def wall(
    name: str, layers: Sequence[Layer], boundaries: Sequence[Boundary], times: Sequence[float] = (),
    probes: Sequence[Probe] = (), initial: float = 293.0, section: tuple[float, float] = (WIDTH, DEPTH),
    heat_source: Value = 0.0,
) -> Scene:  # fmt: skip
    """Layers side by side, steady without ``times`` (s); faces between have probes "face 0" onwards."""
    planes = np.concatenate([[0.0], np.cumsum([layer.thickness for layer in layers])]).tolist()
    boxes = tuple(
        Box(f"layer {i}", Material(f"layer {i}", layer.conductivity, 1.0, layer.heat_capacity),
            flat(planes[i])[0], flat(planes[i + 1], section)[1], heat_source)
        for i, layer in enumerate(layers)
    )  # fmt: skip
    faces = tuple(Probe(f"face {i}", *flat(y, section)) for i, y in enumerate(planes))
    return Scene(
        name, boxes, tuple(boundaries), (*faces, *probes), initial, max(times, default=1.0), ACCURACY,
        not times, tuple(times),
    )  # fmt: skip


def end(
    kind: Literal["temperature", "heat_flux", "convection", "voltage"], y: float, value: Any, ambient: Value = 293.0,
    section: tuple[float, float] = (WIDTH, DEPTH),
) -> Boundary:  # fmt: skip
    """A condition on the plane at y (m)."""
    return Boundary(f"{kind} {y:g}", kind, *flat(y, section), value, ambient)


def flat(y: float, section: tuple[float, float] = (WIDTH, DEPTH)) -> tuple[Point, Point]:
    """The flat box across a wall at y (m)."""
    return (0.0, y, 0.0), (section[0], y, section[1])


def brick() -> Iterator[Row]:
    """A brick whose six faces take another temperature at once: the product of three slabs."""
    half, material = (1.0, 1.6, 2.0), Material("unit", 1.0, 1.0, 1.0)
    box = Box("brick", material, (-1.0, -1.6, -2.0), half)
    faces = tuple(
        Boundary(f"face {d}{side}", "temperature", *face(box, d, side), 2.0) for d, side in product(range(3), (0, 1))
    )
    probes = {"centre O": (0.0, 0.0, 0.0), "point H": (0.5, 0.8, 1.0)}
    times = (0.1, 0.3, 1.0)
    points = tuple(Probe(name, at, at) for name, at in probes.items())
    scene = Scene("brick", (box,), faces, points, 1.0, 1.0, ACCURACY, False, times)

    def exact(at: Point, t: float) -> Any:
        return 2.0 - np.prod([cooling(c / size, t / size**2) for c, size in zip(at, half, strict=True)])

    yield from rows(FAMILY, "brick, step of all faces", scene, [
        Expected(name, np.array([exact(at, t) for t in times]), 1.0) for name, at in probes.items()
    ], "product of series; the brick of Code_Aster's test TTLV301 (V4.25.301)")  # fmt: skip


def joule_bar() -> Iterator[Row]:
    """A bar heated by its own current, its resistivity rising, constant or falling with temperature."""
    probes = (
        MIDDLE, Probe("mean", (0.0, 0.0, 0.0), BAR), Probe("hottest", (0.0, 0.0, 0.0), BAR, "temperature", "max"),
        Probe("current", *ENDS[0], "current"), Probe("heat", *ENDS[1], "heat_flow"),
    )  # fmt: skip
    for volts, coefficient in ((7.0, 5e-4), (7.0, -5e-4), (1.0, 0.0)):
        scene = bar(volts, coefficient, probes)
        peak, mean, current = heated_bar(scene.boxes[0].material, LENGTH, WIDTH * DEPTH, volts)
        power = volts * current
        yield from rows(FAMILY, f"Joule-heated bar, TCR {coefficient:g} 1/K, {volts:g} V", scene, [
            Expected("middle", ROOM + peak, peak), Expected("hottest", ROOM + peak, peak),
            Expected("mean", ROOM + mean, peak), Expected("current", current),
            Expected("heat", -power / 2, power, name="heat into the far end"),
        ], "closed solution of the fin; V^2/8 = integral of k rho dT")  # fmt: skip


def bar(volts: Value, coefficient: float, probes: tuple[Probe, ...]) -> Scene:
    """The steady state of a bar of silicon with some temperature coefficient (1/K) between cold electrodes."""
    material = replace(SILICON, temperature_coefficient=coefficient)
    return bars.bar(material, volts, probes, ACCURACY)


def heated_bar(material: Material, length: float, area: float, volts: float) -> tuple[float, float, float]:
    """Peak and mean rise (K) and current (A) of a bar between cold ends, its resistivity given at their temperature.

    1 + a T is the peak's times the cosine of sqrt(a rho I^2/k)/A from the middle on, which is 1 at the ends (for a < 0
    a hyperbolic one); the peak is from ``hottest``.
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
        expected = [Expected(name, ROOM + peak, peak) for name in ("outer corner", "inner corner", "hottest")]
        if coefficient == 0:
            current = volts * t / SILICON.resistivity / squares
            expected += [Expected("current", current),
                         Expected("half way", volts / 2, volts, name="potential of the outer corner")]  # fmt: skip
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
    yield from rows(FAMILY, "sheet with a partial electrode", scene, [Expected("current", current)], note)
    flow = rise * t * material.thermal_conductivity * shape
    scene = replace(scene, boundaries=boundaries[2:], probes=probes[1:])
    yield from rows(FAMILY, "sheet warmed along a part of an edge", scene, [Expected("heat", flow)], note)
