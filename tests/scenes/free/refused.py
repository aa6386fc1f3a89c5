"""A free scene, its refused changes, and words of the sentence for each."""

from collections.abc import Callable
from typing import Any

Document = dict[str, Any]


def beam() -> Document:
    """A conductor on a foot of oxide, heated by its current."""
    return {
        "run": {"steady": True},
        "material": [
            {"name": "metal", "thermal_conductivity": 100, "resistivity": 1e-5},
            {"name": "oxide", "thermal_conductivity": 1},
        ],
        "box": [
            {"name": "beam", "material": "metal", "lower": [0, 0, 0], "upper": [4, 1, 1]},
            {"name": "foot", "material": "oxide", "lower": [0, 0, -1], "upper": [1, 1, 0]},
        ],
        "boundary": [
            {"name": "base", "lower": [0, 0, -1], "upper": [1, 1, -1], "temperature": 293},
            {"name": "left", "lower": [0, 0, 0], "upper": [0, 1, 1], "voltage": 1},
            {"name": "right", "lower": [4, 0, 0], "upper": [4, 1, 1], "voltage": 0},
        ],
        "probe": [{"name": "tip", "at": [4, 0.5, 0.5]}],
    }


def flat(name: str, lower: list, upper: list, **condition: Any) -> Document:
    return {"name": name, "lower": lower, "upper": upper, **condition}


def add(table: str, item: Document) -> Callable[[Document], None]:
    return lambda document: document[table].append(item)


def put(table: str, number: int, **values: Any) -> Callable[[Document], None]:
    return lambda document: document[table][number].update(values)


def drop(table: str, number: int, *keys: str) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        for key in keys:
            del document[table][number][key]

    return change


def on_top(**condition: Any) -> Callable[[Document], None]:
    return add("boundary", flat("top", [0, 0, 1], [4, 1, 1], **condition))


def both(*changes: Callable[[Document], None]) -> Callable[[Document], None]:
    def change(document: Document) -> None:
        for one in changes:
            one(document)

    return change


def run(**values: Any) -> Callable[[Document], None]:
    return lambda document: document.update(run=values)


def island(**more: Any) -> Document:
    return {"name": "island", "material": "oxide", "lower": [6, 0, 0], "upper": [7, 1, 1]} | more


def joint(name: str = "c", between: list | None = None, **resistances: Any) -> Callable[[Document], None]:
    contact = {"name": name, "between": between or ["beam", "foot"], **resistances}
    return lambda document: document.setdefault("contact", []).append(contact)


LID = {"lower": [0, 0, 1], "upper": [4, 1, 1]}
AIR = {"coefficient": 5, "ambient": 300}
MEETING = add("boundary", flat("side", [0, 0, -1], [0, 1, -0.5], temperature=300))

