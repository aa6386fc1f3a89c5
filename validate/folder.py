"""A folder that a command writes: made beside its place, swapped in whole, and never at the cost of a user's file.

The folder of one run's results, and of an exported model.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import uuid
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from compare.options import FREE, SINK, Given, Option, of_kind
from scenes import loading
from scenes.errors import SceneError, quoted, reason

_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of the operating system for a full disk, quota or file size, and for failed writing."""
SCHEMA = 1
"""The version of summary.json."""


@dataclass(frozen=True)
class Content:
    """The content of such a folder.

    Attributes
    ----------
    name : of the content, such as "a run of this program"
    option : the option that names another folder
    files : pattern of the files that belong to it
    document : the JSON file that marks it, and ``keys``, some of its keys
    """

    name: str
    option: str
    files: re.Pattern[str]
    document: str
    keys: tuple[str, ...]

    def of(self, folder: Path) -> dict[str, Any]:
        """The document in a folder; empty where it holds something else, or nothing."""
        try:
            document = json.loads((folder / self.document).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return document if isinstance(document, dict) and all(key in document for key in self.keys) else {}


class Folder:
    """A context with a new folder ``partial`` to write into; on leaving, it takes the place of ``target``.

    The document of the old content is in ``replaced``; files of the user are kept. On an exception ``target`` stays as
    it was and ``partial`` is removed; a killed process leaves ``partial``, whose name starts with a dot. Entering
    raises SceneError where ``target`` cannot be written or is not ours to replace: a file, or a folder with other
    content alone.
    """

    def __init__(self, target: Path, content: Content) -> None:
        self._given, self._content = target, content
        # A link stays a link: its target is replaced.
        self.target = Path(os.path.realpath(target))
        self.partial = self.target.parent / f".{self.target.name}.{uuid.uuid4().hex[:8]}"
        self._parents: list[Path] = []
        self.replaced: dict[str, Any] = {}

    def __enter__(self) -> Folder:
        shown, option = quoted(self._given), self._content.option
        try:
            if fault := self._fault():
                raise SceneError(f"{option} {shown} {fault}")
            self._parents = [parent for parent in self.partial.parents if not parent.exists()]
            self.partial.mkdir(parents=True)
        except (OSError, ValueError) as error:
            if isinstance(error, SceneError):
                raise
            self._clear()
            raise SceneError(f"{option} {shown} cannot be written ({reason(error)}): give another folder") from None
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, trace: object) -> None:
        option = self._content.option
        try:
            check_room(value, self.partial, self._given, f"or give a folder elsewhere with {option}")
            if kind is None:
                self._swap()
        except OSError as error:
            raise SceneError(f"{option} {quoted(self._given)} cannot be replaced ({reason(error)})") from None
        finally:
            self._clear()

    def _fault(self) -> str:
        """The reason not to replace ``target``; empty without one."""
        target, content = self.target, self._content
        if not target.exists():
            return ""
        if not target.is_dir():
            return "is a file: give a folder"
        if not os.access(target, os.W_OK | os.X_OK):
            return "is not writable: give another folder"
        if os.path.ismount(target) or Path(os.path.realpath(os.curdir)).is_relative_to(target):
            return "is where you are or a mount: give a folder inside it"
        if any(target.iterdir()) and not content.of(target):
            return f"has files that are not {content.name}, and is left as it is: give a new or empty folder"
        return ""

    def _swap(self) -> None:
        """Swap ``partial`` and ``target``; files of the user stay in ``target``."""
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
        self.replaced = self._content.of(self.partial)
        for entry in list(self.partial.iterdir()):
            if not self._content.files.fullmatch(entry.name):
                place = self.target / entry.name
                if os.path.lexists(place):  # of a run that ended meanwhile
                    place = place.with_name(f"{entry.name}.{uuid.uuid4().hex[:8]}")
                entry.rename(place)

    def _clear(self) -> None:
        """Remove ``partial`` and the parents made for it that have remained empty."""
        shutil.rmtree(self.partial, ignore_errors=True)
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


def _exchange(a: Path, b: Path) -> bool:
    """Swap two folders' names in one step, where the system can (Linux); return False where it can't."""
    import ctypes

    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError, TypeError):
        return False
    current_directory, exchange = -100, 2
    return rename(current_directory, os.fsencode(a), current_directory, os.fsencode(b), exchange) == 0


RUN = Content(
    "a run of this program", "--out",
    re.compile(r"(summary\.json|report\.html|(traces|sensitivities)\.csv|(figure\w+|why)\.(png|svg)|fem3d\.pvd|fem3d_\w+\.vtu)"),
    "summary.json", ("schema", "plan"),
)  # fmt: skip

MODEL = Content(
    "a model of this program", "--export",
    re.compile(r"model\.(json|cir|py|fmu)|controllers\.(py|fmu)|__pycache__"), "model.json", ("scene", "matrices"),
)  # fmt: skip


def folder_of_run(kind: str, given: Given, scene: Any, overrides: Sequence[str]) -> Path:
    """Return the usual folder of a run, "results/sink-2V-width20um-steady".

    ``overrides`` are the settings of the scene, of a free scene with the keys that options stand for.
    """
    # A key of the scene is in the name by the scene, or by the overrides; a sink has no key for --steady.
    named = [option for option in of_kind(kind) if not option.sets or (kind == SINK and option.name == "--steady")]
    words = [word for option in named for word in _words(option, given.get(option.key))]
    if kind == FREE:
        return _folder(scene.name, *_setting_words(overrides), *words)
    # Overrides of tolerances, which the scene's own text leaves out.
    of_checks = [setting for setting in overrides if re.match(r"\s*(checks\.)?(tolerances|expect_differs)\b", setting)]
    return _folder(scene.name, loading.distinguishes(scene), *words, *_setting_words(of_checks))


def folder_of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": the varied and the overridden keys, then other options."""
    return _folder(f"{scene}-{kind}", *_setting_words([re.sub("[:,]", "-", text) for text in settings]), *words)


def _words(option: Option, text: Any) -> list[str]:
    """The words of an option in a folder's name: its name and the text, unless ``in_name`` differs."""
    if text == option.default or text in (None, False) or option.in_name == "":
        return []
    texts = [str(part) for part in text] if option.repeats else [str(text)] * (not option.switch)
    if option.in_name is not None:
        return [option.in_name.format(part) for part in texts]
    return [option.name.lstrip("-"), *texts]


def _setting_words(settings: Sequence[str]) -> list[str]:
    """The words of settings in a folder's name: "width20um"."""
    words = []
    for key, _, value in (setting.partition("=") for setting in settings):
        value = "" if value.strip() == "true" else value.strip()  # "results/hotplate-steady"
        words.append((key.strip().partition(".")[2] or key) + re.sub("^-", "minus", value))
    return words


def _folder(name: str, *words: str) -> Path:
    """A folder below results/, its name without characters that a file system or a shell minds."""
    words = tuple(re.sub(r":(?=\d)", "", word.replace("..", "up")) for word in words)
    safe = [re.sub(r"[^\w.+-]", "", re.sub(r"[\s/\\:]+", "-", word.strip())).strip("-.") for word in words]
    return Path("results") / "-".join(filter(None, (name, loading.shortened("-".join(filter(None, safe))))))
