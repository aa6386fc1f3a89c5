"""The sink at its extremes: sizes, conductivities, accuracies, voltages; every error
estimate against a finer solve. Steps, ramps and square waves of the voltage: a bar between cold ends against its
series, and heat balances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fem3d.run import solve
from fem3d.solve_scene import solve as solve_scene
from scenes.errors import RunawayError
from scenes.model import Box, Probe, Scene, Schedule, Value
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import SILICON, Sink
from validate.stress.report import Row
from validate.verify.exact import cold_electrodes
from validate.verify.series import heated_middle

STEADY = Request(transient=False)
ACCURACY, FINER = 1e-3, 2e-4
BALANCE = 1e-8  # of the power
CONTRASTED = 1e-6  # of the power, where entries of the matrix are 1e8 apart and their sums lose that many digits
LENGTH, VOLTS, ROOM = 1e-3, 2.0, 293.0
SLOW = LENGTH**2 / 4 * SILICON.heat_capacity / SILICON.thermal_conductivity  # s: l^2/alpha of half the length


def aspect_ratios(quick: bool) -> Iterator[Row]:
    oxides = (20e-9, 20e-6) if quick else (20e-9, 60e-9, 200e-9, 700e-9, 2e-6, 7e-6, 20e-6)
    yield from _family("aspect ratios", "thickness of the oxide", [
        (f"{t * 1e9:g} nm", replace(Sink(), oxide_thickness=t)) for t in oxides
    ])  # fmt: skip
    beams = (10e-6, 10e-3) if quick else (10e-6, 30e-6, 100e-6, 300e-6, 1e-3, 3e-3, 10e-3)
    yield from _family("aspect ratios", "length of the beam", [
        (f"{length * 1e6:g} um", replace(Sink(), length=length)) for length in beams
    ])  # fmt: skip


def contrasts(quick: bool) -> Iterator[Row]:
    """Conductivities of silicon over that of the oxide, from 1e-8 to 1e8."""
    ratios = (1e-4, 1e8) if quick else (1e-8, 1e-6, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6, 1e8)
    sink = Sink(silicon=replace(Sink().silicon, temperature_coefficient=0.0))
    yield from _family("contrasts", "conductivity of silicon over oxide", [
        (f"{r:g}", replace(sink, oxide=replace(sink.oxide, thermal_conductivity=130.0 / r))) for r in ratios
    ], CONTRASTED)  # fmt: skip


def accuracies(quick: bool) -> Iterator[Row]:
    """Requests from 1e-1 to 1e-6: what was delivered over what was asked for."""
    asked = (1e-1, 1e-3, 1e-5) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    best = solve(replace(Sink(), accuracy=asked[-1]), STEADY)
    for accuracy in asked:
        found = best if accuracy == asked[-1] else solve(replace(Sink(), accuracy=accuracy), STEADY)
        stated = max(e.error / abs(e.value) for e in found.steady.values()) / accuracy
        if found is not best:  # the finest is the truth of the others
            ratio, name = _dishonesty(found, best)
            yield Row("accuracies", "the sink", f"{accuracy:g} asked for", "true error over the estimated one", ratio,
                      1.0, said=f"{name}; {found.details['unknowns']} unknowns")  # fmt: skip
        yield Row("accuracies", "the sink", f"{accuracy:g} asked for", "estimated error over the one asked for",
                  stated, 1.0)  # fmt: skip


def runaway(quick: bool) -> Iterator[Row]:
    """Voltages up to thermal runaway with a negative temperature coefficient; far beyond with a positive one."""
    for coefficient in (-5e-4,) if quick else (-5e-4, -2e-3, -1e-4):
        sink = Sink(silicon=replace(Sink().silicon, temperature_coefficient=coefficient), accuracy=ACCURACY)
        limit = _limit(sink)
        below = solve(replace(sink, voltage=0.999 * limit), STEADY)
        what, extremes = "thermal runaway", f"TCR {coefficient:g} 1/K"
        yield Row("voltages", what, f"{extremes}, 99.9 % of the limit of {limit:.5g} V", "heat balance",
                  float(below.details["energy_imbalance"]), BALANCE)  # fmt: skip
        again = _limit(replace(sink, voltage=1.001 * limit))
        yield Row("voltages", what, f"{extremes}, limits named from 3 and from 1.001 times", "difference",
                  abs(again / limit - 1), ACCURACY)  # fmt: skip
    hot = Sink(silicon=replace(Sink().silicon, temperature_coefficient=2e-3), accuracy=ACCURACY)
    for volts in (1e-6, 100.0):
        found = solve(replace(hot, voltage=volts), STEADY)
        yield Row("voltages", "a positive coefficient", f"TCR 0.002 1/K, {volts:g} V", "heat balance",
                  float(found.details["energy_imbalance"]), BALANCE,
                  said=f"peak rise {found.steady['peak_rise_K'].value:.4g} K")  # fmt: skip


def _limit(sink: Sink) -> float:
    """The voltage of runaway (V) that is named at the first voltage beyond it, from the sink's own in steps of 3."""
    volts = sink.voltage
    for _ in range(40):
        try:
            solve(replace(sink, voltage=volts), STEADY)
        except RunawayError as error:
            return error.limit
        volts *= 3
    raise ArithmeticError("no runaway up to 1e19 V")


