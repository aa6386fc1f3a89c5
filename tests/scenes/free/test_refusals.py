"""Bad free scenes: each is refused in one sentence that names the part, and its twin that is fine is not."""

from collections.abc import Callable

import pytest

from scenes.errors import SceneError
from scenes.free import from_dict
from scenes.loading import load_free as load
from tests.scenes.free.refused import AIR, MEETING, REFUSED, Document, add, beam, both, flat, island, joint, put
from tests.scenes.test_refusals import refusal


@pytest.mark.parametrize("case", REFUSED)
def test_refused_in_one_sentence(case):
    change, said = REFUSED[case]
    document = beam()
    change(document)
    message = refusal(from_dict, document)
    for words in said:
        assert words in message


ALLOWED: dict[str, Callable[[Document], None]] = {
    "as it is": lambda d: None,
    "contact": both(joint(thermal_resistance="1e-7 m2 K/W"), put("probe", 0, at=[0.5, 0.5, 0], box="foot")),
    "perfect contact": both(joint(thermal_resistance=0), put("probe", 0, at=[0.5, 0.5, 0])),
    "voltage behind a contact": put("boundary", 1, contact_resistance="1e-12 ohm m2"),
    "behind a contact": put("boundary", 0, contact_resistance="1e-7 m2 K/W"),
    "behind a perfect contact": put("boundary", 0, contact_resistance="0 m2 K/W"),
    "electrodes apart": add("boundary", flat("top", [2, 0, 1], [3, 1, 1], voltage=2)),
    "electrodes of one voltage": add("boundary", flat("top", [0, 0, 1], [1, 1, 1], voltage=1)),
    "electrode inside": put("boundary", 1, lower=[2, 0, 0], upper=[2, 1, 1]),
    "electrode larger than its face": put("boundary", 1, lower=[0, -9, -9], upper=[0, 9, 9]),
    "temperatures side by side": add("boundary", flat("side", [0, 0, -1], [0, 1, -0.5], temperature=300)),
    "heat through both of two temperatures that meet": both(
        put("boundary", 0, upper=[0.5, 1, -1]),
        add("boundary", flat("side", [0.5, 0, -1], [1, 1, -1], temperature=300)),
        add("probe", flat("in", [0, 0, -1], [1, 1, -1], quantity="heat_flow")),
    ),
    "heat short of where two temperatures meet": both(
        MEETING, add("probe", flat("in", [0.1, 0, -1], [1, 1, -1], quantity="heat_flow"))
    ),
    "heat through one of two temperatures that are the same": both(
        add("boundary", flat("side", [0, 0, -1], [0, 1, -0.5], temperature=293)),
        add("probe", flat("in", [0, 0, -1], [1, 1, -1], quantity="heat_flow")),
    ),
    "the same temperature over itself": add("boundary", flat("again", [0.5, 0, -1], [2, 1, -1], temperature=293)),
    "flux into a fixed temperature and beside it": add("boundary", flat("in", [0, 0, -1], [0, 1, 1], heat_flux=1)),
    "flux where partly exposed": add("boundary", flat("under", [0, 0, 0], [4, 1, 0], heat_flux=1)),
    "probe on a corner": put("probe", 0, at=[4, 1, 1]),
    "probe within rounding": put("probe", 0, at=[4 + 1e-10, 1, 1]),
    "current through a section": add("probe", flat("i", [2, -5, -5], [2, 5, 5], quantity="current")),
    "island that is heated and cooled": both(
        add("box", island(heat_source=1)), add("boundary", flat("air", [6, 0, 1], [7, 1, 1], convection=AIR)),
    ),
    "conductor that is insulated": add(
        "box", {"name": "lead", "material": "oxide", "lower": [0, 0, -2], "upper": [1, 1, -1]}
    ),
    "library of materials": add("material", {"name": "unused"}),
    "box cut by a later one": add(
        "box", {"name": "ring", "material": "oxide", "lower": [2, 0, 0], "upper": [3, 1, 0.5]}
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", ALLOWED)
def test_twins_of_what_is_refused(case):
    document = beam()
    ALLOWED[case](document)
    from_dict(document)


def test_transient_needs_no_exit_but_something_that_acts():
    document = beam()
    for material in document["material"]:
        material |= {"density": 1000, "specific_heat": 700}
    document |= {"run": {"end_time": 1}, "boundary": document["boundary"][1:]}
    assert not from_dict(document).steady
    document["box"].append(island())
    assert 'acts on "island"' in refusal(from_dict, document)


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("boundary.lft electrode.voltage=1", ('no boundary "lft electrode"', 'did you mean "left electrode"?')),
        ("boundry.left.voltage=1", ("boundry.left.voltage", 'did you mean "boundary.left electrode.voltage"?')),
        ("run.acuracy=1", ("unknown key run.acuracy", 'did you mean "run.accuracy"?')),
        ("box.beam=1", ("box.beam names no item", "give box.NAME.KEY")),
        ("run.accuracy=1", ("run.accuracy = 1 is out of range",)),
        ("voltage", ("sets nothing",)),
        ("box.beam.lower=1", ('box "beam".lower = 1 does not fit',)),
    ],
)
def test_refused_overrides(setting, said):
    message = refusal(load, "bridge", [setting])
    for words in said:
        assert words in message


@pytest.mark.parametrize("text", ["[[box]", "\xff", "a = 1", ""])
def test_files_that_are_no_scene(text, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_bytes(text.encode("latin-1"))
    refusal(load, path)


def test_too_many_planes_is_refused_before_the_memory_is_gone():
    boxes = [
        {"name": f"b{i}", "material": "m", "lower": [i, i, i], "upper": [i + 1.5, i + 1.5, i + 1.5]} for i in range(400)
    ]
    document = {"run": {"steady": True}, "material": [{"name": "m", "thermal_conductivity": 1}], "box": boxes}
    with pytest.raises(SceneError, match="cells"):
        from_dict(document)


def test_too_many_cells_are_refused_with_the_planes():
    """150 boxes whose planes all differ make 27 million cells, which are never made."""
    document = beam()
    for n, x in enumerate(0.01 * k for k in range(1, 151)):
        lower, upper = [x, x / 4, x / 4], [x + 1e-3, x / 4 + 1e-3, x / 4 + 1e-3]
        document["box"].append(flat(f"b{n}", lower, upper, material="metal"))
    with pytest.raises(SceneError) as refused:
        from_dict(document)
    said = str(refused.value)
    assert "the scene is cut into 2.74e+07 cells, and 1e+07 are the most" in said
    assert "planes that all cross the whole scene, 302 along x" in said
    assert "let more of them coincide" in said
