"""A bar between cold electrodes: its scene, and the closed forms of its steady state for any law.

With k(T), rho(T) and both ends at T0 and V apart, k rho dT integrates to V^2/8 from T0 to the peak, whatever the laws
(Kohlrausch 1900). Where the integral over all temperatures is finite, the square root of 8 times that is the largest
voltage that has a steady state.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.optimize import brentq

from benchmarks.rows import Row, at_most
from compare.processes import TimeIsUpError, limited
from fem3d.runs.scene import solve
from scenes.errors import NumericsError
from scenes.laws import PowerLaw, Table
from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Value
from scenes.sink import SILICON

ROOM = 293.0  # K
WIDTH, LENGTH, DEPTH = SIZE = (20e-6, 1e-3, 2e-6)  # m
ENDS: list[tuple[Point, Point]] = [((0.0, y, 0.0), (WIDTH, y, DEPTH)) for y in (0.0, LENGTH)]
MIDDLE = Probe("middle", (WIDTH / 2, LENGTH / 2, DEPTH / 2), (WIDTH / 2, LENGTH / 2, DEPTH / 2))
SLOW = LENGTH**2 * SILICON.heat_capacity / SILICON.thermal_conductivity  # s: diffusion time of the length
LATE = 20 * SLOW  # s: long beside the slowest mode, also near a limit
HOTTEST = 2000.0  # K: peak of a bar that has no limit
FRACTIONS = (0.5, 0.9, 0.99)  # of the limit
ACCURACY, LIMIT, COUNT, FEW = 1e-3, 120, 12, 3  # LIMIT: s of computing for one bar; COUNT of bars, FEW where quick
CONDUCTIVITY, RESISTIVITY = 130.0, 6e-5  # W/(m K) and ohm m, of `SILICON`
GROUP = "bars of random laws against the closed form"


def bar(material: Material, volts: Value, probes: tuple[Probe, ...] = (MIDDLE,), accuracy: float = ACCURACY) -> Scene:
    """Return the steady scene of a bar."""
    boundaries = cold_electrodes(ENDS, volts)
    box = Box("bar", material, (0.0, 0.0, 0.0), SIZE)
    return Scene("bar", (box,), boundaries, probes, ROOM, accuracy=accuracy, steady=True)


def cold_electrodes(ends: Sequence[tuple[Point, Point]], volts: Value) -> tuple[Boundary, ...]:
    """Return two ends at room temperature, the first at a voltage and the other grounded."""
    cold = (Boundary(f"cold {i}", "temperature", *at, ROOM) for i, at in enumerate(ends))
    return (*cold, Boundary("plus", "voltage", *ends[0], volts), Boundary("minus", "voltage", *ends[1], 0.0))


def random_resistivity(rng: np.random.Generator) -> PowerLaw | Table:
    """Draw a law that rises or falls: a power, or a table that is monotone.

    A power between -2.5 and -1 has a limit too, but its peak at 0.99 of the limit is many thousand kelvin.
    """
    falls = rng.random() < 0.5
    if rng.random() < 0.5:
        return PowerLaw(RESISTIVITY, ROOM, float(rng.uniform(-6.0, -2.5) if falls else rng.uniform(0.0, 2.0)))
    temperatures = np.sort(rng.uniform(ROOM, 1200.0, int(rng.integers(2, 6))))
    exponents = (-1.0 if falls else 1.0) * rng.uniform(0.2, 3.0, len(temperatures))
    values = RESISTIVITY * np.exp(np.cumsum(exponents * np.diff(np.log([ROOM, *temperatures]))))
    return Table(tuple(temperatures.tolist()), tuple(values.tolist()))


def heat(law: PowerLaw | Table, conductivity: float, peak: float) -> float:
    """Return the integral (V^2) of k rho dT from room temperature to a peak (K)."""
    return float(conductivity * (law.integral(peak) - law.integral(ROOM)))


def limit(law: PowerLaw | Table, conductivity: float) -> float:
    """Return the largest voltage (V) that has a steady state; infinite where the integral of rho has no end."""
    return math.sqrt(8 * heat(law, conductivity, math.inf))


def peak(law: PowerLaw | Table, conductivity: float, volts: float) -> float:
    """Return the largest temperature (K) at a voltage below the limit."""
    goal, top = volts**2 / 8, 2 * ROOM
    while heat(law, conductivity, top) < goal:
        top *= 2
    return float(brentq(lambda t: heat(law, conductivity, t) - goal, ROOM, top, xtol=1e-9))


def rows(quick: bool, seed: int) -> Iterator[Row]:
    """Compare the peaks of bars of random laws with the closed form, steady and at the end of a transient; ``quick``
    takes a few laws, steady at 0.9 of their limits."""
    cases = [("steady", FRACTIONS[1])] if quick else [*product(("steady", "over time"), FRACTIONS)]
    seeds = range(seed, seed + (FEW if quick else COUNT))
    for way, fraction in cases:
        ratios, denied = list[tuple[float, str]](), list[str]()
        for number in seeds:
            law = random_resistivity(np.random.default_rng([number, 8]))
            most = min(limit(law, CONDUCTIVITY), math.sqrt(8 * heat(law, CONDUCTIVITY, HOTTEST)) / FRACTIONS[-1])
            exact = peak(law, CONDUCTIVITY, fraction * most)
            scene = bar(replace(SILICON, resistivity=law, temperature_coefficient=0.0), fraction * most)
            try:
                with limited(LIMIT):
                    temperature, error = middle(scene, 0.0 if way == "steady" else LATE)
            except (NumericsError, TimeIsUpError) as wrong:
                denied.append(f"seed {number}, {type(law).__name__}: {wrong or 'out of time'}")
            else:
                name = f"worst: seed {number}, {type(law).__name__}"
                ratios.append((abs(temperature - exact) / (error + 1e-9 * exact), name))
        worst, where = max(ratios, default=(0.0, ""))
        case = f"{len(seeds)} laws, {way}, at {fraction:g} of the limit"
        yield at_most(GROUP, case, "true error of the peak over its bound", worst, 1.0, where)
        yield at_most(GROUP, case, "steady states that are denied", len(denied), 0, "; ".join(denied[:2]))


def middle(scene: Scene, end: float) -> tuple[float, float]:
    """Return the temperature (K) of the middle and its error bound at an end time (s), or for 0 at rest."""
    if not end:
        found = solve(scene).steady["middle"]
        return found.value, found.error
    traces = solve(replace(scene, steady=False, end_time=end, output_times=(end,))).over_time
    return float(traces.values["middle"][-1]), traces.errors["middle"]
