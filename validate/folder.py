"""A folder that a command writes: made beside its place, swapped in whole, and never at the cost of a user's file.

The folder of one run's results, and of an exported model.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import time
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.options import safe_folder, setting_words
from scenes.errors import SceneError, quoted, reason

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of the operating system for a full disk, quota or file size, and for failed writing."""
PICTURE = "scene.png"
"""The picture of a scene that is not solved yet."""
SCHEMA = 1
"""The version of summary.json."""


@dataclass(frozen=True)
class Content:
    """The content of such a folder.

    Attributes
    ----------
    name : of the content, such as "a run of this program"
    role : of the folder, such as "output"
    option : the option that names another folder
    files : pattern of the files that belong to it
    document : the JSON file that marks it, and ``keys``, some of its keys
    before : files written before the document, which alone need not be kept
    """

    name: str
    role: str
    option: str
    files: re.Pattern[str]
    document: str
    keys: tuple[str, ...]
    before: tuple[str, ...] = ()

    def of(self, folder: Path) -> dict[str, Any]:
        """The document in a folder; empty where it holds something else, or nothing."""
        try:
            document = json.loads((folder / self.document).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return document if isinstance(document, dict) and all(key in document for key in self.keys) else {}

    def among(self, folder: Path) -> set[str]:
        """The names of its files there; all others are the user's."""
        return {entry.name for entry in folder.iterdir() if self.files.fullmatch(entry.name)}


class Folder:
    """A context with a new folder ``partial`` to write into; on leaving, it takes the place of ``target``.

    The old content is ``replaced``: its document and the names of its files; other files of the user are kept. On an
    exception ``target`` stays as it was and ``partial`` is removed; after a kill, the next run there removes it.
    Entering raises SceneError where ``target`` cannot be written or is not ours to replace: a file, or a folder with
    other content alone.
    """

    def __init__(self, target: Path, content: Content) -> None:
        self._given, self._content = target, content
        # A link stays a link: its target is replaced.
        self.target = Path(os.path.realpath(target))
        self.partial = self.target.parent / f".{self.target.name}.{uuid.uuid4().hex[:8]}"
        self._shown = f"{content.role} folder {quoted(target)}"
        self._parents: list[Path] = []
        self._lock: int | None = None
        self.replaced: tuple[dict[str, Any], set[str]] = {}, set()

    def __enter__(self) -> Folder:
        try:
            self._remove_abandoned()
            self._check_target()
            self._parents = [parent for parent in self.partial.parents if not parent.exists()]
            new = self.partial.with_name(f"{self.partial.name}.new")  # by which nobody removes it before it is locked
            new.mkdir(parents=True)
            self._lock = _locked(new)
            new.rename(self.partial)
        except SceneError:
            raise
        except (OSError, ValueError) as error:
            self._clear()
            raise SceneError(
                f"{self._shown} cannot be written ({reason(error)}): give another with {self._content.option}"
            ) from None
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: object) -> None:
        try:
            check_room(value, self.partial, self._given, f"or give a folder elsewhere with {self._content.option}")
            if kind is None:
                self._swap()
        except OSError as error:
            raise SceneError(f"{self._shown} cannot be replaced ({reason(error)})") from None
        finally:
            self._clear()

    def add(self, name: str, write: Callable[[Path], object]) -> Path:
        """Writes one file into ``target`` as it is, made where it isn't there. Raises SceneError as entering does."""
        beside = self.target / f".{uuid.uuid4().hex[:8]}.{name}"
        try:
            self._check_target()
            self.target.mkdir(parents=True, exist_ok=True)
            write(beside)
            return beside.replace(self.target / name)
        except OSError as error:
            raise SceneError(
                f"{self._shown} cannot be written ({reason(error)}): give another with {self._content.option}"
            ) from None
        finally:
            with suppress(OSError):
                beside.unlink()

    def _check_target(self) -> None:
        target, option = self.target, self._content.option
        if not target.exists():
            return
        if not target.is_dir():
            raise SceneError(f"{self._shown} is a file: give a folder with {option}")
        if not os.access(target, os.W_OK | os.X_OK):
            raise PermissionError("it is not writable")
        current_folder = Path(os.path.realpath(os.curdir))
        if os.path.ismount(target) or current_folder.is_relative_to(target):
            raise SceneError(f"{self._shown} is where you are or a mount: give a folder inside it with {option}")
        others = {entry.name for entry in target.iterdir()} - {*self._content.before}
        if others and not self._content.of(target):
            raise SceneError(
                f"{self._shown} has files that are not {self._content.name}, and is left as it is: give a new or empty "
                f"folder with {option}"
            )

    def _swap(self) -> None:
        """Swap ``partial`` and ``target``; files of the user stay in ``target``."""
        if not self.target.exists():
            self.partial.rename(self.target)
            return
        lock = _locked(self.target)  # under its other name it is ours too
        try:
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
            self.replaced = self._content.of(self.partial), self._content.among(self.partial)
            self._keep(self.partial)
        finally:
            if lock is not None:
                os.close(lock)

    def _keep(self, old: Path) -> None:
        """Move the user's files from a replaced folder to the new folder."""
        for name in {entry.name for entry in old.iterdir()} - self._content.among(old):
            place = self.target / name
            if os.path.lexists(place):  # of a run that ended meanwhile
                place = place.with_name(f"{name}.{uuid.uuid4().hex[:8]}")
            (old / name).rename(place)

    def _remove_abandoned(self) -> None:
        """Remove the remains of killed processes beside this folder; files of the user go back to their place, and so
        does a whole folder that had just been moved away."""
        pattern = re.compile(rf"\.{re.escape(self.target.name)}\.[0-9a-f]{{8}}(\.new|\.old)?")
        with suppress(OSError):  # it is no reason not to run
            for entry in list(self.target.parent.iterdir()):
                if pattern.fullmatch(entry.name):
                    self._remove(entry)

    def _remove(self, abandoned: Path) -> None:
        lock = _locked(abandoned)
        if lock is None:
            return
        try:
            if abandoned.suffix == ".new" and time.time() - abandoned.stat().st_mtime < 60:
                return  # it is about to be locked
            if abandoned.suffix == ".old" and not self.target.exists():
                abandoned.rename(self.target)
                return
            if self.target.exists():
                self._keep(abandoned)
            if {entry.name for entry in abandoned.iterdir()} == self._content.among(abandoned):
                shutil.rmtree(abandoned)
        finally:
            os.close(lock)

    def _clear(self) -> None:
        """Removes ``partial`` and the parents made for it that have remained empty."""
        shutil.rmtree(self.partial, ignore_errors=True)
        if self._lock is not None:
            os.close(self._lock)
        for parent in self._parents:
            with suppress(OSError):
                parent.rmdir()


