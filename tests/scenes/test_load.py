"""Loading the sink: the built-in scene, files, overrides, and the dictionary that it can be rebuilt from."""

import json
import re
import tomllib
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import physics
from scenes.checks import DEFAULT_TOLERANCES
from scenes.errors import SceneError
from scenes.free.tables import BOXES, ON_MESH
from scenes.keys import DEVICE, SINK, TYPES
from scenes.loading import as_dict, builtin_text, distinguishes, from_dict, load
from scenes.model import Material
from scenes.schema import nest
from scenes.sink import Sink

CHANGED = {
    "sink.length": "800 um", "sink.width": "80 um", "sink.thickness": "3 um",
    "anchor.pad_length": "200 um", "anchor.pad_width": "180 um", "anchor.oxide_length": "60 um",
    "anchor.oxide_width": "40 um", "anchor.oxide_thickness": "1 um", "anchor.oxide_offset": "10 um",
    "anchor.contact_resistance": "perfect",
    "materials.silicon.thermal_conductivity": 148, "materials.silicon.density": "2.3 g/cm3",
    "materials.silicon.specific_heat": 700, "materials.silicon.resistivity": "1e-2 ohm cm",
    "materials.silicon.temperature_coefficient": "1000 ppm/K", "materials.silicon.reference_temperature": "20 degC",
    "materials.oxide.thermal_conductivity": 1.1, "materials.oxide.density": 2100,
    "materials.oxide.specific_heat": 1000, "materials.oxide.resistivity": "1e13 ohm m",
    "materials.oxide.temperature_coefficient": 1e-3, "materials.oxide.reference_temperature": 300,
    "substrate.thickness": "0.4 mm", "substrate.length": "4 mm", "substrate.width": "2 mm",
    "materials.substrate.thermal_conductivity": 148, "materials.substrate.density": "2.3 g/cm3",
    "materials.substrate.specific_heat": 700, "materials.substrate.resistivity": "1e-2 ohm cm",
    "materials.substrate.temperature_coefficient": "1000 ppm/K", "materials.substrate.valid_to": "1000 degC",
    "materials.substrate.reference_temperature": "20 degC",
    "materials.silicon.valid_to": "1000 degC", "materials.oxide.valid_to": "unknown",
    "drive.voltage": "-2.5 V", "drive.current": "none", "drive.series_resistance": "20 ohm",
    "drive.electrodes": "pad-edge",
    "environment.room_temperature": "27 degC", "environment.convection_coefficient": 12,
    "environment.gap_gas_conductivity": "0.03 W/(m K)", "environment.emissivity": 0.5,
    "run.end_time": "5 ms", "run.accuracy": "0.2 %",
    "sink.spans": 1, "sink.island_length": "30 um",
    "scene.name": "mine", "checks.tolerances": {"eq12": "1 %"}, "checks.expect_differs": ["eq14"],
    "inputs.uncertainties": {"sink.width": "1 %"},
}  # fmt: skip
EXPECTED = Sink(
    length=800e-6, width=80e-6, thickness=3e-6, spans=1, island_length=30e-6,
    pad_length=200e-6, pad_width=180e-6, oxide_length=60e-6, oxide_width=40e-6,
    oxide_thickness=1e-6, oxide_offset=10e-6, contact_resistance=None,
    silicon=Material("silicon", 148.0, 2300.0, 700.0, 1e-4, 1e-3, 293.15, 1273.15),
    oxide=Material("oxide", 1.1, 2100.0, 1000.0, None, 1e-3, 300.0),
    substrate_thickness=4e-4, substrate_length=4e-3, substrate_width=2e-3,
    substrate=Material("substrate", 148.0, 2300.0, 700.0, None, 1e-3, 293.15, 1273.15),
    voltage=-2.5, series_resistance=20.0, electrodes="pad-edge", room_temperature=300.15, convection_coefficient=12.0,
    gap_gas_conductivity=0.03, emissivity=0.5,
    end_time=5e-3, accuracy=2e-3, name="mine", tolerances={"eq12": 0.01}, expected_to_differ=("eq14",),
    uncertainties={"sink.width": 0.01},
)  # fmt: skip


