"""The folder of a sweep: what was asked, and the rows found so far, each on disk before it is spoken of."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from scenes.errors import SceneError, quoted, reason
from validate.folder import check_room
from validate.sweep.point import Row

ROWS, SUMMARY = "points.jsonl", "sweep.json"
_OURS = re.compile(r"points\.(jsonl|csv)|map\.csv|report\.html|figure_\w+\.(png|svg)")


class Store:
    """A context in which a folder is ours alone: rows are appended to it, and those of an earlier run are there.

    A file of rows has one line a task, a list of its rows; what a kill leaves of a line is cut off, so that a task is
    there whole or not at all. Of a line that somebody has changed, so that it holds no rows of the ``count`` points,
    nothing is taken. In memory are only the places of the lines.
    """

    def __init__(
        self, folder: Path, settings: Mapping[str, Any], fresh: bool = False, count: int = sys.maxsize
    ) -> None:
        self.folder, self._count = Path(os.path.realpath(folder)), count
        self._given, self._shown, self._asked, self._fresh = folder, quoted(folder), dict(settings), fresh
        self._places: dict[int, tuple[int, int]] = {}  # where a point's line begins, and which row of it is the point's

    def __enter__(self) -> Store:
        """Raises SceneError for a folder that can't be written, holds something else, or is in use."""
        from locket import LockError, lock_file

        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            names = {path.name for path in self.folder.iterdir() if not path.name.startswith(".")}
            if names and SUMMARY not in names:
                raise ValueError("it has files that are not a sweep, and is left as it is")
            self._lock = lock_file(str(self.folder / ".lock"), timeout=0)
            self._lock.acquire()
        except LockError:
            raise SceneError(
                f"{self._shown} is in use by another sweep or map: wait for it, or give another folder with --out"
            ) from None
        except (OSError, ValueError) as error:
            raise SceneError(
                f"folder {self._shown} cannot be written ({reason(error)}): give another with --out"
            ) from None
        try:
            self._begin()
        except BaseException as error:
            self._lock.release()
            self._check_room(error)
            raise
        return self

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        # The file of the lock stays: were it removed, two others could each lock one of that name.
        try:
            self._check_room(error)
        finally:
            with suppress(OSError):  # of what could not be written there is some left
                self._rows.close()
            self._lock.release()

    def _check_room(self, error: object) -> None:
        check_room(error, self.folder, self._given, "and the same command goes on: what is solved is stored")

    def __contains__(self, point: int) -> bool:
        return point in self._places

    def __len__(self) -> int:
        return len(self._places)

    def append(self, tasks: Sequence[Sequence[Row]]) -> None:
        """Writes the rows of some tasks; they are on disk when this returns. ValueError for a row that is there."""
        end = self._rows.seek(0, os.SEEK_END)
        for rows in tasks:
            for n, row in enumerate(rows):
                if row.point in self._places:
                    raise ValueError(f"point {row.point} is stored already")
                self._places[row.point] = end, n
            end += self._rows.write((json.dumps([asdict(row) for row in rows]) + "\n").encode())
        self._rows.flush()
        os.fsync(self._rows.fileno())

    def rows(self, points: Iterable[int] | None = None) -> Iterator[Row]:
        """The rows of some points, or all in the order of their points, read one by one."""
        with (self.folder / ROWS).open("rb") as file:
            for point in sorted(self._places) if points is None else points:
                place, n = self._places[point]
                file.seek(place)
                yield Row(**json.loads(file.readline())[n])

    @contextmanager
    def writing(self, name: str) -> Iterator[TextIO]:
        """A file to write to, which is then put into the folder, whole or not at all."""
        partial = self.folder / f".{name}"
        with partial.open("w", encoding="utf-8", newline="") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(self.folder / name)

    def write(self, document: Mapping[str, Any]) -> None:
        with self.writing(SUMMARY) as file:
            file.write(json.dumps(document, indent=1) + "\n")

    def _begin(self) -> None:
        """The rows of an earlier run of the same; those of another are refused, or removed for a fresh start."""
        earlier = _asked(self.folder / SUMMARY)
        if self._fresh:
            for path in self.folder.iterdir():
                if _OURS.fullmatch(path.name):
                    path.unlink()
        elif earlier is not None and earlier != self._asked:
            if not earlier:
                raise SceneError(
                    f"{self._shown} holds a sweep whose {SUMMARY} is not as it was written: give another folder with "
                    "--out, or --fresh to start over"
                )
            key = next((key.replace("_", " ") for key in self._asked if earlier.get(key) != self._asked[key]), None)
            raise SceneError(
                f"{self._shown} holds another sweep ({f'its {key} differs' if key else 'it says more'}): give "
                "another folder with --out, or --fresh to start over"
            )
        if self._fresh or earlier is None:
            self.write({"schema": 1, "asked": self._asked, "finished": False})
        (self.folder / ROWS).touch()
        self._rows = (self.folder / ROWS).open("r+b")
        self._rows.truncate(self._read())

    def _read(self) -> int:
        """Finds the rows that are there; returns where the last whole task ends."""
        place = 0
        for line in self._rows:
            if not line.endswith(b"\n"):
                break
            rows = _rows(line)
            if all(row.sound and 0 <= row.point < self._count for row in rows):
                self._places |= {row.point: (place, n) for n, row in enumerate(rows)}
            place += len(line)
        return place


def _rows(line: bytes) -> list[Row]:
    """What a line holds, none where that is no rows."""
    try:
        return [Row(**row) for row in json.loads(line)]
    except (ValueError, TypeError, RecursionError):
        return []


def _asked(path: Path) -> dict[str, Any] | None:
    """What an earlier run was asked, nothing where its file is no longer readable; ``None`` where there was none."""
    try:
        settings = json.loads(path.read_text(encoding="utf-8"))["asked"]
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return {}
    return settings if isinstance(settings, dict) else {}
