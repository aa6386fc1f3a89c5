"""Crosstalk of parallel heat sinks on one substrate: the mean rise of each beam per watt in each other beam.

The array is a free scene: the boxes, contacts and conditions of one sink, repeated across a common plate. Each sink is
driven alone, and the mean temperatures of all beams over its power fill one column of the crosstalk matrix. A row that
is mirrored about its middle needs half of these solutions.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

import compare
import scenes
from scenes.errors import SceneError
from scenes.model import Boundary, Point, Probe, Scene
from scenes.sink import Sink, face


@dataclass(frozen=True)
class Crosstalk:
    """Crosstalk of an array.

    Attributes
    ----------
    value : (columns, columns) array
        Mean rise of beam i per watt in beam j, K/W.
    error : (columns, columns) array
        Error bound of each entry, K/W.
    """

    value: np.ndarray
    error: np.ndarray


def array_scene(sink: Sink, columns: int, pitch: float, driven: int) -> Scene:
    """Build the free scene of parallel sinks on one substrate.

    Parameters
    ----------
    sink : Sink
        One sink with a substrate; its plate carries all sinks.
    columns : int
        Number of sinks, side by side across the beam.
    pitch : float
        Distance from middle to middle, m.
    driven : int
        Number of the sink, from 0, whose electrodes have a voltage. The others carry no current.

    Returns
    -------
    Scene
        A steady scene with the probes "mean 0", "mean 1", ... of the beams and "power" of the driven beam.

    Raises
    ------
    SceneError
        Where the sink has no substrate or several spans, or where pads overlap or stand beside the plate.
    """
    if sink.substrate_thickness is None or sink.spans > 1:
        raise SceneError("an array needs one span and a substrate: give substrate.thickness and sink.spans = 1")
    widest = max(sink.pad_width, sink.width)
    if columns > 1 and pitch <= widest:
        raise SceneError(f"pitch = {pitch:g} m lets pads touch: give more than {widest:g} m")
    extent = (columns - 1) * pitch + widest
    if sink.substrate_width < extent:
        raise SceneError(f"substrate.width = {sink.substrate_width:g} m is too narrow: give at least {extent:g} m")
    one = sink.scene()
    plate = next(box for box in one.boxes if box.name == "substrate")
    bottom = Boundary("bottom", "temperature", *face(plate, 2, 0), sink.room_temperature)
    boxes, boundaries, contacts, probes = [], [bottom], [], []
    for k in range(columns):
        shift = (k - (columns - 1) / 2) * pitch

        def moved(point: Point, shift: float = shift) -> Point:
            return point[0] + shift, point[1], point[2]

        own = [replace(b, name=f"{b.name} {k}", lower=moved(b.lower), upper=moved(b.upper)) for b in one.boxes]
        boxes += [box for box in own if not box.name.startswith("substrate")]
        boundaries += [
            replace(b, name=f"{b.name} {k}", lower=moved(b.lower), upper=moved(b.upper))
            for b in one.boundaries
            if b.kind in ("convection", "radiation") or (b.kind == "voltage" and k == driven)
        ]
        for contact in one.contacts:
            first, second = (name if name == "substrate" else f"{name} {k}" for name in contact.between)
            contacts.append(replace(contact, name=f"{contact.name} {k}", between=(first, second)))
        beam = own[0]
        probes.append(Probe(f"mean {k}", beam.lower, beam.upper))
        if k == driven:
            probes.append(Probe("power", beam.lower, beam.upper, "power"))
    return Scene(
        "array", (*boxes, plate), tuple(boundaries), tuple(probes), sink.room_temperature, accuracy=sink.accuracy,
        steady=True, contacts=tuple(contacts),
    )  # fmt: skip


def crosstalk(sink: Sink, columns: int, pitch: float) -> Crosstalk:
    """Solve for the crosstalk matrix of parallel sinks; parameters and errors as of `array_scene`."""
    value, error = np.zeros((2, columns, columns))
    for driven in range((columns + 1) // 2):
        solution = compare.solve(array_scene(sink, columns, pitch, driven))
        power = solution["power"]
        for k in range(columns):
            mean = solution[f"mean {k}"]
            value[k, driven] = (mean.value - sink.room_temperature) / power.value
            error[k, driven] = (mean.error + abs(value[k, driven]) * power.error) / power.value
        # The row is symmetric about its middle.
        value[::-1, columns - 1 - driven] = value[:, driven]
        error[::-1, columns - 1 - driven] = error[:, driven]
    return Crosstalk(value, error)


if __name__ == "__main__":
    COLUMNS, PITCH = 3, 400e-6
    found = crosstalk(scenes.load("sink", ["substrate.thickness=0.5mm"]), COLUMNS, PITCH)
    print(f"Mean rise in K/W of each beam (row) per watt in each beam (column), pitch {PITCH * 1e6:.0f} um:")
    for i in range(COLUMNS):
        print("  ".join(f"{found.value[i, j]:9.4g} +- {found.error[i, j]:<7.1g}" for j in range(COLUMNS)))
