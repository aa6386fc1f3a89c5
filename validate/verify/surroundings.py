"""Exact cases beyond constant properties and plain boundaries: contacts, conductivities that differ along the axes or
follow the temperature, radiation, and the spreading resistance of a substrate."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.constants import Stefan_Boltzmann as STEFAN_BOLTZMANN
from scipy.optimize import brentq

from benchmarks import bars
from benchmarks.rows import Row
from benchmarks.walls import Layer
from reduced1d.equations import plate_resistance
from scenes.laws import PowerLaw, Table
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.sink import OXIDE, SILICON, face
from validate.verify.exact import (
    BAR,
    DEPTH,
    ENDS,
    FAMILY,
    LENGTH,
    MIDDLE,
    ROOM,
    WIDTH,
    bar,
    end,
    flat,
    heated_bar,
    wall,
)
from validate.verify.expected import ACCURACY, Expected, rows


def contact_at_a_face() -> Iterator[Row]:
    """Two layers whose outer faces stand behind contact resistances at given temperatures: resistances in series."""
    hot, first, last = ROOM + 40.0, 3e-6, 8e-6
    a, b = Layer(0.3e-3, SILICON.thermal_conductivity, 1.0), Layer(5e-6, OXIDE.thermal_conductivity, 1.0)
    far = a.thickness + b.thickness
    ends = [
        replace(end("convection", y, 1 / resistance, T), contact_resistance=resistance)
        for y, resistance, T in ((0.0, first, hot), (far, last, ROOM))
    ]
    steps = np.array([first, a.thickness / a.conductivity, b.thickness / b.conductivity, last])
    flux = (hot - ROOM) / steps.sum()
    faces = hot - flux * np.cumsum(steps)[:3]
    scene = wall("contacts", [a, b], ends, probes=[Probe("heat", *flat(0.0), "heat_flow")])
    section = scene.boxes[0].upper
    flow = flux * section[0] * section[2]
    yield from rows(FAMILY, "two layers behind contact resistances", scene, [
        *(Expected(f"face {i}", T, hot - ROOM) for i, T in enumerate(faces)),
        Expected("heat", flow, name="heat into the near face"),
    ], "resistances in series")  # fmt: skip


def given_current() -> Iterator[Row]:
    """A bar with the current that a voltage gives, and with a larger voltage behind a resistance: the same state."""
    volts, series = 7.0, 250.0
    probes = (MIDDLE, Probe("mean", (0.0, 0.0, 0.0), BAR), Probe("potential", *ENDS[0], "potential"))
    scene = bar(volts, 5e-4, probes)
    peak, mean, current = heated_bar(scene.boxes[0].material, LENGTH, WIDTH * DEPTH, volts)
    expected = [
        Expected("middle", ROOM + peak, peak), Expected("mean", ROOM + mean, peak),
        Expected("potential", volts),
    ]  # fmt: skip
    for case, value, behind in (("its current given", current, math.inf),
                                ("its voltage behind a resistance", volts + series * current, series)):  # fmt: skip
        driven = tuple(
            replace(b, value=value, series_resistance=behind) if b.name == "plus" else b for b in scene.boundaries
        )
        yield from rows(FAMILY, f"Joule-heated bar, {case}", replace(scene, boundaries=driven), expected,
                        "the state at the voltage: closed solution of the fin")  # fmt: skip


def anisotropic_block() -> Iterator[Row]:
    """A block whose conductivity differs along the axes, heated inside and cold on three faces: where x, y and z are
    measured in lengths that are as the roots of the conductivities, it is one of a single conductivity."""
    k, source, size = (40.0, 90.0, 160.0), 1e12, (30e-6, 40e-6, 50e-6)
    mean = float(np.prod(k)) ** (1 / 3)
    stretched = tuple(length * (mean / along) ** 0.5 for length, along in zip(size, k, strict=True))
    corner = heated_corner(stretched, mean, source)
    material = Material("block", k, 1.0, 1.0)  # type: ignore[arg-type]
    box = Box("block", material, (0.0, 0.0, 0.0), size, source)
    cold = tuple(Boundary(f"cold {d}", "temperature", *face(box, d, 1), ROOM) for d in range(3))
    hottest = Probe("corner", (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    scene = Scene("block", (box,), cold, (hottest,), accuracy=ACCURACY, steady=True)
    yield from rows(FAMILY, "block with three conductivities, heated inside", scene,
                    [Expected("corner", ROOM + corner, corner)],
                    "the block stretched along x, y and z; its series")  # fmt: skip


def heated_corner(size: tuple[float, ...], conductivity: float, source: float) -> float:
    """The rise (K) in the corner of three mirrors of a block (m) with heat inside (W/m3), cold on the other faces.

    A series of cosines along y and z; along x in closed form: 1 - 1/cosh.
    """
    a, b, c = size
    n = (2 * np.arange(1600) + 1) * np.pi / 2
    square = np.add.outer((n / b) ** 2, (n / c) ** 2)
    amplitudes = (-1.0) ** np.arange(len(n)) * 2 / n
    along = 1 - 1 / np.cosh(np.minimum(np.sqrt(square) * a, 700.0))
    return source / conductivity * float(amplitudes @ (along / square) @ amplitudes)


def following_conductivity() -> Iterator[Row]:
    """A bar heated inside between cold ends, its conductivity a power of the temperature and a table: the integral
    theta of the conductivity from the ends' temperature on is a parabola (Kirchhoff's transform)."""
    k = SILICON.thermal_conductivity
    assert isinstance(k, float)
    peak = 30_000.0  # W/m: rises of 427 K with the power and 375 K with the table, beyond where that ends
    source = 8 * peak / LENGTH**2
    at = (0.0, LENGTH / 4, 0.0)
    probes = (MIDDLE, Probe("quarter", at, at), Probe("heat", *ENDS[1], "heat_flow"))
    cold = tuple(Boundary(f"cold {i}", "temperature", *ends, ROOM) for i, ends in enumerate(ENDS))
    power, table = PowerLaw(k, ROOM, -1.3), Table((ROOM, 400.0, 600.0), (k, 90.0, 55.0))
    for called, law in (("a power of the temperature", power), ("a table", table)):
        material = replace(SILICON, name="bar", thermal_conductivity=law)
        scene = Scene("bar", (Box("bar", material, (0.0, 0.0, 0.0), BAR, source),), cold, probes,
                      accuracy=ACCURACY, steady=True)  # fmt: skip
        middle_K, quarter_K = (bars.peak(law, 1.0, (8 * theta) ** 0.5) for theta in (peak, 0.75 * peak))
        rise, flow = middle_K - ROOM, source * LENGTH * WIDTH * DEPTH / 2
        yield from rows(FAMILY, f"heated bar whose conductivity is {called}", scene, [
            Expected("middle", middle_K, rise), Expected("quarter", quarter_K, rise),
            Expected("heat", -flow, name="heat through the far end"),
        ], "Kirchhoff's transform, Carslaw and Jaeger 1.6")  # fmt: skip


def radiation() -> Iterator[Row]:
    """A slab between a given temperature and a face that radiates to another: conduction equals radiation."""
    hot, cold, emissivity = 1200.0, 300.0, 0.8
    k, length = 2.0, 20e-3

    def left(face: float) -> float:
        return k * (hot - face) / length - emissivity * STEFAN_BOLTZMANN * (face**4 - cold**4)

    face = brentq(left, cold, hot, xtol=1e-10)
    ends = [end("temperature", 0.0, hot), Boundary("face", "radiation", *flat(length), emissivity, cold)]
    scene = wall("radiation", [Layer(length, k, 1.0)], ends, initial=cold,
                 probes=[Probe("face", *flat(length)), Probe("heat", *flat(0.0), "heat_flow")])  # fmt: skip
    section = scene.boxes[0].upper
    flow = k * (hot - face) / length * section[0] * section[2]
    yield from rows(FAMILY, "slab whose far face radiates", scene, [
        Expected("face", face, hot - cold), Expected("heat", flow, name="heat into the near face"),
    ], "emissivity x sigma (T^4 - T_a^4) is what is conducted")  # fmt: skip


def spreading() -> Iterator[Row]:
    """A source on a plate whose underside is cold: the mean rise under it, as much at once and spread as 1D has it."""
    length, width, thickness = 200e-6, 150e-6, 50e-6
    a, b, flux = 80e-6, 50e-6, 1e7
    k = SILICON.thermal_conductivity
    x, y = (width - b) / 2, (length - a) / 2
    plate = Box("plate", replace(SILICON, resistivity=None), (0.0, 0.0, 0.0), (width, length, thickness))
    source = ((x, y, thickness), (x + b, y + a, thickness))
    scene = Scene("plate", (plate,), (
        Boundary("bottom", "temperature", (0.0, 0.0, 0.0), (width, length, 0.0), ROOM),
        Boundary("source", "heat_flux", *source, flux),
    ), (Probe("mean", *source),), accuracy=ACCURACY, steady=True)  # fmt: skip
    rise = flux * a * b * plate_resistance((width, length, thickness), (b, a), (width / 2, length / 2), k)
    expected = Expected("mean", ROOM + rise, rise, 1e-5 * rise, name="mean under it")
    yield from rows(FAMILY, "source on a plate", scene, [expected],
                    "Muzychka, Culham and Yovanovich, J. Electron. Packag. 125, 178 (2003)")  # fmt: skip
