"""Designs of a sweep: a scene, its varied keys, and the points of a grid or a sample."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

from scenes import free
from scenes.errors import SceneError, quoted
from scenes.free import schema_of
from scenes.keys import DEVICE, SINK
from scenes.kinds import Count, Quantity
from scenes.loading import check, document, known_names, type_of_file, written
from scenes.model import AnyScene
from scenes.parameters import SECTION, Names
from scenes.schema import Schema, locate, override
from scenes.sink import Sink
from scenes.units import UnitError, dimension_of, parse_quantity

Value = float | str
MOST = 1_000_000  # the most points of a sweep


@dataclass(frozen=True)
class Base:
    """The scene that a sweep varies, in a form that other processes can read: the ``document`` of its file and the
    ``settings`` ("KEY=VALUE") over it; its mesh lies in ``folder``."""

    kind: Literal["sink", "free"]
    name: str
    document: Mapping[str, Any]
    folder: str = ""
    settings: tuple[str, ...] = ()

    @property
    def set(self) -> frozenset[str]:
        """The keys that are set, by their full names."""
        read = [self.read(*(part.strip() for part in text.split("=", 1)))[0] for text in self.settings]
        return frozenset(key for joined in read for key in joined.split("+"))

    @property
    def schema(self) -> Schema:
        return SINK.schema if self.kind == "sink" else schema_of(self.document)

    def at(self, settings: Sequence[str]) -> Sink | AnyScene:
        """The scene with more settings, checked; raises SceneError."""
        if self.kind == "free":
            return free.from_dict(self.document, self.name, self.folder, (*self.settings, *settings))
        # Expected differences of checks hold for the scene in the file alone.
        read = {"scene.name": self.name} | self._read(settings) | {"checks.expect_differs": None}
        return check(SINK.schema.apply(read, SINK.default))

    def read(self, key: str, text: str) -> tuple[str, Value]:
        """Return the full name of a key, or of keys that move together ("+"), and the value in SI units or as a word.

        Raises SceneError for an unknown key and a value outside its range; the whole scene is not checked.
        """
        if "+" in key:
            read = [self.read(part.strip(), text) for part in key.split("+")]
            return "+".join(name for name, _ in read), read[0][1]
        self._read([f"{key}={text}"])
        if key.partition(".")[0] not in self.schema.lists:
            key = ".".join(filter(None, locate(key, text, self.schema, self._flat(()))))
        try:
            return key, parse_quantity(text)[0]
        except UnitError:
            return key, text

    def text(self, key: str, value: Value) -> str:
        """A value of a key as a setting has it: a parameter's number with its SI unit."""
        if isinstance(value, str):
            return value
        unit = self.unit(key) if key.startswith(f"{SECTION}.") else ""
        return f"{repr(value).lower()} {unit}".rstrip()

    def counts(self, key: str) -> bool:
        return isinstance(self._kind(key), Count)

    def unit(self, key: str) -> str:
        """Return the SI unit of a key, "" without one."""
        section, _, name = key.partition("+")[0].partition(".")
        if section == SECTION:
            return dimension_of(Names(self._flat(())[SECTION])[name].powers).unit
        kind = self._kind(key)
        # A point has coordinates, and a value over time has a quantity.
        kind = getattr(kind, "coordinate", getattr(kind, "quantity", kind))
        return kind.dimension.unit if isinstance(kind, Quantity) else ""

    def _kind(self, key: str) -> Any:
        """The kind of a key's values, or of the first of several that move together; ``None`` without one."""
        key = key.partition("+")[0]
        if key in self.schema.paths:
            return self.schema.paths[key].kind
        table, *inner, last = key.split(".")
        kinds = self.schema.lists.get(table, {})
        return kinds.get(last) or (kinds.get(inner[-1]) if inner and last in "xyz" else None)

    def _read(self, settings: Sequence[str]) -> dict[str, Any]:
        """The values of the document with all settings, by path."""
        return self.schema.read(self._flat(settings))

    def _flat(self, settings: Sequence[str]) -> dict[str, Any]:
        return override(self.schema.flatten(self.document), (*self.settings, *settings), self.schema)


