"""The tables of a free scene file and the keys of each, with the kind of every value.

The bounds are wide, for textbook cases have round numbers that nothing real has; what lies outside is a slip of the
unit.
"""

from __future__ import annotations

from scenes import dimensions as d
from scenes.keys import ACCURACY, VALID_TO
from scenes.kinds import (
    GROUP,
    KELVIN,
    LABEL,
    MESH_FILE,
    NAME,
    Choice,
    Convection,
    GroupNames,
    Instants,
    Kind,
    LengthUnit,
    Place,
    Quantity,
    Switch,
    Varying,
)
from scenes.schema import Key, Schema

POINT = Place(Quantity(d.LENGTH, 0.0, 1e4, signed=True))

CONDITIONS: dict[str, Varying | Convection] = {
    "temperature": Varying(KELVIN),
    "heat_flux": Varying(Quantity(d.HEAT_FLUX, 0.0, 1e15, signed=True)),
    "convection": Convection(Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e12), Varying(KELVIN)),
    "voltage": Varying(Quantity(d.VOLTAGE, 0.0, 1e6, signed=True)),
}
"""What a boundary may have, of which it has one."""

RESISTIVITY = Quantity(d.RESISTIVITY, 1e-12, 1e9, word="insulator")
HEAT_SOURCE = Varying(Quantity(d.HEAT_SOURCE, 0.0, 1e20, signed=True))


_SCENE_AND_RUN = (
    Key("scene.name", "name", NAME),
    Key("scene.initial_temperature", "initial_temperature", KELVIN),
    Key("run.steady", "steady", Switch()),
    Key("run.end_time", "end_time", Quantity(d.TIME, 1e-12, 1e9)),
    Key("run.output_times", "output_times", Instants()),
    Key("run.accuracy", "accuracy", ACCURACY),
)

LISTS: dict[str, dict[str, Kind]] = {
    "material": {
        "name": LABEL,
        "thermal_conductivity": Quantity(d.THERMAL_CONDUCTIVITY, 1e-9, 1e9),
        "density": Quantity(d.DENSITY, 1e-6, 1e9),
        "specific_heat": Quantity(d.SPECIFIC_HEAT, 1e-6, 1e9),
        "resistivity": RESISTIVITY,
        "temperature_coefficient": Quantity(d.TEMPERATURE_COEFFICIENT, 0.0, 1.0, signed=True),
        "reference_temperature": KELVIN,
        "valid_to": VALID_TO,
    },
    "box": {
        "name": LABEL,
        "material": LABEL,
        "lower": POINT,
        "upper": POINT,
        "heat_source": HEAT_SOURCE,
    },
    "boundary": {"name": LABEL, "lower": POINT, "upper": POINT, **CONDITIONS},
    "probe": {
        "name": LABEL,
        "quantity": Choice(("temperature", "potential", "heat_flow", "current")),
        "at": POINT,
        "lower": POINT,
        "upper": POINT,
        "reduce": Choice(("mean", "max", "min")),
    },
}
"""The tables that a file may have many of, as [[material]] and so on."""

REQUIRED: dict[str, tuple[str, ...]] = {
    "material": ("name",),
    "box": ("material", "lower", "upper"),
    "boundary": ("lower", "upper"),
    "probe": ("name",),
}
"""What has no default; a box or boundary without a name is called box-1, boundary-1 and so on."""

BOXES = Schema(_SCENE_AND_RUN, LISTS, REQUIRED, "a free scene", "run.accuracy=1e-4")
"""What a file of a free scene of boxes may say."""

_CORNERS = ("lower", "upper")
ON_MESH = Schema(
    (*_SCENE_AND_RUN, Key("mesh.file", "file", MESH_FILE), Key("mesh.unit", "unit", LengthUnit())),
    {
        "material": {**LISTS["material"], "groups": GroupNames()},
        "source": {"name": LABEL, "group": GROUP, "heat_source": HEAT_SOURCE},
        "boundary": {"name": LABEL, "group": GROUP, **CONDITIONS},
        "probe": {key: kind for key, kind in LISTS["probe"].items() if key not in _CORNERS} | {"group": GROUP},
    },
    {"material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",)},
    "a scene on a mesh",
    "run.accuracy=1e-4",
)
"""What a file with a [mesh] may say: groups stand in the place of boxes and corners."""
