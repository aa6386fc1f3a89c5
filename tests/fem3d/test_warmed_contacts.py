"""A bar with a contact that its current warms: a resistivity by a law, and the way to the steady state."""

from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from fem3d.runs.scene import solve
from scenes.free import from_dict


def _warming(electrical: float, end_time: float = 0.0, **resistivity: object) -> dict[str, Any]:
    """A bar of two halves between cold ends that a current warms by a hundred kelvins."""
    start, middle, far, end = [0, 0, 0], [4e-5, 1e-5, 2e-6], [4e-5, 0, 0], [1e-4, 1e-5, 2e-6]
    near, last = {"lower": start, "upper": [0, *end[1:]]}, {"lower": [end[0], 0, 0], "upper": end}
    contact = {"thermal_resistance": 1e-6, **({"electrical_resistance": electrical} if electrical else {})}
    return {
        "scene": {"initial_temperature": 300.0},
        "material": [{"name": "m", "thermal_conductivity": 100.0, "density": 2330.0, "specific_heat": 700.0,
                      "resistivity": 1e-5, **resistivity}],
        "box": [{"name": "p", "material": "m", "lower": start, "upper": middle},
                {"name": "q", "material": "m", "lower": far, "upper": end}],
        "contact": [{"name": "c", "between": ["p", "q"], **contact}],
        "boundary": [{"name": "a", **near, "temperature": 300.0}, {"name": "b", **last, "temperature": 300.0},
                     {"name": "v", **near, "voltage": 0.0}, {"name": "w", **last, "voltage": 0.9}],
        "probe": [{"name": "p", "at": far, "box": "p"}, {"name": "q", "at": far, "box": "q"},
                  {"name": "current", **last, "quantity": "current"}],
        "run": {"end_time": end_time, "accuracy": 1e-3} if end_time else {"steady": True, "accuracy": 1e-3},
    }  # fmt: skip


LINE = {"temperature_coefficient": 2e-3, "reference_temperature": 300.0}
SAID = {"resistivity": {"temperatures": [300.0, 1300.0], "values": [1e-5, 3e-5]}}
"""The same line as a table."""
OTHER = {"resistivity": {"temperatures": [300.0, 1300.0], "values": [1e-5, 2.9e-5]}}


@pytest.mark.parametrize("electrical", [0.0, 3e-10])
def test_table_of_line_beside_contact_equals_line(electrical):
    line, law, other = (solve(from_dict(_warming(electrical, **of))).steady for of in (LINE, SAID, OTHER))
    for name, value in line.items():
        assert abs(law[name].value - value.value) <= law[name].error + value.error
        assert abs(other[name].value - value.value) > other[name].error + value.error


def warmed_bar(
    lengths: tuple[float, float], area: float, k: float, line: tuple[float, float], thermal: float, electric: float,
    voltage: float,
) -> tuple[float, float, float]:  # fmt: skip
    """The rises (K) at both sides of a contact between two halves with cold ends, and the current (A); the resistivity
    is ``line`` = (rho, a), rho (1 + a rise).

    With m^2 = rho a j^2/k, rise + 1/a = cos(m s)/a + B sin(m s) in each half, s from its cold end. The flow into the
    contact, and half its own heat, crosses it; j follows from the voltage.
    """
    rho, a = line

    def at(j: float) -> tuple[float, np.ndarray]:
        m = j * np.sqrt(rho * a / k)
        c, s = np.cos(m * np.array(lengths)), np.sin(m * np.array(lengths))
        # Unknown are both B: the heat that the halves take up is the contact's own, and half its difference crosses.
        matrix = np.array([k * m * c, np.array([-1, 1]) * (k * m * c / 2 + s / thermal)])
        right = [j**2 * electric + k * m * s.sum() / a, (np.array([-1, 1]) @ (k * m * s / 2 - c / thermal)) / a]
        b = np.linalg.solve(matrix, right)
        inside = j * rho * a * (s / a + b * (1 - c)).sum() / m
        return inside + j * electric - voltage, (c - 1) / a + b * s

    j = brentq(lambda j: at(j)[0], 1e-6 * voltage / electric, voltage / (rho * sum(lengths) + electric), rtol=1e-12)
    return (*at(j)[1].tolist(), j * area)


@pytest.mark.long
@pytest.mark.parametrize(("electrical", "of"), [(3e-10, SAID), (1e-11, LINE)])
def test_warmed_bar_with_contact_ends_in_steady_state(electrical, of):
    names = ("p", "q", "current")
    values, others = (
        warmed_bar((4e-5, 6e-5), 2e-11, 100.0, (1e-5, slope), 1e-6, electrical, 0.9) for slope in (2e-3, 1.9e-3)
    )
    # The slowest mode has decayed by exp(-12).
    traces = solve(from_dict(_warming(electrical, 3e-4, **of))).over_time
    for name, value, other in zip(names, values, others, strict=True):
        last = traces.values[name][-1] - (0.0 if name == "current" else 300.0)
        assert abs(last - value) <= traces.errors[name] < 1e-3 * abs(value)
        assert abs(last - other) > traces.errors[name]
