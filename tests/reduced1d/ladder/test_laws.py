"""Fin, plate and moments of materials whose properties follow the temperature."""

from dataclasses import replace

import numpy as np
import pytest

from reduced1d import ladder
from reduced1d.ladder.few_states import over_time, steady
from reduced1d.ladder.levels import Levels
from scenes.errors import RunawayError
from scenes.laws import PowerLaw, Table
from scenes.sink import Sink

ROOM = Sink().room_temperature
POWER = PowerLaw(130.0, ROOM, -1.3)
TABLE = Table((293.0, 400.0, 600.0, 1000.0, 1600.0), (130.0, 90.0, 55.0, 30.0, 22.0))
AT = np.array([0.0, 1e-5, 1e-4, 1e-3, 2e-2])


def with_laws(sink: Sink, **laws) -> Sink:
    """The sink with laws of its silicon; a number in that of its oxide is of the same shape."""
    return replace(sink, silicon=replace(sink.silicon, **laws))


def alike(sink: Sink, law) -> Sink:
    """A sink of constant resistivity whose silicon and oxide conduct, and hold, by the same law: in Kirchhoff's
    variable, the integral of k, all its equations are linear. The oxide holds next to nothing, as it is not clear where
    in it the temperature is that counts."""
    shape = lambda number: replace(law, value=number)  # noqa: E731
    silicon, oxide = (
        replace(m, thermal_conductivity=shape(m.thermal_conductivity), specific_heat=shape(m.specific_heat))
        for m in (sink.silicon, replace(sink.oxide, density=1e-3))
    )
    return replace(sink, silicon=replace(silicon, temperature_coefficient=0.0), oxide=oxide)


def numbers(sink: Sink) -> Sink:
    return sink.plain


def transformed(sink: Sink, rise: np.ndarray) -> np.ndarray:
    """Kirchhoff's variable over the conductivity at room temperature (K)."""
    law = sink.silicon.thermal_conductivity
    return (law.integral(ROOM + rise) - law.integral(ROOM)) / law(ROOM)
