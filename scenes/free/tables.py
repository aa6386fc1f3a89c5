"""The tables that the file of a free scene may have, and the keys of each.

The bounds are wide, for textbook cases have unreal round numbers; a value outside is a slip of the
unit.
"""

from __future__ import annotations

from scenes import functions as ck
from scenes import kinds as k
from scenes import model as m
from scenes import units as d
from scenes.checks import Differing, tolerances
from scenes.functions import Following
from scenes.keys import ACCURACY, VALID_TO
from scenes.schema import Key, Schema

UNUSED = 1.0
"""The value of a material's property that the scene does not need and the file does not give."""
TOTALS = (*m.FLOWS, *m.DERIVED)
"""Quantities that are totals over a surface or volume: no mean, maximum or minimum of them."""
RESISTANCES = ("thermal_resistance", "electrical_resistance")

POINT = k.Place(k.Quantity(d.LENGTH, 0.0, 1e4, signed=True))

CONDITIONS: dict[str, ck.Varying | ck.Surroundings] = {
    "temperature": ck.Varying(k.KELVIN),
    "heat_flux": ck.Varying(k.Quantity(d.HEAT_FLUX, 0.0, 1e15, signed=True)),
    "convection": ck.Surroundings(
        "coefficient",
        k.Quantity(d.CONVECTION_COEFFICIENT, 0.0, 1e12),
        ck.Varying(k.KELVIN),
        '"10 W/(m2 K)"',
        Following(k.Quantity(d.CONVECTION_COEFFICIENT, 1e-9, 1e12)),
    ),
    "radiation": ck.Surroundings("emissivity", k.Quantity(d.NUMBER, 1e-6, 1.0), k.KELVIN, "0.8"),
    "voltage": ck.Varying(k.Quantity(d.VOLTAGE, 0.0, 1e6, signed=True)),
    "current": ck.Varying(k.Quantity(d.CURRENT, 0.0, 1e6, signed=True)),
}
"""A boundary has one of these, or a convection and radiation."""
RADIATION = " radiation"
"""The radiation beside a convection becomes a boundary of its own, whose name ends so."""
SERIES = k.Quantity(d.RESISTANCE, 1e-9, 1e15)
"""The series resistance of a voltage; a larger one is a given current."""

# The least are found at interfaces within a crystal, or of metals in one another (kapitza resistances are from 1e-9
# m2 K/W on, contacts of silicides from 1e-13 ohm m2 on), far below; the largest pass nothing that matters.
_PERFECT = ", or 0 for a perfect contact"
HEAT_CONTACT = k.Quantity(d.THERMAL_CONTACT, 1e-12, 1e6, note=_PERFECT)
CURRENT_CONTACT = k.Quantity(d.ELECTRICAL_CONTACT, 1e-18, 1e6, note=_PERFECT)
CONTACT_RESISTANCE = ck.ContactResistance((HEAT_CONTACT, CURRENT_CONTACT))
"""The key beside a boundary's temperature or voltage."""
RESISTIVITY = Following(k.Quantity(d.RESISTIVITY, 1e-12, 1e9, word="insulator"), axes=True, proportional=True)
CONDUCTIVITY = Following(k.Quantity(d.ELECTRICAL_CONDUCTIVITY, 1e-9, 1e12), axes=True, proportional=True)
HEAT_SOURCE = ck.Varying(k.Quantity(d.HEAT_SOURCE, 0.0, 1e20, signed=True))


_NAMED = k.Numbers(k.NUMBER_OR_TEXT, (), "parameter", 'a table such as {R0 = "300 ohm"}')
_NAMED_TEXTS = k.Numbers(k.MODEL_FILE, (), "probe", 'a table such as {middle = "v(mid)"}')

