"""Compare a model of any scene with 3D, quantity by quantity: steady, and at the largest difference over time.

The difference is (model - 3D)/scale. The scale of a temperature is its 3D rise above the initial temperature, over time
the largest rise; of other quantities the 3D value, over time the largest. No difference is relative to kelvins.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compare import quantities
from compare.course import NO_CHANGE, Course, at
from compare.outcome import Outcome
from compare.verdict import Comparison, ratio
from scenes.formats import cut, quantity
from scenes.model import OVER_TIME, AnyScene
from scenes.result import Estimate

NEAR = 0.2
"""Values are called degrees Celsius or rises where that leaves less than this part of their difference."""


class Probes:
    """The same quantities of a run by 3D and by a model."""

    def __init__(self, outcome: Outcome[AnyScene]) -> None:
        self.fem3d, self.model = outcome.solved, outcome.reduced
        self.quantities = quantities.of(outcome.scene, outcome.solved)

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
        in_3d, in_1d = (replace(result.steady[name], value=result.steady[name].value - base)
                        for result in (self.fem3d, self.model))  # fmt: skip
        off = ratio(in_1d, in_3d)
        u_num = off.error if abs(in_3d.value) > in_3d.error else float("inf")
        p, m = in_1d.value, in_3d.value
        above = " (above the initial temperature)" * (unit == "K")
        reason = f"{quantity(p, unit)} against {quantity(m, unit)} in 3D{above}{self._meant(name, p, m)}"
        return Comparison(
            cut(name, 30), p, m, unit, off.value, u_num, reason, relative_to=f"the 3D {self._whole(name)}"
        )

    def _whole(self, name: str) -> str:
        return "rise" if self.quantities.units[name] == "K" else "value"

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
        course = self.course(name)
        error = self.fem3d.over_time.errors[name] + self.model.over_time.errors[name]

        def note() -> str:
            meant = self._meant(name, float(course.model[course.worst]), float(course.fem3d[course.worst]))
            return meant.removeprefix("; ") or self.change(name) or NO_CHANGE

        return course.comparison(
            f"{cut(name, 24)}, trace", self.quantities.units[name], error, self.scale(name, course),
            f"the largest 3D {self._whole(name)}", note,
        )  # fmt: skip

    def change(self, name: str) -> str:
        """Return the change of size or time that brings the model's course nearer; empty where none does."""
        course = self.course(name)
        return course.change(abs(self.scale(name, course).value))

    def _meant(self, name: str, value: float, measured: float) -> str:
        """Ask for kelvins where the model's values are near as other temperatures."""
        base, off = self.quantities.base(name), abs(value - measured)
        near = {word: abs(value + zero - measured) for word, zero in (("degrees Celsius", 273.15), ("rises", base))}
        word = min(near, key=lambda each: near[each])
        meant = self.quantities.units[name] == "K" and near[word] < NEAR * off
        return f"; as {word} it would be near: give kelvins, not {word}" if meant else ""
