"""`validate view`: refusals in a sentence, pictures and films of a real run, and a machine that cannot draw."""

import os
import re
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from compare.options import Options
from scenes.errors import SceneError
from scenes.loading import builtin_text, load
from validate.cli import main
from validate.report import output
from validate.viewer import window
from validate.viewer.boxes import parts
from validate.viewer.source import KEYS, View, find, title
from validate.viewer.window import start

REQUEST = {
    "show": "rise", "time": None, "exaggerate": None, "clip": None, "probe": False, "edges": False, "screenshot": None,
    "off_screen": True, "size": [64, 64],
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view") / "run"
    with pytest.MonkeyPatch.context() as patch:
        # Enough states for a film.
        patch.setattr("validate.report.fields.TIMES", 4)
        output.run(load("sink", ["accuracy=1e-2"]), Options(figures=False, fields=True), folder)
    return folder


def test_a_run_without_fields_is_told_how_to_get_them(tmp_path):
    (tmp_path / "summary.json").write_text("{}", encoding="utf-8")
    with pytest.raises(ValueError, match="run again with --fields"):
        find(tmp_path)


@pytest.mark.long
@pytest.mark.parametrize("name", ["", "fem3d.pvd", "fem3d_steady.vtu", "fem3d_03.vtu"])
def test_every_kind_of_file_is_found_with_its_times(run, name):
    whole, found = find(run), find(run / name)
    if name in ("", "fem3d.pvd"):
        assert found.times == pytest.approx(whole.times, rel=1e-6)
    elif name == "fem3d_03.vtu":
        assert found.times == (whole.times[3],)
    else:
        assert found.times == (None,)
    grid = found.grid(len(found.times) - 1)
    # The steady peak, 20.33 K, to the run's accuracy.
    assert grid["rise"].max() == pytest.approx(20.33 if name != "fem3d_03.vtu" else grid["rise"].max(), abs=0.3)


CELL = """<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{points}" NumberOfCells="1"><PointData>
<DataArray type="Float64" Name="temperature" format="ascii">1 2 3 4</DataArray></PointData><Points>
<DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 {last}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{kind}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"""
"""A tetrahedron (type 10) of four points, the last number 3."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"last": 99_999_999}, "of points that it does not have"), ({"last": -99_999_999}, "of points that it"),
        ({"kind": 12}, "of points that it does not have"),  # a hexahedron has eight
        ({"points": 99_999_999_999}, "cannot be read: VTK ended at it"),
    ],
)  # fmt: skip
def test_a_file_that_ends_vtk_is_not_taken_for_a_lack_of_graphics(change, said, capsys):
    Path("good.vtu").write_text(CELL.format(points=4, last=3, kind=10), encoding="utf-8")
    Path("bad.vtu").write_text(CELL.format(**{"points": 4, "last": 3, "kind": 10} | change), encoding="utf-8")
    assert find(Path("good.vtu")).grid(0).n_cells == 1
    assert main(["view", "bad.vtu", "--screenshot", "a.png"]) == 2
    assert said in capsys.readouterr().err
    assert not Path("a.png").exists()


def test_a_time_beyond_the_end_is_refused_and_one_between_stored_times_is_named(run):
    times = tuple(time for time in find(run).times if time is not None)
    with pytest.raises(SceneError, match="from 0 to 20 ms"):
        window.nearest(times, 7.0)
    step, (note,) = window.nearest(times, 5e-4)
    assert abs(times[step] - 5e-4) == min(abs(time - 5e-4) for time in times)
    assert f"0.5 ms is not stored: this is {times[step] * 1e3:.4g} ms" in note
    assert window.nearest(times, times[step]) == (step, [])


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.0, 20.33, ["0", "5", "10", "15", "20"]), (-3.1, 0.02, ["-3", "-2", "-1", "0"]),
        (293.0, 293.004, ["293", "293.001", "293.002", "293.003", "293.004"]), (0.0, 8.7e7, ["0", "2e+07", "4e+07"]),
        (-1.4, 1.4, ["-1", "-0.5", "0", "0.5", "1"]),
    ],
)  # fmt: skip
def test_a_colour_bar_has_round_labels(low, high, labels):
    from validate.viewer.stage import LABEL, round_ticks

    ticks = round_ticks(low, high)
    assert [LABEL % tick for tick in ticks][: len(labels)] == labels
    assert ticks[0] >= low - 1e-9
    assert ticks[-1] <= high + 1e-9


@pytest.mark.parametrize(("least", "shown"), [(-2.838e-5, 0.0), (-0.5, -0.5)])
def test_what_rounding_leaves_of_a_zero_is_none_on_the_colour_bar(run, least, shown):
    from validate.viewer.stage import Stage

    source = find(run / "fem3d_steady.vtu")
    source.grid(0).point_data["rise"][7] = least
    stage = Stage(source, True, (64, 64))
    assert stage._range("rise", None)[0] == pytest.approx(shown)
    stage.plotter.close()


def test_a_films_times_are_even_and_its_states_those_stored(run):
    source = find(run)
    film = source.evenly(9, "rise")
    assert np.diff(film.times) == pytest.approx(source.times[-1] / 8)
    for stored, shown in ((0, 0), (-1, 8)):
        at = range(len(source.times))[stored]
        assert film.grid(shown)["rise"] == pytest.approx(source.grid(at)["rise"], abs=1e-9)
    low, high = source.grid(0)["rise"].min(), source.grid(len(source.times) - 1)["rise"].max()
    assert all(low - 1e-9 <= film.grid(k)["rise"].min() and film.grid(k)["rise"].max() <= high + 1e-9 for k in range(9))


def test_a_missing_package_is_said_before_anything_is_drawn(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    monkeypatch.setitem(sys.modules, "validate.viewer.stage", None)  # nothing could be drawn
    request = {**REQUEST, "path": str(run)}
    with pytest.raises(ValueError, match="imageio with its ffmpeg"):
        window.read({**request, "movie": "a.mp4"})
    window.read({**request, "movie": "a.gif"})
    with pytest.raises(ImportError):
        window.draw({**request, "movie": "a.gif"})


@pytest.mark.long
def test_a_picture_and_a_film(run, tmp_path, capsys, monkeypatch):
    from PIL import GifImagePlugin, Image

    # Else every frame after the first is read as RGB, and not only frames with their own palette.
    monkeypatch.setattr(
        GifImagePlugin, "LOADING_STRATEGY", GifImagePlugin.LoadingStrategy.RGB_AFTER_DIFFERENT_PALETTE_ONLY
    )
    monkeypatch.setattr("validate.viewer.window.FRAMES", 3)
    picture, movie = tmp_path / "a.png", tmp_path / "a.gif"
    options = ["--show", "rise", "--probe", "--clip", "y=0.6", "--edges", "--size", "400x320", "--exaggerate", "10",
               "--time", "0.5ms"]  # fmt: skip
    assert main(["view", str(run), *options, "--screenshot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "Wrote" in said
    assert "0.5 ms is not stored" in said
    request = {**REQUEST, "path": str(run), "show": "rise", "movie": str(movie), "size": [120, 96]}
    window.read(request)
    window.draw(request)
    image = np.asarray(Image.open(picture).convert("RGB"))
    assert image.shape == (320, 400, 3)
    # The middle third has something coloured: not white, not grey.
    assert (np.ptp(image[:222, 130:270].astype(int), axis=2) > 60).any()
    film = Image.open(movie)
    assert film.n_frames == 3
    film.seek(0)
    first = np.asarray(film.convert("RGB"), dtype=int)
    film.seek(film.n_frames - 1)
    assert film.mode == "P"
    assert np.abs(np.asarray(film.convert("RGB"), dtype=int) - first).max() > 50


@pytest.mark.parametrize(
    ("dies", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "the signal SIGSEGV"),
        ("raise ImportError('no libGL')", "no lib"),
    ],
)
def test_a_machine_that_cannot_draw_says_so(dies, said, run, tmp_path, monkeypatch, capsys):
    (tmp_path / "pyvista.py").write_text(dies, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    assert main(["view", str(run), "--screenshot", str(tmp_path / "a.png")]) == 3
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "OpenGL" in err
    assert said in err


@pytest.mark.skipif(not hasattr(os, "uname") or os.uname().sysname != "Linux", reason="displays as Linux has them")
def test_without_a_display(run, monkeypatch, capsys):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", str(run)]) == 3
    assert "--screenshot" in capsys.readouterr().err


VIEW = View(("rise", "temperature", "potential"), 4, 20.0)


def pressed(view: View, *keys: str) -> View:
    for key in keys:
        view = KEYS[key][2](view)
    return view


@pytest.mark.parametrize("key", ["space", "l"])
def test_a_switch_pressed_twice_is_as_before(key):
    once = pressed(VIEW, key)
    assert once != VIEW
    assert pressed(once, key) == VIEW


def test_each_key_moves_its_own_setting():
    steps = [pressed(VIEW, *keys).step for keys in (["Right", "Right"], ["Left"], ["Left", "Right"])]
    assert steps == [2, 3, 0]
    assert [pressed(VIEW, *["t"] * n).quantity for n in range(4)] == ["rise", "temperature", "potential", "rise"]
    assert [pressed(VIEW, *["x"] * n).cut for n in range(5)] == ["", "x", "y", "z", ""]
    assert "thickness drawn x50" in title(replace(VIEW, factor=50.0), "run", 1e-3)
    assert "true proportions" in title(replace(VIEW, factor=1.0), "run", None)
    assert "1 ms" in title(VIEW, "run", 1e-3)
    assert "steady" in title(VIEW, "run", None)


def test_a_scene_without_a_run_and_with_a_sign_that_the_font_lacks_is_drawn(tmp_path, capsys):
    scene, picture = tmp_path / "mine.toml", tmp_path / "a.png"
    text = re.sub(r"\[run\].*?\n\n", "", builtin_text("bridge"), flags=re.DOTALL)
    assert "[run]" not in text
    named = text.replace('name = "bridge"', 'name = "bridge \N{CJK UNIFIED IDEOGRAPH-4E2D}"', 1)
    scene.write_text(named, encoding="utf-8")
    view = ["view", str(scene), "--screenshot", str(picture), "--set"]
    # A transient needs the heat capacity of all materials, which the bridge does not give.
    assert main([*view, "run.end_time=1ms", "--set", "material.polysilicon.density=1"]) == 2
    assert "specific_heat is missing" in capsys.readouterr().err
    assert not picture.exists()
    with warnings.catch_warnings(record=True) as raised:
        warnings.simplefilter("always")
        assert main([*view, "parameters.L=300um"]) == 0
    assert picture.exists()
    assert not raised
    assert not capsys.readouterr().err


@pytest.mark.long
def test_the_window_of_a_scene_has_its_names_beside_it(tmp_path):
    """Drawn without a display: ink of every kind of name in the margins, and the materials' colours between them."""
    scene = load("bridge")
    file = tmp_path / "window.png"
    given = {"off_screen": True, "screenshot": str(file), "movie": None, "size": [900, 500], **parts(scene)}
    start(given, lambda _: None)
    image = (imread(file)[..., :3] * 255).round().astype(int)
    for part in given["parts"]:
        ink = np.array([int(part["ink"][n : n + 2], 16) for n in (1, 3, 5)])
        margins = np.concatenate([image[:, :230], image[:, -230:]], axis=1)
        assert (np.abs(margins - ink).sum(axis=2) < 30).any(), part["name"]
        if part["solid"] == 1.0:
            colour = np.array(part["colour"]) * 255
            assert (np.abs(image[:, 230:-230] - colour).sum(axis=2) < 12).sum() > 50, part["name"]
