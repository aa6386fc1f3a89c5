"""The results folder: swapped in whole, never at the cost of other files, also where there is no room to write. The
largest size of a file stands for a full disk, which VTK doesn't survive."""

import errno
import json
import os
import resource
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from scenes.errors import SceneError
from statespace import export
from validate import folder as module
from validate.cli import main
from validate.folder import MODEL, RUN, Folder
from validate.sweep.run import Store

SUMMARY = json.dumps({"schema": 1, "plan": []})


def run(target: Path, **files: str) -> None:
    with Folder(target, RUN) as folder:
        for name, text in files.items():
            (folder.partial / name.replace("__", ".")).write_text(text, encoding="utf-8")


def names(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


@pytest.mark.parametrize("exchange", [True, False])
def test_an_earlier_run_is_replaced_and_a_users_file_kept(exchange, tmp_path, monkeypatch):
    if not exchange:
        monkeypatch.setattr(module, "_exchange", lambda a, b: False)
    target = tmp_path / "deep" / "run"
    run(target, summary__json=SUMMARY, figure4__png="old", fem3d_00__vtu="old")
    (target / "notes.txt").write_text("mine", encoding="utf-8")
    run(target, summary__json=SUMMARY, traces__csv="new")
    assert names(target) == {"summary.json", "traces.csv", "notes.txt"}
    assert names(target.parent) == {"run"}


def test_a_failure_leaves_everything_as_it_was(tmp_path):
    target = tmp_path / "deep" / "run"
    with pytest.raises(KeyboardInterrupt), Folder(target, RUN):
        raise KeyboardInterrupt
    assert names(tmp_path) == set()
    run(target, summary__json=SUMMARY)
    with pytest.raises(FileNotFoundError), Folder(target, RUN) as folder:
        (folder.partial / "summary.json").rename(folder.partial / "missing" / "summary.json")
    assert (target / "summary.json").read_text(encoding="utf-8") == SUMMARY
    assert names(target.parent) == {"run"}


def test_a_folder_that_is_not_writable_is_refused(tmp_path, monkeypatch):
    """By way of os.access, for root may write anywhere."""
    monkeypatch.setattr(module.os, "access", lambda *_: False)
    with pytest.raises(SceneError, match="not writable"), Folder(tmp_path, RUN):
        pytest.fail("entered")


def test_an_empty_folder_and_a_link_are_used(tmp_path):
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    run(tmp_path / "link", summary__json=SUMMARY)
    assert (tmp_path / "link").is_symlink()
    assert names(tmp_path / "real") == {"summary.json"}


def model(target: Path, text: str) -> None:
    with Folder(target, MODEL) as folder:
        (folder.partial / "model.json").write_text('{"scene": "s", "matrices": {}}', encoding="utf-8")
        (folder.partial / "model.py").write_text(text, encoding="utf-8")


@pytest.mark.long
def test_an_export_replaces_an_export_whole_or_not_at_all(tmp_path, monkeypatch, capsys):
    # Where the disk is full the earlier export stays, whole, and nothing else does.
    model(tmp_path / "model", "ROOM = 1.0")
    before = (tmp_path / "model" / "model.json").read_bytes()

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(export, "fmu_available", lambda: True)
    monkeypatch.setattr(export, "_build_fmu", full)
    solve = ["solve", "bridge", "--no-figures", "--quiet", "--export", str(tmp_path / "model"), "--out"]
    assert main([*solve, str(tmp_path / "run")]) == 2
    assert "cannot be written (No space left on device): make room, or give a folder elsewhere with --export" in (
        capsys.readouterr().err
    )
    assert (tmp_path / "model" / "model.json").read_bytes() == before
    assert names(tmp_path) == {"model"}
    # And where the two are one folder, it has both.
    monkeypatch.setattr(export, "fmu_available", lambda: False)
    both = ["solve", "bridge", "--no-figures", "--quiet", "--export", str(tmp_path / "b"), "--out", str(tmp_path / "b")]
    for _ in range(2):
        assert main(both) == 0
        assert names(tmp_path / "b") == {"model.json", "model.cir", "model.py", "summary.json", "report.html"}


def test_an_export_over_another_is_the_one_that_is_imported(tmp_path):
    """Within a second and at equal size Python would take the compiled copy of the first for the second."""
    found = []
    for text in ("ROOM = 1.0", "ROOM = 2.0", "ROOM = 3.0"):
        model(tmp_path / "model", text)
        command = [sys.executable, "-I", "-S", "-c", "import sys; sys.path.insert(0, sys.argv[1]); import model; "
                   "print(model.ROOM)", str(tmp_path / "model")]  # fmt: skip
        found.append(
            subprocess.run(command, check=True, capture_output=True, encoding="utf-8", timeout=60).stdout.strip()
        )
    assert found == ["1.0", "2.0", "3.0"]


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


def test_fields_are_whole_or_refused_by_name(earlier, capsys):
    file = "fem3d_steady.vtu"
    before = {entry.name: entry.read_bytes() for entry in earlier.iterdir()}
    with files_up_to(len(before[file]) - 1000):
        assert main([*FIELDS, str(earlier)]) == 2
    assert f'{file}" cannot be written' in (said := capsys.readouterr().err)
    assert "make room, or give a folder elsewhere with --out" in said
    assert {entry.name: entry.read_bytes() for entry in earlier.iterdir()} == before
    assert [entry.name for entry in earlier.parent.iterdir()] == ["run"]


def test_a_sweep_names_the_file_and_goes_on(tmp_path):
    def append(store: Store) -> None:
        for point in range(len(store.rows), 100):
            store.append({"point": point, "status": "ok", "fem3d_peak_rise_K": 20.0, "because": ""})

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
        assert 10 < len(store.rows) < 100
        append(store)
        assert sorted(store.rows) == list(range(100))
