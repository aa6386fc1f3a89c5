"""The request of a sweep or a map: a scene, its varied keys, the points of a grid or a sample, and their results."""

from __future__ import annotations

import json
import math
import warnings
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from compare.kinds import kind_of
from compare.kinds.free import probed, varies
from compare.models import open_model, parse_reduction
from compare.options import Options, whole
from compare.verdict import PAPER
from scenes import loading
from scenes.checks import OF_THE_PAPER, SINK_CHECKS
from scenes.errors import SceneError, quoted, unknown
from scenes.free import schema_of_scene
from scenes.keys import TYPES, type_of
from scenes.kinds import Quantity
from scenes.loading import document, known_names, overridden, refuse_unused, written
from scenes.model import OVER_TIME
from scenes.parameters import SECTION
from scenes.schema import Schema, locate, override
from scenes.units import UnitError, dimension_of, parse_quantity
from validate import __version__

Value = float | str
Row = dict[str, Any]
"""The columns of a point by name, and its number ``point``."""
Task = tuple["Scope", int, list[str]]
"""The scope of a point, its number, and its settings."""
MOST = 1_000_000  # the most points of a sweep
FORMS = {"grid": "KEY=FROM:TO:COUNT[:log] or KEY=a,b,c", "sample": "KEY=FROM:TO[:log] or KEY=a,b,c",
         "range": "KEY=FROM:TO[:log]"}  # fmt: skip
"""The forms of --vary of a sweep, a sample and a map."""


def load(source: Any, settings: Sequence[str] = ()) -> tuple[Any, dict[str, Any]]:
    """Return a scene, by its name, its file or as it is, with settings, and a record of them. Raises SceneError."""
    if isinstance(source, str | Path):
        content, _, folder = document(source, known_names())
        # Workers find the mesh beside the file from any folder.
        scene = loading.load(Path(source).absolute() if folder else source, settings)
    else:
        content, scene = written(source), overridden(source, settings)
    if scene.kind not in ("sink", "free"):
        raise SceneError(f"{quoted(scene.name)} is a device, which has no 3D model to sweep: give another scene")
    asked = {"name": scene.name, "kind": scene.kind, "document": content}
    return scene, {"scene": asked, "settings": list(settings)}


