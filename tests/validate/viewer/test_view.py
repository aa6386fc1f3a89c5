"""`validate view`: refusals in a sentence, pictures and films of a real run, and a machine that cannot draw."""

import os
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.image import imread

from compare.options import Options
from scenes.errors import SceneError
from scenes.loading import builtin_text, load
from validate.cli import main
from validate.report import output
from validate.viewer import stage
from validate.viewer.boxes import request
from validate.viewer.source import Field, stored
from validate.viewer.stage import Stage, nearest, round_ticks
from validate.viewer.window import start

REQUEST = {
    "show": "rise", "time": None, "exaggerate": None, "clip": None, "probe": False, "edges": False, "screenshot": None,
    "movie": None, "off_screen": True, "size": [120, 96],
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view") / "run"
    with pytest.MonkeyPatch.context() as patch:
        # Enough states for a film.
        patch.setattr("validate.report.fields.TIMES", 4)
        output.run(load("sink", ["accuracy=1e-2"]), Options(figures=False, fields=True), folder)
    return folder


def test_files_without_a_field_are_refused(run, tmp_path):
    with pytest.raises(SceneError, match="run again with --fields"):
        stored(tmp_path)
    stage.pv.UnstructuredGrid().save("none.vtu")
    Path("one.vtu").write_text(CELL.format(points=4, last=3, kind=10), encoding="utf-8")
    for files, said in (([Path("none.vtu")], "no cells"), ([Path("one.vtu"), stored(run)[0][1]], "different meshes")):
        with pytest.raises(SceneError, match=said):
            Field.read("two", [(None, file) for file in files], None)


@pytest.mark.long
@pytest.mark.parametrize("name", ["", "fem3d.pvd", "fem3d_steady.vtu"])
def test_every_kind_of_file_is_found_with_its_times(run, name):
    field = Field.read("run", stored(run / name), 1.0)
    if name == "fem3d_steady.vtu":
        assert field.times == (None,)
    else:
        assert field.times[0] == 0.0
        assert field.times[-1] == pytest.approx(0.02, rel=1e-6)
    # The steady peak, 20.33 K, to the run's accuracy.
    assert field.range("rise_K")[1] == pytest.approx(20.33, abs=0.3)


CELL = """<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{points}" NumberOfCells="1"><PointData>
<DataArray type="Float64" Name="temperature_K" format="ascii">1 2 3 4</DataArray></PointData><Points>
<DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 {last}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">4</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{kind}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"""
"""A tetrahedron (type 10) of four points, the last number 3."""


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"last": 99_999_999}, "invalid point"), ({"last": -99_999_999}, "invalid point"),
        ({"kind": 12}, "wrong number of points"),  # a hexahedron has eight
    ],
)  # fmt: skip
def test_a_damaged_file_is_not_taken_for_a_lack_of_graphics(change, said, capsys):
    Path("good.vtu").write_text(CELL.format(points=4, last=3, kind=10), encoding="utf-8")
    Path("bad.vtu").write_text(CELL.format(**{"points": 4, "last": 3, "kind": 10} | change), encoding="utf-8")
    assert Field.read("good", stored(Path("good.vtu")), None).grids[0].n_cells == 1
    assert main(["view", "bad.vtu", "--screenshot", "a.png"]) == 2
    assert said in capsys.readouterr().err
    assert not Path("a.png").exists()


def test_a_time_beyond_the_end_is_refused_and_one_between_stored_times_is_named(run):
    times = [time for time, _ in stored(run)]
    with pytest.raises(SceneError, match="outside this run, from 0 to 20 ms"):
        nearest(times, 7.0)
    step, (note,) = nearest(times, 5e-4)
    assert abs(times[step] - 5e-4) == min(abs(time - 5e-4) for time in times)
    assert f"0.5 ms is not stored: this is {times[step] * 1e3:.4g} ms" in note
    assert nearest(times, times[step]) == (step, [])


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.0, 20.33, ["0", "5", "10", "15", "20"]), (-3.1, 0.02, ["-3", "-2", "-1", "0"]),
        (293.0, 293.004, ["293", "293.001", "293.002", "293.003", "293.004"]), (0.0, 8.7e7, ["0", "2e+07", "4e+07"]),
        (-1.4, 1.4, ["-1", "-0.5", "0", "0.5", "1"]),
    ],
)  # fmt: skip
def test_a_colour_bar_has_round_labels(low, high, labels):
    ticks = round_ticks(low, high)
    assert [f"{tick:.7g}" for tick in ticks][: len(labels)] == labels
    assert ticks[0] >= low - 1e-9
    assert ticks[-1] <= high + 1e-9


