"""A scene before a solve: its picture and the request for the window, names of parts, and refusals."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.loading import load, load_free
from scenes.model import Box, Contact, Scene
from scenes.sink import SILICON
from validate.cli import main
from validate.report.figures.drawing import Label, columns, spread
from validate.viewer.boxes import THIN, parts


@settings(deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=12), st.floats(0.01, 0.1))
def test_heights_are_apart_within_bounds_and_no_worse_than_others(wanted, apart):
    wanted = sorted(wanted, reverse=True)
    found = spread(wanted, apart, -1.0, 1.0)
    if len(found) > 1:
        assert (-np.diff(found)).min() >= apart * (1 - 1e-9)
    assert found.max() <= 1 + 1e-9
    assert found.min() >= -1 - 1e-9 or apart * (len(found) - 1) > 2
    # Of the unbounded problem no small shift of a run of names comes nearer to the wanted places.
    free = spread(wanted, apart, -1e3, 1e3)
    for first, last in combinations(range(len(free) + 1), 2):
        for shift in (1e-4, -1e-4):
            other = free.copy()
            other[first:last] += shift
            if len(other) < 2 or (-np.diff(other)).min() >= apart:
                assert ((free - wanted) ** 2).sum() <= ((other - wanted) ** 2).sum() + 1e-12


def test_columns_have_all_names_in_order():
    labels = [Label(str(n), "black", (float(n % 7), float(n))) for n in range(20)]
    left, right = columns(labels, 12)
    assert sorted((*left, *right), key=lambda label: int(label.text)) == labels
    assert max(len(left), len(right)) <= 14
    assert max(label.at[0] for label in left) <= min(label.at[0] for label in right)
    assert [label.at[1] for label in left] == sorted((label.at[1] for label in left), reverse=True)


@pytest.mark.long
def test_a_picture_without_solving(tmp_path, capsys):
    from matplotlib.image import imread

    file = tmp_path / "bridge.png"
    assert main(["view", "bridge", "--set", "parameters.w=40um", "--screenshot", str(file), "--size", "800x600"]) == 0
    assert imread(file).shape[1] == 800
    assert len(np.unique(imread(file).reshape(-1, 4), axis=0)) > 20
    assert main(["solve", "bridge", "--dry-run", "--out", str(tmp_path / "dry")]) == 0
    assert [entry.name for entry in (tmp_path / "dry").iterdir()] == ["scene.png"]
    # A run takes the folder of a picture; a picture joins a run, and leaves it as it is.
    assert main(["solve", "plate", "--no-figures", "--quiet", "--out", str(tmp_path / "dry")]) == 0
    before = (tmp_path / "dry" / "summary.json").read_text(encoding="utf-8")
    assert not (tmp_path / "dry" / "scene.png").exists()
    assert main(["sink", "--dry-run", "--out", str(tmp_path / "dry")]) == 0
    assert (tmp_path / "dry" / "scene.png").exists()
    assert (tmp_path / "dry" / "summary.json").read_text(encoding="utf-8") == before
    assert "scene.png" in capsys.readouterr().out


@pytest.mark.parametrize(("given", "said"), [
    (["bridge", "--time", "3ms"], "--time is for fields"), (["bridge", "--movie", "x.gif"], "--movie is for fields"),
    (["bridge", "--off-screen"], "--off-screen shows nothing"), (["none.toml"], "is no file"),
    (["bridge", "--set", "parameters.x=3"], "sets nothing"), (["bridge", "--screenshot", "x.bmp"], "ends in .png"),
    (["run", "--set", "a=b"], "--set is for a scene"),
])  # fmt: skip
def test_bad_input_is_one_sentence(
    given, said, tmp_path, monkeypatch, capsys
):  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").mkdir()
    assert main(["view", *given]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_users_folder_takes_no_picture(tmp_path, capsys):
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine", encoding="utf-8")
    assert main(["solve", "bridge", "--dry-run", "--out", str(tmp_path / "mine")]) == 2
    assert "files that are not a run" in capsys.readouterr().err
    assert [entry.name for entry in (tmp_path / "mine").iterdir()] == ["notes.txt"]


def test_window_shows_all_parts():
    scene = load_free("hotplate")
    request = parts(scene)
    assert [part["name"].partition(" ")[0].rstrip(":") for part in request["parts"][:2]] == ["plate", "heater"]
    assert len(request["parts"]) == len(scene.boxes) + len(scene.boundaries) + len(scene.probes)
    assert request["axes"] == ["x", "y", "z"]
    assert [text for text, _ in request["legend"]] == [
        f"{m.name}, {m.thermal_conductivity:g} W/(m K)" for m in (box.material for box in scene.boxes)
    ]
    assert parts(load("bridge"))["axes"] == ["y", "-x", "z"]
    film = request["parts"][1]
    assert film["upper"][2] - film["lower"][2] >= 0.5 * THIN
    title = parts(replace(scene, probes=()))["title"]
    assert title.startswith("hotplate: 2 boxes, 5 boundaries, 0 probes (drawn with z")


def test_contact_is_named_at_the_common_face():
    boxes = (Box("a", SILICON, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3)), Box("b", SILICON, (0.0, 0.0, 1e-3), (2e-3,) * 3))
    request = parts(Scene("two", boxes, (), (), contacts=(Contact("glue", ("a", "b"), 1e-6, 1e-10),)))
    contact, upper = request["parts"][-1], request["parts"][1]
    assert contact["name"] == "glue: 1e-6 m2 K/W, 1e-10 ohm m2"
    assert contact["lower"] == contact["upper"]
    assert contact["lower"][2] == pytest.approx(upper["lower"][2])
