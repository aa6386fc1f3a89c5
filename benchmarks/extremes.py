"""The sink at its extremes: sizes, conductivities and voltages, every error bound against a finer solution."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.rows import Row, at_most
from fem3d.runs.sink import solve as solve_sink
from scenes.errors import RunawayError
from scenes.sink import SILICON, Sink

ACCURACY, FINER = 1e-3, 2e-4
BALANCE = 1e-8  # of the power: heat that may be missing
CONTRASTED = 1e-6  # the same where entries of the matrix differ by 1e8, so that their sums lose that many digits
TRUE = "true error over the error bound"
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