def write(folder, text, name="my-sink.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


CONDUCTIVITY = "materials.silicon.electrical_conductivity"
"""A key beside the resistivity, in whose place it may stand."""


def test_the_built_in_sink_is_the_default_one():
    sink = load("sink")
    assert replace(sink, expected_to_differ=None) == Sink()
    assert sink.expected_to_differ == ("eq14", "eq18", "fig4", "fig6_peak", "fig6_end", "fig7_current")
    assert sink.anchor_distance == pytest.approx(50e-6, rel=1e-12)


def test_the_built_in_file_shows_every_key():
    stated = SINK.schema.flatten(tomllib.loads(builtin_text("sink")))
    shown_as_comments = set(SINK.schema.paths) - set(stated) - {CONDUCTIVITY}
    assert shown_as_comments == {"anchor.oxide_offset", "sink.island_length", "checks.tolerances"}
    for path in shown_as_comments:
        assert f"\n# {path.rpartition('.')[2]} = " in builtin_text("sink")


def test_the_comments_of_the_built_in_file_are_true(tmp_path):
    for section, key in (("anchor", "oxide_offset"), ("sink", "island_length"), ("checks", "tolerances")):
        line = next(x for x in builtin_text("sink").splitlines() if x.startswith(f"# {key}"))
        assert load(write(tmp_path, f"[{section}]\n{line[2:]}\n")) != Sink(name="my-sink")
    assert (DEFAULT_TOLERANCES["eq12"], DEFAULT_TOLERANCES["fig5"], DEFAULT_TOLERANCES["energy"]) == (0.02, 0.05, 1e-8)


def test_every_name_of_a_built_in_scene_has_its_text():
    for name in TYPES:
        assert tomllib.loads(builtin_text(name))["scene"]["name"] == name


def test_every_key_reaches_its_own_attribute():
    assert set(CHANGED) | {CONDUCTIVITY} == set(SINK.schema.paths)
    assert from_dict(nest(CHANGED)) == EXPECTED


def test_what_a_file_says(tmp_path):
    assert load(write(tmp_path, "")) == Sink(name="my-sink")
    assert load(write(tmp_path, "", "odd: (2).toml")).name == "odd_ _2_"
    assert load(write(tmp_path, "[scene]\nname = 'other'\n")).name == "other"
    assert load(write(tmp_path, builtin_text("sink"), "copy.toml")) == load("sink")
    # A byte order mark is no part of the text.
    assert load(write(tmp_path, "\ufeff[drive]\nvoltage = 2\n")).voltage == 2.0
    path = write(tmp_path, '[sink]\nwidth = "50 um"\nlength = 9e-4\n')
    sink = load(str(path), ["sink.width=20um"])
    assert (sink.width, sink.length, sink.thickness) == (20e-6, 9e-4, 2e-6)


@pytest.mark.parametrize(("setting", "attribute", "value"), [
    ("sink.width=20um", "width", 20e-6), ("sink.width = 20 um", "width", 20e-6), ('width="20 um"', "width", 20e-6),
    ("width=2e-5", "width", 20e-6), ("length=800um", "length", 800e-6), ("voltage=2", "voltage", 2.0),
    ("voltage=.5", "voltage", 0.5), ("voltage=-3 V", "voltage", -3.0),
    ("electrodes=pad-edge", "electrodes", "pad-edge"),
    ("contact_resistance=2e-7 m2 K/W", "contact_resistance", 2e-7),
    ("oxide_offset=centred", "oxide_offset", None), ("oxide_offset=0", "oxide_offset", 0.0),
    ("tolerances.eq12=5 %", "tolerances", {"eq12": 0.05}), ("room_temperature=20 degC", "room_temperature", 293.15),
    ("checks.tolerances={eq12 = 0.1, fig4 = 0.2}", "tolerances", {"eq12": 0.1, "fig4": 0.2}),
    ('expect_differs=["eq14", "eq14", "eq18"]', "expected_to_differ", ("eq14", "eq18")),
    ("expect_differs=eq14, eq18", "expected_to_differ", ("eq14", "eq18")),
    ("expect_differs=[]", "expected_to_differ", ()), ("expect_differs=undeclared", "expected_to_differ", None),
])  # fmt: skip
def test_an_override_sets_one_key(setting, attribute, value):
    sink = load("sink", [setting])
    assert getattr(sink, attribute) == value
    assert replace(sink, **{"expected_to_differ": None, attribute: getattr(Sink(), attribute)}) == Sink()


def test_the_tail_of_a_path_is_enough_a_later_override_wins_and_tolerances_add_up():
    denser = load("sink", ["silicon.density=3000"])
    assert (denser.silicon.density, denser.oxide.density) == (3000.0, 2200.0)
    assert load("sink", ["voltage=2", "drive.voltage=3"]).voltage == 3.0
    assert load("sink", ["tolerances.eq12=1", "tolerances.eq13=2"]).tolerances == {"eq12": 1.0, "eq13": 2.0}


@pytest.mark.parametrize(
    "settings", [["drive.voltage=1", "current=3mA"], ["current=3mA", "voltage=2"], ["current=3mA", "drive={voltage=1}"]]
)
def test_a_voltage_that_is_set_beside_a_given_current_is_refused_also_the_one_that_is_there_anyway(settings):
    with pytest.raises(SceneError, match=r"^drive\.voltage .* give one of them"):
        load("sink", settings)
    assert load("sink", ["voltage=1", "current=none"]).current is None
    assert load("sink", ["current=3mA"]).voltage == 1.0


def test_expectations_hold_only_for_the_scene_that_declares_them(tmp_path):
    declared = load("sink").expected_to_differ
    assert load("sink", ["accuracy=1e-4", "name=mine", "tolerances.eq12=0.1"]).expected_to_differ == declared
    assert load("sink", ["voltage=1 V", "oxide_offset=centred"]).expected_to_differ == declared
    assert load("sink", ["voltage=2"]).expected_to_differ is None
    assert load("sink", ["silicon.density=1000"]).expected_to_differ is None
    assert load("sink", ["voltage=2", "expect_differs=eq18"]).expected_to_differ == ("eq18",)
    path = write(tmp_path, '[sink]\nwidth = "20 um"\n[checks]\nexpect_differs = ["eq13"]\n')
    assert load(path).expected_to_differ == ("eq13",)
    assert load(path, ["width=30um"]).expected_to_differ is None
    assert load(write(tmp_path, "[checks]\ntolerances = {eq12 = 1}\n")).expected_to_differ is None


def test_a_declared_tolerance_is_told_from_a_default():
    sink = load("sink", ["tolerances.eq12=0.5"])
    assert sink.tolerances == {"eq12": 0.5}
    assert (sink.tolerance("eq12"), sink.tolerance("eq13")) == (0.5, 0.02)
    with pytest.raises(KeyError):
        sink.tolerance("eq99")


@pytest.mark.parametrize("sink", [Sink(), EXPECTED, load("sink"), Sink(voltage=2, length=1)], ids=range(4))
def test_the_dictionary_survives_json_and_rebuilds_an_equal_sink(sink):
    assert from_dict(json.loads(json.dumps(as_dict(sink), allow_nan=False))) == sink


def test_the_dictionary_holds_every_key_in_si():
    assert set(SINK.schema.flatten(as_dict(Sink()))) | {CONDUCTIVITY} == set(SINK.schema.paths)
    assert as_dict(Sink())["anchor"]["pad_width"] == 150e-6


SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,79}")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ([], "1V"),
        (["voltage=2", "width=20um"], "2V-width20um"),
        (["voltage=-0.5"], "minus500mV"),
        (["electrodes=pad-edge"], "1V-pad-edge"),
        (["oxide_offset=10um", "end_time=5 ms"], "1V-oxide_offset10um-end_time5ms"),
        (["silicon.resistivity=1e-4 ohm m"], "1V-silicon_resistivity0.0001"),
        (["accuracy=1e-4"], "1V-accuracy0.0001"),
        (["room_temperature=300"], "1V-room_temperature300K"),
        (["name=other", "tolerances.eq12=1"], "1V"),
    ],
)
def test_it_says_what_differs(settings, text):
    assert distinguishes(load("sink", settings)) == text


