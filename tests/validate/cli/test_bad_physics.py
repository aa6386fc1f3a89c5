"""Bad laws of the temperature, contacts, drives, faces and substrates, through the command: each is one sentence
with the allowed values, exit status 2, and nothing is printed or written."""

import re
import shlex
from pathlib import Path

import pytest

from validate.cli import main

BEAM = """
[[material]]
name = "metal"
thermal_conductivity = 100
resistivity = 1e-5

[[material]]
name = "oxide"
thermal_conductivity = 1

[[box]]
name = "beam"
material = "metal"
lower = [0, 0, 0]
upper = [4, 1, 1]

[[box]]
name = "foot"
material = "oxide"
lower = [0, 0, -1]
upper = [1, 1, 0]

[[box]]
name = "cap"
material = "oxide"
lower = [3, 0, 1]
upper = [4, 1, 2]

[[boundary]]
name = "base"
lower = [0, 0, -1]
upper = [1, 1, -1]
temperature = 293

[[boundary]]
name = "left"
lower = [0, 0, 0]
upper = [0, 1, 1]
voltage = 1

[[boundary]]
name = "right"
lower = [4, 0, 0]
upper = [4, 1, 1]
voltage = 0

[[probe]]
name = "tip"
at = [4, 0.5, 0.5]

[run]
steady = true
"""
K, VOLT, RIGHT = "thermal_conductivity = 100", "voltage = 1", "voltage = 0"
RHO, PROBE, BASE = "resistivity = 1e-5", "at = [4, 0.5, 0.5]", "temperature = 293"


def law(table: str) -> tuple[str, str]:
    return K, f"thermal_conductivity = {table}"


def contact(between: str, more: str = "thermal_resistance = 1e-7", name: str = "c") -> tuple[str, str]:
    return "[run]", f'[[contact]]\nname = "{name}"\nbetween = [{between}]\n{more}\n\n[run]'


def top(condition: str) -> tuple[str, str]:
    return "[run]", f'[[boundary]]\nname = "top"\nlower = [0, 0, 1]\nupper = [2, 1, 1]\n{condition}\n\n[run]'


