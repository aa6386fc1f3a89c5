"""The folder of a sweep: the request, and the rows so far, each on disk before it is reported."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping
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
    """A context that locks a folder, reads the rows of an earlier run and appends further ones.

    The file of rows has a line for each; a line that a kill has torn, or that is no row, is ignored.
    """

    def __init__(self, folder: Path, request: Mapping[str, Any], fresh: bool = False) -> None:
        self.folder = Path(os.path.realpath(folder))
        self._given, self._shown, self._request, self._fresh = folder, quoted(folder), dict(request), fresh
        self._stored: dict[int, Row] = {}

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
            with suppress(OSError):  # the buffer still holds unwritten bytes
                self._rows.close()
            self._lock.release()

    def _check_room(self, error: object) -> None:
        check_room(error, self.folder, self._given, "and the same command goes on: what is solved is stored")

    def __contains__(self, point: int) -> bool:
        return point in self._stored

    def __len__(self) -> int:
        return len(self._stored)

    def append(self, rows: Iterable[Row]) -> None:
        """Write rows, which are on disk when this returns. ValueError for a row that is there."""
        for row in rows:
            if row.point in self._stored:
                raise ValueError(f"point {row.point} is stored already")
            self._stored[row.point] = row
            self._rows.write((json.dumps(asdict(row)) + "\n").encode())
        self._rows.flush()
        os.fsync(self._rows.fileno())

    def rows(self) -> list[Row]:
        """Return all rows in the order of their points."""
        return [self._stored[point] for point in sorted(self._stored)]

    @contextmanager
    def writing(self, name: str) -> Iterator[TextIO]:
        """Open a file that is put into the folder at the end, whole or not at all."""
        partial = self.folder / f".{name}"
        with partial.open("w", encoding="utf-8", newline="") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        partial.replace(self.folder / name)

    def write(self, document: Mapping[str, Any]) -> None:
        """Write sweep.json."""
        with self.writing(SUMMARY) as file:
            file.write(json.dumps(document, indent=1) + "\n")

    def _begin(self) -> None:
        """Read the rows of an earlier run of the same request; refuse another, or remove it for a fresh start."""
        earlier = _read_request(self.folder / SUMMARY)
        if self._fresh:
            for path in self.folder.iterdir():
                if _OURS.fullmatch(path.name):
                    path.unlink()
        elif earlier is not None and earlier != self._request:
            key = next((key.replace("_", " ") for key in self._request if earlier.get(key) != self._request[key]), "")
            held = f"another sweep (its {key} differs)" if earlier else f"a sweep whose {SUMMARY} was changed"
            raise SceneError(f"{self._shown} holds {held}: give another folder with --out, or --fresh to start over")
        if self._fresh or earlier is None:
            self.write({"schema": 1, "asked": self._request, "finished": False})
        (self.folder / ROWS).touch()
        self._rows = (self.folder / ROWS).open("r+b")
        place = 0
        for line in self._rows:
            if not line.endswith(b"\n"):
                break
            with suppress(ValueError, TypeError):
                row = Row(**json.loads(line))
                self._stored[row.point] = row
            place += len(line)
        self._rows.seek(place)
        self._rows.truncate()


def _read_request(path: Path) -> dict[str, Any] | None:
    """The request of an earlier run, empty where its file was changed; ``None`` where there was none."""
    try:
        request: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))["asked"]
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError):
        return {}
    return request
