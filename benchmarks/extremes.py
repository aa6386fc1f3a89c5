"""The sink at its extremes: sizes, conductivities and voltages, every error bound against a finer solution;
and a bar between cold ends under a step and square waves of the voltage."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks import bars
from benchmarks.rows import Row, at_most
from fem3d.runs.scene import solve as solve_scene
from fem3d.runs.sink import solve as solve_sink
from scenes.errors import RunawayError
from scenes.model import Schedule, Value
from scenes.sink import SILICON, Sink

ACCURACY, FINER = 1e-3, 2e-4
BALANCE = 1e-8  # of the power: heat that may be missing
CONTRASTED = 1e-6  # the same where entries of the matrix differ by 1e8, so that their sums lose that many digits
TRUE = "true error over the error bound"
VOLTS, SLOW = 2.0, bars.SLOW / 4  # SLOW: the diffusion time of half the bar's length


steady = partial(solve_sink, transient=False)


def silicon(coefficient: float, voltage: float = 1.0) -> Sink:
    """Return the sink with another temperature coefficient (1/K)."""
    return Sink(accuracy=ACCURACY, voltage=voltage, silicon=replace(SILICON, temperature_coefficient=coefficient))


def families(quick: bool) -> Iterator[Row]:
    """Solve sinks from one extreme to the other; the worst error bound and the worst heat balance of each family."""
    insulated = silicon(0.0)

    def contrast(r: float) -> Sink:
        # A rise goes with V^2 r where the oxide resists: within 100,000 K, the hottest state of interest.
        oxide = replace(insulated.oxide, thermal_conductivity=130.0 / r)
        return replace(insulated, oxide=oxide, voltage=min(1.0, 1e2 / math.sqrt(r)))

    for group, case, low, high, count, sink_of, balance in (
        ("aspect ratios", "thickness of the oxide in m", 20e-9, 20e-6, 7,
         lambda t: replace(Sink(), oxide_thickness=t), BALANCE),
        ("aspect ratios", "length of the beam in m", 10e-6, 10e-3, 7, lambda y: replace(Sink(), length=y), BALANCE),
        ("contrasts", "conductivity of silicon over oxide", 1e-8, 1e8, 9, contrast, CONTRASTED),
    ):  # fmt: skip
        violations, balances = list[tuple[float, str]](), list[tuple[float, str]]()
        values = np.geomspace(low, high, 2 if quick else count)
        for value in values:
            coarse, fine = (steady(replace(sink_of(float(value)), accuracy=a)) for a in (ACCURACY, FINER))
            balances.append((coarse.details["energy_imbalance"], f"at {value:.3g}"))
            for name, e in coarse.steady.items():
                other = fine.steady[name]
                violations.append((abs(e.value - other.value) / (e.error + other.error), f"at {value:.3g}, {name}"))
        case = f"{case}, {low:g} to {high:g}, {len(values)} sinks"
        for quantity, numbers, limit in ((TRUE, violations, 1.0), ("heat balance", balances, balance)):
            worst, note = max(numbers)
            yield at_most(group, case, quantity, worst, limit, note)


def runaway(quick: bool) -> Iterator[Row]:
    """Raise the voltage to thermal runaway with a negative coefficient, and far with a positive one."""
    for coefficient in (-5e-4,) if quick else (-5e-4, -2e-3, -1e-4):
        sink = silicon(coefficient)
        limit = _limit(sink)
        missing = steady(replace(sink, voltage=0.999 * limit)).details["energy_imbalance"]
        case = f"TCR {coefficient:g} 1/K, limit of {limit:.5g} V"
        yield at_most("voltages", case, "heat balance at 99.9 % of the limit", missing, BALANCE)
        again = _limit(replace(sink, voltage=1.001 * limit))
        yield Row("voltages", case, "the limit from 1.001 times, over that from 3 times", again / limit, 1.0, ACCURACY)
    for volts in (1e-6, 100.0):
        result = steady(silicon(2e-3, volts))
        note, missing = f"peak rise {result.steady['peak_rise_K'].value:.4g} K", result.details["energy_imbalance"]
        yield at_most("voltages", f"TCR 0.002 1/K, {volts:g} V", "heat balance", missing, BALANCE, note)


def _limit(sink: Sink) -> float:
    """The voltage of runaway (V) that is named at the first voltage beyond it, from the sink's own in steps of 3."""
    for power in range(40):
        try:
            steady(replace(sink, voltage=sink.voltage * 3.0**power))
        except RunawayError as error:
            return error.limit
    raise ArithmeticError("no runaway up to 1e19 V")


def drives(quick: bool) -> Iterator[Row]:
    """Drive a bar by a voltage in a step and as a square wave."""
    yield _against_series("step", VOLTS, [(0.0, 1.0)], 4 * SLOW)
    for hertz, count in ((1e4, 5),) if quick else ((1e3, 10), (1e4, 20)):
        times = 0.5 / hertz * np.arange(2 * count + 1)
        wave = Schedule(tuple(np.repeat(times, 2)[1:-1].tolist()), (VOLTS, VOLTS, 0.0, 0.0) * count)
        edges = list(zip(times[:-1].tolist(), (1.0, -1.0) * count, strict=True))
        yield _against_series(f"square wave of {hertz:g} Hz", wave, edges, times[-1])


def _against_series(name: str, voltage: Value, edges: list[tuple[float, float]], end: float) -> Row:
    """The middle of a bar without a temperature coefficient, against the superposed series of its steps."""
    scene = bars.bar(replace(SILICON, temperature_coefficient=0.0), voltage)
    times = tuple((end * np.linspace(0.02, 1.0, 50)).tolist())
    traces = solve_scene(replace(scene, end_time=end, steady=False, output_times=times)).over_time
    found, error = np.interp(times, traces.time, traces.values["middle"]), traces.errors["middle"]
    peak = VOLTS**2 / (8 * bars.CONDUCTIVITY * bars.RESISTIVITY)
    rise = sum(size * peak * heated_middle(np.maximum(np.array(times) - start, 0.0) / SLOW) for start, size in edges)
    off = float(np.abs(found - bars.ROOM - rise).max())
    return at_most("drives", f"{name}, bar of 1 mm", TRUE, off / error, 1.0)


def heated_middle(number: np.ndarray) -> np.ndarray:
    """Return the rise in the middle of a slab with heat q between faces held cold, over q l^2/(2 k), at Fourier numbers
    of the half thickness l (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed., 3.14, eq 7)."""
    n = np.arange(400)
    a = (2 * n + 1) * np.pi / 2
    return 1 - 4 * ((-1.0) ** n / a**3 * np.exp(-np.multiply.outer(number, a**2))).sum(axis=-1)
