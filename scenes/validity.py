"""Whether a sink can be solved: every value within its bounds, and the sizes fitting together."""

from __future__ import annotations

from operator import attrgetter

from scenes.dimensions import LENGTH
from scenes.errors import SceneError, quoted
from scenes.keys import SINK
from scenes.sink import Sink

_ROUNDING = 1e-9


def check(sink: Sink) -> Sink:
    """The sink itself, wherever it comes from: a file, an override or Python.

    Raises SceneError for a value of the wrong type or out of bounds, an oxide that does not lie under its pad, and
    silicon whose resistivity would not be positive at room temperature. A beam wider than its pads is fine.
    """
    for key in SINK.keys:
        value = attrgetter(key.attribute)(sink)
        read = key.kind.read(key.path, key.kind.write(value))
        if read != value:
            raise SceneError(f"{key.path} = {quoted(value)} must be given as {read!r} in Python")
    _check_oxide(sink)
    _check_resistivity(sink)
    return sink


def _check_oxide(sink: Sink) -> None:
    for side in ("length", "width"):
        oxide, pad = getattr(sink, f"oxide_{side}"), getattr(sink, f"pad_{side}")
        if oxide > pad * (1 + _ROUNDING):
            raise SceneError(
                f"anchor.oxide_{side} = {_shown(oxide)} lets the oxide stick out of its pad: give at most "
                f"anchor.pad_{side} = {_shown(pad)}"
            )
    room = sink.pad_length - sink.oxide_length
    if sink.anchor_distance > room + sink.pad_length * _ROUNDING:
        raise SceneError(
            f"anchor.oxide_offset = {_shown(sink.anchor_distance)} lets the oxide stick out of its pad: give at most "
            f"anchor.pad_length - anchor.oxide_length = {_shown(room)}"
        )


def _shown(length: float) -> str:
    """A length without the noise that a difference leaves in its last digits."""
    return quoted(LENGTH.show(float(f"{length:.9g}")))


def _check_resistivity(sink: Sink) -> None:
    silicon, room = sink.silicon, sink.room_temperature
    factor = 1 + silicon.temperature_coefficient * (room - silicon.reference_temperature)
    if factor <= 0:
        raise SceneError(
            f"materials.silicon.temperature_coefficient = {silicon.temperature_coefficient} 1/K makes the resistivity "
            f"{factor:.3g} times its reference value at environment.room_temperature = {room} K: give values that keep "
            "1 + coefficient * (room - reference temperature) above 0"
        )
