"""Check a parametric scene: bounds of values and fitting sizes."""

from __future__ import annotations

from typing import TypeVar

from scenes.device import Device
from scenes.errors import SceneError, quoted
from scenes.keys import type_of
from scenes.model import ROUNDING, Material
from scenes.physics import check_law, check_resistivity, refuse_laws
from scenes.sink import Sink
from scenes.units import LENGTH, TIME

T = TypeVar("T")
_MOST_SAMPLES = 1_000_000  # The most controller samples of a run.


def check(scene: T) -> T:
    """Check a scene from a file, an override or Python, and return it.

    Raises SceneError for a value of the wrong type or out of bounds, an oxide that does not lie under its pad, an
    island longer than a span, a film whose resistivity is not positive at room temperature, and device settings that
    its controllers cannot work with. A beam wider than its pads is fine.
    """
    schema = type_of(scene).schema
    values = schema.values(scene)
    for path, written in schema.write(scene).items():
        value, read = values[path], schema.paths[path].kind.read(path, written)
        if read != value:
            raise SceneError(f"{path} = {quoted(value)} must be given as {read!r} in Python")
    if isinstance(scene, Device):
        _check_device(scene)
    elif isinstance(scene, Sink):
        _check_sink(scene)
    return scene


def _check_device(device: Device) -> None:
    _check_sink(device.sink)
    substrate = device.sink.substrate
    follows = (substrate,) if substrate.follows else ()
    refuse_laws((device.sink.silicon, device.sink.oxide, device.gold, device.pdms, *follows), "a device")
    if device.sink.spans > 1:
        raise SceneError(f"sink.spans = {device.sink.spans} makes a row, and a device has one span: give 1")
    if device.sink.emissivity:
        raise SceneError(f"environment.emissivity = {device.sink.emissivity:g} is not solved for a device: give 0")
    room, control, external = device.sink.room_temperature, device.control, device.external
    if not control.set_temperature > room:
        least = f"give more than environment.room_temperature = {room:g} K"
        raise SceneError(f"control.set_temperature = {control.set_temperature:g} K asks for cooling: {least}")
    if device.end_time / control.sample_time > _MOST_SAMPLES:
        each, end = (quoted(TIME.show(time)) for time in (control.sample_time, device.end_time))
        most = f"give at most {_MOST_SAMPLES} samples in a run"
        raise SceneError(f"control.sample_time = {each} is too short for run.end_time = {end}: {most}")
    for film in (device.sink.silicon, device.gold):
        if not film.temperature_coefficient > 0:
            key = f"materials.{film.name}.temperature_coefficient = {film.temperature_coefficient:g} 1/K"
            raise SceneError(f"{key} leaves the controllers without a signal: give more than 0")
        _check_film(film, "environment.room_temperature", room)
        for name in ("initial_temperature", "final_temperature"):
            _check_film(film, f"external.{name}", getattr(external, name))


def _check_sink(sink: Sink) -> None:
    """Refuse sizes that do not fit, keys without effect or not solved together, and a film without a resistance."""
    room, usual = sink.pad_length - sink.oxide_length, Sink()
    blocks = sink.length + 2 * (sink.anchor_distance + sink.oxide_length)
    for key, size, most, of in (
        ("anchor.oxide_length", sink.oxide_length, sink.pad_length, "anchor.pad_length"),
        ("anchor.oxide_width", sink.oxide_width, sink.pad_width, "anchor.pad_width"),
        ("anchor.oxide_offset", sink.anchor_distance, room, "anchor.pad_length - anchor.oxide_length"),
    ):
        if size > most + sink.pad_length * ROUNDING:
            allowed = f"give at most {of} = {_shown(most)}"
            raise SceneError(f"{key} = {_shown(size)} lets the oxide stick out of its pad: {allowed}")
    for key, size, default, least, extent in (
        ("length", sink.substrate_length, usual.substrate_length, blocks, "from one block's far side to the other's"),
        ("width", sink.substrate_width, usual.substrate_width, sink.oxide_width, "anchor.oxide_width"),
    ):
        if sink.substrate_thickness is None and size != default:
            raise SceneError(f"substrate.{key} = {_shown(size)} is of no substrate: give substrate.thickness too")
        if sink.substrate_thickness is not None and size < least * (1 - ROUNDING):
            allowed = f"give at least {_shown(least)}, {extent}"
            raise SceneError(f"substrate.{key} = {_shown(size)} lets the oxide stick out of it: {allowed}")
    current, row = sink.current is not None, sink.spans > 1
    for wrong, key, beside in (
        (current and sink.voltage != usual.voltage, "drive.voltage", "drive.current"),
        (current and sink.series_resistance, "drive.series_resistance", "drive.current"),
        (row and sink.gap_gas_conductivity, "environment.gap_gas_conductivity", f"sink.spans = {sink.spans}"),
        (row and current, "drive.current", f"sink.spans = {sink.spans}"),
        (row and sink.series_resistance, "drive.series_resistance", f"sink.spans = {sink.spans}"),
        (row and sink.substrate_thickness, "substrate.thickness", f"sink.spans = {sink.spans}"),
    ):
        if wrong:
            value = type_of(sink).schema.write(sink)[key]
            raise SceneError(f"{key} = {value:g} is not solved beside {beside}: give one of them")
    if row and sink.island > sink.length * (1 + ROUNDING):
        allowed = f"give at most sink.length = {_shown(sink.length)}"
        raise SceneError(f"sink.island_length = {_shown(sink.island)} is longer than a span: {allowed}")
    _check_film(sink.silicon, "environment.room_temperature", sink.room_temperature)


def _shown(length: float) -> str:
    """A length without the noise that a difference leaves in its last digits."""
    return quoted(LENGTH.show(float(f"{length:.9g}")))


def _check_film(film: Material, where: str, temperature: float) -> None:
    check_law(f"materials.{film.name}", film)
    check_resistivity(film, f"materials.{film.name}", f"{where} = {temperature} K", temperature)
