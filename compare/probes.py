"""Compare a model of any scene with 3D, quantity by quantity: steady, and at the largest difference over time.

The difference is (model - 3D)/scale. The scale of a temperature is its 3D rise above the initial temperature, over time
the largest rise; of other quantities the 3D value, over time the largest. No difference is relative to kelvins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compare import quantities
from compare.course import NO_CHANGE, Course, at
from compare.quantities import Quantities, called
from compare.verdict import Comparison, part, share, spread
from scenes.formats import cut, quantity, signed
from scenes.model import OVER_TIME, AnyScene
from scenes.result import Estimate, Result

NEAR = 0.2
"""Values are called degrees Celsius or rises where that leaves less than this part of their difference."""


@dataclass(frozen=True)
class Both:
    """The same quantities by 3D and by a model."""

    quantities: Quantities
    fem3d: Result
    model: Result

    def comparisons(self) -> dict[str, Comparison]:
        """Compare every quantity that both have, by the ids of checks, in the order of the quantities."""
        made: dict[str, Comparison] = {}
        for name in self.quantities.units:
            if name in self.model.steady and name in self.fem3d.steady:
                made[name] = self.at_rest(name)
            if self.model.traces is not None and self.fem3d.traces is not None and name in self.model.traces.values:
                made[f"{name}{OVER_TIME}"] = self.over_time(name)
        return made

    def at_rest(self, name: str) -> Comparison:
        """Compare the steady values."""
        base, unit = self.quantities.base(name), self.quantities.units[name]
        in_3d, in_1d = self.fem3d.steady[name], self.model.steady[name]

        def off(value: float, measured: float) -> float:
            return part(value - measured, measured - base)

        known = abs(in_3d.value - base) > in_3d.error
        u_num = spread(off, {"value": in_1d, "measured": in_3d}) if known else float("inf")
        p, m = in_1d.value - base, in_3d.value - base
        said = f"{called(name)} is {quantity(p, unit)} against {quantity(m, unit)} in 3D"
        above = " (above the initial temperature)" * (unit == "K")
        return Comparison(
            cut(name, 30), p, m, unit, off(in_1d.value, in_3d.value), u_num, f"{said}{above}{self._meant(name, p, m)}",
            relative_to=f"the 3D {'rise' if unit == 'K' else 'value'}",
        )  # fmt: skip

    def course(self, name: str) -> Course:
        """Return both traces at the model's times at which 3D's error bound holds, above the base of their scale."""
        in_3d, in_1d = self.fem3d.over_time, self.model.over_time
        late, base = self.quantities.sure(in_1d.time), self.quantities.base(name)
        value, beyond = at(in_3d, name, in_1d.time)
        return Course(in_1d.time[late], value[late] - base, in_1d.values[name][late] - base, beyond[late])

    def scale(self, name: str, course: Course) -> Estimate:
        """Return 3D's largest value, at its times and the course's: the same scale for every model."""
        fem3d = self.fem3d.over_time
        rows = fem3d.values[name][fem3d.sure(fem3d.time)] - self.quantities.base(name)
        values, beyond = np.append(course.fem3d, rows), np.append(course.beyond, np.zeros(len(rows)))
        n = int(np.argmax(np.abs(values)))
        return Estimate(float(values[n]), fem3d.errors[name] + float(beyond[n]))

    def over_time(self, name: str) -> Comparison:
        """Compare at the largest difference over time."""
        course, unit = self.course(name), self.quantities.units[name]
        i, scale = course.worst, self.scale(name, course)
        error = self.fem3d.over_time.errors[name] + self.model.over_time.errors[name] + float(course.beyond[i])
        off = share(Estimate(float(course.off[i]), error), scale)
        p, m, time = float(course.model[i]), float(course.fem3d[i]), float(course.time[i])

        def reason() -> str:
            when = f"at {quantity(time, 's', 3)}, {signed(p - m, unit)}"
            said = f"{called(name)} is {quantity(p, unit)} against {quantity(m, unit)} in 3D {when}"
            return said + (self._meant(name, p, m) or f"; {course.in_words(abs(scale.value)) or NO_CHANGE}")

        return Comparison(
            f"{cut(name, 24)}, trace", p, m, unit, off.value, off.error, reason, time,
            relative_to=f"the largest 3D {'rise' if unit == 'K' else 'value'}",
        )  # fmt: skip

    def change(self, name: str) -> str:
        """Return the change of size or time that brings the model's course nearer; empty where none does."""
        course = self.course(name)
        return course.in_words(abs(self.scale(name, course).value))

    def _meant(self, name: str, value: float, measured: float) -> str:
        """Ask for kelvins where the model's values are near as other temperatures."""
        base, off = self.quantities.base(name), abs(value - measured)
        near = {word: abs(value + zero - measured) for word, zero in (("degrees Celsius", 273.15), ("rises", base))}
        word = min(near, key=lambda each: near[each])
        meant = self.quantities.units[name] == "K" and near[word] < NEAR * off
        return f"; as {word} it would be near: give kelvins, not {word}" if meant else ""


def both(scene: AnyScene, fem3d: Result, model: Result) -> Both:
    """Return 3D and a model of the same quantities."""
    return Both(quantities.of(scene, fem3d), fem3d, model)
