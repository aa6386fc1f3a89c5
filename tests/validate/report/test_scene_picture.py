"""The picture of a scene before it is solved: what covers what, that thin parts are seen, and names apart."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.path import Path as Outline

from scenes.free import from_dict
from scenes.free.grid import VOID
from scenes.loading import load, load_free
from scenes.model import Box, Contact, Material, Scene
from validate.cli import main
from validate.report.figures import axonometry
from validate.report.figures.axonometry import THIN, Drawing, drawing
from validate.report.figures.drawing import style
from validate.report.figures.labels import Label, columns, spread
from validate.report.figures.scene_picture import draw, labels_of
from validate.viewer.boxes import of_boxes, parts

SILICON = Material("silicon", 130.0, 2330.0, 712.0)


def union(seed: int, count: int) -> Scene:
    """Boxes at random places of a net of 6 x 6 x 6, which overlap and leave gaps."""
    random = np.random.default_rng(seed)
    boxes = []
    for number in range(count):
        low = random.integers(0, 5, 3)
        high = low + random.integers(1, 3, 3)
        boxes.append(Box(f"b{number}", SILICON, cast(Any, tuple(low * 1e-6)), cast(Any, tuple(high * 1e-6))))
    return Scene("random", tuple(boxes), (), ())


def first_on_the_way(found: Drawing, at: np.ndarray, towards: np.ndarray) -> int:
    """The owner of the first cell that a line of sight meets, from the eye on, between all planes that it crosses."""
    crossings = [(planes - c) / slope for planes, c, slope in zip(found.drawn, at, towards, strict=True)]
    steps = np.unique(np.concatenate(crossings))
    for step in (steps[1:] + steps[:-1]) / 2:
        place = at + step * towards
        cell = [int(np.searchsorted(drawn, c)) - 1 for drawn, c in zip(found.drawn, place, strict=True)]
        if all(0 <= c < n for c, n in zip(cell, found.owner.shape, strict=True)) and found.owner[tuple(cell)] != VOID:
            return int(found.owner[tuple(cell)])
    return VOID


@pytest.mark.parametrize("seed", range(3))
def test_what_is_drawn_last_is_what_is_seen(seed: int) -> None:
    found = drawing(union(seed, 9))
    onto = np.array([axonometry._on_paper(unit) for unit in np.eye(3)]).T
    towards = np.cross(*onto)
    # The line of sight runs away from the eye: to the left, away and down.
    towards *= -np.sign(towards[2]) / np.linalg.norm(towards)
    low, high = found.extent
    looked = 0
    for place in low + (high - low) * np.random.default_rng(seed).random((60, 2)):
        over = [
            owner
            for corners, owner in zip(found.faces.corners, found.faces.owner, strict=True)
            if Outline(corners).contains_point(place)
        ]
        start = np.linalg.lstsq(onto, place, rcond=None)[0]
        expected = first_on_the_way(found, start, towards)
        assert (over[-1] if over else VOID) == expected
        looked += expected != VOID
    assert looked > 20


def test_thin_parts_are_seen_and_the_view_says_how_it_is_drawn() -> None:
    """0.2 um of gold under 100 um of polymer; and what lies under other boxes is hidden."""
    scene = of_boxes(load("device"))
    found = drawing(scene)
    names = [box.name for box in scene.boxes]
    assert found.thickened
    assert {names[number] for number in found.seen} == set(names) - {"oxide-0", "oxide-1"}
    assert min(float(np.diff(drawn).min()) for drawn in found.drawn) >= 0.5 * THIN
    bridge = drawing(cast(Scene, load("bridge")))
    assert (bridge.axes, bridge.factors, bridge.thickened) == ((1, 0, 2), (1.0, 5.0, 10.0), False)


def test_sheets_know_whether_they_are_turned_to_the_eye() -> None:
    scene = cast(Scene, load("bridge"))
    found = drawing(scene)
    facing = {b.name: found.facing(b.lower, b.upper) for b in scene.boundaries}
    assert facing == {"substrate": False, "left electrode": False, "right electrode": True}
    beam = scene.boxes[0]
    top, front = (beam.lower[0], beam.lower[1], beam.upper[2]), (beam.upper[0], beam.lower[1], beam.lower[2])
    assert found.facing(top, beam.upper)
    assert found.facing(front, beam.upper)


@settings(deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=1, max_size=12), st.floats(0.01, 0.1))
def test_heights_are_apart_within_bounds_and_no_worse_than_others(wanted: list[float], apart: float) -> None:
    wanted = sorted(wanted, reverse=True)
    found = spread(wanted, apart, -1.0, 1.0)
    if len(found) > 1:
        assert (-np.diff(found)).min() >= apart * (1 - 1e-9)
    assert found.max() <= 1 + 1e-9
    assert found.min() >= -1 - 1e-9 or apart * (len(found) - 1) > 2
    # Of the unbounded problem no small shift of a run of names comes nearer to what is wanted.
    free = spread(wanted, apart, -1e3, 1e3)
    for first, last in combinations(range(len(free) + 1), 2):
        for shift in (1e-4, -1e-4):
            other = free.copy()
            other[first:last] += shift
            if len(other) < 2 or (-np.diff(other)).min() >= apart:
                assert ((free - wanted) ** 2).sum() <= ((other - wanted) ** 2).sum() + 1e-12


def test_a_contact_is_named_where_its_boxes_touch() -> None:
    boxes = (Box("a", SILICON, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3)), Box("b", SILICON, (0.0, 0.0, 1e-3), (2e-3,) * 3))
    scene = Scene("two", boxes, (), (), contacts=(Contact("glue", ("a", "b"), 1e-6, 1e-10),))
    found = drawing(scene)
    label = next(each for each in labels_of(scene, found) if each.text.startswith("glue"))
    assert label.text == "glue: 1e-6 m2 K/W, 1e-10 ohm m2"
    assert label.at == pytest.approx(tuple(found.place(np.array([[5e-4, 5e-4, 1e-3]]))[0]))


def test_columns_have_all_names_in_order() -> None:
    labels = [Label(str(n), "black", (float(n % 7), float(n))) for n in range(20)]
    left, right = columns(labels, 12)
    assert sorted((*left, *right), key=lambda label: int(label.text)) == labels
    assert max(len(left), len(right)) <= 14
    assert max(label.at[0] for label in left) <= min(label.at[0] for label in right)
    assert [label.at[1] for label in left] == sorted((label.at[1] for label in left), reverse=True)


def crowd() -> Scene:
    """A net of 6 x 7 posts on a plate, each with a name of its own, under a lid."""
    box: list[dict[str, Any]] = [
        {"name": "plate", "material": "si", "lower": [0, 0, 0], "upper": [1e-3, 1e-3, "0.1 um"]}
    ]
    for n in range(42):
        x, y = (50e-6 + 150e-6 * (n % 6), 40e-6 + 130e-6 * (n // 6))
        box.append({"name": f"a post of number {n}", "material": "au", "lower": [x, y, 1e-7],
                    "upper": [x + 50e-6, y + 40e-6, 3e-6]})  # fmt: skip
    box.append({"name": "lid", "material": "si", "lower": [0, 0, 3e-6], "upper": [3e-4, 3e-4, 4e-6]})
    return cast(Scene, from_dict({
        "run": {"steady": True}, "box": box,
        "material": [{"name": n, "thermal_conductivity": 100.0} for n in ("si", "au")],
        "boundary": [{"name": "below", "lower": [0, 0, 0], "upper": [1e-3, 1e-3, 0], "temperature": 300.0},
                     {"name": "sun", "lower": [0, 0, 4e-6], "upper": [3e-4, 3e-4, 4e-6], "heat_flux": 100.0}],
        "probe": [{"name": "top", "at": [1e-4, 1e-4, 4e-6]}],
    }))  # fmt: skip


@pytest.mark.parametrize("name", ["bridge", "hotplate", "plate", "sink", "device", "crowd"])
def test_names_are_all_there_and_none_covers_another(name: str) -> None:
    scene = crowd() if name == "crowd" else of_boxes(load(name))
    with style():
        figure = draw(scene)
        renderer = FigureCanvasAgg(figure).get_renderer()
        figure.draw(renderer)
        texts = [text for text in (*figure.axes[0].texts, *figure.texts) if text.get_text()]
        boxes = [text.get_window_extent(renderer) for text in texts]
    said = " ".join(text.get_text() for text in texts)
    for part in (*scene.boxes, *scene.boundaries, *scene.probes):
        assert part.name in said
    wide, high = figure.get_size_inches() * figure.dpi
    for box in boxes:
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= wide
        assert box.y1 <= high
    for (one, a), (other, b) in combinations(zip(texts, boxes, strict=True), 2):
        # A pixel is what their rims may share.
        apart = a.x1 <= b.x0 + 1 or b.x1 <= a.x0 + 1 or a.y1 <= b.y0 + 1 or b.y1 <= a.y0 + 1
        assert apart, (one.get_text(), other.get_text())
    unit = "mm" if name == "plate" else "µm"
    assert {f"{axis} ({unit})" for axis in "xyz"} <= {text.get_text() for text in texts}


@pytest.mark.long
def test_a_picture_without_solving(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
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
    given: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run").mkdir()
    assert main(["view", *given]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert [entry.name for entry in tmp_path.iterdir()] == ["run"]


def test_a_users_folder_takes_no_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine", encoding="utf-8")
    assert main(["solve", "bridge", "--dry-run", "--out", str(tmp_path / "mine")]) == 2
    assert "files that are not a run" in capsys.readouterr().err
    assert [entry.name for entry in (tmp_path / "mine").iterdir()] == ["notes.txt"]


def test_the_window_is_told_all_parts() -> None:
    scene = cast(Scene, load_free("hotplate"))
    found = parts(scene)
    assert [part["name"].partition(" ")[0].rstrip(":") for part in found["parts"][:2]] == ["plate", "heater"]
    assert len(found["parts"]) == len(scene.boxes) + len(scene.boundaries) + len(scene.probes)
    assert found["axes"] == ["x", "y", "z"]
    assert parts(cast(Scene, load("bridge")))["axes"] == ["y", "-x", "z"]
    film = found["parts"][1]
    assert film["upper"][2] - film["lower"][2] >= 0.5 * THIN
    assert (
        parts(replace(scene, probes=()))["title"]
        == "hotplate: 2 boxes, 5 boundaries, 0 probes (drawn with z 15 times as large)"
    )
