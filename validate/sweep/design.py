"""The points of a sweep: a grid, or a sample of a low-discrepancy sequence; and which of them are solved together."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from inspect import signature

import numpy as np

from scenes.errors import SceneError
from validate.sweep.axes import MOST, Axis
from validate.sweep.base import VOLTAGE, Value

TOGETHER = 16
"""Points of one task, at most: they are stored together, so this is also what a kill can cost."""


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
        for n, axis in enumerate(self.axes):
            if any(axis.key == other.key for other in self.axes[:n]):
                raise SceneError(f"{axis.key} is varied twice: give it one --vary")
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

        # The keyword has changed its name; both mean the same generator.
        name = "rng" if "rng" in signature(qmc.Sobol.__init__).parameters else "seed"
        engine = qmc.Sobol(len(self.axes), **{name: np.random.default_rng(self.seed)})
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a number that is no power of 2
            drawn: np.ndarray = engine.random(self.sample)
        return drawn

    def point(self, number: int) -> tuple[Value, ...]:
        """The values of a point's keys."""
        if self.sample is not None:
            return tuple(axis.at(float(u)) for axis, u in zip(self.axes, self._drawn[number], strict=True))
        places = np.unravel_index(number, self.shape)
        return tuple(axis.values[int(i)] for axis, i in zip(self.axes, places, strict=True))

    def tasks(self) -> Iterator[tuple[int, ...]]:
        """The points by task. Those of a grid that differ in voltage alone are together, from the highest voltage down,
        and which are does not depend on what has been solved before; all others are alone."""
        voltages = self._voltages()
        if voltages is None or self.sample is not None:
            yield from ((number,) for number in range(self.count))
            return
        axis, order = voltages
        numbers = np.moveaxis(np.arange(self.count).reshape(self.shape), axis, -1).reshape(-1, len(order))
        for alike in numbers:
            for first in range(0, len(order), TOGETHER):
                yield tuple(int(alike[i]) for i in order[first : first + TOGETHER])

    def _voltages(self) -> tuple[int, list[int]] | None:
        """Which axis is the voltage, and its values' numbers from the largest magnitude down."""
        for n, axis in enumerate(self.axes):
            if axis.key == VOLTAGE and axis.numeric:
                return n, sorted(range(len(axis.values)), key=lambda i: -abs(float(axis.values[i])))
        return None


def settings(keys: Sequence[str], point: Sequence[Value]) -> list[str]:
    """A point as settings of its scene; keys that move together are joined by "+"."""
    texts = (repr(value) if isinstance(value, float) else value for value in point)
    return [f"{part}={text}" for key, text in zip(keys, texts, strict=True) for part in key.split("+")]
