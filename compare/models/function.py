"""A model that is a Python function: f(scene, times) -> {quantity: number or (n,) numbers}.

``scene`` is the scene's document in SI numbers, and ``times`` (n,) are in s, or None in the steady state. A callable
is called in this process. The function of a file is called in a process of its own, so that this one survives it. The
function's output goes to standard error.
"""

from __future__ import annotations

import copy
import os
import runpy
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from compare.models.model import LONGEST, Answer, Model, Question, find_file
from compare.processes import TimeIsUpError
from compare.worker import Worker
from scenes.errors import SceneError, did_you_mean, listed, printable, quoted


class Function(Model):
    """A callable as a model; the ``file`` that defines it may be known."""

    def __init__(self, call: Callable[..., object], name: str = "", file: Path | None = None) -> None:
        self.name = name or getattr(call, "__name__", type(call).__name__)
        self._call, self._file = call, file

    def answer(self, question: Question, times: np.ndarray | None) -> Answer:
        when = "in the steady state" if times is None else "over time"
        with _sentences(self._file, f" when it was asked {when}"):
            answer = self._call(copy.deepcopy(dict(question.document)), None if times is None else times.copy())
        if not isinstance(answer, Mapping):
            wanted = f"return a dict such as {{{next(iter(question.units(times)), 'probe')!r}: 300.0}}"
            raise SceneError(f"it returned {quoted(type(answer).__name__)} {when}: {wanted}")
        shape = () if times is None else times.shape
        return Answer({str(name): self._numbers(str(name), value, shape, when) for name, value in answer.items()})

    def _numbers(self, name: str, value: object, shape: tuple[int, ...], when: str) -> np.ndarray:
        """Return a value as real numbers of a shape; masked ones are not numbers."""
        try:
            numbers: np.ma.MaskedArray = np.ma.asarray(value)
            if numbers.dtype.kind not in "fiu":
                raise TypeError
            array: np.ndarray = np.ma.filled(numbers.astype(float), np.nan)
            return np.broadcast_to(array.reshape(()) if array.size == 1 else array, shape).astype(float)
        except (TypeError, ValueError):
            needed = f"{shape[0]} real numbers, one for each time" if shape else "one real number"
            raise SceneError(f"{quoted(name)} {when} is {quoted(repr(value))}: give {needed}") from None


class FileFunction(Model):
    """The function of FILE.py:FUNCTION, in a process of its own."""

    def __init__(self, path: Path, function: str, saved: int) -> None:
        self.name = f"{path.name}:{function}"
        self._key = str(path), function, saved
        self._worker = Worker("it", quiet=False)
        self._worker.run(LONGEST, _ask, self._key, os.getcwd())

    def answer(self, question: Question, times: np.ndarray | None) -> Answer:
        return self._worker.run(LONGEST, _ask, self._key, os.getcwd(), question, times)


def open_model(given: str, folder: str) -> FileFunction:
    """Return the function of FILE.py:FUNCTION, loaded; the same as before where the file has not changed."""
    file, _, name = given.rpartition(":")
    path = find_file(file, folder, "a Python file and a function in it, such as lumped.py:bridge")
    return _open(path.resolve(), name, path.stat().st_mtime_ns)


_open = lru_cache(maxsize=1)(FileFunction)


def _ask(key: tuple[str, str, int], folder: str, *question: Any) -> Answer:
    """Return the answer of a file's function, which finds other files from ``folder``; without a question load the
    function alone. For a process of its own."""
    os.chdir(folder)
    function = _function(*key)
    return function.answer(*question) if question else Answer({})


@lru_cache(maxsize=1)
def _function(file: str, name: str, saved: int) -> Function:
    """Run a file that was ``saved`` at a time (ns), with its own folder on the path for its imports."""
    path, loaded = Path(file), f"model_{Path(file).stem}"
    sys.path.insert(0, str(path.parent))
    with _sentences(path, ""):
        names = runpy.run_path(file, run_name=loaded)
    call = names.get(name)
    if callable(call):
        return Function(call, f"{path.name}:{name}", path)
    defined = [n for n, each in names.items() if callable(each) and getattr(each, "__module__", None) == loaded]
    functions = [n for n in defined if not n.startswith("_")]
    has = f"give {listed(functions)}" if functions else "it has none"
    raise SceneError(f"it has no function {quoted(name)}: {has}{did_you_mean(name, functions)}")


@contextmanager
def _sentences(file: Path | None, when: str) -> Iterator[None]:
    """Turn an exception of the user's code into a sentence with the innermost line of the user's file."""
    try:
        with redirect_stdout(sys.stderr), np.errstate(all="ignore"):
            yield
    except (KeyboardInterrupt, TimeIsUpError):
        raise
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        mine = [f for f in frames if (Path(f.filename).resolve() == file if file else f.filename != __file__)]
        where = f"{Path(mine[-1].filename).name}, line {mine[-1].lineno}: " if mine else ""
        if isinstance(error, SyntaxError) and error.lineno is not None:
            where = f"{Path(error.filename or '').name}, line {error.lineno}: "
        said = printable(traceback.format_exception_only(error)[-1].strip(), 200)
        raise SceneError(f"it failed{when}: {where}{said}") from None
