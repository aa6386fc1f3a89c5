"""The sink at its extremes: sizes, conductivities, accuracies, voltages; every error
estimate against a finer solve. Steps, ramps and square waves of the voltage: a bar between cold ends against its
series, and heat balances."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from fem3d.runs.scene import solve as solve_scene
from fem3d.runs.sink import solve
from scenes.errors import RunawayError
from scenes.model import Scene, Schedule, Value
from scenes.result import Result
from scenes.sink import SILICON, Sink
from validate.stress.report import Row
from validate.verify import exact
from validate.verify.series import heated_middle

STEADY = False
ACCURACY, FINER = 1e-3, 2e-4
BALANCE = 1e-8  # the heat that may be missing in the balance, over the power
CONTRASTED = 1e-6  # the same where entries of the matrix are 1e8 apart, so that their sums lose that many digits
VOLTS = 2.0
SLOW = exact.SLOW / 4  # s: l^2/alpha of half the length


def families(quick: bool) -> Iterator[Row]:
    """Sinks from one extreme to the other: two rows for each family, the worst ratio of true to estimated error and the
    worst heat balance."""
    insulated = Sink(silicon=replace(Sink().silicon, temperature_coefficient=0.0))
    for group, what, few, all_, sinks, balance in (
        ("aspect ratios", "thickness of the oxide", (20e-9, 20e-6), (20e-9, 60e-9, 200e-9, 700e-9, 2e-6, 7e-6, 20e-6),
         lambda t: (f"{t * 1e9:g} nm", replace(Sink(), oxide_thickness=t)), BALANCE),
        ("aspect ratios", "length of the beam", (10e-6, 10e-3), (10e-6, 30e-6, 100e-6, 300e-6, 1e-3, 3e-3, 10e-3),
         lambda length: (f"{length * 1e6:g} um", replace(Sink(), length=length)), BALANCE),
        ("contrasts", "conductivity of silicon over oxide", (1e-4, 1e8), tuple(10.0**n for n in range(-8, 9, 2)),
         lambda r: (f"{r:g}", replace(insulated, oxide=replace(insulated.oxide, thermal_conductivity=130.0 / r))),
         CONTRASTED),
    ):  # fmt: skip
        ratios, balances = [], []
        names, each = zip(*map(sinks, few if quick else all_), strict=True)
        for name, sink in zip(names, each, strict=True):
            result = solve(replace(sink, accuracy=ACCURACY), STEADY)
            ratio, quantity = _dishonesty(result, solve(replace(sink, accuracy=FINER), STEADY))
            ratios.append((ratio, f"at {name}, {quantity}"))
            balances.append((float(result.details["energy_imbalance"]), f"at {name}"))
        extremes = f"{names[0]} to {names[-1]}, {len(names)} sinks"
        yield Row(group, what, extremes, "true error over the estimated one", max(ratios)[0], 1.0, said=max(ratios)[1])
        yield Row(group, what, extremes, "heat balance", max(balances)[0], balance, said=max(balances)[1])


def accuracies(quick: bool) -> Iterator[Row]:
    """Requests from 1e-1 to 1e-6: what was delivered over what was asked for."""
    accuracies = (1e-1, 1e-3, 1e-5) if quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
    best = solve(replace(Sink(), accuracy=accuracies[-1]), STEADY)
    for accuracy in accuracies:
        result = best if accuracy == accuracies[-1] else solve(replace(Sink(), accuracy=accuracy), STEADY)
        stated = max(e.error / abs(e.value) for e in result.steady.values()) / accuracy
        if result is not best:  # the finest is the truth of the others
            ratio, name = _dishonesty(result, best)
            yield Row("accuracies", "the sink", f"{accuracy:g} asked for", "true error over the estimated one", ratio,
                      1.0, said=f"{name}; {result.details['unknowns']} unknowns")  # fmt: skip
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
        result = solve(replace(hot, voltage=volts), STEADY)
        yield Row("voltages", "a positive coefficient", f"TCR 0.002 1/K, {volts:g} V", "heat balance",
                  float(result.details["energy_imbalance"]), BALANCE,
                  said=f"peak rise {result.steady['peak_rise_K'].value:.4g} K")  # fmt: skip


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


def _dishonesty(result: Result, best: Result) -> tuple[float, str]:
    """The largest |difference| / (estimated errors) over the quantities, and its name."""
    ratios = [
        (abs(e.value - best.steady[name].value) / (e.error + best.steady[name].error), name)
        for name, e in result.steady.items()
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
        result, best = solve_scene(scene), solve_scene(replace(scene, accuracy=ACCURACY / 10))
        times = scene.output_times  # type: ignore[assignment]
        a, b = (np.interp(times, r.over_time.time, r.over_time.values["middle"]) for r in (result, best))
        error = result.over_time.errors["middle"] + best.over_time.errors["middle"]
        yield Row("drives", "ramp up and down through zero", f"TCR {coefficient:g} 1/K",
                  "true error over the estimated one", float(np.abs(a - b).max() / error), 1.0)  # fmt: skip
        yield Row("drives", "ramp up and down through zero", f"TCR {coefficient:g} 1/K", "heat balance",
                  float(result.details["energy_imbalance"]), 10 * ACCURACY)  # fmt: skip


def _against_series(name: str, voltage: Value, edges: list[tuple[float, float]], end: float) -> Row:
    """The middle of a bar without a temperature coefficient, against the superposed series of its steps."""
    scene = _bar(voltage, 0.0, end)
    result = solve_scene(scene)
    assert SILICON.resistivity is not None
    peak = VOLTS**2 / (8 * SILICON.thermal_conductivity * SILICON.resistivity)
    times = np.array(scene.output_times)
    expected = np.full(len(times), exact.ROOM)
    for start, size in edges:
        since = np.maximum(times - start, 0.0)
        expected += size * peak * np.where(since > 0, heated_middle(since / SLOW), 0.0)
    values = np.interp(times, result.over_time.time, result.over_time.values["middle"])
    off = float(np.abs(values - expected).max() / result.over_time.errors["middle"])
    said = f"{result.details['steps']} steps for {len(edges)} edges"
    return Row("drives", name, f"bar of 1 mm, {VOLTS:g} V", "true error over the estimated one", off, 1.0, said=said)


def _bar(voltage: Value, coefficient: float, end: float) -> Scene:
    times = tuple((end * np.linspace(0.02, 1.0, 50)).tolist())
    scene = exact.bar(voltage, coefficient, (exact.MIDDLE,))
    return replace(scene, end_time=end, accuracy=ACCURACY, steady=False, output_times=times)
