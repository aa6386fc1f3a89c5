"""The tables of a free scene file and the keys of each, with the kind of every value.

The bounds are wide, for textbook cases have round numbers that nothing real has; what lies outside is a slip of the
unit.
"""

from __future__ import annotations

from scenes import dimensions as d
from scenes.free.document import Tables
from scenes.free.kinds import (
    GROUP,
    KELVIN,
    LABEL,
    MESH_FILE,
    Convection,
    GroupNames,
    Instants,
    LengthUnit,
    Place,
    Varying,
)
from scenes.keys import ACCURACY, VALID_TO
from scenes.kinds import NAME, Choice, Quantity, Readable, Switch

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
HEAT_KEYS = ("thermal_conductivity", "density", "specific_heat")

SECTIONS: dict[str, dict[str, Readable]] = {
    "scene": {"name": NAME, "initial_temperature": KELVIN},
    "run": {
        "steady": Switch(),
        "end_time": Quantity(d.TIME, 1e-12, 1e9),
        "output_times": Instants(),
        "accuracy": ACCURACY,
    },
}
"""The tables that a file has once."""

LISTS: dict[str, dict[str, Readable]] = {
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

TABLES = Tables("a free scene", SECTIONS, LISTS, REQUIRED)
"""What a file of a free scene of boxes may say."""

_CORNERS = ("lower", "upper")
MESH_TABLES = Tables(
    "a scene on a mesh",
    {"scene": SECTIONS["scene"], "mesh": {"file": MESH_FILE, "unit": LengthUnit()}, "run": SECTIONS["run"]},
    {
        "material": {**LISTS["material"], "groups": GroupNames()},
        "source": {"name": LABEL, "group": GROUP, "heat_source": HEAT_SOURCE},
        "boundary": {"name": LABEL, "group": GROUP, **CONDITIONS},
        "probe": {key: kind for key, kind in LISTS["probe"].items() if key not in _CORNERS} | {"group": GROUP},
    },
    {"material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",)},
)
"""What a file with a [mesh] may say: groups stand in the place of boxes and corners."""