REFUSED: dict[str, tuple[Callable[[Document], None], tuple[str, ...]]] = {
    "two given currents": (
        both(drop("boundary", 1, "voltage"), drop("boundary", 2, "voltage"), put("boundary", 1, current="3 mA"),
             put("boundary", 2, current="-3 mA")),
        ('a current is given at "left" and "right"', "no electrode of that conductor has a voltage", '"0 V"'),
    ),
    "a current in volts": (
        both(drop("boundary", 1, "voltage"), put("boundary", 1, current="3 V")),
        ('boundary "left".current = "3 V"', "a voltage, not a current", '"3 mA"'),
    ),
    "a voltage and a current": (put("boundary", 1, current=1), ("has voltage and current", "exactly one")),
    "resistance and current": (
        both(drop("boundary", 1, "voltage"), put("boundary", 1, current=1, series_resistance=5)),
        ('boundary "left".series_resistance = 5 ohm stands beside a current', "beside a voltage"),
    ),
    "resistance of a film": (
        put("boundary", 0, series_resistance=5), ("series_resistance = 5 ohm stands beside a temperature",),
    ),
    "no series resistance": (
        put("boundary", 1, series_resistance=0), ('"left".series_resistance = 0 is out of range', "from 1 nohm"),
    ),
    "a resistance in volts": (
        put("boundary", 1, series_resistance="5 V"), ("a voltage, not a resistance", '"100 ohm"'),
    ),
    "a current beside a voltage": (
        add("boundary", flat("top", [0, 0, 1], [1, 1, 1], current=1)),
        ('boundaries "left" and "top" touch on a conductor', "potential of one is not given", "leave a gap"),
    ),
    "a current into an insulator": (
        add("boundary", flat("foot", [0.2, 0, -1], [0.2, 1, -0.5], current=1)), ("touches nothing that conducts",),
    ),
    "unknown table": (lambda d: d.update(boxes=[]), ("unknown key boxes", 'did you mean "box"?')),
    "unknown key": (put("boundary", 1, voltge=1), ('boundary "left".voltge = 1', 'did you mean "voltage"?')),
    "single bracket": (lambda d: d.update(box=d["box"][0]), ("box must be a list of tables", "[[box]]")),
    "no boxes": (lambda d: d.update(box=[]), ("no [[box]]",)),
    "wrong unit": (put("boundary", 1, voltage="2 um"),
        ('boundary "left".voltage = "2 um" is a length, not a voltage',)),
    "unnamed boundary": (both(drop("boundary", 1, "name"), put("boundary", 1, voltage="x")),
        ("boundary[2].voltage = ",)),
    "flux in volts": (both(drop("boundary", 1, "voltage"), put("boundary", 1, heat_flux="2 V")),
        ("not a heat flux", "100 W/m2")),
    "not a point": (put("box", 0, lower=[0, 0]), ('box "beam".lower = [0, 0] does not fit: give a list of 3',)),
    "bad coordinate": (put("box", 0, lower=[0, 0, "1 s"]), ('box "beam".lower[z] = "1 s" is a time',)),
    "no upper": (drop("box", 0, "upper"), ('box "beam".upper is missing',)),
    "flat box": (put("box", 0, upper=[4, 1, 0]), ('box "beam" has no extent, z from 0 m to 0 m',)),
    "negative box": (put("box", 0, upper=[4, 1, -2]), ('box "beam" has a negative extent, z',)),
    "sliver": (put("box", 1, upper=[1e-9, 1, 0]), ('box "foot" has no extent, x',)),
    "unknown material": (put("box", 0, material="metl"), ('box "beam".material', '"metl"', 'did you mean "metal"?')),
    "two of a name": (put("box", 1, name="beam"), ('box[2].name = "beam" is taken',)),
    "two materials": (put("material", 1, name="metal"), ('material[2].name = "metal" is taken',)),
    "bad name": (put("probe", 0, name="a,b"), ('"a,b" is not a name',)),
    "name of the times": (put("probe", 0, name="time_s"), ("the column of times",)),
    "covered box": (add("box", {"name": "all", "material": "metal", "lower": [0, 0, -1], "upper": [1, 1, 0]}),
        ('box "foot" is entirely covered',)),
    "no conductivity": (drop("material", 1, "thermal_conductivity"),
        ('material "oxide".thermal_conductivity is missing',)),
    "no capacity": (run(end_time=1), ('material "metal".density is missing', "specific_heat")),
    "negative resistivity": (put("material", 0, temperature_coefficient=0.1, reference_temperature=350),
        ('material "metal".temperature_coefficient', "scene.initial_temperature = 293 K", "above 0")),
    "not flat": (put("boundary", 1, upper=[1, 1, 1]), ('boundary "left" is not flat',)),
    "no condition": (drop("boundary", 1, "voltage"), ('boundary "left" has no condition', "heat_flux")),
    "two conditions": (put("boundary", 1, temperature=1), ('boundary "left" has temperature and voltage',)),
    "in the air": (put("boundary", 1, lower=[-1, 0, 0], upper=[-1, 1, 1]), ('boundary "left" touches no solid',)),
    "touches an edge": (put("boundary", 1, lower=[0, 1, 0], upper=[0, 2, 1]), ('boundary "left" touches no solid',)),
    "buried flux": (add("boundary", flat("in", [0, 0, 0], [1, 1, 0], heat_flux=1)),
        ('boundary "in".heat_flux has solid on both sides', "exposed")),
    "buried convection": (add("boundary", flat("in", [2, 0, 0], [2, 1, 1], convection=AIR)),
        ('boundary "in".convection has solid',)),
    "varying coefficient": (
        add("boundary", {"name": "air", **LID, "convection": {"coefficient": {"times": [0], "values": [1]},
                                                              "ambient": 1}}),
        ('unknown key boundary "air".convection.coefficient.times = [0]',),
    ),
    "schedule of 2,001 points": (
        put("boundary", 1, voltage={"times": [n / 1e3 for n in range(2001)], "values": [1] * 2001}),
        ('boundary "left".voltage.times has 2001 times: give at most 2000',),
    ),
    "10,001 output times": (run(output_times=[n / 1e3 for n in range(10_001)]),
        ("run.output_times has 10001 times: give at most 10000",)),
    "no ambient": (add("boundary", {"name": "air", **LID, "convection": {"coefficient": 1}}),
        ("convection.ambient is missing",)),
    "electrode on oxide": (add("boundary", flat("low", [0, 0, -1], [1, 1, -1], voltage=1)),
        ('boundary "low".voltage touches nothing that',)),
    "electrodes at an edge": (add("boundary", flat("top", [0, 0, 1], [1, 1, 1], voltage=2)),
        ('"left" and "top" touch', "1 V and 2 V")),
    "electrodes over one another": (add("boundary", flat("again", [0, 0.5, 0], [0, 1, 1], voltage=2)),
        ('"left" and "again" touch',)),
    "flux into a fixed temperature": (add("boundary", flat("in", [0, 0, -1], [0.5, 1, -1], heat_flux=1)),
        ('boundary "in".heat_flux lies where other boundaries fix the temperature',)),
    "two temperatures": (add("boundary", flat("warm", [0.5, 0, -1], [2, 1, -1], temperature=300)),
        ('"base" and "warm" overlap', "300 K")),
    "probe outside": (put("probe", 0, at=[2, 0.5, -0.5]), ('"tip" lies outside the solid', "at [2.0, 0.5, -0.5]")),
    "probe half outside": (both(drop("probe", 0, "at"), put("probe", 0, lower=[0, 0, -1], upper=[4, 1, 1])),
        ('probe "tip" reaches outside the solid',)),
    "probe nowhere": (drop("probe", 0, "at"), ('probe "tip" has no place', "give at or lower and upper")),
    "probe twice": (put("probe", 0, lower=[0, 0, 0]), ('probe "tip" has at and lower',)),
    "flow at a point": (put("probe", 0, quantity="heat_flow"),
        ('probe "tip" asks for a heat flow through what is not',)),
    "largest current": (put("probe", 0, quantity="current", reduce="max"), ('probe "tip".reduce = "max"',)),
    "current in oxide": (add("probe", flat("i", [0, 0, -0.5], [1, 1, -0.5], quantity="current")),
        ('probe "i" asks for a current where',)),
    "flow in the air": (add("probe", flat("q", [2, 0, -0.5], [3, 1, -0.5], quantity="heat_flow")),
        ('probe "q" lies outside',)),
    "potential in oxide": (put("probe", 0, quantity="potential", at=[0.5, 0.5, -0.5]),
        ('probe "tip" asks for the potential where',)),
    "flow both ways": (
        both(add("boundary", {"name": "air", **LID, "convection": AIR}),
             add("box", {"name": "knob", "material": "oxide", "lower": [0, 0, 1], "upper": [1, 1, 2]}),
             add("probe", {"name": "up", **LID, "quantity": "heat_flow"})),
        ('probe "up" lies partly inside the solid', 'boundary "air"'),
    ),
    "heat through one of two temperatures that meet": (
        both(MEETING, add("probe", flat("in", [0, 0, -1], [1, 1, -1], quantity="heat_flow"))),
        ('probe "in" reaches the edge', 'boundaries "base" and "side"', "leave a gap"),
    ),
    "heat through a section that ends where two temperatures meet": (
        both(put("boundary", 0, upper=[0.5, 1, -1]),
             add("boundary", flat("side", [0.5, 0, -1], [1, 1, -1], temperature=300)),
             add("probe", flat("in", [0.5, 0, -1], [0.5, 1, 0], quantity="heat_flow"))),
        ('probe "in" reaches the edge', 'boundaries "base" and "side"'),
    ),
    "potential of a floating conductor": (
        both(add("box", {"name": "lead", "material": "metal", "lower": [0, 0, -2], "upper": [1, 1, -1]}),
             add("probe", {"name": "v", "quantity": "potential", "at": [0.5, 0.5, -1.5]})),
        ('probe "v" asks for a potential in a conductor that no electrode touches', "no electrode touches"),
    ),
    "floating": (add("box", island()), ('no boundary and no heat source acts on "island"',)),
    "touches with an edge": (
        add("box", {"name": "corner", "material": "oxide", "lower": [4, 1, 0], "upper": [5, 2, 1]}),
        ('no boundary and no heat source acts on "corner"',),
    ),
    "no exit": (add("box", island(heat_source=1)), ('without an exit for heat from "island"',)),
    "no exit at all": (put("boundary", 0, lower=[1, 1, 0], upper=[1, 1, 0]), ('boundary "base" is not flat',)),
    "convection of zero": (
        both(drop("boundary", 0, "temperature"), put("boundary", 0, convection={"coefficient": 0, "ambient": 300})),
        ('without an exit for heat from "beam" and "foot"',),
    ),
    "nearly touching": (
        both(put("box", 0, upper=[2, 1, 1]), add("box", island(material="metal", lower=[2.01, 0, 0], upper=[4, 1, 1]))),
        ("without an exit for heat", 'boxes "beam" and "island" are 10.0 mm apart along x', "let their faces coincide"),
    ),
    "nothing happens": (put("boundary", 1, voltage=0), ("nothing happens", "no voltage across a conductor")),
    "nothing is fed": (both(drop("boundary", 1, "voltage"), put("boundary", 1, current=0)), ("nothing happens",)),
    "no time": (run(), ("neither how long nor steady",)),
    "steady for a time": (run(steady=True, end_time=1), ("run.steady = true and run.end_time",)),
    "steady at times": (run(steady=True, output_times=[1]), ("run.steady = true and run.output_times",)),
    "times after the end": (run(end_time=1, output_times=[2]), ("run.end_time = 1 s is before",)),
    "steady and varying": (put("boundary", 1, voltage={"times": [0, 1], "values": [0, 1]}),
        ('boundary "left".voltage varies in time', "run.end_time")),
    "lists of two lengths": (put("box", 0, heat_source={"times": [0, 1], "values": [0]}),
        ('box "beam".heat_source has 2 times and 1 values',)),
    "decreasing times": (put("box", 0, heat_source={"times": [1, 0], "values": [0, 1]}),
        ('box "beam".heat_source.times[2] = 0',)),
    "no values": (put("box", 0, heat_source={"times": [1]}), ('box "beam".heat_source.values is missing',)),
    "emissivity of two": (on_top(radiation={"emissivity": 2, "ambient": 293}),
        ('boundary "top".radiation.emissivity = 2 is out of range', "to 1")),
    "radiation to nowhere": (on_top(radiation={"emissivity": 0.5}),
        ('boundary "top".radiation.ambient is missing', '{emissivity = 0.8, ambient = "293 K"}')),
    "radiation to less than nothing": (on_top(radiation={"emissivity": 0.5, "ambient": "-300 degC"}),
        ('ambient = "-300 degC" = -26.85 K is out of range',)),
    "film below zero": (on_top(convection={"coefficient": -5, "ambient": 293}), ("coefficient = -5 is out of range",)),
    "radiation to what varies": (on_top(
        radiation={"emissivity": 0.5, "ambient": {"times": [0, 1], "values": [293, 400]}}),
        ('boundary "top".radiation.ambient = {times = [0, 1], values = [293, 400]} is not a temperature',)),
    "radiation beside a temperature": (put("boundary", 0, radiation={"emissivity": 0.5, "ambient": 293}),
        ('boundary "base" has temperature and radiation', "convection and radiation go together")),
    "film that steps back": (on_top(
        convection={"coefficient": {"temperatures": [400, 300], "values": [10, 20]}, "ambient": 293}),
        ('boundary "top".convection.coefficient.temperatures[2] = 300 is not above',)),
    "film of nothing": (on_top(
        convection={"coefficient": {"temperatures": [300, 400], "values": [0, 20]}, "ambient": 293}),
        ('boundary "top".convection.coefficient.values[1] = 0 is out of range',)),
    "contact beside a film": (both(drop("boundary", 0, "temperature"),
        put("boundary", 0, convection=AIR, contact_resistance=1e-7)),
        ('boundary "base".contact_resistance = 1e-07 stands beside a convection', "temperature or a voltage")),
    "electrical contact of a temperature": (put("boundary", 0, contact_resistance="1e-12 ohm m2"),
        ('boundary "base".contact_resistance = "1e-12 ohm m2" is an electrical contact resistance, not a thermal',)),
    "negative contact": (put("boundary", 0, contact_resistance=-1e-7),
        ('boundary "base".contact_resistance = -1e-07 is out of range', "or 0 for a perfect contact")),
    "contact in kelvin": (put("boundary", 0, contact_resistance="2 K"),
        ("is a temperature, not a thermal contact resistance",)),
    "contact inside": (put("boundary", 0, lower=[0, 0, 0], upper=[1, 1, 0], contact_resistance=1e-7),
        ('boundary "base".temperature behind a contact_resistance has solid on both sides',)),
    "thermal contact of a voltage": (put("boundary", 1, contact_resistance="1e-7 m2 K/W"),
        ('boundary "left".contact_resistance = "1e-7 m2 K/W" is a thermal contact resistance, not an electrical',)),
    "electrode inside behind a contact": (put("boundary", 1, lower=[2, 0, 0], upper=[2, 1, 1], contact_resistance=1),
        ('boundary "left".voltage behind a contact_resistance has conductors on both sides',)),
    "contact without a resistance": (joint(), ('contact "c" has no resistance', "thermal_resistance")),
    "contact of one box": (joint(between=["beam"], thermal_resistance=1),
        ('contact "c".between = ["beam"] does not fit: give a list of 2',)),
    "contact of three": (joint(between=["beam", "foot", "cap"], thermal_resistance=1), ("give a list of 2",)),
    "contact of an unknown box": (joint(between=["beam", "fot"], thermal_resistance=1),
        ('contact "c".between names no box "fot"', 'did you mean "foot"?')),
    "contact of a box with itself": (joint(between=["beam", "beam"], thermal_resistance=1),
        ('contact "c" is between box "beam" and box "beam", which have cells in common',)),
    "contact twice": (both(joint(thermal_resistance=1), joint("d", ["foot", "beam"], thermal_resistance=1)),
        ('contact "d" is between box "foot" and box "beam", as contact "c" is',)),
    "contact of two that are apart": (both(add("box", island()),
        joint(between=["beam", "island"], thermal_resistance=1),
        add("boundary", flat("far", [7, 0, 0], [7, 1, 1], temperature=300))),
        ('contact "c" is between box "beam" and box "island", which have no face in common',)),
    "contact of an insulator": (joint(electrical_resistance=1),
        ('contact "c".electrical_resistance is one with box "foot", which insulates',)),
    "negative resistance": (joint(thermal_resistance=-1), ('contact "c".thermal_resistance = -1 is out of range',)),
    "a current's resistance for heat": (joint(thermal_resistance="1e-12 ohm m2"),
        ('contact "c".thermal_resistance = "1e-12 ohm m2" is an electrical contact resistance, not a thermal',)),
    "probe on a contact": (both(joint(thermal_resistance=1), put("probe", 0, at=[0.5, 0.5, 0])),
        ('probe "tip" lies on contact "c", where the temperature jumps', 'box = "beam" or box = "foot"')),
    "face probe partly on a contact": (both(joint(thermal_resistance=1), drop("probe", 0, "at"),
        put("probe", 0, lower=[0, 0, 0], upper=[2, 1, 0])), ('probe "tip" lies on contact "c"',)),
    "probe of an unknown box": (put("probe", 0, box="bem"), ('probe "tip".box is no box: "bem"', 'mean "beam"?')),
    "probe away from its box": (put("probe", 0, box="foot"), ("isn't everywhere at the probe",)),
    "flow of a box": (both(drop("probe", 0, "at"), put("probe", 0, lower=[0, 0, -1], upper=[1, 1, -1], box="foot",
        quantity="heat_flow")), ('probe "tip".box = "foot" says nothing about a heat_flow',)),
    "temperature on a contact": (both(joint(thermal_resistance=1),
        add("boundary", flat("inside", [0, 0, 0], [1, 1, 0], temperature=300))),
        ('boundary "inside".temperature lies on contact "c"',)),
    "value of values": (put("box", 0, heat_source={"times": [1], "values": ["1 V"]}),
        ('heat_source.values[1] = "1 V" is a voltage',)),
}  # fmt: skip