def base(source: str | Path | Sink | AnyScene, settings: Sequence[str] = ()) -> Base:
    """Return the base of a scene, of its name or of its file. Raises SceneError."""
    if not isinstance(source, str | Path):
        given: Any = source
        given_folder = getattr(getattr(given, "model", None), "folder", "") or getattr(given, "folder", "")
        return Base(given.kind, given.name, written(given), str(Path(given_folder).resolve()), tuple(settings))
    content, name, folder = document(source, known_names())
    scene_type = type_of_file(content)
    if scene_type is DEVICE:
        said = f"{quoted(str(source))} is a device, which has no 3D model to sweep: give a sink or a scene of boxes"
        raise SceneError(said)
    folder = str(Path(folder).resolve()) if folder else ""
    return Base("free" if scene_type is None else "sink", name, content, folder, tuple(settings))


@dataclass(frozen=True)
class Axis:
    """A varied key with its ``values`` (SI numbers, or words), spaced evenly in their logarithm where ``log``. Of a
    ``range`` they are its two ends."""

    key: str
    values: tuple[Value, ...]
    log: bool = False
    range: bool = False

    def at(self, place: float) -> Value:
        """The value at a place in [0, 1): of a list of values, or within a range, there to twelve digits, so that 20 um
        is 20 um and no plane of a scene misses another by rounding."""
        if not self.range:
            return self.values[min(int(place * len(self.values)), len(self.values) - 1)]
        low, high = (float(value) for value in self.values)
        value = low * (high / low) ** place if self.log else low + place * (high - low)
        return min(max(float(f"{value:.12g}"), low), high)

    def taken(self, places: Iterable[float]) -> Axis:
        return Axis(self.key, tuple(self.at(place) for place in places), self.log)


def parse(base: Base, text: str, form: str) -> Axis:
    """Return the axis of a command's text: of the form "grid", "range", or "sample", which takes a range or a list.

    Raises SceneError for another form, an unknown key, values outside its range, an empty range, a logarithm over zero
    and a count out of range.
    """
    key, equals, given = (part.strip() for part in text.partition("="))
    wanted = "give KEY=FROM:TO[:log], such as sink.width=10um:200um"
    if form == "grid":
        wanted = "give KEY=FROM:TO:COUNT[:log] or KEY=a,b,c, such as sink.width=10um:200um:20"
    if not (key and equals and given):
        raise SceneError(f"--vary {quoted(text)} varies nothing: {wanted}")
    if ":" not in given:
        if form == "range":
            raise SceneError(f"--vary {quoted(text)} is no range: {wanted}")
        return listed(base, key, [part.strip() for part in given.split(",")])
    parts = [part.strip() for part in given.split(":")]
    log = parts[-1] == "log"
    ends, counts = parts[:2], parts[2 : len(parts) - log]
    if form != "grid" and counts:
        why = "--sample says how many points there are" if form == "sample" else "--cells says how many cells there are"
        raise SceneError(f"--vary {quoted(text)} has a count, and {why}: {wanted}")
    if len(counts) != (form == "grid"):
        raise SceneError(f"--vary {quoted(text)} has {'no' if not counts else 'more than one'} count: {wanted}")
    axis = _range(base, key, ends, log)
    if form != "grid":
        return axis
    (count,) = counts
    if not count.isascii() or not count.isdigit() or not 1 <= int(count) <= MOST:
        raise SceneError(f"the count of {key}, {quoted(count)}, is not allowed: give a whole number from 1 to {MOST}")
    return axis.taken(i / max(int(count) - 1, 1) for i in range(int(count)))