_SCENE_AND_RUN = (
    Key("scene.name", "name", k.NAME),
    Key("scene.initial_temperature", "initial_temperature", k.KELVIN),
    Key("run.steady", "steady", k.SWITCH),
    Key("run.end_time", "end_time", k.Quantity(d.TIME, 1e-12, 1e9)),
    Key("run.output_times", "output_times", k.OUTPUT_TIMES),
    Key("run.accuracy", "accuracy", ACCURACY),
    Key("run.memory", "memory", k.MEMORY, physical=False),
    Key("model.file", "model.file", k.MODEL_FILE, physical=False),
    Key("model.parameters", "model.parameters", _NAMED, physical=False),
    Key("model.outputs", "model.outputs", _NAMED_TEXTS, physical=False),
    Key("checks.tolerances", "tolerances", tolerances(()), physical=False),
    Key("checks.expect_differs", "expected_to_differ", Differing(()), physical=False),
)

LISTS: dict[str, dict[str, k.Kind]] = {
    "material": {
        "name": k.LABEL,
        "thermal_conductivity": Following(k.Quantity(d.THERMAL_CONDUCTIVITY, 1e-9, 1e9), axes=True),
        "density": k.Quantity(d.DENSITY, 1e-6, 1e9),
        "specific_heat": Following(k.Quantity(d.SPECIFIC_HEAT, 1e-6, 1e9)),
        "resistivity": RESISTIVITY,
        "electrical_conductivity": CONDUCTIVITY,
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
    "boundary": {
        "name": k.LABEL,
        "lower": POINT,
        "upper": POINT,
        **CONDITIONS,
        "contact_resistance": CONTACT_RESISTANCE,
        "series_resistance": SERIES,
    },
    "probe": {
        "name": k.LABEL,
        "quantity": k.Choice(tuple(m.UNITS)),
        "at": POINT,
        "lower": POINT,
        "upper": POINT,
        "reduce": k.Choice(("mean", "max", "min")),
        "box": k.LABEL,
        "boxes": k.Items(k.LABEL, "boxes", '["left pad", "right pad"]'),
        "material": k.LABEL,
    },
    "contact": {
        "name": k.LABEL,
        "between": k.Items(k.LABEL, "boxes", '["a", "b"]', 2),
        "thermal_resistance": ck.ContactResistance((HEAT_CONTACT,)),
        "electrical_resistance": ck.ContactResistance((CURRENT_CONTACT,)),
    },
}
"""The tables that a file may have several of, such as [[material]]."""

REQUIRED: dict[str, tuple[str, ...]] = {
    "material": ("name",),
    "box": ("material", "lower", "upper"),
    "boundary": ("lower", "upper"),
    "probe": ("name",),
    "contact": ("between",),
}
"""Keys without a default; a box or boundary without a name is called box-1, boundary-1 and so on."""

BOXES = Schema(
    (*_SCENE_AND_RUN, Key("run.mesh", "mesh", k.Choice(("bricks", "tetrahedra")), physical=False)),
    LISTS, REQUIRED, "a free scene", "run.accuracy=1e-4",
)  # fmt: skip
"""The schema of a free scene of boxes."""

_OF_BOXES = ("lower", "upper", "box", "boxes")
ON_MESH = Schema(
    (*_SCENE_AND_RUN, Key("mesh.file", "file", k.MESH_FILE), Key("mesh.unit", "unit", k.LENGTH_UNIT)),
    {
        "material": {**LISTS["material"], "groups": k.Items(k.GROUP, "groups", '["silicon"]')},
        "source": {"name": k.LABEL, "group": k.GROUP, "heat_source": HEAT_SOURCE},
        "boundary": {
            "name": k.LABEL,
            "group": k.GROUP,
            **CONDITIONS,
            "contact_resistance": CONTACT_RESISTANCE,
            "series_resistance": SERIES,
        },
        "probe": {key: kind for key, kind in LISTS["probe"].items() if key not in _OF_BOXES}
        | {"group": k.GROUP, "groups": k.Items(k.GROUP, "groups", '["silicon"]'), "side": k.GROUP},
        "contact": {**LISTS["contact"], "between": k.Items(k.GROUP, "volume groups", '["a", "b"]', 2)},
    },
    {
        "material": ("name",), "source": ("group", "heat_source"), "boundary": ("group",), "probe": ("name",),
        "contact": ("between",),
    },
    "a scene on a mesh", "run.accuracy=1e-4",
)  # fmt: skip
"""The schema of a scene with a [mesh]: groups in place of boxes and corners."""
