"""1D and lumped models that somebody brings: a Python function, an ngspice netlist, an FMU or a table of values; or the
network that one makes by hand of the boxes. Whatever it is, it is asked the same (`asked`) and answers as a Result.

A model sees the scene as plain numbers, the document that summary.json has of it. A netlist that could do more than
describe a circuit is refused; a Python file and an FMU are programs, which run only where the user names them.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from scenes.errors import SceneError, quoted

OF_THE_SCENE = "scene"
_FORM = "give FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv, network, or scene for the scene's own [model]"
_KINDS = {".py": "apart", ".cir": "spice", ".net": "spice", ".sp": "spice", ".fmu": "fmu", ".csv": "values"}
_PROGRAMS = ("apart", "spice", "fmu")
"""Kinds of file that run code: never on the word of a scene that somebody sent."""


@dataclass(frozen=True)
class Asked:
    """What a model is asked for: the scene's ``document`` and ``name``; quantities with their units, in the ``steady``
    state and ``over_time``; its own ``parameters``, and its names of the quantities (``outputs``)."""

    name: str
    document: Mapping[str, Any]
    steady: Mapping[str, str]
    over_time: Mapping[str, str]
    parameters: Mapping[str, float]
    outputs: Mapping[str, str]


LONGEST = 600.0
"""s that a model may take for an answer, by the clock: a model is there to be faster than 3D, which takes minutes."""

Answer = tuple[Mapping[str, Any], Mapping[str, float]]
"""Values by quantity, numbers or (n,) arrays, and the estimated errors of those that have one."""


class Model(Protocol):
    """A model: its ``name``; its values in the steady state, or at ascending times (n,) in s; and the ``rows`` (s) of
    its own between which it is interpolated, if any. All raise SceneError where it has no answer."""

    name: str

    def rows(self, question: Asked) -> np.ndarray: ...

    def steady(self, question: Asked) -> Answer: ...

    def over_time(self, question: Asked, times: np.ndarray) -> Answer: ...


def named(given: str | Callable[..., Any]) -> str:
    """What a model is called before it is opened."""
    return getattr(given, "__name__", type(given).__name__) if callable(given) else Path(given).name


def of_reduction(given: str | Callable[..., Any]) -> tuple[str, str | Callable[..., Any]]:
    """What a reduction of the sink is called, and the user's own model that it is, "" where it is this program's.
    Raises SceneError for what is neither."""
    from reduced1d.ladder import canonical, is_one

    if not callable(given):
        file = given.rpartition(":")[0] or given
        if is_one(given) or (given != "network" and Path(file).suffix.lower() not in _KINDS):
            try:
                return canonical(given), ""
            except SceneError as error:
                raise SceneError(f"{error}; or network, FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv") from None
        kind_of(given)
    return named(given), given


def of_reductions(given: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """The names of some reductions of a sink, and the path of the user's own model that is the only one of them, ""
    where all are this program's. Raises SceneError for what is neither, and for an own one beside others."""
    each = [of_reduction(text) for text in given]
    own_models = [str(model) for _, model in each if model]
    if own_models and len(each) > 1:
        raise SceneError(f"--reduction {quoted(own_models[0])} is judged alone: leave the others out")
    model = "".join(own_models)
    path = model if model in ("", "network") else str(Path(model).resolve())
    if path:
        opened(path)
    return tuple(dict.fromkeys(name for name, _ in each)), path


def kind_of(given: str) -> str:
    """The module of this package that opens what is given; SceneError where none does."""
    if given == "network":
        return given
    file = given.rpartition(":")[0] if Path(given.rpartition(":")[0]).suffix == ".py" else given
    kind = _KINDS.get(Path(file).suffix.lower())
    if kind is None or (kind == "apart" and file == given):
        why = "names no function" if kind == "apart" else "is no model"
        raise SceneError(f"--model {quoted(given)} {why}: {_FORM}")
    return kind


def runs_code(given: str) -> bool:
    """Whether a model is a program, which a scene that somebody sends must not start by itself."""
    return kind_of(given) in _PROGRAMS


def opened(given: str | Callable[..., Any], folder: str = "") -> Model:
    """The model of a name, a file (relative to ``folder``) or a Python callable. Raises SceneError for what there
    isn't, and what running a Python file raises, as one."""
    if callable(given):
        from validate.models.function import Function

        return Function(given)
    kind = kind_of(given)
    return import_module(f"validate.models.{kind}").opened(given, folder)


def readable(given: str, folder: str, called: str) -> Path:
    """The path of a model's file; SceneError where there is none that can be read."""
    path = Path(folder, given)
    if not path.is_file():
        raise SceneError(f"--model {quoted(given)}: {quoted(path)} is no file: give {called}")
    return path


def command_of(function: str, *arguments: str) -> list[str]:
    """The command that calls "module:function" with texts in a process of its own: with this one's path for imports,
    so that no file of the folder that the user is in takes the place of a library's."""
    module, _, name = function.partition(":")
    start = f"import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); from {module} import {name}"
    return [sys.executable, "-P", "-c", f"{start}; {name}(*sys.argv[1:])", json.dumps(sys.path), *arguments]


def too_long(name: str) -> str:
    """The sentence of a model that has been waited for long enough."""
    return f"--model {name} has not answered within {LONGEST / 60:g} minutes, and was ended"