SCENES: dict[str, tuple[tuple[tuple[str, str], ...], tuple[str, ...]]] = {
    # change of the scene, and words of the message
    "k below zero": ((law("-5"),), ('"metal".thermal_conductivity = -5 is out of range', "from 1")),
    "a power of a value below zero": (
        (law("{value = -130, at = 293, exponent = -1.3}"),),
        ("conductivity.value = -130 is out of range", "from "),
    ),
    "a table below zero at a temperature that is reached": (
        (law("{temperatures = [273, 300], values = [130, -1]}"),),
        ("values[2] = -1 is out of range", "from "),
    ),
    "a table that steps back": (
        (law("{temperatures = [300, 400, 350], values = [1, 2, 3]}"),),
        ("temperatures[3] = 350 is not above",),
    ),
    "a temperature twice": (
        (law("{temperatures = [300, 300], values = [1, 2]}"),),
        ("temperatures[2] = 300 is not above",),
    ),
    "a table of one": ((law("{temperatures = [300], values = [130]}"),), ("[300] is not a list of two or more",)),
    "an empty table": ((law("{temperatures = [], values = []}"),), ("not a list of two or more",)),
    "fewer values": ((law("{temperatures = [300, 400], values = [130]}"),), ("values = [130] is not a list of two",)),
    "more values": (
        (law("{temperatures = [300, 400], values = [1, 2, 3]}"),),
        ("2 temperatures and 3 values", "as many of each"),
    ),
    "exponent nan": (
        (law("{value = 130, at = 293, exponent = nan}"),),
        ("exponent = nan is not a finite number", "of magnitude 0 to 20"),
    ),
    "no exponent": ((law("{value = 130, at = 293}"),), ("thermal_conductivity.exponent is missing",)),
    "a power from absolute zero": (
        (law("{value = 130, at = 0, exponent = -1.3}"),),
        ("conductivity.at = 0 is out of range", "from "),
    ),
    "a power and a table": (
        (law("{value = 130, at = 293, exponent = -1, values = [1]}"),),
        ("unknown key", "value = 130: give temperatures, values"),
    ),
    "a law in volts": (
        (law('{value = "1 V", at = 293, exponent = -1}'),),
        ("is a voltage, not a thermal conductivity",),
    ),
    "[kx, ky]": ((law("[130, 60]"),), ("[130, 60] is not [x, y, z]",)),
    "a resistivity of two": (
        ((RHO, "resistivity = [1e-5, 2e-5]"),),
        ("[1e-05, 2e-05] is not [x, y, z]",),
    ),
    "a law and a coefficient": (
        ((RHO, "resistivity = {value = 1e-5, at = 293, exponent = 1}\ntemperature_coefficient = 1e-3"),),
        ("resistivity is a law of the temperature", "give one of them"),
    ),
    "contact of boxes that don't touch": (
        (contact('"foot", "cap"'),),
        ('boxes "foot" and "cap", which have no face in common', "that touch"),
    ),
    "contact twice": (
        (contact('"beam", "foot"'), contact('"foot", "beam"', name="d")),
        ('contact "c" is', "give one contact for both"),
    ),
    "contact of a box with itself": (
        (contact('"beam", "beam"'),),
        ('boxes "beam" and "beam"', "give two that touch"),
    ),
    "contact of three": ((contact('"beam", "foot", "cap"'),), ("is not a pair", 'such as ["a", "b"]')),
    "contact with nothing": ((contact('"beam", "fot"'),), ('no box "fot"', 'did you mean "foot"?')),
    "contact below zero": (
        (contact('"beam", "foot"', "thermal_resistance = -1e-7"),),
        ("thermal_resistance = -1e-07 is out of range", "from "),
    ),
    "contact without a resistance": ((contact('"beam", "foot"', ""),), ("has no resistance", "give")),
    "electrical contact of an insulator": (
        (contact('"beam", "foot"', "electrical_resistance = 1"),),
        ('box "foot", which insulates', "resistivity"),
    ),
    "contact resistance of a film": (
        ((BASE, "convection = {coefficient = 5, ambient = 293}\ncontact_resistance = 1e-7"),),
        ("contact_resistance = 1e-07 stands beside a convection",),
    ),
    "two given currents without a ground": (
        ((VOLT, 'current = "3 mA"'), (RIGHT, 'current = "-3 mA"')),
        ('"left" and "right" give currents, and no electrode of that conductor has a voltage', '"0 V"'),
    ),
    "current and voltage": (((VOLT, "voltage = 1\ncurrent = 1"),), ('"left" has voltage and current', "exactly one")),
    "series resistance below zero": (
        ((VOLT, 'voltage = 1\nseries_resistance = "-5 ohm"'),),
        ('series_resistance = "-5 ohm" is out of range', "from 1 n"),
    ),
    "series resistance of a current": (
        ((VOLT, "current = 1\nseries_resistance = 5"),),
        ("5 ohm stands beside a current",),
    ),
    "emissivity of 2": (
        (top("radiation = {emissivity = 2, ambient = 293}"),),
        ("radiation.emissivity = 2 is out of range", "to 1"),
    ),
    "emissivity of -0.1": (
        (top("radiation = {emissivity = -0.1, ambient = 293}"),),
        ("emissivity = -0.1 is out of range", "to 1"),
    ),
    "no ambient": ((top("radiation = {emissivity = 0.5}"),), ("radiation.ambient is missing", "ambient = ")),
    "ambient below absolute zero": (
        (top('radiation = {emissivity = 0.5, ambient = "-300 degC"}'),),
        ('ambient = "-300 degC" is out of range', "from "),
    ),
    "film below zero": (
        (top("convection = {coefficient = -5, ambient = 293}"),),
        ("coefficient = -5 is out of range",),
    ),
    "film's table that goes below zero": (
        (top("convection = {coefficient = {temperatures = [300, 400], values = [10, -20]}, ambient = 293}"),),
        ("convection.coefficient.values[2] = -20 is out of range", "from "),
    ),
    "film's table that steps back": (
        (top("convection = {coefficient = {temperatures = [400, 300], values = [10, 20]}, ambient = 293}"),),
        ("coefficient.temperatures[2] = 300 is not above",),
    ),
    "resistance of no electrode": (
        ((PROBE, 'quantity = "resistance"\nlower = [0, 0, -1]\nupper = [1, 1, -1]'),),
        ("asks for a resistance, and no electrode is there", '"left" and "right"'),
    ),
    "power over a point": (
        ((PROBE, f'quantity = "power"\n{PROBE}'),),
        ("asks for a power in what is no volume", "give corners"),
    ),
    "power on a face": (
        ((PROBE, 'quantity = "power"\nlower = [0, 0, 0]\nupper = [0, 1, 1]'),),
        ('probe "tip" asks for', "power", "volume"),
    ),
    "probe on a contact": (
        (contact('"beam", "foot"'), (PROBE, "at = [0.5, 0.5, 0]")),
        ('lies on contact "c"', 'box = "beam" or box = "foot"'),
    ),
}
SINKS = {
    "materials.silicon.thermal_conductivity={temperatures=[300,400],values=[130,-5]}": "values[2] = -5 is out of range",
    "materials.silicon.thermal_conductivity={temperatures=[400,300],values=[130,5]}": "[2] = 300 is not above",
    "materials.silicon.thermal_conductivity={value=130,at=293,exponent=nan}": "exponent = nan is not a finite number",
    "materials.silicon.thermal_conductivity=[130,60]": "[130, 60] is not [x, y, z]",
    "anchor.contact_resistance=-1e-7": "anchor.contact_resistance = -1e-07 is out of range",
    "anchor.contact_resistance=1ohm": "is a resistance, not a",
    "drive.series_resistance=-5": "drive.series_resistance = -5 is out of range",
    "drive.current=3V": "is a voltage, not a current",
    "drive={current=3e-3,voltage=2}": "give one of them",
    "drive={current=3e-3,series_resistance=5}": "is not solved beside drive.current",
    "environment.emissivity=2": "environment.emissivity = 2 is out of range",
    "environment.emissivity=-0.1": "environment.emissivity = -0.1 is out of range",
    "environment.gap_gas_conductivity=-0.026": "environment.gap_gas_conductivity = -0.026 is out of range",
    "substrate={thickness=0.5e-3,length=1e-3}": 'substrate.length = "1 mm"',
    "substrate={thickness=0.5e-3,width=10e-6}": 'substrate.width = "10 um"',
    "substrate.width=4mm": "substrate.thickness",
    "substrate.thickness=-1mm": 'substrate.thickness = "-1mm" is out of range',
}


def refused(command: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the sentence of the refusal."""
    before = {path.name for path in folder.iterdir()}
    assert main(shlex.split(command)) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("validate: ")
    assert err.count("\n") == 1
    assert not re.search(r"\w\. ", err)
    assert {path.name for path in folder.iterdir()} == before
    return err


@pytest.mark.parametrize("case", SCENES)
def test_a_scene_that_cannot_be_is_refused(case, tmp_path, capsys):
    changes, said = SCENES[case]
    text = BEAM
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    message = refused("solve mine.toml", tmp_path, capsys)
    for words in said:
        assert words in message


@pytest.mark.parametrize("setting", SINKS)
def test_a_sink_that_cannot_be_is_refused(setting, tmp_path, capsys):
    assert SINKS[setting] in refused(f"sink --set '{setting}'", tmp_path, capsys)


def test_what_the_bad_scenes_are_made_of_is_fine(tmp_path):
    (tmp_path / "mine.toml").write_text(BEAM, encoding="utf-8")
    assert main(["solve", "mine.toml", "--no-figures", "--quiet"]) == 0
