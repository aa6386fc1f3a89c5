"""The tables of a free scene file and the keys of each, with the kind of every value.

The bounds are wide, for textbook cases have round numbers that nothing real has; what lies outside is a slip of the
unit.
"""

from __future__ import annotations

from scenes import kinds as k
from scenes import units as d
from scenes.keys import ACCURACY, VALID_TO
from scenes.schema import Key, Schema

POINT = k.Place(k.Quantity(d.LENGTH, 0.0, 1e4, signed=True))

CONDITIONS: dict[str, k.Varying | k.Convection] = {
    "temperature": k.Varying(k.KELVIN),
    "heat_flux": k.Varying(k.Quantity(d.HEAT_FLUX, 0.0, 1e15, signed=True)),
    "convection": k.Convection(k.Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e12), k.Varying(k.KELVIN)),
    "voltage": k.Varying(k.Quantity(d.VOLTAGE, 0.0, 1e6, signed=True)),
}
"""What a boundary may have, of which it has one."""

RESISTIVITY = k.Quantity(d.RESISTIVITY, 1e-12, 1e9, word="insulator")
HEAT_SOURCE = k.Varying(k.Quantity(d.HEAT_SOURCE, 0.0, 1e20, signed=True))


_SCENE_AND_RUN = (
    Key("scene.name", "name", k.NAME),
    Key("scene.initial_temperature", "initial_temperature", k.KELVIN),
    Key("run.steady", "steady", k.Switch()),
    Key("run.end_time", "end_time", k.Quantity(d.TIME, 1e-12, 1e9)),
    Key("run.output_times", "output_times", k.Instants()),
    Key("run.accuracy", "accuracy", ACCURACY),
)

LISTS: dict[str, dict[str, k.Kind]] = {
    "material": {
        "name": k.LABEL,
        "thermal_conductivity": k.Quantity(d.THERMAL_CONDUCTIVITY, 1e-9, 1e9),
        "density": k.Quantity(d.DENSITY, 1e-6, 1e9),
        "specific_heat": k.Quantity(d.SPECIFIC_HEAT, 1e-6, 1e9),
        "resistivity": RESISTIVITY,
        "temperature_coefficient": k.Quantity(d.TEMPERATURE_COEFFICIENT, 0.0, 1.0, signed=True),
        "reference_temperature": k.KELVIN,
        "valid_to": VALID_TO,
    },
    "box": {
        "name": k.LABEL,
        "material": k.LABEL,
        "lower": POINT,
        "upper": POINT,
        "heat_source": HEAT_SOURCE,
    },
    "boundary": {"name": k.LABEL, "lower": POINT, "upper": POINT, **CONDITIONS},
    "probe": {
        "name": k.LABEL,
        "quantity": k.Choice(("temperature", "potential", "heat_flow", "current")),
        "at": POINT,
        "lower": POINT,
        "upper": POINT,
        "reduce": k.Choice(("mean", "max", "min")),
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
    (*_SCENE_AND_RUN, Key("mesh.file", "file", k.MESH_FILE), Key("mesh.unit", "unit", k.LengthUnit())),
    {
        "material": {**LISTS["material"], "groups": k.GroupNames()},
        "source": {"name": k.LABEL, "group": k.GROUP, "heat_source": HEAT_SOURCE},
        "boundary": {"name": k.LABEL, "group": k.GROUP, **CONDITIONS},
        "probe": {key: kind for key, kind in LISTS["probe"].items() if key not in _CORNERS} | {"group": k.GROUP},
    },
    {"material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",)},
    "a scene on a mesh",
    "run.accuracy=1e-4",
)
"""What a file with a [mesh] may say: groups stand in the place of boxes and corners."""