def listed(base: Base, key: str, given: Sequence[Any]) -> Axis:
    """Return the axis of values given one by one: texts with units, words or SI numbers."""
    read = [base.read(key, base.text(key, value)) for value in given]
    if not read:
        raise SceneError(f"{key} is varied over no values: give at least one")
    name, values = read[0][0], tuple(value for _, value in read)
    if len(set(values)) < len(values):
        again = next(value for n, value in enumerate(values) if value in values[:n])
        raise SceneError(f"{name} is given {quoted(again)} twice: give each value once")
    return Axis(name, values)


def _range(base: Base, key: str, ends: Sequence[str], log: bool) -> Axis:
    (name, low), (_, high) = (base.read(key, end) for end in ends)
    shown = f"{name} from {ends[0]} to {ends[1]}"
    if isinstance(low, str) or isinstance(high, str):
        raise SceneError(f"{shown} is no range of numbers: give them one by one, as {name}=a,b,c")
    if base.counts(name):
        raise SceneError(f"{name} takes whole numbers, and {shown} has others: give them one by one, as {name}=1,2,3")
    if not low < high:
        raise SceneError(f"{shown} is an empty range: give the smaller end first")
    if log and low <= 0:
        raise SceneError(f"{shown} has no logarithm: give ends above zero, or leave out :log")
    return Axis(name, (low, high), log, range=True)


@dataclass(frozen=True)
class Design:
    """The product of the axes' values, or ``sample`` points drawn with a ``seed``. Points have numbers from 0 on, the
    last axis varying fastest."""

    axes: tuple[Axis, ...]
    sample: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        """Raises SceneError for no axes, a key that is varied twice, and more points than MOST."""
        if not self.axes:
            raise SceneError("nothing is varied: give --vary KEY=FROM:TO:COUNT, such as sink.width=10um:200um:20")
        for key in self.keys:
            if self.keys.count(key) > 1:
                raise SceneError(f"{key} is varied twice: give it one --vary")
        if not 1 <= self.count <= MOST:
            raise SceneError(f"{self.count} points are too many: give counts whose product is at most {MOST}")

    @property
    def keys(self) -> tuple[str, ...]:
        return tuple(axis.key for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """The counts of a grid's axes; of a sample its number of points."""
        return tuple(len(axis.values) for axis in self.axes) if self.sample is None else (self.sample,)

    @property
    def count(self) -> int:
        return math.prod(self.shape)

    @cached_property
    def _drawn(self) -> np.ndarray:
        from scipy.stats import qmc

        with warnings.catch_warnings(action="ignore", category=UserWarning):  # a number that is no power of 2
            drawn: np.ndarray = qmc.Sobol(len(self.axes), seed=np.random.default_rng(self.seed)).random(self.sample)
        return drawn

    def point(self, number: int) -> tuple[Value, ...]:
        if self.sample is not None:
            return tuple(axis.at(float(u)) for axis, u in zip(self.axes, self._drawn[number], strict=True))
        places = np.unravel_index(number, self.shape)
        return tuple(axis.values[int(i)] for axis, i in zip(self.axes, places, strict=True))

    def columns(self, numbers: Iterable[int]) -> dict[str, np.ndarray]:
        points = [self.point(number) for number in numbers]
        return {key: array([point[i] for point in points]) for i, key in enumerate(self.keys)}


def settings(base: Base, keys: Sequence[str], point: Sequence[Value]) -> list[str]:
    """A point as settings of its scene; keys that move together are joined by "+"."""
    texts = (base.text(key, value) for key, value in zip(keys, point, strict=True))
    return [f"{part}={text}" for key, text in zip(keys, texts, strict=True) for part in key.split("+")]


def array(column: Sequence[Any]) -> np.ndarray:
    """Numbers as such with NaN for none; words with "" for none."""
    if any(isinstance(value, str) for value in column):
        return np.array(["" if value is None else value for value in column], object)
    return np.array([np.nan if value is None else value for value in column], float)
