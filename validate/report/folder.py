"""The folder of one run's results: made beside its place, swapped in whole, and never at the cost of a user's file."""

from __future__ import annotations

import json
import os
import re
import shutil
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

from scenes.errors import SceneError, quoted, reason

SCHEMA = 1
"""The version of summary.json."""

_OURS = re.compile(
    r"summary\.json|(traces|sensitivities)\.csv|(figure\w+|islands|islands_runs|air|why|sensitivity|validation)"
    r"\.(png|svg)|fem3d\.(pvd|vtkhdf)|fem3d_\w+\.vtu|report\.html"
)


class Folder:
    """A context in which ``partial`` is a new folder to write into; on leaving, it takes the place of ``target``.

    An earlier run there is replaced, and ``replaced`` says which; what else a user has put into it is kept. On an
    exception ``target`` stays as it was and ``partial`` is removed. Entering raises SceneError where ``target`` can't
    be written or is not ours to replace: a file, or a folder with content that is not a run.
    """

    def __init__(self, target: Path) -> None:
        self._given = target
        # A link stays a link: it is what it points to that is replaced.
        self.target = Path(os.path.realpath(target))
        self.partial = self.target.with_name(f".{self.target.name}.{uuid.uuid4().hex[:8]}")
        self._parents: list[Path] = []
        self.replaced = ""

    def __enter__(self) -> Folder:
        try:
            self._check_target()
            self._parents = [parent for parent in self.partial.parents if not parent.exists()]
            self.partial.mkdir(parents=True)
        except SceneError:
            raise
        except (OSError, ValueError) as error:
            self._clear()
            raise SceneError(
                f"output folder {quoted(self._given)} cannot be written ({reason(error)}): give another with --out"
            ) from None
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: object) -> None:
        try:
            if isinstance(value, OSError) and value.filename is None:
                # Where a disk is full the system names no file: it is the one that was being written last.
                written = max(self.partial.iterdir(), key=lambda entry: entry.stat().st_mtime_ns, default=Path())
                raise SceneError(
                    f"{quoted(self._given / written.name)} cannot be written ({reason(value)}): make room, or give a "
                    "folder elsewhere with --out"
                ) from None
            if kind is None:
                self._swap()
        except OSError as error:
            raise SceneError(f"output folder {quoted(self._given)} cannot be replaced ({reason(error)})") from None
        finally:
            self._clear()

    def _check_target(self) -> None:
        target, shown = self.target, f"output folder {quoted(self._given)}"
        if not target.exists():
            return
        if not target.is_dir():
            raise SceneError(f"{shown} is a file: give a folder with --out")
        if not os.access(target, os.W_OK | os.X_OK):
            raise PermissionError("it is not writable")
        here = Path(os.path.realpath(os.curdir))
        if os.path.ismount(target) or here.is_relative_to(target):
            raise SceneError(f"{shown} is where you are or a mount: give a folder inside it with --out")
        if any(target.iterdir()) and not _run(target):
            raise SceneError(
                f"{shown} has files that are not a run of this program, and is left as it is: give a new or empty "
                "folder with --out"
            )

    def _swap(self) -> None:
        """``partial`` at ``target``'s place; an earlier run is left at ``partial``'s, less what is the user's."""
        if not self.target.exists():
            self.partial.rename(self.target)
            return
        if not _exchange(self.partial, self.target):
            # There is a moment without a folder then; if the second step fails, the first is undone.
            old = self.partial.with_name(f"{self.partial.name}.old")
            self.target.rename(old)
            try:
                self.partial.rename(self.target)
            except OSError:
                old.rename(self.target)
                raise
            old.rename(self.partial)
        self.replaced = _replaced(self.partial, self.target)
        for entry in list(self.partial.iterdir()):
            if not _OURS.fullmatch(entry.name):
                entry.rename(self.target / entry.name)

    def _clear(self) -> None:
        """Removes ``partial`` and the parents made for it that have remained empty."""
        shutil.rmtree(self.partial, ignore_errors=True)
        for parent in self._parents:
            with suppress(OSError):
                parent.rmdir()


def _run(folder: Path) -> dict[str, Any]:
    """The summary of the run in a folder; empty where there is none."""
    try:
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("schema"), int) and "plan" in found else {}


def _replaced(old: Path, new: Path) -> str:
    """Which run has been replaced, and what of it the new one does not have; empty where there was none."""
    found = _run(old)
    if not found:
        return ""
    command = found.get("command")
    which = "of the same command" if command == _run(new).get("command") else "there" + f" ({command})" * bool(command)
    gone = {_kind(entry.name) for entry in old.iterdir() if _OURS.fullmatch(entry.name)}
    gone -= {_kind(entry.name) for entry in new.iterdir()}
    return f"the earlier run {which}" + (f", gone with it: {', '.join(sorted(gone))}" if gone else "")


def _kind(name: str) -> str:
    """What a file is one of several of: a figure in two formats, the fields."""
    if name.startswith("fem3d"):
        return "fields"
    return name.partition(".")[0] if name.endswith((".png", ".svg")) else name


def _exchange(a: Path, b: Path) -> bool:
    """Swaps two folders' names in one step, where the system can (Linux); False where it can't."""
    import ctypes

    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    current_directory, exchange = -100, 2
    return rename(current_directory, os.fsencode(a), current_directory, os.fsencode(b), exchange) == 0
