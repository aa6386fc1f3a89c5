"""The folder of a sweep: the request, and the rows so far, each on disk before it is reported."""

from __future__ import annotations

import fcntl
import json
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TextIO

from scenes.errors import SceneError, quoted, reason
from validate.folder import check_room
from validate.sweep.design import Row

ROWS, SUMMARY = "points.jsonl", "sweep.json"
_OLD = re.compile(r"(points|map)\.csv|report\.html|figure_\w+\.(png|svg)")


class Store:
    """A context that locks a folder, reads the ``rows`` of an earlier run, by point, and appends further ones.

    The file of rows has a line for each; a line that a kill has torn, or that is no row, is ignored.
    """

    def __init__(self, folder: Path, request: Mapping[str, Any], fresh: bool = False) -> None:
        self.folder, self._given, self._request, self._fresh = Path(os.path.realpath(folder)), folder, request, fresh
        self.rows: dict[int, Row] = {}

    def __enter__(self) -> Store:
        """Raises SceneError for a folder that can't be written, holds something else, or is in use."""
        shown = quoted(self._given)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            names = {path.name for path in self.folder.iterdir() if not path.name.startswith(".")}
            if names - {ROWS} and SUMMARY not in names:
                raise ValueError("it has files that are not a sweep, and is left as it is")
            self._file = (self.folder / ROWS).open("a+b")
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise SceneError(f"{shown} is in use by another sweep or map: wait for it, or give another --out") from None
        except (OSError, ValueError) as error:
            raise SceneError(f"folder {shown} cannot be written ({reason(error)}): give another with --out") from None
        try:
            self._begin()
        except BaseException as error:
            self.__exit__(None, error)
            raise
        return self

    def __exit__(self, kind: object, error: object, trace: object = None) -> None:
        try:
            check_room(error, self.folder, self._given, "and the same command goes on: what is solved is stored")
        finally:
            with suppress(OSError):  # the buffer still holds unwritten bytes
                self._file.close()

    def append(self, row: Row) -> None:
        """Write a row, which is on disk when this returns."""
        self.rows[row["point"]] = row
        self._file.write((json.dumps(row) + "\n").encode())
        self._file.flush()
        os.fsync(self._file.fileno())

    @contextmanager
    def writing(self, name: str) -> Iterator[TextIO]:
        """Open a file that is put into the folder at the end, whole or not at all."""
        partial = self.folder / f".{name}"
        with partial.open("w", encoding="utf-8", newline="") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(self.folder / name)

    def _begin(self) -> None:
        """Read the rows of an earlier run of the same request; refuse another, or remove it for a fresh start."""
        summary, earlier = self.folder / SUMMARY, dict[str, Any]()
        if self._fresh:
            self._file.truncate(0)
            for path in self.folder.iterdir():
                if _OLD.fullmatch(path.name):
                    path.unlink()
        elif summary.exists():
            with suppress(ValueError, KeyError, TypeError):  # of a file that somebody changed
                earlier = dict(json.loads(summary.read_text(encoding="utf-8"))["asked"])
            if earlier != self._request:
                key = next((key for key, value in self._request.items() if earlier.get(key) != value), "request")
                held = f"{quoted(self._given)} holds another sweep (its {key.replace('_', ' ')} differs)"
                raise SceneError(f"{held}: give another folder with --out, or --fresh to start over")
        with self.writing(SUMMARY) as file:
            json.dump({"schema": 1, "asked": self._request, "finished": False}, file)
        self._file.seek(0)
        line = b"\n"
        for line in self._file:
            with suppress(ValueError, TypeError, KeyError):
                row = json.loads(line)
                self.rows[row["point"]] = row
        if not line.endswith(b"\n"):
            self._file.write(b"\n")
