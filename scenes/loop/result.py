"""The answer of a model of the device: what the controllers see and do, sample by sample, and how far to trust it."""

# ruff: noqa: N815 - the symbols of units keep their capitals, as in the keys of the output
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

QUANTITIES = ("sink_K", "sensor_K", "sink_V", "sensor_V", "sink_power_W", "sensor_power_W", "polymer_flux_W")
TOP = "polymer_top_W"


@dataclass(frozen=True)
class Steady:
    """A steady state: temperatures in K; voltages in V; powers and the heat flow from the sensor into the polymer in W.

    ``sink_saturated`` and ``sensor_saturated``: the element is above the set temperature without any power.
    """

    sink_K: float
    sensor_K: float
    sink_V: float
    sensor_V: float
    sink_power_W: float
    sensor_power_W: float
    polymer_flux_W: float
    sink_saturated: bool
    sensor_saturated: bool


@dataclass(frozen=True)
class DeviceResult:
    """Traces with one entry per controller sample, their estimated errors, and findings in plain sentences.

    ``time_s`` in s; temperatures in K; voltages in V and powers in W are those that hold from the sample on;
    ``polymer_flux_W`` is the heat flow from the sensor into the polymer in W, ``polymer_top_W`` that out of its top, in
    models that tell them apart; flows are those just before a sample. ``before`` and ``after`` are the steady states at
    the initial and the final outer temperature. ``errors`` bounds the numerical error of
    each trace over the run, in its unit; ``error_parts`` splits it by source. ``findings`` says what a reader must
    know: a limiter that acts, an unstable loop with its growth rate, a run that was stopped. ``details`` has numbers
    of the run (states, nodes, energy imbalance).
    """

    scheme: str
    time_s: np.ndarray
    sink_K: np.ndarray
    sensor_K: np.ndarray
    sink_V: np.ndarray
    sensor_V: np.ndarray
    sink_power_W: np.ndarray
    sensor_power_W: np.ndarray
    polymer_flux_W: np.ndarray
    errors: dict[str, float]
    before: Steady
    after: Steady
    polymer_top_W: np.ndarray | None = None
    error_parts: dict[str, dict[str, float]] = field(default_factory=dict)
    findings: tuple[str, ...] = ()
    details: dict[str, Any] = field(default_factory=dict)

    @property
    def quantities(self) -> tuple[str, ...]:
        return QUANTITIES if self.polymer_top_W is None else (*QUANTITIES, TOP)

    def trace(self, quantity: str) -> np.ndarray:
        if quantity not in self.quantities:
            raise KeyError(f"no quantity {quantity!r}; there are {', '.join(self.quantities)}")
        return np.asarray(getattr(self, quantity))


def device_result(
    scheme: str, time: np.ndarray, traces: np.ndarray, room: float, errors: dict[str, float], **rest: Any
) -> DeviceResult:
    """A result from ``traces`` (samples, 7 or 8) in the order of QUANTITIES and TOP, with temperatures as rises above
    ``room``."""
    columns = traces.T.copy()
    columns[:2] += room
    names = (*QUANTITIES, TOP)[: len(columns)]
    return DeviceResult(scheme=scheme, time_s=time, errors=errors, **dict(zip(names, columns, strict=True)), **rest)
