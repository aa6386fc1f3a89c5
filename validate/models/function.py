"""A model that is a Python function: f(scene, times) -> {quantity: number or (n,) numbers}.

``scene`` is the scene's document in SI numbers, and ``times`` (n,) are in s, or None in the steady state. What the
function prints goes to standard error, so that it is no part of what the command prints. A callable is called here, the
function of a file in a process of its own (`validate.models.apart`).
"""

from __future__ import annotations

import copy
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from compare.processes import TimeIsUpError
from scenes.errors import SceneError, did_you_mean, listed, printable, quoted
from validate.models import Answer, Asked, readable


@dataclass
class Function:
    """A callable as a model, perhaps of a ``file``; what its threads raise is ``in_threads``, and is its own then."""

    call: Callable[..., Any]
    name: str = ""
    file: Path | None = None
    in_threads: list[BaseException] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.name = self.name or getattr(self.call, "__name__", type(self.call).__name__)

    def rows(self, question: Asked) -> np.ndarray:
        return np.empty(0)

    def steady(self, question: Asked) -> Answer:
        return self._called(question, None), {}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        return self._called(question, times.copy()), {}

    def _called(self, question: Asked, times: np.ndarray | None) -> Mapping[str, Any]:
        document = copy.deepcopy(dict(question.document))
        when = "in the steady state" if times is None else "over time"
        process = os.getpid()
        with _sentences(self.name, self.file, f" when it was asked {when}"), _beside(self.file):
            answer = self.call(document, times)
            if os.getpid() != process:
                os._exit(0)  # a copy that the model made of this process: there is one run, and one that writes
            if self.in_threads:
                raise self.in_threads[0]
        if answer is None:
            return {}
        if not isinstance(answer, Mapping):
            raise SceneError(
                f"--model {self.name} returned {quoted(type(answer).__name__)} {when}: return a dict such as "
                f"{{{next(iter(question.steady or question.over_time), 'probe')!r}: 300.0}}"
            )
        return answer


def opened(given: str, folder: str, in_threads: list[BaseException]) -> Function:
    """The function of FILE.py:FUNCTION; the file is run for it, with its own folder on the path for its imports."""
    file, _, name = given.rpartition(":")
    path = readable(file, folder, "a Python file and a function in it, such as lumped.py:bridge")
    if not name.strip():
        raise SceneError(f"--model {quoted(given)} names no function: give {printable(file)}:FUNCTION")
    spec = importlib.util.spec_from_file_location(f"model_{path.stem}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    with _sentences(path.name, path, ""), _beside(path):
        spec.loader.exec_module(module)
    call = getattr(module, name, None)
    defined = {n: each for n, each in vars(module).items() if getattr(each, "__module__", None) == spec.name}
    functions = [n for n, each in defined.items() if callable(each) and not n.startswith("_")]
    if not callable(call):
        what = f"has no function {quoted(name)}" if call is None else f"has {quoted(name)}, but not as a function"
        has = f"give {listed(functions)}" if functions else "it has none"
        raise SceneError(f"--model {quoted(given)}: {path.name} {what}: {has}{did_you_mean(name, functions)}")
    return Function(call, f"{path.name}:{name}", path, in_threads)


@contextmanager
def _beside(file: Path | None) -> Iterator[None]:
    """With the folder of the user's file on the path for its imports, also for those that a function makes."""
    before = sys.path.copy()
    if file is not None:
        sys.path.insert(0, str(file.parent.resolve()))
    try:
        yield
    finally:
        sys.path[:] = before


@contextmanager
def _sentences(name: str, file: Path | None, when: str) -> Iterator[None]:
    """Whatever the user's code raises, as a sentence with its line: that of the innermost frame in the user's file."""
    try:
        with redirect_stdout(sys.stderr):
            yield
    except (KeyboardInterrupt, TimeIsUpError):
        raise
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        its_own = (lambda f: Path(f.filename).resolve() == file.resolve()) if file else lambda f: f.filename != __file__
        user_frames = [frame for frame in frames if its_own(frame)]
        where = f"{Path(user_frames[-1].filename).name}, line {user_frames[-1].lineno}: " if user_frames else ""
        if isinstance(error, SyntaxError) and error.lineno is not None:
            where = f"{Path(error.filename or name).name}, line {error.lineno}: "
        said = f"{type(error).__name__}: {printable(_message(error), 200)}".rstrip(": ")
        if isinstance(error, TypeError) and when and not user_frames:
            said += "; it is called as f(scene, times)"
        raise SceneError(f"--model {name} failed{when}: {where}{said}") from None


def _message(error: BaseException) -> str:
    """What an exception says, unless it fails even at that."""
    try:
        return str(error)
    except Exception:
        return ""
