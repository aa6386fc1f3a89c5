"""The keys of the parametric scenes, sink and device: what each means, in which dimension and between which bounds.

The bounds are those of continuum heat conduction in solids, wide enough for anything that can be built; what lies
outside is a slip of the unit. The defaults are those of ``scenes.sink.Sink`` and ``scenes.device.Device``. At the end
are the types of scene file: each a schema, the scene whose values are its defaults, and a leading key.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

from scenes import dimensions as d
from scenes.checks import DEVICE_CHECKS, SLOPE_TOLERANCES, Differing, tolerances
from scenes.device import Device
from scenes.kinds import NAME, Choice, Count, Insulator, Kind, Numbers, Quantity, Switch
from scenes.schema import Key, Schema
from scenes.sink import Sink

T = TypeVar("T")

SIZE = Quantity(d.LENGTH, 1e-9, 1.0)
TEMPERATURE = Quantity(d.TEMPERATURE, 1.0, 5000.0)
VALID_TO = Quantity(d.TEMPERATURE, 1.0, 1e4, word="unknown")
DURATION = Quantity(d.TIME, 1e-9, 1e6)
ACCURACY = Quantity(d.NUMBER, 1e-6, 0.1)
CONVECTION = Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e6)
CONDUCTOR = Quantity(d.RESISTIVITY, 1e-9, 1e6)
# A resistivity that is given for the oxide (the paper's Table 1 has 10e12 ohm m) is accepted and then left out: no
# current is modelled there, which is right only for an insulator.
INSULATOR = Insulator(
    Quantity(
        replace(d.RESISTIVITY, example="1e13 ohm m"),
        1e6,
        1e30,
        word="insulator",
        note=", for no current is modelled in this material",
    )
)
VOLTAGE = Quantity(d.VOLTAGE, 1e-4, 1e3, signed=True, note=" (at 0 V nothing heats and no relative error is defined)")


def material(name: str, resistivity: Kind) -> tuple[Key, ...]:
    """The keys of the section of one material, which is the attribute of the same name."""
    kinds: dict[str, Kind] = {
        "thermal_conductivity": Quantity(d.THERMAL_CONDUCTIVITY, 1e-4, 1e5),
        "density": Quantity(d.DENSITY, 0.1, 1e5),
        "specific_heat": Quantity(d.SPECIFIC_HEAT, 1.0, 1e5),
        "resistivity": resistivity,
        "temperature_coefficient": Quantity(d.TEMPERATURE_COEFFICIENT, -1.0, 1.0),
        "reference_temperature": TEMPERATURE,
        "valid_to": VALID_TO,
    }
    return tuple(
        Key(f"materials.{name}.{key}", f"{name}.{key}", kind, key != "valid_to") for key, kind in kinds.items()
    )


_PHYSICAL = (
    Key("sink.length", "length", SIZE),
    Key("sink.width", "width", SIZE),
    Key("sink.thickness", "thickness", SIZE),
    Key("sink.spans", "spans", Count(1, 100)),
    Key("sink.island_length", "island_length", Quantity(d.LENGTH, 1e-9, 1.0, word="as the anchors")),
    Key("anchor.pad_length", "pad_length", SIZE),
    Key("anchor.pad_width", "pad_width", SIZE),
    Key("anchor.oxide_length", "oxide_length", SIZE),
    Key("anchor.oxide_width", "oxide_width", SIZE),
    Key("anchor.oxide_thickness", "oxide_thickness", SIZE),
    Key("anchor.oxide_offset", "oxide_offset", Quantity(d.LENGTH, 0.0, 1.0, word="centred")),
    *material("silicon", CONDUCTOR),
    *material("oxide", INSULATOR),
    Key("drive.voltage", "voltage", VOLTAGE),
    Key("drive.electrodes", "electrodes", Choice(("beam-end", "pad-edge"))),
    Key("environment.room_temperature", "room_temperature", TEMPERATURE),
    Key("environment.convection_coefficient", "convection_coefficient", CONVECTION),
)  # fmt: skip

_UNCERTAINTIES = Numbers(
    Quantity(d.NUMBER, 1e-9, 1.0), tuple(key.path for key in _PHYSICAL), "key",
    'a table such as {"sink.length" = "1 %"}',
)  # fmt: skip

_SINK = Schema((
    Key("scene.name", "name", NAME, physical=False),
    *_PHYSICAL,
    Key("run.end_time", "end_time", DURATION),
    Key("run.accuracy", "accuracy", ACCURACY, physical=False),
    Key("checks.tolerances", "tolerances", tolerances(), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(), physical=False),
    Key("inputs.uncertainties", "uncertainties", _UNCERTAINTIES, physical=False),
))  # fmt: skip


def _of_the_sink() -> tuple[Key, ...]:
    """The sink's keys as parts of a device, which is run and checked in a way of its own.

    The drive is read, so that a sink's file can be extended to a device's, but the controllers take its place.
    """
    own = ("scene.", "run.", "checks.")
    return tuple(
        replace(key, attribute=f"sink.{key.attribute}", physical=key.physical and not key.path.startswith("drive."))
        for key in _SINK.keys
        if not key.path.startswith(own)
    )


GAIN = Quantity(d.VOLTAGE, 0.0, 1e6)

_DEVICE = Schema((
    Key("scene.name", "name", NAME, physical=False),
    *_of_the_sink(),
    Key("device.sensor_thickness", "sensor_thickness", SIZE),
    Key("device.insulator_thickness", "insulator_thickness", SIZE),
    Key("device.polymer_thickness", "polymer_thickness", SIZE),
    *material("gold", CONDUCTOR),
    *material("pdms", INSULATOR),
    Key("control.sample_time", "control.sample_time", Quantity(d.TIME, 1e-6, 100.0)),
    Key("control.sink_gain", "control.sink_gain", GAIN),
    Key("control.sensor_gain", "control.sensor_gain", GAIN),
    Key("control.set_temperature", "control.set_temperature", TEMPERATURE),
    Key("control.allow_negative_voltage", "control.allow_negative_voltage", Switch()),
    Key("external.initial_temperature", "external.initial_temperature", TEMPERATURE),
    Key("external.final_temperature", "external.final_temperature", TEMPERATURE),
    Key("external.step_time", "external.step_time", Quantity(d.TIME, 0.0, 1e6)),
    Key("run.end_time", "end_time", DURATION),
    Key("run.accuracy", "accuracy", Quantity(d.NUMBER, 1e-7, 0.1), physical=False),
    Key("run.accuracy_3d", "accuracy_3d", ACCURACY, physical=False),
    Key("checks.tolerances", "tolerances", tolerances((*DEVICE_CHECKS, *SLOPE_TOLERANCES)), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(DEVICE_CHECKS), physical=False),
))  # fmt: skip


@dataclass(frozen=True)
class SceneType(Generic[T]):
    """A type of scene, by the ``name`` of its built-in one; ``leading`` is the key that its folders start with."""

    name: str
    schema: Schema
    default: T
    leading: str


SINK = SceneType("sink", _SINK, Sink(), "drive.voltage")
DEVICE = SceneType("device", _DEVICE, Device(), "external.final_temperature")

TYPES: dict[str, SceneType[Any]] = {found.name: found for found in (SINK, DEVICE)}
"""All types by name."""


def type_of(scene: object) -> SceneType[Any]:
    """The type of a scene; TypeError for what is none."""
    for found in TYPES.values():
        if isinstance(scene, type(found.default)):
            return found
    raise TypeError(f"{type(scene).__name__} is not a scene")
