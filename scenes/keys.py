"""The keys of the parametric scenes, sink and device, with their dimensions and bounds.

The bounds hold for continuum heat conduction in solids, wide enough for any buildable device; a value outside is a
slip of the unit. The defaults are in ``scenes.sink.Sink`` and ``scenes.device.Device``. A type of scene file is a
schema, the scene with the default values, and a leading key.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from scenes import units as d
from scenes.checks import DEVICE_CHECKS, SLOPE_TOLERANCES, Differing, tolerances
from scenes.device import Device
from scenes.functions import Following
from scenes.kinds import LABEL, SWITCH, Choice, Count, Insulator, Kind, Numbers, Quantity
from scenes.schema import Key, Schema
from scenes.sink import Sink

SIZE = Quantity(d.LENGTH, 1e-9, 1.0)
TEMPERATURE = Quantity(d.TEMPERATURE, 1.0, 5000.0)
VALID_TO = Quantity(d.TEMPERATURE, 1.0, 1e4, word="unknown")
DURATION = Quantity(d.TIME, 1e-9, 1e6)
ACCURACY = Quantity(d.NUMBER, 1e-6, 0.1)
CONDUCTOR = Following(Quantity(d.RESISTIVITY, 1e-9, 1e6))
CONDUCTIVITY = Following(Quantity(d.ELECTRICAL_CONDUCTIVITY, 1e-6, 1e9))
# A resistivity that is given for the oxide (the paper's Table 1 has 10e12 ohm m) is accepted and then left out: no
# current is modelled there, which is right only for an insulator.
INSULATOR = Insulator(
    replace(d.RESISTIVITY, example="1e13 ohm m"), 1e6, 1e30, word="insulator",
    note=", for no current is modelled in this material",
)  # fmt: skip
# The substrate's may be any: the oxide keeps the current from it.
UNREACHED = Insulator(d.RESISTIVITY, 1e-9, 1e30, word="insulator")
GAIN = Quantity(d.VOLTAGE, 0.0, 1e6)
VOLTAGE = Quantity(d.VOLTAGE, 1e-4, 1e3, signed=True, note=" (at 0 V nothing heats and no relative error is defined)")


def _section(path: str, owner: str = "", physical: bool = True, **kinds: Kind) -> tuple[Key, ...]:
    """The keys of one section; each is the attribute of the same name behind ``owner``."""
    return tuple(Key(f"{path}.{name}", f"{owner}{name}", kind, physical) for name, kind in kinds.items())


def _material(name: str, resistivity: Kind) -> tuple[Key, ...]:
    """The keys of the section of one material, which is the attribute of the same name."""
    path, owner = f"materials.{name}", f"{name}."
    return (
        *_section(
            path, owner, thermal_conductivity=Following(Quantity(d.THERMAL_CONDUCTIVITY, 1e-4, 1e5), axes=True),
            density=Quantity(d.DENSITY, 0.1, 1e5), specific_heat=Following(Quantity(d.SPECIFIC_HEAT, 1.0, 1e5)),
            resistivity=resistivity, temperature_coefficient=Quantity(d.TEMPERATURE_COEFFICIENT, -1.0, 1.0),
            reference_temperature=TEMPERATURE,
        ),
        *(_section(path, owner, electrical_conductivity=CONDUCTIVITY) if resistivity is CONDUCTOR else ()),
        *_section(path, owner, False, valid_to=VALID_TO),
    )  # fmt: skip


_PHYSICAL = (
    *_section(
        "sink", length=SIZE, width=SIZE, thickness=SIZE, spans=Count(1, 100),
        island_length=Quantity(d.LENGTH, 1e-9, 1.0, word="as the anchors"),
    ),
    *_section(
        "anchor", pad_length=SIZE, pad_width=SIZE, oxide_length=SIZE, oxide_width=SIZE, oxide_thickness=SIZE,
        oxide_offset=Quantity(d.LENGTH, 0.0, 1.0, word="centred"),
        contact_resistance=Quantity(d.THERMAL_CONTACT, 1e-12, 1e6, word="perfect"),
    ),
    *_section(
        "substrate", "substrate_", thickness=Quantity(d.LENGTH, 1e-9, 1.0, word="none"), length=SIZE, width=SIZE
    ),
    *_material("silicon", CONDUCTOR),
    *_material("oxide", INSULATOR),
    *_material("substrate", UNREACHED),
    *_section(
        "drive", voltage=VOLTAGE, current=Quantity(d.CURRENT, 1e-9, 1e3, signed=True, word="none"),
        series_resistance=Quantity(d.RESISTANCE, 0.0, 1e12), electrodes=Choice(("beam-end", "pad-edge")),
    ),
    *_section(
        "environment", room_temperature=TEMPERATURE,
        convection_coefficient=Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e6),
        gap_gas_conductivity=Quantity(d.THERMAL_CONDUCTIVITY, 0.0, 10.0), emissivity=Quantity(d.NUMBER, 0.0, 1.0),
    ),
)  # fmt: skip

_UNCERTAINTIES = Numbers(
    Quantity(d.NUMBER, 1e-9, 1.0), tuple(key.path for key in _PHYSICAL), "key",
    'a table such as {"sink.length" = "1 %"}',
)  # fmt: skip


_SINK = Schema((
    *_section("scene", physical=False, name=LABEL),
    *_PHYSICAL,
    *_section("run", end_time=DURATION),
    *_section("run", physical=False, accuracy=ACCURACY),
    Key("checks.tolerances", "tolerances", tolerances(), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(), physical=False),
    *_section("inputs", physical=False, uncertainties=_UNCERTAINTIES),
), main="sink")  # fmt: skip

_DEVICE = Schema((
    *_section("scene", physical=False, name=LABEL),
    # The drive is read, so that a sink's file can be extended to a device's, but the controllers take its place.
    *(
        replace(key, attribute=f"sink.{key.attribute}", physical=key.physical and not key.path.startswith("drive."))
        for key in (*_PHYSICAL, *_section("inputs", physical=False, uncertainties=_UNCERTAINTIES))
    ),
    *_section("device", sensor_thickness=SIZE, insulator_thickness=SIZE, polymer_thickness=SIZE),
    *_material("gold", CONDUCTOR),
    *_material("pdms", INSULATOR),
    *_section(
        "control", "control.", sample_time=Quantity(d.TIME, 1e-6, 100.0), sink_gain=GAIN, sensor_gain=GAIN,
        set_temperature=TEMPERATURE, allow_negative_voltage=SWITCH,
        ground_resistance=Quantity(d.RESISTANCE, 0.0, 1e3),
    ),
    *_section(
        "external", "external.", initial_temperature=TEMPERATURE, final_temperature=TEMPERATURE,
        step_time=Quantity(d.TIME, 0.0, 1e6),
    ),
    *_section("run", end_time=DURATION),
    *_section("run", physical=False, accuracy=Quantity(d.NUMBER, 1e-7, 0.1), accuracy_3d=ACCURACY),
    Key("checks.tolerances", "tolerances", tolerances((*DEVICE_CHECKS, *SLOPE_TOLERANCES)), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(DEVICE_CHECKS), physical=False),
), main="sink")  # fmt: skip


@dataclass(frozen=True)
class SceneType:
    """A type of scene, by the ``name`` of its built-in one; ``leading`` is the key that its folders start with."""

    name: str
    schema: Schema
    default: Any
    leading: str


SINK = SceneType("sink", _SINK, Sink(), "drive.voltage")
DEVICE = SceneType("device", _DEVICE, Device(), "external.final_temperature")

TYPES: dict[str, SceneType] = {kind.name: kind for kind in (SINK, DEVICE)}


def type_of(scene: object) -> SceneType:
    """Return the type of a parametric scene; TypeError for any other object."""
    kind = TYPES.get(getattr(scene, "kind", ""))
    if kind is None:
        raise TypeError(f"{type(scene).__name__} is not a scene")
    return kind
