"""Several devices on one plate in 1D: each is the 1D device with its oxide on the plate's top, at room temperature
but for what the others do to it. What that is, is given: 1D has no plate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reduced1d.device.accurate import FIRST
from reduced1d.device.lumped import lump, modes
from scenes.array import DeviceArray
from scenes.loop.array import Course, Paths, Rest, at_rest, course
from scenes.loop.march import Resolution
from scenes.loop.shielding import without_sink


@dataclass(frozen=True, eq=False)
class Beside:
    """An array at rest with the loops closed and with all sinks off; both over time where another is at work."""

    closed: Rest
    sinks_off: Rest
    over_time: tuple[Course, ...]


def beside(array: DeviceArray, plate: np.ndarray, through: Paths | None) -> Beside:
    """The array in 1D on a ``plate`` (elements, elements) in K/W and ``through`` its paths over time."""
    element = array.element
    resolution = Resolution(modes(lump(element), FIRST.degree).modal, FIRST.nodes)
    devices = element, without_sink(element)
    closed, off = (at_rest(array, resolution.modal, device, plate) for device in devices)
    over = tuple(course(array, resolution, device, through, plate) for device in devices) if through else ()
    return Beside(closed, off, over)