def _family(group: str, what: str, sinks: list[tuple[str, Sink]], balance: float = BALANCE) -> Iterator[Row]:
    """Two rows for some sinks: the worst ratio of true to estimated error, and the worst heat balance."""
    ratios, balances = [], []
    for name, sink in sinks:
        found = solve(replace(sink, accuracy=ACCURACY), STEADY)
        best = solve(replace(sink, accuracy=FINER), STEADY)
        ratio, quantity = _dishonesty(found, best)
        ratios.append((ratio, f"at {name}, {quantity}"))
        balances.append((float(found.details["energy_imbalance"]), f"at {name}"))
    extremes = f"{sinks[0][0]} to {sinks[-1][0]}, {len(sinks)} sinks"
    yield Row(group, what, extremes, "true error over the estimated one", max(ratios)[0], 1.0, said=max(ratios)[1])
    yield Row(group, what, extremes, "heat balance", max(balances)[0], balance, said=max(balances)[1])


def _dishonesty(found: Result, best: Result) -> tuple[float, str]:
    """The largest |difference| / (estimated errors) over the quantities, and its name."""
    ratios = [
        (abs(e.value - best.steady[name].value) / (e.error + best.steady[name].error), name)
        for name, e in found.steady.items()
    ]
    return max(ratios)


def drives(quick: bool) -> Iterator[Row]:
    """The voltage in steps, in ramps and as square waves of 1 kHz and 10 kHz."""
    waves = {"square wave of 10 kHz": (1e-4, 5)} if quick else {
        "square wave of 1 kHz": (1e-3, 10), "square wave of 10 kHz": (1e-4, 20),
    }  # fmt: skip
    yield _against_series("step", VOLTS, [(0.0, 1.0)], 4 * SLOW)
    for name, (period, count) in waves.items():
        edges = [(i * period / 2, 1.0 - 2.0 * (i % 2)) for i in range(2 * count)]
        times = [t for i in range(2 * count) for t in (i * period / 2, (i + 1) * period / 2)]
        values = [VOLTS * (1 - i % 2) for i in range(2 * count) for _ in (0, 1)]
        yield _against_series(name, Schedule(tuple(times), tuple(values)), edges, count * period)
    ramp = Schedule((0.0, SLOW, 2 * SLOW), (0.0, VOLTS, -VOLTS))
    for coefficient in (-5e-4, 5e-4):
        scene = _bar(ramp, coefficient, 2 * SLOW)
        found, best = solve_scene(scene), solve_scene(replace(scene, accuracy=ACCURACY / 10))
        times = scene.output_times  # type: ignore[assignment]
        a, b = (np.interp(times, r.over_time.time, r.over_time.values["middle"]) for r in (found, best))
        error = found.over_time.errors["middle"] + best.over_time.errors["middle"]
        yield Row("drives", "ramp up and down through zero", f"TCR {coefficient:g} 1/K",
                  "true error over the estimated one", float(np.abs(a - b).max() / error), 1.0)  # fmt: skip
        yield Row("drives", "ramp up and down through zero", f"TCR {coefficient:g} 1/K", "heat balance",
                  float(found.details["energy_imbalance"]), 10 * ACCURACY)  # fmt: skip


def _against_series(name: str, voltage: Value, edges: list[tuple[float, float]], end: float) -> Row:
    """The middle of a bar without a temperature coefficient, against the superposed series of its steps."""
    scene = _bar(voltage, 0.0, end)
    found = solve_scene(scene)
    assert SILICON.resistivity is not None
    peak = VOLTS**2 / (8 * SILICON.thermal_conductivity * SILICON.resistivity)
    times = np.array(scene.output_times)
    exact = np.full(len(times), ROOM)
    for start, size in edges:
        since = np.maximum(times - start, 0.0)
        exact += size * peak * np.where(since > 0, heated_middle(since / SLOW), 0.0)
    values = np.interp(times, found.over_time.time, found.over_time.values["middle"])
    off = float(np.abs(values - exact).max() / found.over_time.errors["middle"])
    said = f"{found.details['steps']} steps for {len(edges)} edges"
    return Row("drives", name, f"bar of 1 mm, {VOLTS:g} V", "true error over the estimated one", off, 1.0, said=said)


def _bar(voltage: Value, coefficient: float, end: float) -> Scene:
    upper = (20e-6, LENGTH, 2e-6)
    ends = [((0.0, y, 0.0), (upper[0], y, upper[2])) for y in (0.0, LENGTH)]
    middle = (10e-6, LENGTH / 2, 1e-6)
    material = replace(SILICON, temperature_coefficient=coefficient)
    times = tuple((end * np.linspace(0.02, 1.0, 50)).tolist())
    return Scene("bar", (Box("bar", material, (0.0, 0.0, 0.0), upper),), cold_electrodes(ends, voltage),
                 (Probe("middle", middle, middle),), ROOM, end, ACCURACY, False, times)  # fmt: skip
