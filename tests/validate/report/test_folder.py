"""The results folder: swapped in whole, never at the cost of what is not a run's."""

from __future__ import annotations

import errno
import json
import os
from pathlib import Path

import pytest

from scenes.errors import SceneError
from validate.report import folder as module
from validate.report.folder import Folder

SUMMARY = json.dumps({"schema": 1, "plan": []})


def run(target: Path, **files: str) -> None:
    with Folder(target) as folder:
        for name, text in files.items():
            (folder.partial / name.replace("__", ".")).write_text(text)


def names(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


@pytest.mark.parametrize("exchange", [True, False])
def test_an_earlier_run_is_replaced_and_a_users_file_kept(
    exchange: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not exchange:
        monkeypatch.setattr(module, "_exchange", lambda a, b: False)
    target = tmp_path / "deep" / "run"
    run(target, summary__json=SUMMARY, figure4__png="old", fem3d_00__vtu="old")
    (target / "notes.txt").write_text("mine")
    run(target, summary__json=SUMMARY, traces__csv="new")
    assert names(target) == {"summary.json", "traces.csv", "notes.txt"}
    assert names(target.parent) == {"run"}


def test_a_failure_leaves_everything_as_it_was(tmp_path: Path) -> None:
    target = tmp_path / "deep" / "run"
    with pytest.raises(KeyboardInterrupt), Folder(target):
        raise KeyboardInterrupt
    assert names(tmp_path) == set()
    run(target, summary__json=SUMMARY)
    with pytest.raises(FileNotFoundError), Folder(target) as folder:
        (folder.partial / "summary.json").rename(folder.partial / "missing" / "summary.json")
    assert (target / "summary.json").read_text() == SUMMARY
    assert names(target.parent) == {"run"}


def test_a_full_disk_names_the_file(tmp_path: Path) -> None:
    """The system names none where writing fails, as against opening."""

    def written(number: int, name: str | None) -> None:
        with Folder(tmp_path / "run") as folder:
            (folder.partial / "figure7.png").write_text("done")
            os.utime(folder.partial / "figure7.png", (0, 0))
            (folder.partial / "traces.csv").write_text("half")
            raise OSError(number, os.strerror(number), name)

    with pytest.raises(SceneError, match=r'run/traces\.csv" cannot be written \(No space left'):
        written(errno.ENOSPC, None)
    assert names(tmp_path) == set()
    with pytest.raises(FileNotFoundError):
        written(errno.ENOENT, "my-scene.toml")


@pytest.mark.parametrize(
    ("there", "target"),
    [("out/thesis.tex", "out"), ("out", "out"), ("plain", "plain/out"), ("out/summary.json", "out")],
    ids=["foreign", "file", "under a file", "broken summary"],
)
def test_refused_before_anything_happens(there: str, target: str, tmp_path: Path) -> None:
    (tmp_path / there).parent.mkdir(exist_ok=True)
    (tmp_path / there).write_text("mine")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(SceneError, match="output folder"), Folder(tmp_path / target):
        pytest.fail("entered")
    assert sorted(tmp_path.rglob("*")) == before


def test_neither_what_is_not_writable_nor_where_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first by way of os.access, for root may write anywhere."""
    with pytest.raises(SceneError, match="where you are"), Folder(Path(".")):
        pytest.fail("entered")
    monkeypatch.setattr(module.os, "access", lambda *_: False)
    with pytest.raises(SceneError, match="not writable"), Folder(tmp_path):
        pytest.fail("entered")


def test_an_empty_folder_and_a_link_are_used(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "real")
    run(tmp_path / "link", summary__json=SUMMARY)
    assert (tmp_path / "link").is_symlink()
    assert names(tmp_path / "real") == {"summary.json"}
