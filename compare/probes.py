"""Compare a model of any scene with 3D, quantity by quantity: steady, and at the largest distance over time.

The difference is (model - 3D)/scale. The scale of a temperature is its 3D rise above the initial temperature, over time
the largest rise; of other quantities the 3D value, over time the largest. No difference is relative to kelvins.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from compare.course import Course, told_apart
from compare.quantities import Quantities, called
from compare.verdict import Check, Comparison, judged, spread
from scenes.formats import cut, quantity, signed
from scenes.model import OVER_TIME, Declared
from scenes.result import Estimate, Result, Traces

NEAR = 0.2
"""Values are called degrees Celsius or rises where that leaves less than this part of their difference."""


@dataclass(frozen=True)
class Both:
    """The same quantities by 3D and by a model."""

    quantities: Quantities
    fem3d: Result
    model: Result

    @cached_property
    def definitions(self) -> dict[str, Callable[[], Comparison]]:
        """The function that makes each check, by id, in the order of the quantities."""
        definitions: dict[str, Callable[[], Comparison]] = {}
        for name in self.quantities.units:
            if name in self.model.steady and name in self.fem3d.steady:
                definitions[name] = partial(self.at_rest, name)
            if self.model.traces is not None and self.fem3d.traces is not None and name in self.model.traces.values:
                definitions[f"{name}{OVER_TIME}"] = partial(self.over_time, name)
        return definitions

    def at_rest(self, name: str) -> Comparison:
        """Compare the steady values."""
        base, unit = self.quantities.base(name), self.quantities.units[name]
        in_3d, in_1d = self.fem3d.steady[name], self.model.steady[name]
        inputs = {"value": in_1d, "measured": in_3d}

        def relative(value: float, measured: float) -> float:
            return part(value - measured, measured - base)

        u_num = spread(relative, inputs) if abs(in_3d.value - base) > in_3d.error else float("inf")
        off = relative(in_1d.value, in_3d.value)
        said = f"{quantity(in_1d.value - base, unit)} against {quantity(in_3d.value - base, unit)} in 3D"
        return Comparison(
            cut(name, 30), in_1d.value - base, in_3d.value - base, unit, off, u_num,
            f"{called(name)} is {said}{_above(unit)}{self._meant(name, in_1d.value, in_3d.value)}",
            relative_to=_scale(unit),
        )  # fmt: skip

    def _meant(self, name: str, value: float, measured: float) -> str:
        zeros = {"degrees Celsius": 273.15, "rises": self.quantities.initial}
        near = {word: abs(value + zero - measured) for word, zero in zeros.items()}
        word = min(near, key=lambda each: near[each])
        meant = self.quantities.units[name] == "K" and near[word] < NEAR * abs(value - measured)
        return f"; as {word} it would be near: give kelvins, not {word}" if meant else ""

    def course(self, name: str) -> Course:
        """Return both traces at the model's times at which 3D's error bound holds, above the base of their scale."""
        in_3d, in_1d = self.fem3d.over_time, self.model.over_time
        late, base = self.quantities.sure(in_1d.time), self.quantities.base(name)
        value, beyond = at(in_3d, name, in_1d.time)
        return Course(in_1d.time[late], value[late] - base, in_1d.values[name][late] - base, beyond[late])

    def over_time(self, name: str) -> Comparison:
        """Compare at the largest difference over time, with its shift, stretch and size."""
        course, unit = self.course(name), self.quantities.units[name]
        off = course.model - course.fem3d
        i, error = int(np.argmax(np.abs(off))), self.fem3d.over_time.errors[name]
        inputs = {
            "distance": Estimate(float(off[i]), error + self.model.over_time.errors[name] + float(course.beyond[i])),
            "scale": self._largest(name, course),
        }
        u_num = spread(part, inputs) if abs(inputs["scale"].value) > inputs["scale"].error else float("inf")
        scale = inputs["scale"].value

        def because() -> str:
            where = f"{quantity(float(course.model[i]), unit)} against {quantity(float(course.fem3d[i]), unit)} in 3D"
            apart = told_apart(course, abs(scale))
            said = f"; {apart.said()}" if apart is not None else ""
            when = f"at {quantity(float(course.time[i]), 's', 3)}, {signed(float(off[i]), unit)}"
            base = self.quantities.base(name)
            meant = self._meant(name, float(course.model[i]) + base, float(course.fem3d[i]) + base)
            return f"{called(name)} is {where} {when}{meant or said}"

        return Comparison(
            f"{cut(name, 24)}, trace", float(course.model[i]), float(course.fem3d[i]), unit, part(float(off[i]), scale),
            u_num, because, float(course.time[i]), relative_to=f"the largest {_scale(unit).removeprefix('the ')}",
        )  # fmt: skip

    def _largest(self, name: str, course: Course) -> Estimate:
        """3D's largest value, at its times and the course's: the same scale for every model."""
        fem3d = self.fem3d.over_time
        rows = fem3d.values[name][fem3d.sure(fem3d.time)] - self.quantities.base(name)
        values, beyond = np.append(course.fem3d, rows), np.append(course.beyond, np.zeros(len(rows)))
        n = int(np.argmax(np.abs(values)))
        return Estimate(float(values[n]), fem3d.errors[name] + float(beyond[n]))


def evaluate(scene: Declared, both: Both) -> tuple[Check, ...]:
    """Check every quantity that both models have, in the steady state and over time."""
    return tuple(judged(name, made(), scene) for name, made in both.definitions.items())


def part(distance: float, scale: float) -> float:
    """distance/scale, infinite where only the latter is zero."""
    return distance / scale if scale else (0.0 if not distance else float("inf"))


def at(traces: Traces, name: str, times: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a trace at ascending times (s), and its interpolation error there.

    Where a trace jumps it has two values at one time: the first of two equal times gets the first value, a single one
    the later.
    """
    values = traces.values[name]
    n = np.clip(np.searchsorted(traces.time, times, side="right") - 1, 0, len(traces.time) - 2)
    interpolated, on_a_row = np.interp(times, traces.time, values), np.isin(times, traces.time)
    first = np.flatnonzero(np.diff(times) == 0)
    interpolated[first] = values[np.searchsorted(traces.time, times[first])]
    return interpolated, np.where(on_a_row, 0.0, bends(traces.time, values)[n])


JUMP = 2e-9
"""Rows closer in time than this part of the run are the values just before and just after a jump."""


def bends(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return (n - 1,): the error of straight lines between rows, h^2/8 |y''|; zero where a trace jumps.

    The larger second difference of both ends of the interval counts.
    """
    h = np.diff(time)
    if len(h) < 2:
        return np.abs(np.diff(values))
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.where(h > JUMP * (time[-1] - time[0]), np.diff(values) / h, np.nan)
        second = np.abs(2 * np.diff(slopes) / (h[1:] + h[:-1]))
    second = np.nan_to_num(second, nan=0.0, posinf=0.0)
    larger = np.maximum(np.append(second, second[-1]), np.append(second[0], second))
    return h**2 / 8 * larger


def _above(unit: str) -> str:
    return " (above the initial temperature)" if unit == "K" else ""


def _scale(unit: str) -> str:
    return "the 3D rise" if unit == "K" else "the 3D value"
