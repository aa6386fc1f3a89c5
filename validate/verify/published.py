"""Published benchmarks of heat conduction: two of NAFEMS and the first of ISO 10211, each with a series behind it.

A printed number is known to half its last digit, which is added to the estimated error; the row below it compares with
the exact value. Plane problems are extruded by one layer.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Schedule
from validate.verify import series
from validate.verify.answers import ACCURACY, Expected, Row, rows
from validate.verify.exact_walls import end, wall
from validate.verify.series import Layer

FAMILY = "published"
ZERO = 273.15  # K: 0 degrees Celsius
NAFEMS = "The Standard NAFEMS Benchmarks, rev. 3, 1990"
ISO = "ISO 10211:2017, annex C"
STEPS = 320  # straight lines for the sine of NAFEMS T3


def nafems_t3() -> Iterator[Row]:
    """NAFEMS T3: a bar of 0.1 m, 0 degrees at one end, 100 sin(pi t/40) at the other; at 0.08 m after 32 s 36.60."""
    section, printed, time = (0.01, 0.01), 36.60, 32.0
    bar = Layer(0.1, 35.0, 7200 * 440.5)
    times = np.linspace(0.0, time, STEPS + 1)
    values = 100 * np.sin(np.pi * times / 40)
    hot = Schedule(tuple(times.tolist()), tuple((ZERO + values).tolist()))
    at = (0.005, 0.08, 0.005)
    scene = wall(
        "NAFEMS T3", [bar],
        [end("temperature", 0.0, ZERO, section=section), end("temperature", 0.1, hot, section=section)],
        (time,), [Probe("C", at, at)], ZERO, section,
    )  # fmt: skip
    slow = bar.thickness**2 * bar.heat_capacity / bar.conductivity
    exact = 100 * series.sine_driven(0.8, slow, np.pi / 40, time)
    cut = abs(exact - series.ramped(0.8, slow, times, values, time))
    yield from rows(FAMILY, "NAFEMS T3, transient bar", scene, [
        Expected("C", "K", ZERO + printed, 100.0, 0.005 + cut, "C at 32 s, printed 36.60 C", None, NAFEMS),
        Expected("C", "K", ZERO + exact, 100.0, cut, "C at 32 s, series", note="Duhamel's theorem"),
    ])  # fmt: skip


def nafems_t4() -> Iterator[Row]:
    """NAFEMS T4: a plate of 0.6 x 1 m, 100 degrees below, air at 0 right and above; 18.25 at (0.6, 0.2)."""
    width, height, depth, k, h = 0.6, 1.0, 0.1, 52.0, 750.0
    upper, at = (width, height, depth), (width, 0.2, depth / 2)
    boundaries = (
        Boundary("hot", "temperature", (0.0, 0.0, 0.0), (width, 0.0, depth), ZERO + 100.0),
        Boundary("right", "convection", (width, 0.0, 0.0), upper, h, ZERO),
        Boundary("above", "convection", (0.0, height, 0.0), upper, h, ZERO),
    )
    box = Box("plate", Material("steel", k, 7850.0, 460.0), (0.0, 0.0, 0.0), upper)
    scene = Scene("NAFEMS T4", (box,), boundaries, (Probe("E", at, at),), ZERO, accuracy=ACCURACY, steady=True)
    exact = 100 * series.convective_rectangle(width, height, k, h, width, 0.2)
    yield from rows(FAMILY, "NAFEMS T4, plate in air", scene, [
        Expected("E", "K", ZERO + 18.25, 100.0, 0.005, "E, printed 18.25 C", None, NAFEMS),
        Expected("E", "K", ZERO + exact, 100.0, 0.0, "E, series", note="separation of variables"),
    ])  # fmt: skip


CASE_1 = (
    (9.7, 13.4, 14.7, 15.1), (5.3, 8.6, 10.3, 10.8), (3.2, 5.6, 7.0, 7.5), (2.0, 3.6, 4.7, 5.0),
    (1.3, 2.3, 3.0, 3.2), (0.7, 1.4, 1.8, 1.9), (0.3, 0.6, 0.8, 0.9),
)  # fmt: skip


def iso_case_1() -> Iterator[Row]:
    """ISO 10211 case 1: half of a square column, 20 degrees above, 0 at the side and below; 28 temperatures.

    At the corner the given temperatures jump, so the heat flow there has no limit, but temperatures do.
    """
    size, depth = 0.1, 0.01
    cell = size / 8
    box = Box("column", Material("stone", 1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (size / 2, size, depth))
    boundaries = (
        Boundary("side", "temperature", (0.0, 0.0, 0.0), (0.0, size, depth), ZERO),
        Boundary("below", "temperature", (0.0, 0.0, 0.0), (size / 2, 0.0, depth), ZERO),
        Boundary("above", "temperature", (0.0, size, 0.0), (size / 2, size, depth), ZERO + 20.0),
    )
    probes, printed, exact = [], [], []
    for j, row in enumerate(CASE_1, start=1):
        for i, value in enumerate(row, start=1):
            at: Point = (i * cell, size - j * cell, depth / 2)
            probes.append(Probe(f"{i},{j}", at, at))
            printed.append(value)
            exact.append(20 * series.half_heated_square(i / 8, j / 8))
    scene = Scene("ISO 10211 case 1", (box,), boundaries, tuple(probes), ZERO, accuracy=ACCURACY, steady=True)
    expected = [Expected(p.name, "K", ZERO + v, 20.0, 0.05, settled=None) for p, v in zip(probes, printed, strict=True)]
    expected += [Expected(p.name, "K", ZERO + v, 20.0) for p, v in zip(probes, exact, strict=True)]
    found = list(rows(FAMILY, "ISO 10211 case 1, half a column", scene, expected))
    yield worst(found[: len(probes)], "28 printed temperatures", ISO)
    yield worst(found[len(probes) :], "28 temperatures, series", "separation of variables")


def worst(found: list[Row], quantity: str, note: str) -> Row:
    """Of several rows the one that is furthest off in terms of its error, renamed."""
    chosen = max(found, key=lambda row: abs(row.difference) / row.error)
    return replace(chosen, quantity=quantity, note=note, count=len(found))
