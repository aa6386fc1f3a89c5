"""A model that is a Python function: f(scene, times) -> {quantity: number or (n,) numbers}.

``scene`` is the scene's document in SI numbers, and ``times`` (n,) are in s, or None in the steady state. A callable
is called in this process. The function of a file is called in a process of its own, so that this one survives it. The
function's output goes to standard error.
"""

import copy
import reprlib
import runpy
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stdout, suppress
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from compare.models.model import LONGEST, Model, Question, find_file
from compare.quantities import AT_REST
from compare.worker import Worker
from scenes.errors import SceneError, printable, quoted, unknown
from scenes.result import Traces


def of_callable(call: Callable[..., object], file: str = "") -> Model:
    """Return a callable as a model; the ``file`` that defines it may be known."""
    return Model(getattr(call, "__name__", type(call).__name__), partial(_answer, call, file))


def _answer(call: Callable[..., object], file: str, question: Question) -> Traces:
    """The checked values of a callable."""
    times, when, wanted = question.times, question.when, next(iter(question.units), "probe")
    with _sentences(file, f" when it was asked {when}"):
        given = call(copy.deepcopy(question.document), None if times is None else times.copy())
    if not isinstance(given, Mapping):
        raise SceneError(f"it returned {quoted(type(given).__name__)} {when}: return such as {{{wanted!r}: 300.0}}")
    rows, values = AT_REST if times is None else times, dict[str, np.ndarray]()
    for name, value in given.items():
        array: np.ndarray = np.ma.asarray(None)
        with suppress(Exception):  # of lists of unequal length, and of tensors with gradients
            array = np.ma.asarray(value)
        if array.dtype.kind not in "fiu" or not (array.size == 1 or array.shape == rows.shape):
            needed = "one real number" if times is None else f"{len(rows)} real numbers, one for each time"
            raise SceneError(f"{quoted(str(name))} {when} is {quoted(reprlib.repr(value))}: give {needed}")
        filled = np.ma.filled(array.astype(float), np.nan)  # masked values are not numbers
        values[str(name)] = np.broadcast_to(filled.reshape(-1), rows.shape)
    return Traces(rows, values, {})


def open_model(given: str, folder: str) -> Model:
    """Return the function of FILE.py:FUNCTION, loaded; the same as before where the file has not changed."""
    file, _, name = given.rpartition(":")
    path = find_file(file, folder, "a Python file and a function in it, such as lumped.py:bridge")
    return _open(path.resolve(), name, path.stat().st_mtime_ns)


@lru_cache(maxsize=1)
def _open(path: Path, name: str, saved: int) -> Model:
    """Load a function at once, in a process of its own."""
    worker = Worker("it", quiet=False)

    def ask(question: Question | None) -> Traces:
        return worker.run(LONGEST, _ask, str(path), name, saved, question)

    ask(None)
    return Model(f"{path.name}:{name}", ask)


@lru_cache(maxsize=1)
def _function(file: str, name: str, saved: int) -> Model:
    """Run a file that was ``saved`` at a time (ns), with its own folder on the path for its imports."""
    path, loaded = Path(file), f"model_{Path(file).stem}"
    sys.path.insert(0, str(path.parent))
    with _sentences(file, ""):
        names = runpy.run_path(file, run_name=loaded)
    if callable(call := names.get(name)):
        return of_callable(call, file)
    functions = [n for n, each in names.items() if callable(each) and getattr(each, "__module__", None) == loaded]
    raise unknown("it has no function", name, [n for n in functions if not n.startswith("_")])


def _ask(file: str, name: str, saved: int, question: Question | None) -> Traces:
    """Load the function of a file, and return its answer to a question, in a process of its own."""
    function = _function(file, name, saved)
    return function.answer(question) if question else Traces(AT_REST, {}, {})


@contextmanager
def _sentences(file: str, when: str) -> Iterator[None]:
    """Turn an exception of the user's code into a sentence with the innermost line of the user's file, if known."""
    try:
        with redirect_stdout(sys.stderr), np.errstate(all="ignore"):
            yield
    except (Exception, SystemExit) as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
        if isinstance(error, SyntaxError) and error.lineno is not None:
            file, lines = error.filename or file, [error.lineno]
        where = f"{Path(file).name}, line {lines[-1]}: " if lines else ""
        said = printable(traceback.format_exception_only(error)[-1].strip(), 200)
        raise SceneError(f"it failed{when}: {where}{said}") from error
