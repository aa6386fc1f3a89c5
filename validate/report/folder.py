"""The folder of one run's results: made beside its place, swapped in whole, and never at the cost of a user's file.

Its usual name tells apart everything that makes results different: the scene with each of its keys that is not as
usual, and each option that changes a number, leaves out a part or adds one. ``--no-figures`` is none of these.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import uuid
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from scenes.errors import SceneError, quoted, reason
from scenes.loading import distinguishes, shortened
from scenes.plan import Request
from scenes.units import POWER, TIME, VOLTAGE
from validate.run.pipeline import kind

PICTURE = "scene.png"
"""The picture of a scene that isn't solved yet: a folder that holds it alone is as good as empty."""
SCHEMA = 1
"""The version of summary.json."""

_OURS = re.compile(
    r"scene\.png|summary\.json|(traces|sensitivities)\.csv|(figure\w+|islands|islands_runs|air|why|sensitivity|validation)"
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
        self.partial = self.target.parent / f".{self.target.name}.{uuid.uuid4().hex[:8]}"
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

    def add(self, name: str, write: Callable[[Path], object]) -> Path:
        """Writes one file into ``target`` as it is, made where it isn't there; raises SceneError as entering does."""
        beside = self.target / f".{name}"
        try:
            self._check_target()
            self.target.mkdir(parents=True, exist_ok=True)
            write(beside)
            return beside.replace(self.target / name)
        except OSError as error:
            raise SceneError(
                f"output folder {quoted(self._given)} cannot be written ({reason(error)}): give another with --out"
            ) from None
        finally:
            beside.unlink(missing_ok=True)

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
        if any(entry.name != PICTURE for entry in target.iterdir()) and not _run(target):
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


def folder_of(scene: Any, request: Request, settings: Sequence[str] = (), data: Sequence[str] = ()) -> Path:
    """The folder of a run, "results/sink-2V-width20um-steady", "results/device-273K-paper-figure9" or
    "results/bridge-left-electrode.voltage2"; ``settings`` are the overrides, and ``data`` a file to compare with and
    what is said of its columns."""
    asked = ["sensitivities"] * request.sensitivities
    asked += [] if request.uncertain is None else ["uncertain", *request.uncertain.given]
    fields = ["fields"] * request.fields
    model = ["model", getattr(request.model, "__name__", str(request.model))] if request.model else []
    if kind(scene) == "free":
        return _safe(scene.name, *_words(settings), *model, *asked, *fields)
    if kind(scene) == "sink":
        words = [request.reduction.replace(":", "")] * (request.reduction != "paper")
        words += ["3d"] * (request.models == ("fem3d",)) + ["1d"] * (request.models == ("reduced1d",))
        words += ["steady"] * (not request.transient) + ["why"] * request.why + ["air"] * request.air
        words += [*asked, *request.data_uncertainty, *["calibrate"] * bool(request.calibrate), *request.calibrate]
        words += [f"monte-carlo-{request.monte_carlo}"] * (request.monte_carlo > 0)
        words += [*fields, *(TIME.show(time).replace(" ", "") for time in request.field_times)]
        words += ["against", data[0].replace("..", "up"), *data[1:]] if data else []
    else:
        words = ["3d"] * request.in_3d + ["paper"] * (request.scheme == "paper")
        words += [*request.about, request.meter or "", *asked]
        limits = (request.largest_voltage, VOLTAGE), (request.largest_power, POWER)
        words += [f"max{known.show(limit)}".replace(" ", "") for limit, known in limits if limit < float("inf")]
    # Overrides of what the checks are held to, which the scene's own text leaves out.
    found = (re.match(r"\s*(?:checks\.)?(tolerances|expect_differs)\b\.?(.*)", setting) for setting in settings)
    of_checks = [(match[2] or match[1]).replace("=", "") for match in found if match]
    return _safe(scene.name, distinguishes(scene), *words, *of_checks)


def folder_of_sweep(scene: str, kind: str, settings: Sequence[str], *words: str) -> Path:
    """ "results/sink-sweep-width10um-200um-20-steady": what varies and what is overridden, then other options."""
    return _safe(f"{scene}-{kind}", *_words([re.sub("[:,]", "-", text) for text in settings]), *words)


def _words(settings: Sequence[str]) -> list[str]:
    words = []
    for setting in settings:
        key, _, value = setting.partition("=")
        value = "" if value.strip() == "true" else value.strip()  # "results/hotplate-steady"
        words.append((key.strip().partition(".")[2] or key) + re.sub("^-", "minus", value))
    return words


def _safe(name: str, *words: str) -> Path:
    safe = [re.sub(r"[^\w.+-]", "", re.sub(r"[\s/\\]+", "-", word.strip())).strip("-.") for word in words]
    return Path("results") / "-".join(filter(None, (name, shortened("-".join(filter(None, safe))))))
