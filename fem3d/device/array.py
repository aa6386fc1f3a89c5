"""Several whole sensors on one substrate: what the step of one's outer temperature does to the readings of the others.

Each element is a device in the middle of the plate (`fem3d.device.solve`); the others warm the plate under its feet by
the plate's own solution (`fem3d.runs.plate`), as `scenes.loop.array` has it of any model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d.device.array_time import Over, over_time, paths
from fem3d.device.solve import Model, model
from fem3d.runs.array import Footprint, coupling, foot_of
from scenes.array import DeviceArray, idle, places
from scenes.device import Device
from scenes.loop.array import Paths, Slopes, at_rest, at_work, slopes
from scenes.loop.shielding import without_sink


@dataclass(frozen=True, eq=False)
class Known:
    """Values with the errors that are estimated of them, in their unit and alike in shape."""

    value: np.ndarray
    error: np.ndarray


@dataclass(frozen=True, eq=False)
class Together:
    """The elements at work together, all outside at the initial temperature: how much warmer the plate is under each by
    the others, ``plate_rise`` (elements,) in K; what that changes in the power of each sensor at work, ``power_change``
    (elements,) in W; and ``per_outside`` (elements, elements) in W/K, what a kelvin outside of one (column) adds to the
    sensor's power of another (row), none for an idle one, nor to its own."""

    plate_rise: Known
    power_change: Known
    per_outside: Known


@dataclass(frozen=True, eq=False)
class Solved:
    """An array of devices: one element's model, the mean rise (K/W) of the plate under each by heat of each, and both
    of the arrays: with the loops closed, and with all sinks off."""

    array: DeviceArray
    model: Model
    plate: Known
    closed: Together
    sinks_off: Together
    paths: Paths | None
    over_time: tuple[Over, ...]

    @property
    def at_work(self) -> np.ndarray:
        """(elements,): which have their circuits."""
        return at_work(self.array)

    @property
    def places(self) -> list[tuple[float, float]]:
        """The middles (x, y) of the elements in m, about that of the plate."""
        return places(self.array.sink)

    @property
    def most_moved(self) -> int:
        """The element, from 0, whose reading the others would change most with all sinks off."""
        return int(np.abs(self.sinks_off.power_change.value).argmax())

    @property
    def base(self) -> tuple[float, float]:
        """The power (W) of the sensor of an element alone at the initial outer temperature, and its error."""
        element = self.array.element
        outer = element.external.initial_temperature
        errors = self.model.steady_errors(element, outer)
        return self.model.steady(element, outer).sensor_power_W, errors["sensor_power_W"]

    @property
    def slopes(self) -> dict[str, Slopes]:
        """Those of an element at work, of one without its sink, and of an idle one."""
        element, fine = self.array.element, self.model.fine
        kinds = {"closed": element, "sinks_off": without_sink(element), "idle": idle(element)}
        return {name: slopes(fine, device) for name, device in kinds.items()}


def solve(array: DeviceArray, say: Callable[[str], None] = lambda _: None) -> Solved:
    """The elements' steady state and crosstalk with estimated errors, and the response of the nearest neighbour of one
    over time, loops closed and sinks off.

    Raises what `fem3d.device.solve.model` raises, and NumericsError where the plate mirrors the array too often.
    """
    element = array.element
    states = model(element, element.accuracy_3d, say)
    say("the substrate between the elements")
    foot = footprint(states)
    fine, rough = (coupling(array.sink, each).per_heat.mean(axis=(2, 3)) for each in (foot, foot.middle))
    plate = Known(fine, np.abs(fine - rough) + element.accuracy_3d * np.abs(fine))
    closed, off = (together(array, states, each, plate) for each in (element, without_sink(element)))
    say("over time")
    known = float(np.max(plate.error / np.maximum(np.abs(plate.value), 1e-300)))
    through = paths(array, plate.value)
    over = over_time(array, states, through, plate.value, known) if through else ()
    return Solved(array, states, plate, closed, off, through, over)


def footprint(states: Model) -> Footprint:
    """How the heat of both films enters the plate under a foot of the element."""
    structure = states.structures[0]
    heat = structure.heat
    none = np.zeros(heat.size)
    load = np.sum([structure.conductor.joule_load(p.density, none) for p in structure.patterns], axis=0)
    return foot_of(states.device.sink, heat, heat.whole(heat.solve_steady(load[: heat.free])))


def together(array: DeviceArray, states: Model, device: Device, plate: Known) -> Together:
    """The elements of an array, those that are at work as a ``device`` (an element's, or that without its sink)."""
    factor = 2 * states.edges
    fine, low, fewer = (at_rest(array, modal, device, plate.value) for modal in (states.fine, states.low, states.fewer))
    other = at_rest(array, states.fine, device, plate.value + plate.error)
    # A power between samples is iterated to rounding, which differences of steady states show.
    rounding = 1e-13 * device.set_rise
    known = []
    for name in ("plate_rise", "power_change", "per_outside"):
        value, *less = (np.asarray(getattr(each, name)) for each in (fine, low, fewer, other))
        error = factor * np.abs(less[0] - value) + np.abs(less[1] - value) + np.abs(less[2] - value)
        known.append(Known(value, error + rounding * np.abs(value)))
    return Together(*known)