def test_between_stored_times_a_field_is_interpolated(run):
    field = Field.read("run", stored(run), None)
    for array in ("rise_K", "heat_source_W_per_m3"):
        before, after = (field.at(k, array)[array] for k in (2, 3))
        assert field.at(2.25, array)[array] == pytest.approx(0.75 * before + 0.25 * after)
    assert field.at(2.25, "rise_K").points == pytest.approx(field.grids[2].points)


def test_a_missing_package_is_said_before_anything_is_drawn(run, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(SceneError, match=r"imageio\[ffmpeg\]"):
        stage.draw({**REQUEST, "path": str(run), "movie": "a.mp4"})


@pytest.mark.long
def test_a_picture_and_a_film(run, tmp_path, capsys, monkeypatch):
    from PIL import Image

    monkeypatch.setattr(stage, "FRAMES", 3)
    picture, movie = tmp_path / "a.png", tmp_path / "a.gif"
    options = ["--show", "rise", "--probe", "--clip", "y=0.6", "--edges", "--size", "400x320", "--exaggerate", "10",
               "--time", "0.5ms"]  # fmt: skip
    assert main(["view", str(run), *options, "--screenshot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "Wrote" in said
    assert "0.5 ms is not stored" in said
    stage.draw({**REQUEST, "path": str(run), "movie": str(movie)})
    image = np.asarray(Image.open(picture).convert("RGB"))
    assert image.shape == (320, 400, 3)
    # The middle third has something coloured: not white, not grey.
    assert (np.ptp(image[:222, 130:270].astype(int), axis=2) > 60).any()
    film = Image.open(movie)
    assert film.n_frames == 3
    film.seek(0)
    first = np.asarray(film.convert("RGB"), dtype=int)
    film.seek(film.n_frames - 1)
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


@pytest.mark.long
def test_each_key_of_the_window_changes_its_setting(run, monkeypatch):
    view = Stage(Field.read("run", stored(run), 50.0), REQUEST)
    keys = {}
    monkeypatch.setattr(view.plotter, "add_key_event", keys.__setitem__)
    monkeypatch.setattr(view.plotter, "show", lambda **_: None)
    view.open()
    arrays = []
    for _ in view.field.arrays:
        arrays.append(view.array)
        keys["t"]()
    assert sorted(arrays) == sorted(view.field.arrays)
    axes = []
    for _ in range(4):
        keys["x"]()
        axes.append(view.axis)
    assert axes == ["x", "y", "z", ""]
    keys["l"]()
    assert view.line


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
    """Drawn without a display: names in the margin, and the materials' colours beside them."""
    scene = load("bridge")
    file = tmp_path / "window.png"
    given = {**request(scene), "off_screen": True, "screenshot": str(file), "size": [900, 500]}
    start("boxes", given)
    image = (imread(file)[..., :3] * 255).round().astype(int)
    assert (image[:, :230] < 100).all(axis=2).sum() > 500
    for part in given["parts"]:
        if part["opacity"] == 1.0:
            colour = 255 * (0.45 + 0.55 * np.array(to_rgb(part["colour"])))
            assert (np.abs(image[:, 230:-230] - colour).sum(axis=2) < 12).sum() > 50, part["name"]
    # The scene fills what the names leave of the width.
    columns = np.flatnonzero(np.ptp(image[60:-120], axis=(0, 2))[250:])
    assert np.ptp(columns) > 0.55 * 900
