"""The keys of the parametric sink: what each means, in which dimension and between which bounds.

The bounds are those of continuum heat conduction in solids, wide enough for anything that can be built; what lies
outside is a slip of the unit. The defaults are those of ``scenes.sink.Sink``.
"""

from __future__ import annotations

from dataclasses import replace

from scenes import dimensions as d
from scenes.checks import Differing, Tolerances
from scenes.kinds import Choice, Insulator, Kind, Name, Quantity
from scenes.schema import Key, Schema

SIZE = Quantity(d.LENGTH, 1e-9, 1.0)
TEMPERATURE = Quantity(d.TEMPERATURE, 1.0, 5000.0)
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
    }
    return tuple(Key(f"materials.{name}.{key}", f"{name}.{key}", kind) for key, kind in kinds.items())


SINK = Schema((
    Key("scene.name", "name", Name(), physical=False),
    Key("sink.length", "length", SIZE),
    Key("sink.width", "width", SIZE),
    Key("sink.thickness", "thickness", SIZE),
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
    Key("run.end_time", "end_time", DURATION),
    Key("run.accuracy", "accuracy", ACCURACY, physical=False),
    Key("checks.tolerances", "tolerances", Tolerances(), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(), physical=False),
))  # fmt: skip
