"""Inputs of a scene as channels: channel 0 is the constant 1, and each schedule of the scene adds a channel.

Every source, given temperature and voltage is a sum over channels of a constant times the channel's value, so that
matrices and loads are assembled once and time enters through a few numbers g(t).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from scenes.model import Schedule, Value

Side = Literal["left", "right"]


@dataclass(frozen=True)
class Inputs:
    """The schedules of a scene, in order of appearance."""

    schedules: tuple[Schedule, ...]

    @property
    def count(self) -> int:
        """How many channels."""
        return 1 + len(self.schedules)

    def split(self, value: Value) -> np.ndarray:
        """(channels,): the coefficients of a value."""
        coefficients = np.zeros(self.count)
        if isinstance(value, Schedule):
            coefficients[1 + self.schedules.index(value)] = 1.0
        else:
            coefficients[0] = value
        return coefficients

    def knots(self, end: float) -> np.ndarray:
        """The instants (s) inside (0, end) at which a schedule bends or jumps."""
        knots = np.unique(np.concatenate([np.empty(0), *(knots for knots, _ in self._points)]))
        return knots[(knots > 0.0) & (knots < end)]

    def piece(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """(channels,) twice: the values at a time (after a jump there) and their rates (1/s) up to the next knot."""
        return self.at(np.array([time]))[0], self.rates(np.array([time]))[0]

    def jump(self, time: float) -> np.ndarray:
        """(channels,): by how much the values jump at a time."""
        return self.jumps(np.array([time]))[0]

    def jumps(self, times: np.ndarray) -> np.ndarray:
        """(times, channels): by how much the values jump at some times."""
        return self.at(times) - self.at(times, "left")

    def at(self, times: np.ndarray, side: Side = "right") -> np.ndarray:
        """(times, channels): the values, after a jump there, or on its "left"."""
        return np.column_stack([np.ones(len(times)), *(_on(*points, times, side)[0] for points in self._points)])

    def rates(self, times: np.ndarray) -> np.ndarray:
        """(times, channels): the rates (1/s), after a bend there."""
        return np.column_stack([np.zeros(len(times)), *(_on(*points, times)[1] for points in self._points)])

    @cached_property
    def _points(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Times and values of each schedule, as arrays: time steps use them thousands of times."""
        return [(np.array(s.times), np.array(s.values)) for s in self.schedules]

    def largest(self, end: float) -> np.ndarray:
        """(channels,): the largest absolute value of each up to ``end``."""
        times = np.concatenate([[0.0], self.knots(end), [end]])
        return np.abs(np.concatenate([self.at(times), self.at(times[1:], "left")])).max(axis=0)


def value(given: Value, times: np.ndarray) -> np.ndarray:
    """(times,): a value at some times (s)."""
    if not isinstance(given, Schedule):
        return np.full(len(times), float(given))
    return _on(np.array(given.times), np.array(given.values), times)[0]


def _on(
    knots: np.ndarray, values: np.ndarray, times: np.ndarray, side: Side = "right"
) -> tuple[np.ndarray, np.ndarray]:
    """(times,) twice: the values of a schedule at some times, and its rates (1/s); at a knot the limits from the
    right or left ``side``."""
    after = np.searchsorted(knots, times, side=side)
    inside = (after > 0) & (after < len(knots))
    low, high = np.maximum(after - 1, 0), np.minimum(after, len(knots) - 1)
    gap = np.where(inside, knots[high] - knots[low], 1.0)
    rate = np.where(inside, (values[high] - values[low]) / gap, 0.0)
    return values[low] + rate * (times - knots[low]), rate