def parse_reductions(given: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Return the names of some reductions of a sink, and the path of the user's own model, "" without one.

    Raises SceneError for names that are neither, and for an own model beside others.
    """
    models = {name: str(model) for name, model in map(parse_reduction, given)}
    own = next(filter(None, models.values()), "")
    if own and len(models) > 1:
        raise SceneError(f"--reduction {quoted(own)} is judged alone: leave the others out")
    path = own if own in ("", "network") else str(Path(own).resolve())
    if path:
        open_model(path)
    return tuple(models), path


def read(scene: Any, key: str, text: str) -> tuple[str, Value]:
    """Return the full name of a key, or of keys that move together ("+"), and the value in SI units or as a word.

    Raises SceneError for an unknown key and a value outside its range; the whole scene is not checked.
    """
    if "+" in key:
        names, values = zip(*(read(scene, part.strip(), text) for part in key.split("+")), strict=True)
        return "+".join(names), values[0]
    schema = _schema(scene)
    flat = scene.parameters.flat if scene.parameters else schema.flatten(written(scene))
    schema.read(override(flat, [f"{key}={text}"], schema))
    if key.partition(".")[0] not in schema.lists:
        key = ".".join(filter(None, locate(key, text, schema, flat)))
    try:
        return key, parse_quantity(text)[0]
    except UnitError:
        return key, text


def _text(scene: Any, key: str, value: Value) -> str:
    """A value of a key as a setting has it: a parameter's number with its SI unit."""
    if isinstance(value, str):
        return value
    return f"{str(value).lower()} {unit(scene, key) if key.startswith(SECTION) else ''}".rstrip()


def unit(scene: Any, key: str) -> str:
    """Return the SI unit of a key, or of the first of several that move together; "" without one."""
    schema, first = _schema(scene), key.partition("+")[0]
    table, *inner, last = first.split(".")
    if table == SECTION:
        measures = scene.parameters.measures if scene.parameters else {}
        return dimension_of(measures[last].powers).unit if last in measures else ""
    kinds = schema.lists.get(table, {})
    kind: Any = schema.paths[first].kind if first in schema.paths else kinds.get(last) or kinds.get(inner[-1])
    # A point has coordinates, and a value over time has a quantity.
    kind = getattr(kind, "member", getattr(kind, "quantity", kind))
    return kind.dimension.unit if isinstance(kind, Quantity) else ""


def _schema(scene: Any) -> Schema:
    return type_of(scene).schema if scene.kind in TYPES else schema_of_scene(scene)


@dataclass(frozen=True)
class Axis:
    """A varied key with its ``values`` (SI numbers, or words), spaced evenly in their logarithm where ``log``. Of a
    ``range`` they are its two ends."""

    key: str
    values: tuple[Value, ...]
    log: bool = False
    range: bool = False

    def at(self, place: float) -> Value:
        """Return the value at a place in [0, 1): of a list of values, or within a range. The latter has twelve digits:
        20 um is 20 um, and no plane of a scene misses another by rounding."""
        if not self.range:
            return self.values[min(int(place * len(self.values)), len(self.values) - 1)]
        low, high = (float(value) for value in self.values)
        value = low * (high / low) ** place if self.log else low + place * (high - low)
        return min(max(float(f"{value:.12g}"), low), high)

    def taken(self, places: Iterable[float]) -> Axis:
        """Return the axis of the values at some places."""
        return Axis(self.key, tuple(self.at(place) for place in places), self.log)


def parse(scene: Any, text: str, form: str) -> Axis:
    """Return the axis of a text of one of the `FORMS`.

    Raises SceneError for another form, an unknown key, and values or a count out of range.
    """
    key, _, given = (part.strip() for part in text.partition("="))
    parts = [part.strip() for part in given.split(":")]
    log = parts[-1] == "log"
    if key and given and ":" not in given and form != "range":
        return listed(scene, key, [part.strip() for part in given.split(",")])
    if not key or len(parts) - log != (3 if form == "grid" else 2):
        raise SceneError(f"--vary {quoted(text)} is not allowed here: give {FORMS[form]}")
    (name, low), (_, high) = (read(scene, key, end) for end in parts[:2])
    if isinstance(low, str) or isinstance(high, str) or not low < high or (log and low <= 0):
        shown = f"{name} from {parts[0]} to {parts[1]} is no range"
        raise SceneError(f"{shown}: give numbers, the smaller one first, and above zero for :log")
    axis = Axis(name, (low, high), log, range=True)
    if form != "grid":
        return axis
    return axis.taken(np.linspace(0.0, 1.0, whole(f"the count of {name}", parts[2], 1, MOST)))


def listed(scene: Any, key: str, given: Sequence[Any]) -> Axis:
    """Return the axis of values given one by one: texts with units, words or SI numbers. Raises SceneError."""
    if not given:
        raise SceneError(f"{key} is varied over no values: give at least one")
    names, values = zip(*(read(scene, key, _text(scene, key, value)) for value in given), strict=True)
    return Axis(names[0], values)


@dataclass(frozen=True)
class Design:
    """The product of the axes' values, or ``sample`` points drawn with a ``seed``. Points have numbers from 0 on, the
    last axis varying fastest. Raises SceneError for no axes, a key that is varied twice, and too many points."""

    axes: tuple[Axis, ...]
    sample: int | None = None
    seed: int = 0

    def __post_init__(self) -> None:
        if not self.axes:
            raise SceneError(f"nothing is varied: give --vary {FORMS['grid']}")
        for key in self.keys:
            if self.keys.count(key) > 1:
                raise SceneError(f"{key} is varied twice: give it one --vary")
        if not 0 < self.count <= MOST:
            raise SceneError(f"{self.count} points are not allowed: give counts whose product is from 1 to {MOST}")

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
        """Return the values of each key at some points."""
        points = zip(*map(self.point, numbers), strict=True)
        return {key: array(values) for key, values in zip(self.keys, points, strict=True)}


def array(column: Sequence[Any]) -> np.ndarray:
    """Return numbers with NaN for None, or words with "" for None."""
    if any(isinstance(value, str) for value in column):
        return np.array(["" if value is None else value for value in column], object)
    return np.array([np.nan if value is None else value for value in column], float)


@dataclass(frozen=True)
class Scope:
    """The scene that a sweep varies, and the results that every point should have.

    The difference of the ``check`` is split by assumption if ``blame``. An open verdict of ``all_checks``, or of the
    ``check`` alone, is solved again more accurately. The ``model`` is the path of the user's own one, whose name is
    then the only one of the ``reductions``.
    """

    scene: Any
    reductions: tuple[str, ...] = ("paper",)
    steady: bool = False
    check: str = "fig4"
    blame: bool = True
    all_checks: bool = True
    model: str = ""


@dataclass(frozen=True)
class Job:
    """A request: a ``design``, the ``scope`` of each point, and what was ``asked`` as JSON types.

    The design of a map is the cells, of which about ``solves`` are solved.
    """

    scope: Scope
    design: Design
    asked: dict[str, Any]
    solves: int | None = None

    def task(self, number: int, blamed: bool = True) -> Task:
        """Return the task of a point, its difference split where the request and ``blamed`` want it."""
        scope, values = self.scope, zip(self.design.keys, self.design.point(number), strict=True)
        settings = [f"{part}={_text(scope.scene, key, value)}" for key, value in values for part in key.split("+")]
        return replace(scope, blame=scope.blame and blamed), number, settings


def prepare(
    scene: Any, asked: dict[str, Any], design: Design, models: tuple[tuple[str, ...], str], check: str | None = None,
    steady: bool = False, blame: bool = True, solves: int | None = None, tolerance: str | None = None,
) -> Job:  # fmt: skip
    """Return the request of a sweep, or of a map for a number of ``solves``.

    ``models`` are the names of the 1D models, and the path of the user's own one; ``tolerance`` is of the check. Raises
    SceneError for a check that the scene, the first model or every design lacks.
    """
    keys = {key for joined in design.keys for key in joined.split("+")}
    scope = Scope(scene, models[0], steady, "", blame, solves is None, models[1])
    scope = replace(scope, check=_checked(scope, check, keys))
    if scene.kind == "sink":
        refuse_unused(keys, scene)
    given = [] if tolerance is None else [f"checks.tolerances.{scope.check}={tolerance}"]
    scope = replace(scope, scene=overridden(scene, given))
    vary = {axis.key: {"values": axis.values, "log": axis.log, "range": axis.range} for axis in design.axes}
    document = {
        "program": __version__, "kind": "sweep" if solves is None else "map", **asked,
        "settings": [*asked["settings"], *given], "vary": vary,
        **({} if design.sample is None else {"sample": design.sample, "seed": design.seed}),
        **{name: value for name, value in vars(scope).items() if name != "scene"},
        **({} if solves is None else {"solves": solves}),
    }  # fmt: skip
    return Job(scope, design, json.loads(json.dumps(document, default=str)), solves)


def _checked(scope: Scope, given: str | None, varied: Collection[str]) -> str:
    """The name of the check that a request gives, or of the usual one. Raises SceneError where no point has it."""
    scene, reason = scope.scene, ""
    if scene.kind == "free":
        known = [probe.name for probe in probed(scene).probes]
        if scope.model and not scene.steady:
            over_time = [f"{name}{OVER_TIME}" for name in known]
            known = over_time if varies(scene) else [*known, *over_time]
            # A probe's name will do where it is judged over time alone.
            given = f"{given}{OVER_TIME}" if given not in known and f"{given}{OVER_TIME}" in known else given
    else:
        kind, options, given = kind_of(scene), Options(steady=scope.steady), given or "fig4"
        skipped = kind.skipped(scene, options)
        reason = f"{skipped[given]}: " if given in skipped else ""
        possible = SINK_CHECKS if "sink.spans" in varied else kind.definitions(scene, options)
        others = skipped if scope.reductions[0] == PAPER else {*skipped, *OF_THE_PAPER}
        known = [name for name in possible if name not in others]
    if given is not None and given not in known:
        raise unknown(f"{reason}there is no check", given, known)
    return given or next(iter(known), "")
