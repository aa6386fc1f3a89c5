"""Rows on disk: nothing is lost by a kill, and nothing is there twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenes.errors import SceneError
from validate.sweep.point import Row
from validate.sweep.store import ROWS, Store

ASKED = {"kind": "sweep", "vary": {"a": [1, 2]}}


def row(number: int) -> Row:
    return Row(number, "ok", "", 0.1, {"x": number / 3})


def test_what_a_kill_leaves_of_a_task_is_cut_off(tmp_path: Path) -> None:
    with Store(tmp_path / "s", ASKED) as store:
        store.append([[row(4)], [row(0), row(1), row(2)]])
    file = tmp_path / "s" / ROWS
    whole = file.read_bytes()
    ends = [n + 1 for n, byte in enumerate(whole) if byte == ord("\n")]
    # Wherever the second task is torn, inside a line or between two, the first stays and the second is gone.
    for kept in (ends[0], ends[0] + 7, ends[1], ends[2], len(whole) - 1):
        file.write_bytes(whole[:kept])
        with Store(tmp_path / "s", ASKED) as store:
            assert [r.point for r in store.rows()] == [4]
            store.append([[row(0), row(1), row(2)]])
        assert file.read_bytes() == whole
    with Store(tmp_path / "s", ASKED) as store:
        assert list(store.rows()) == [row(n) for n in (0, 1, 2, 4)]


def test_a_row_that_is_there_is_not_written_again(tmp_path: Path) -> None:
    with Store(tmp_path / "s", ASKED) as store:
        store.append([[row(1)]])
        with pytest.raises(ValueError, match="stored already"):
            store.append([[row(1)]])


def test_the_folder_is_of_one_sweep_and_one_process(tmp_path: Path) -> None:
    folder = tmp_path / "s"
    with Store(folder, ASKED) as store:
        store.append([[row(1)]])
        with pytest.raises(SceneError, match="in use by another"), Store(folder, ASKED):
            pass
    with pytest.raises(SceneError, match="holds another sweep"), Store(folder, {**ASKED, "vary": {}}):
        pass
    with Store(folder, {**ASKED, "vary": {}}, fresh=True) as store:
        assert len(store) == 0
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "notes.txt").write_text("mine")
    with pytest.raises(SceneError, match="not a sweep"), Store(tmp_path / "mine", ASKED, fresh=True):
        pass
    assert (tmp_path / "mine" / "notes.txt").read_text() == "mine"
