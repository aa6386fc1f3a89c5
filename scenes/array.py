"""Rows of sinks, or of whole sensors, on one substrate: columns of them side by side across, rows along, each an
element of the array.

Elements are numbered from 1, along x first, from the plate's lower corner. Any of them are driven at the sink's
voltage, the others have no circuit.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, ClassVar

from scenes.device import Device
from scenes.model import Boundary, Box, Contact, Point, Probe, Scene
from scenes.sink import Sink, face

ONE_SINK = "array.columns = {0.columns} and array.rows = {0.rows}: {1}, so give 1 of each"
"""The refusal of more than one sink where only one is solved."""


@dataclass(frozen=True)
class SinkArray(Sink):
    """A sink that stands on its substrate more than once; all of it is a sink's."""

    kind: ClassVar[str] = "array"

    @staticmethod
    def of(sink: Sink) -> SinkArray:
        """The array that a sink's keys ask for."""
        return SinkArray(**_given(sink))

    @property
    def element(self) -> Sink:
        """One of them alone, in the middle of the same substrate."""
        return alone(self)

    def scene(self, count: int | None = None) -> Scene:
        """All of them as boxes, conditions and probes, in one structure."""
        return whole(self)


@dataclass(frozen=True)
class DeviceArray(Device):
    """A whole sensor that stands on its substrate more than once; all of it is a device's."""

    kind: ClassVar[str] = "device_array"

    @staticmethod
    def of(device: Device) -> DeviceArray:
        """The array that a device's keys ask for."""
        return DeviceArray(**{field.name: getattr(device, field.name) for field in fields(device)})

    @property
    def element(self) -> Device:
        """One of them alone, in the middle of the same substrate."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return Device(**given | {"sink": alone(self.sink)})


def alone(sink: Sink) -> Sink:
    """One element in the middle of the array's substrate."""
    return Sink(**_given(sink) | {"columns": 1, "rows": 1, "driven": None})


def _given(sink: Sink) -> dict[str, Any]:
    return {field.name: getattr(sink, field.name) for field in fields(sink)}


def idle(device: Device) -> Device:
    """A device without circuits."""
    return replace(device, control=replace(device.control, sink_gain=0.0, sensor_gain=0.0))


def places(sink: Sink) -> list[tuple[float, float]]:
    """The middles (x, y) of the elements in m, about the middle of the plate."""
    return [
        ((column - (sink.columns - 1) / 2) * sink.pitch, (row - (sink.rows - 1) / 2) * sink.row_pitch)
        for row in range(sink.rows)
        for column in range(sink.columns)
    ]


def driven(sink: Sink) -> tuple[int, ...]:
    """The numbers of the elements that are."""
    return tuple(range(1, sink.count + 1)) if sink.driven is None else sink.driven


def whole(sink: Sink) -> Scene:
    """The array in one structure: of each element ``sink<k>_`` and its own names, of idle ones without circuits."""
    element = alone(sink).scene()
    on = driven(sink)
    boxes: list[Box] = []
    boundaries: list[Boundary] = []
    probes: list[Probe] = []
    contacts: list[Contact] = []
    for number, (x, y) in enumerate(places(sink), 1):

        def moved(point: Point, x: float = x, y: float = y) -> Point:
            return (point[0] + x, point[1] + y, point[2])

        def put(item, number: int = number):  # type: ignore[no-untyped-def]
            return replace(item, name=f"sink{number}_{item.name}", lower=moved(item.lower), upper=moved(item.upper))

        boxes += [put(b) for b in element.boxes if b.name != "substrate"]
        boundaries += [
            put(b) for b in element.boundaries if b.kind == "convection" or (b.kind == "voltage" and number in on)
        ]
        probes += [put(p) for p in element.probes if p.name != "end"]
        for c in element.contacts:
            pair = tuple(name if name == "substrate" else f"sink{number}_{name}" for name in c.between)
            contacts.append(replace(c, name=f"sink{number}_{c.name}", between=(pair[0], pair[1])))
    plate = element.boxes[-1]
    bottom = Boundary("substrate", "temperature", *face(plate, 2, 0), sink.room_temperature)
    return Scene(
        sink.name, (*boxes, plate), (*boundaries, bottom), tuple(probes), sink.room_temperature, sink.end_time,
        sink.accuracy, steady=True, contacts=tuple(contacts),
    )  # fmt: skip
