"""One varied key: the values that it takes, or the range that they are drawn from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from scenes.errors import SceneError, quoted
from validate.sweep.base import Base, Value

MOST = 1_000_000
"""The most points of a sweep."""

_FORMS = {
    "grid": "KEY=FROM:TO:COUNT[:log] or KEY=a,b,c, such as sink.width=10um:200um:20",
    "range": "KEY=FROM:TO[:log], such as sink.width=10um:200um",
}


@dataclass(frozen=True)
class Axis:
    """A key with its ``values`` (SI numbers, or words), spaced evenly in their logarithm where ``log``. Of a ``range``
    they are its two ends."""

    key: str
    values: tuple[Value, ...]
    log: bool = False
    range: bool = False

    @property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(isinstance(value, float) for value in self.values)

    def at(self, place: float) -> Value:
        """The value at a place in [0, 1): within a range, or of a list of values."""
        if not self.range:
            return self.values[min(int(place * len(self.values)), len(self.values) - 1)]
        return _between(self, place)

    def cells(self, count: int) -> tuple[float, ...]:
        """The middles of the cells into which a range is divided."""
        return tuple(_between(self, (i + 0.5) / count) for i in range(count))


def _between(axis: Axis, place: float) -> float:
    """Within a range; to twelve digits, so that 20 um is 20 um and no plane of a scene misses another by rounding."""
    low, high = (float(value) for value in axis.values)
    found = low * (high / low) ** place if axis.log else low + place * (high - low)
    return min(max(float(f"{found:.12g}"), low), high)


def parse(base: Base, text: str, form: str) -> Axis:
    """An axis from a command's text: of the form "grid", "range", or "sample", which takes a range or a list.

    Raises SceneError for what is not of the form, an unknown key, values that it can't have, an empty range, a
    logarithm over zero and a count out of range.
    """
    key, equals, given = (part.strip() for part in text.partition("="))
    wanted = f"give {_FORMS['grid' if form == 'grid' else 'range']}"
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
    found = ranged(base, key, ends, log)
    return found if form != "grid" else spaced(found, _count(key, counts[0]))


def listed(base: Base, key: str, texts: Sequence[object]) -> Axis:
    """An axis of the values given one by one: texts with units, words or SI numbers."""
    read = [base.read(key, _text(text)) for text in texts]
    name, values = read[0][0] if read else key, tuple(value for _, value in read)
    if not values:
        raise SceneError(f"{key} is varied over no values: give at least one")
    if len(set(values)) < len(values):
        again = next(value for n, value in enumerate(values) if value in values[:n])
        raise SceneError(f"{name} is given {quoted(again)} twice: give each value once")
    return Axis(name, values)


def ranged(base: Base, key: str, ends: Sequence[object], log: bool) -> Axis:
    """A range between two ends."""
    (name, low), (_, high) = (base.read(key, _text(end)) for end in ends)
    shown = f"{name} from {_text(ends[0])} to {_text(ends[1])}"
    if isinstance(low, str) or isinstance(high, str):
        raise SceneError(f"{shown} is no range of numbers: give them one by one, as {name}=a,b,c")
    if base.counts(name):
        raise SceneError(f"{name} takes whole numbers, and {shown} has others: give them one by one, as {name}=1,2,3")
    if not low < high:
        raise SceneError(f"{shown} is an empty range: give the smaller end first")
    if log and low <= 0:
        raise SceneError(f"{shown} has no logarithm: give ends above zero, or leave out :log")
    return Axis(name, (low, high), log, range=True)


def spaced(axis: Axis, count: int) -> Axis:
    """A range as that many values, its ends among them."""
    steps = max(count - 1, 1)
    return Axis(axis.key, tuple(_between(axis, i / steps) for i in range(count)), axis.log)


def _count(key: str, text: str) -> int:
    if not text.isascii() or not text.isdigit() or not 1 <= int(text) <= MOST:
        raise SceneError(f"the count of {key}, {quoted(text)}, is not allowed: give a whole number from 1 to {MOST}")
    return int(text)


def _text(value: object) -> str:
    """A value as `--set` takes it; numbers in SI."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return str(value).lower()
    number = float(value)  # type: ignore[arg-type]
    return repr(number) if math.isfinite(number) else str(number)
