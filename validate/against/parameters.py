"""Which of several runs in a file is that of the scene: by columns, or headers' "@", that stand for its keys.

COMSOL writes the runs of a parametric sweep below one another with a column for each parameter, or beside one another
with the parameters behind an "@" in the headers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter

import numpy as np

from scenes.errors import SceneError, quoted
from scenes.keys import SINK
from scenes.kinds import Quantity
from scenes.sink import Sink
from scenes.units import UnitError, parse_quantity
from validate.against.columns import Column, in_si, split, unit_of

_CLOSE = 1e-4
"""Of a parameter: tables round to five digits, and nothing that is compared moves by more than a few times this."""
_MANY = 100_000
"""Rows that are looked at for the distinct values of a parameter."""
_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)
_PATHS = {path: key for path, key in SINK.schema.paths.items() if key.physical and isinstance(key.kind, Quantity)}


@dataclass(frozen=True)
class Parameter:
    """A parameter of the file's runs: its name there, the scene's key that it stands for, that key's SI value for each
    row or header, and its distinct values in words."""

    name: str
    path: str
    values: np.ndarray
    shown: tuple[str, ...]

    def matches(self, sink: Sink) -> np.ndarray:
        """Which of them have the scene's value."""
        wanted = attrgetter(_PATHS[self.path].attribute)(sink)
        return np.isclose(self.values, np.nan if wanted is None else wanted, rtol=_CLOSE, atol=1e-15)


def key_of(name: str) -> str | None:
    """The path of the scene's key that a name stands for: "drive.voltage", "voltage", "V0"; ``None`` for none."""
    plain = re.sub(r"\s+", "_", name.strip()).lower()
    if plain in _PATHS:
        return plain
    ends = [path for path in _PATHS if path.endswith(f".{plain}")]
    if len(ends) == 1:
        return ends[0]
    return "drive.voltage" if _VOLTAGE.fullmatch(plain) else None


def of_column(column: Column, path: str | None, unit: str = "") -> Parameter | None:
    """A column as the key that it is said to stand for, or the one of its name if it has that key's unit; ``None`` for
    none. SceneError where what is said can't be."""
    found = path or key_of(split(column.name)[0])
    if found is None:
        return None
    said = unit_of(unit or column.unit)
    dimension = _kind(found).dimension
    if said is not None and said.powers != dimension.powers:
        if path is None:
            return None
        raise SceneError(f"--column: {quoted(column.name)} is not {dimension.name}, as {found} is")
    values = column.values if said is None else in_si(column.values, said)
    distinct = dict.fromkeys(values[:_MANY].tolist())
    return Parameter(split(column.name)[0], found, values, tuple(_show(found, value) for value in distinct))


def of_header(name: str, texts: Sequence[str], path: str | None, unit: str = "") -> Parameter | None:
    """A parameter behind the headers' "@", a text for each run, as a scene's key; ``None`` where it stands for none."""
    found = path or key_of(name)
    if found is None:
        return None
    values = []
    for text in texts:
        spelled = text.replace("[", " ").replace("]", "")
        try:
            value, said = parse_quantity(f"{spelled} {unit}" if unit and _bare(spelled) else spelled)
        except UnitError:
            return None
        if said is not None and said.powers != _kind(found).dimension.powers:
            return None
        values.append(value)
    return Parameter(name, found, np.array(values), tuple(dict.fromkeys(texts)))


def choose(shown: str, parameters: Sequence[Parameter], sink: Sink, count: int) -> tuple[np.ndarray, str]:
    """Which of ``count`` rows or headers are of the scene's run, and a text on that: "the run at V0 = 1 V of 0.5, 1,
    2 V". SceneError, with the choices, where none is. All are where there is no parameter."""
    if not parameters:
        return np.ones(count, dtype=bool), ""
    fits: np.ndarray = np.all([p.matches(sink) for p in parameters], axis=0)
    if not fits.any():
        raise SceneError(
            f"--against {shown} has no run of this scene: "
            + "; ".join(f"{p.name} ({p.path}) is {_list(p)}, in the scene {_of(p.path, sink)}" for p in parameters)
            + f": export that run, or set the scene: --set {parameters[0].path}={_first(parameters[0])}"
            + f' (--column "ignore={parameters[0].name}" where it is no such parameter)'
        )
    said = []
    for p in parameters:
        several = len(p.shown) > 1
        said.append(f"{p.name} = {_of(p.path, sink)} ({p.path})" + (f" of {_list(p)}" if several else ""))
    return fits, f"the run at {', '.join(said)}"


def stretches(time: np.ndarray) -> list[slice]:
    """Where time ascends: the runs that stand below one another."""
    breaks = [0, *(np.flatnonzero(np.diff(time) <= 0) + 1).tolist(), len(time)]
    return [slice(a, b) for a, b in pairwise(breaks)]


def tells_apart(values: np.ndarray, time: np.ndarray) -> bool:
    """Whether values are those of a parameter: the same throughout each run that stands below another, or, where the
    rows of runs take turns, each as often as any other."""
    runs = stretches(time)
    if all(bool((values[run] == values[run.start]).all()) for run in runs):
        return True
    counts = np.unique(values, return_counts=True)[1]
    return len(runs) > 1 and bool(counts[0] > 2 and (counts == counts[0]).all())


def _show(path: str, value: float) -> str:
    """An SI value of a key as a person reads it."""
    return _kind(path).show(float(f"{value:.6g}"))


def _kind(path: str) -> Quantity:
    kind = _PATHS[path].kind
    assert isinstance(kind, Quantity)
    return kind


def _of(path: str, sink: Sink) -> str:
    return _PATHS[path].kind.show(attrgetter(_PATHS[path].attribute)(sink))


def _list(parameter: Parameter) -> str:
    values = parameter.shown
    return ", ".join(values[:12]) + (f" and {len(values) - 12} more" if len(values) > 12 else "")


def _first(parameter: Parameter) -> str:
    return _show(parameter.path, float(parameter.values[0])).replace(" ", "")


def _bare(text: str) -> bool:
    return re.fullmatch(r"[-+.\deE\s]+", text) is not None
