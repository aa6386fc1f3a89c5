"""The silicon layer on its oxide where properties follow the temperature, or faces radiate: what it conducts, gives
off, takes and holds at a point, of fin and plate alike.

    [t rho c(T) + c_ox(T)] dT/dt = div([k(T) t + k_ox(T)] grad T) - q(T) - h_air T - h_gas T - b(T) + I^2 s r(T),

the equation of `reduced1d.ladder.plate` with laws in place of numbers, r being the resistivity over that at room
temperature; T is the rise in all but the laws, which take the absolute temperature. Down through the oxide goes the
heat flux q for which

    Theta(T - q [r/2 + t/(3 k(T))]) - Theta(q [r/2 + b]) = t_o q,    Theta the integral of k_o over the temperature

(Kirchhoff's transform), with r of the contacts and b of what is below, whose conductivity is that at room temperature.
What bare faces radiate, b(T) = eps sigma (T^4 - T_room^4) times their area over the layer's, is that of top, underside
and the narrow sides, which are as thick as the layer and spread evenly over beam and pads. What the oxide conducts
along the layer, and its capacity, are those halfway down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.equations import room_resistivity
from scenes.faces import SIGMA
from scenes.laws import Law, Property
from scenes.sink import Sink

_STEPS = 8  # The most Newton steps for the flux through the oxide.
_SETTLED = 1e-13  # They end with a change below this part of the flux.

Both = tuple[np.ndarray, np.ndarray]
"""Values (points,), and their derivatives by the rise there."""


@dataclass(frozen=True)
class Layer:
    """The laws of a ``sink``, functions of the rise (points,) in K, per area of the layer (m2).

    ``below`` is the resistance (m2 K/W) of what the oxide stands on, ``stored`` the share of the oxide that a rise
    above it fills, ``gas`` a coefficient (W/(m2 K))."""

    sink: Sink
    below: float
    stored: float
    gas: float

    def along(self, rise: np.ndarray, oxide: np.ndarray) -> Both:
        """What conducts along the layer (W/K), above ``oxide`` where that is 1 and not where it is 0."""
        sink, share = self.sink, oxide * self.sink.oxide_thickness * self.stored
        _, k_slope = self._valued(sink.silicon.thermal_conductivity, rise)
        _, slope = self._valued(sink.oxide.thermal_conductivity, rise / 2)
        return self.conducts(rise, oxide), sink.thickness * k_slope + share * slope / 2

    def conducts(self, rise: np.ndarray, oxide: np.ndarray) -> np.ndarray:
        """The value of `along` alone."""
        sink, share = self.sink, oxide * self.sink.oxide_thickness * self.stored
        k, lower = sink.silicon.thermal_conductivity, sink.oxide.thermal_conductivity
        temperature = sink.room_temperature + rise
        k = k(temperature) if isinstance(k, Law) else k
        lower = lower(temperature - rise / 2) if isinstance(lower, Law) else lower
        return sink.thickness * k + share * lower + 0.0 * rise

    def down(self, rise: np.ndarray) -> Both:
        """The flux q (W/m2) through the oxide."""
        sink, room, law = self.sink, self.sink.room_temperature, self.sink.oxide.thermal_conductivity
        k, slope = self._valued(sink.silicon.thermal_conductivity, rise)
        above, slope = sink.contacts / 2 + sink.thickness / (3 * k), -sink.thickness / (3 * k**2) * slope
        under = sink.contacts / 2 + self.below
        q = rise / (sink.oxide_thickness / self._valued(law, rise / 2)[0] + above + under)
        steep = top = np.ones_like(rise)
        for _ in range(_STEPS):
            (whole, top), (rest, bottom) = _integral(law, room + rise - q * above), _integral(law, room + q * under)
            steep = top * above + bottom * under + sink.oxide_thickness
            step = (whole - rest - sink.oxide_thickness * q) / steep
            q = q + step
            if np.abs(step).max(initial=0.0) <= _SETTLED * np.abs(q).max(initial=0.0):
                break
        return q, top * (1 - q * slope) / steep

    def up(self, rise: np.ndarray) -> Both:
        """The flux (W/m2) from the top."""
        h = self.sink.convection_coefficient
        return h * rise, np.full_like(rise, h)

    def radiates(self, rise: np.ndarray) -> Both:
        """The flux (W/m2) from a bare face to black surroundings at room temperature."""
        t, factor = self.sink.room_temperature + rise, self.sink.emissivity * SIGMA
        return factor * (t**4 - self.sink.room_temperature**4), 4 * factor * t**3

    def resistivity(self, rise: np.ndarray) -> Both:
        """The silicon's, over that at room temperature."""
        silicon, room = self.sink.silicon, self.sink.room_temperature
        if isinstance(silicon.resistivity, Law):
            cold = silicon.resistivity(room)
            value, slope = self._valued(silicon.resistivity, rise)
            return value / cold, slope / cold
        a = room_resistivity(silicon, room)[1]
        return 1 + a * rise, np.full_like(rise, a)

    def holds(self, rise: np.ndarray, silicon: np.ndarray, oxide: np.ndarray) -> Both:
        """The heat capacity (J/(m2 K)) of so much of the silicon and of the oxide (1: all, 0: none) at each point."""
        sink, share = self.sink, oxide * self.sink.oxide_thickness * self.stored * self.sink.oxide.density
        c, slope = self._valued(sink.silicon.specific_heat, rise)
        lower, lower_slope = self._valued(sink.oxide.specific_heat, rise / 2)
        layer = silicon * sink.thickness * sink.silicon.density
        return layer * c + share * lower, layer * slope + share * lower_slope / 2

    def _valued(self, law: Property, rise: np.ndarray) -> Both:
        if not isinstance(law, Law):
            return np.full_like(rise, law), np.zeros_like(rise)
        temperature = self.sink.room_temperature + rise
        return law(temperature), law.slope(temperature)


def _integral(law: Property, temperature: np.ndarray) -> Both:
    """The integral over the temperature, from any on, and what it is of."""
    if not isinstance(law, Law):
        return law * temperature, np.full_like(temperature, law)
    return law.integral(temperature), law(temperature)