def test_every_key_but_name_and_checks_counts():
    for path in CHANGED:
        nothing = "anchor.contact", "materials.oxide.resistivity", "materials.substrate.resistivity", "drive.current"
        if not path.startswith(("scene.", "checks.", "inputs.", *nothing)):
            others = ["substrate.thickness=1mm", "substrate.length=9mm"] * path.startswith("substrate.")
            one = load("sink", [*others, f"{path}={3 if path == 'sink.spans' else CHANGED[path]}"])
            assert distinguishes(one) not in (distinguishes(load("sink", others)), ""), path


def test_a_long_text_is_cut_and_still_distinguishes():
    one, other = distinguishes(EXPECTED), distinguishes(replace(EXPECTED, accuracy=3e-3))
    assert SAFE.fullmatch(one)
    assert len(one) == len(other) == 80
    assert one != other


@settings(deadline=None)
@given(st.floats(1e-9, 1.0), st.floats(1e-9, 1.0))
def test_different_sizes_have_different_safe_texts(a, b):
    one, other = distinguishes(Sink(width=a)), distinguishes(Sink(width=b))
    assert SAFE.fullmatch(one)
    assert (one == other) == (a == b)


@pytest.mark.parametrize(("kelvin", "said"), [(20.0, "-253.1 degC"), (77.0, "")])
def test_degrees_without_their_unit_are_remarked_on(kelvin, said):
    remarks = physics.frozen(Sink(room_temperature=kelvin).scene())
    assert [said in remark for remark in remarks] == [True] * bool(said)


@pytest.mark.parametrize("schema", [SINK.schema, DEVICE.schema, BOXES, ON_MESH], ids=lambda schema: schema.called)
def test_every_key_says_what_it_takes(schema):
    kinds = [key.kind for key in schema.paths.values()] + [
        kind for table in schema.lists.values() for kind in table.values()
    ]
    assert all(kind.form.strip() for kind in kinds)