def check_room(error: object, folder: Path, shown: Path, otherwise: str) -> None:
    """Raise SceneError with the file in the folder (``shown`` to the user) for an error that means that no room is
    left; any other passes."""
    if not isinstance(error, OSError) or (error.filename is not None and error.errno not in _FULL):
        return
    if error.filename is not None:
        file = Path(os.fsdecode(error.filename))
    else:  # where writing fails, as against opening, the system names none: it is the one that was written last
        file = max(folder.iterdir(), key=lambda entry: entry.stat().st_mtime_ns, default=Path())
    raise SceneError(
        f"{quoted(shown / file.name)} cannot be written ({reason(error)}): make room, {otherwise}"
    ) from None


def _locked(folder: Path) -> int | None:
    """A descriptor that keeps a folder locked as long as this process has it open; ``None`` where another has it locked
    or the system has no locks of folders."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        held = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return None
    try:
        fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(held)
        return None
    return held


def _exchange(a: Path, b: Path) -> bool:
    """Swaps two folders' names in one step, where the system can (Linux); False where it can't."""
    import ctypes

    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    current_directory, exchange = -100, 2
    return rename(current_directory, os.fsencode(a), current_directory, os.fsencode(b), exchange) == 0


RUN = Content(
    "a run of this program", "output", "--out",
    re.compile(
        r"scene\.png|summary\.json|(traces|sensitivities)\.csv|(figure\w+|islands|islands_runs|left_out|why|sensitivity"
        r"|shielding|validation)\.(png|svg)|fem3d\.(pvd|vtkhdf)|fem3d_\w+\.vtu|report\.html"
    ),
    "summary.json", ("schema", "plan"), (PICTURE,),
)  # fmt: skip

MODEL = Content(
    "a model of this program", "export", "--export",
    re.compile(r"model\.(json|cir|py|fmu)|controllers\.(py|fmu)|__pycache__"), "model.json", ("scene", "matrices"),
)  # fmt: skip


def replaced(folder: Folder) -> str:
    """Return a sentence on the replaced run and its files that the new run lacks; empty without a replaced run."""
    earlier, names = folder.replaced
    if not earlier:
        return ""
    command = earlier.get("command")
    same = command == RUN.of(folder.target).get("command")
    which = "of the same command" if same else "there" + f" ({command})" * bool(command)
    gone = {_kind(name) for name in names} - {_kind(name) for name in RUN.among(folder.target)}
    return f"the earlier run {which}" + (f", gone with it: {', '.join(sorted(gone))}" if gone else "")


def _kind(name: str) -> str:
    """Return the group of a file: a figure in two formats, the fields."""
    if name.startswith("fem3d"):
        return "fields"
    return name.partition(".")[0] if name.endswith((".png", ".svg")) else name


def folder_of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": the varied and the overridden keys, then other options."""
    return safe_folder(f"{scene}-{kind}", *setting_words([re.sub("[:,]", "-", text) for text in settings]), *words)
