"""Files are read with a bounded size, and only where they have an end."""

import os
import tracemalloc
from pathlib import Path

import pytest

from compare.data import text
from scenes.errors import SceneError, contents, parsed
from scenes.free.document import MOST_BOXES
from scenes.loading import document, load
from scenes.schema import toml_value


@pytest.fixture
def pipe(tmp_path):
    """A named pipe that nobody writes to: to open it for reading waits for ever."""
    path = tmp_path / "pipe.toml"
    os.mkfifo(path)
    return path


def test_a_pipe_or_a_device_is_refused_where_a_scene_or_data_are_wanted(pipe):
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(SceneError, match=r'^"[^"]*" is a pipe or a device: save what it holds'):
            document(path, ())
        with pytest.raises(SceneError, match=r"^--against .* is a pipe or a device"):
            text.read_bytes(path)


def test_a_mesh_that_is_a_pipe_is_refused(pipe):
    from meshes.grouped.read import read

    with pytest.raises(SceneError, match=r"^mesh\.file: .* is a pipe or a device"):
        read(pipe, 1.0)


def test_a_scene_file_is_read_up_to_a_megabyte(tmp_path):
    path = tmp_path / "large.toml"
    path.write_bytes(b"# " + b"x" * 999_998)
    assert document(path, ())[0] == {}
    path.write_bytes(b"# " + b"x" * 999_999)
    with pytest.raises(SceneError, match="is larger than 1 MB: "):
        document(path, ())


def test_more_boxes_than_are_solved_are_refused(tmp_path):
    box = 'name = "{n}"\nmaterial = "m"\nlower = [{n}, 0, 0]\nupper = [{n}.5, 1, 1]\n'
    path = tmp_path / "row.toml"
    path.write_text("".join("[[box]]\n" + box.format(n=n) for n in range(MOST_BOXES + 1)), encoding="utf-8")
    with pytest.raises(SceneError, match="the scene has 2,001 boxes, and 2,000 are the most: "):
        load(path)


@pytest.mark.parametrize("given", ["mine", "Mine.TOML", "mien.toml"])
def test_a_file_that_is_nearly_called_so_is_named(given, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text("", encoding="utf-8")
    for path in (given, str(tmp_path / given)):
        with pytest.raises(SceneError, match=r'is no file: .*, did you mean ".*mine\.toml"\?'):
            document(path, ("bridge", "hotplate"))


def test_a_scene_of_as_many_boxes_and_contacts_as_are_solved_is_no_larger_than_is_read(tmp_path):
    box = '[[box]]\nname = "box {n}"\nmaterial = "material {n}"\nlower = ["{n} um", 0, 0]\nupper = ["{m} um", 1, 1]\n'
    material = '[[material]]\nname = "material {n}"\nthermal_conductivity = "130.0 W/(m K)"\n'
    contact = '[[contact]]\nbetween = ["box {n}", "box {m}"]\nthermal_resistance = "1e-7 m2 K/W"\n'
    text = "".join(each.format(n=n, m=n + 1) for n in range(MOST_BOXES) for each in (box, material, contact))
    path = tmp_path / "row.toml"
    path.write_text(text, encoding="utf-8")
    assert [len(each) for each in document(path, ())[0].values()] == [MOST_BOXES] * 3


def test_a_file_may_grow_while_it_is_read(tmp_path):
    path = tmp_path / "data.csv"
    path.write_bytes(b"x" * 1_000_001)
    with pytest.raises(SceneError, match="it is larger than 1 MB: less"):
        contents(path, 1, "it", "less")


@pytest.mark.parametrize("joint", [".", " . ", '."a".', ".'a'."])
def test_a_key_of_thousands_of_parts_takes_no_memory(tmp_path, joint):
    """The parser of the standard library would take 64 MB for one of 4,000, 9.6 GB for one of 50,000; a file is read
    through a buffer of 10 MB."""
    path = tmp_path / "deep.toml"
    path.write_text("[scene]\n" + joint.join("a" * 4000) + " = 1\n", encoding="utf-8")
    tracemalloc.start()
    try:
        with pytest.raises(SceneError, match="line 2 has more than 32 names joined by dots"):
            document(path, ())
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_what_only_looks_like_a_deep_key_is_read():
    rows = ", ".join(f"{n}.5" for n in range(100))
    assert len(parsed(f"times = [{rows}]")["times"]) == 100
    assert parsed(".".join("a" * 32) + " = 1")
    assert toml_value('1\n"x"' + ".a" * 2000 + " = 1").startswith("1\n")
