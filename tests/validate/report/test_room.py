"""Where there is no room to write: the largest size of a file stands for a full disk, which VTK doesn't survive."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from scenes.errors import SceneError
from validate.cli import main
from validate.sweep.point import Row
from validate.sweep.store import Store

FIELDS = ["solve", "bridge", "--set", "run.accuracy=1e-2", "--no-figures", "--quiet", "--fields", "--out"]


@contextmanager
def files_up_to(size: int) -> Iterator[None]:
    """Limit the size (bytes) of files that this process and its children write."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.fixture(scope="module")
def earlier(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fields") / "run"
    assert main([*FIELDS, str(folder)]) == 0
    return folder


@pytest.mark.parametrize("file", ["fem3d_steady.vtu"])
def test_fields_are_whole_or_refused_by_name(file, earlier, capsys):
    before = {entry.name: entry.read_bytes() for entry in earlier.iterdir()}
    with files_up_to(len(before[file]) - 1000):
        assert main([*FIELDS, str(earlier)]) == 2
    assert f'{file}" cannot be written' in (said := capsys.readouterr().err)
    assert "make room, or give a folder elsewhere with --out" in said
    assert {entry.name: entry.read_bytes() for entry in earlier.iterdir()} == before
    assert [entry.name for entry in earlier.parent.iterdir()] == ["run"]


def test_a_sweep_names_the_file_and_goes_on(tmp_path):
    def append(store: Store) -> None:
        for point in range(len(store), 100):
            store.append([Row(point, "ok", "", 0.0, {"fem3d_peak_rise_K": 20.0})])

    asked, goes_on = (
        {"kind": "sweep"},
        r'" cannot be written \(File too large\): make room, and the same command goes on',
    )
    with pytest.raises(SceneError, match="sweep.json" + goes_on), files_up_to(10), Store(tmp_path / "s", asked):
        pytest.fail("entered")
    with (
        pytest.raises(SceneError, match="points.jsonl" + goes_on),
        files_up_to(3000),
        Store(tmp_path / "s", asked) as s,
    ):
        append(s)
    with Store(tmp_path / "s", asked) as store:
        assert 10 < len(store) < 100
        append(store)
        assert [row.point for row in store.rows()] == list(range(100))
