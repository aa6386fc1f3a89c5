"""Networks whose electrodes have a given current, or a resistance in series, against closed forms."""

import math

import numpy as np
import pytest

from reduced1d.network import solve
from scenes.errors import RunawayError
from scenes.result import Result
from tests.reduced1d.network.scenes import COLD, LONG, RHO, THICK, WIDE, C, box, flat, material, over, scene
from tests.reduced1d.network.test_closed_forms import AREA, BAR, FILM, LEFT, OHM, cooled_wire, over_time, rises


def test_a_wire_over_time_at_given_currents():
    """C dT/dt = I^2 R (1 + a T) - G T, of a current that jumps."""
    coefficient, capacity = 3e-3, RHO * C * AREA * LONG
    limit = math.sqrt(FILM / OHM / coefficient)
    end = 4 * capacity / FILM
    currents, jump = (0.5 * limit, 0.3 * limit), end / 3
    exact: list[float] = []
    times = np.linspace(0, end, 31)
    for current, (start, stop) in zip(currents, ((0.0, jump), (jump, end)), strict=True):
        rate = (FILM - current**2 * OHM * coefficient) / capacity
        rest = current**2 * OHM / capacity / rate
        first = exact[-1] if exact else 0.0
        inside = times[(times >= start) & (times < stop - 1e-9 * end)] if stop < end else times[times >= start]
        exact += [*(rest + (first - rest) * np.exp(-rate * (inside - start)))]
        if stop < end:
            exact.append(rest + (first - rest) * math.exp(-rate * (stop - start)))
    values = np.delete(exact, np.searchsorted(times, jump))
    wire = cooled_wire(coefficient, end, current={"times": [jump, jump], "values": list(currents)})
    traces = solve(wire, times)
    over_time(traces, "middle", values)
    current = np.where(times >= jump, currents[1], currents[0])
    over_time(traces, "R", OHM * (1 + coefficient * values), start=0.0)
    over_time(traces, "P", current**2 * OHM * (1 + coefficient * values), start=0.0)


def test_the_wire_that_runs_away_at_a_given_current():
    """I^2 R (1 + a T) = G T has a state below I = sqrt(G / (a R)) alone; just below it there is a state."""
    limit = math.sqrt(FILM / OHM / 3e-3)
    with pytest.raises(RunawayError, match="the resistance rises as it heats; the largest current") as caught:
        solve(cooled_wire(3e-3, current=1.01 * limit))
    assert caught.value.limit == pytest.approx(limit, rel=1e-3)
    part = 0.99**2
    rises(solve(cooled_wire(3e-3, current=0.99 * limit)), middle=part / (1 - part) / 3e-3)


def test_a_current_through_sides():
    """A given current through an electrode on a side has the potential that gives the same current."""
    pads = ((0, 0, THICK), (LONG / 4, WIDE, THICK)), ((0.75 * LONG, 0, THICK), (LONG, WIDE, THICK))

    def bar(**drive: float) -> Result:
        return solve(scene(
            [box(*BAR)],
            [flat("cold", *LEFT, temperature=COLD), flat("plus", *pads[0], **drive),
             flat("minus", *pads[1], voltage=0)],
            [over("mean", *BAR), over("I", *pads[0], quantity="current"), over("face", *pads[0], quantity="potential"),
             over("R", *pads[0], quantity="resistance")],
            [material(resistivity=1e-5, temperature_coefficient=1e-3, reference_temperature=COLD)],
        ))  # fmt: skip

    given = bar(voltage=0.05)
    value = {name: estimate.value for name, estimate in given.steady.items()}
    rises(bar(current=value["I"]), I=value["I"], R=0.05 / value["I"], face=0.05, mean=value["mean"] - COLD)
    rises(bar(voltage=0.05 + 20 * value["I"], series_resistance=20), I=value["I"], face=0.05)
