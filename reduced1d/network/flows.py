"""Flow through a flat box: by the joints, the conditions and the cross-sections of lines that it covers.

Joints and conditions at lines' sides have branches with a flow. Where ends meet, or an end is held, there is no branch,
and the flow follows from the flow that arrives along each line; where ends meet in a ring, in proportion to the areas.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np

from reduced1d.network.lines import Line, Touch, common
from reduced1d.network.model import Model
from scenes import physics
from scenes.model import Point, Probe

EVERYWHERE: tuple[Point, Point] = (-np.inf, -np.inf, -np.inf), (np.inf, np.inf, np.inf)


class Flows:
    """The flows of one of a network's circuits: along its lines' cross-sections, and through its branches.

    A flow is a row on the vector of all flows of `at` and one on the inputs."""

    def __init__(self, model: Model, electric: bool, probes: tuple[Probe, ...]) -> None:
        self.model, self.electric, self.layout = model, electric, model.layout
        circuit = model.current if electric else model.heat
        assert circuit is not None
        self.circuit = circuit
        self.joints = self.layout.wires if electric else self.layout.joints
        self.conditions = self.layout.electrodes if electric else self.layout.conditions
        # Both ends of every line, then where probes cut one.
        self.sections = [(i, place) for i, line in enumerate(self.layout.lines) for place in (line.start, line.stop)]
        for probe in probes:
            normal, at = _plane(probe)
            self.sections += [(i, at) for i in self._cut(probe) if self.layout.lines[i].axis == normal]
        numbers, places = zip(*self.sections, strict=True)
        self.values, self.slopes = model.elements.at(numbers, np.array(places))
        self.branches = len(circuit.extra)
        self.size = self.branches + len(self.sections)

    def at(self, rise: np.ndarray, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(size, times): the flows through branches, then along lines at sections, positive along the axis, at rises
        and unknowns (n, times) and inputs (inputs, times)."""
        model, circuit = self.model, self.circuit
        resistance = model.resistances(rise)[1] if self.electric else 1 / model.conduction[:, None]
        currents = (circuit.across @ u - circuit.given @ x) / resistance
        along = self.slopes @ u
        warm = self.values @ rise
        for k, (i, _) in enumerate(self.sections):
            line = self.layout.lines[i]
            if not self.electric:
                along[k] *= -line.area / model.thermal_resistivity(i)
            elif line.box.material.resistivity is not None:
                along[k] *= -line.area / self.layout.resistivity(i, warm[k])
        return np.concatenate([currents, along])

    def through(self, probe: Probe) -> tuple[np.ndarray, np.ndarray]:
        """The flow through a probe: into the solid on its surface, along the positive axis inside."""
        normal, at = _plane(probe)
        flow = self._none()
        for i in self._cut(probe):
            line = self.layout.lines[i]
            lower, upper = common(line.lower, line.upper, probe)
            if line.axis == normal:
                row = self._none()
                number = 2 * len(self.layout.lines) + self.sections[2 * len(self.layout.lines) :].index((i, at))
                row[0][self.branches + number] = _area(lower, upper, normal) / line.area
                _add(flow, row, 1.0)
                continue
            # Alongside a line, between the flows through its two faces.
            part = (at - line.lower[normal]) / (line.upper[normal] - line.lower[normal])
            _add(flow, self._into(i, normal, line.lower[normal], lower, upper), 1 - part)
            _add(flow, self._into(i, normal, line.upper[normal], lower, upper), -part)
        for j, joint in enumerate(self.joints):
            if joint.one.normal == normal and joint.one.lower[normal] == at:
                _add(flow, self._joint(j, probe.lower, probe.upper), 1.0)
        for c, condition in enumerate(self.conditions):
            touch = condition.touch
            if touch.normal == normal and touch.lower[normal] == at:
                _add(flow, self._condition(c, probe.lower, probe.upper), self._sign(touch))
        return flow

    def entering(self, boundary: int) -> tuple[np.ndarray, np.ndarray]:
        """The flow into all lines by a condition."""
        flow = self._none()
        for c, condition in enumerate(self.conditions):
            if condition.boundary == boundary:
                _add(flow, self._condition(c, *EVERYWHERE), 1.0)
        return flow

    def _none(self) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros(self.size), np.zeros(len(self.model.inputs.values))

    def _cut(self, probe: Probe) -> list[int]:
        """The lines inside which a flat probe lies."""
        normal, at = _plane(probe)
        lines = []
        for i, line in enumerate(self.layout.lines):
            if (
                line.lower[normal] < at < line.upper[normal]
                and _area(*common(line.lower, line.upper, probe), normal) > 0
            ):
                lines.append(i)
        return lines

    def _sign(self, touch: Touch) -> float:
        """The sign of the flow into a line at a condition: into the solid on its surface; inside along the axis, as
        the mean of both sides that carry something."""
        axis, at = touch.normal, touch.lower[touch.normal]
        above = self.layout.lines[touch.line].lower[axis] == at
        opposite = [
            i for i, line in enumerate(self.layout.lines)
            if (line.upper if above else line.lower)[axis] == at and _common(touch, line)
        ]  # fmt: skip
        if not opposite:
            return 1.0
        carried = not self.electric or any(i in self.live for i in opposite)
        return (1.0 if above else -1.0) * (0.5 if carried and (not self.electric or touch.line in self.live) else 1.0)

    @cached_property
    def live(self) -> set[int]:
        """The lines that are joined to electrodes of two voltages."""
        label = list(range(len(self.layout.lines)))
        for joint in self.layout.wires:
            one, other = label[joint.one.line], label[joint.other.line]
            label = [one if x == other else x for x in label]
        voltages: dict[int, set[object]] = {}
        for c in self.layout.electrodes:
            b = self.layout.scene.boundaries[c.boundary]
            voltages.setdefault(label[c.touch.line], set()).add(physics.potential_of(b))
        return {i for i, x in enumerate(label) if len(voltages.get(x, ())) > 1}

    def _into(self, i: int, normal: int, at: float, lower: Point, upper: Point) -> tuple[np.ndarray, np.ndarray]:
        """The flow into a line through a part of one of its sides."""
        flow = self._none()
        lower, upper = _moved(lower, normal, at), _moved(upper, normal, at)
        for j, joint in enumerate(self.joints):
            for touch, sign in ((joint.one, -1.0), (joint.other, 1.0)):
                if touch.line == i and touch.normal == normal and touch.lower[normal] == at:
                    _add(flow, self._joint(j, lower, upper), sign)
        for c, condition in enumerate(self.conditions):
            touch = condition.touch
            if touch.line == i and touch.normal == normal and touch.lower[normal] == at:
                _add(flow, self._condition(c, lower, upper), 1.0)
        return flow

    def _joint(self, j: int, lower: Point, upper: Point) -> tuple[np.ndarray, np.ndarray]:
        """The flow through a joint, from its first line to the other, in a part of space."""
        joint = self.joints[j]
        if ("joint", j) not in self.circuit.rows:
            return _scaled(self._at_ends["joint", j], _part(joint.one, lower, upper))
        return self._branch(("joint", j), joint.one, joint.kind == "along", lower, upper)

    def _condition(self, c: int, lower: Point, upper: Point) -> tuple[np.ndarray, np.ndarray]:
        """The flow into a line by a condition, in a part of space."""
        condition = self.conditions[c]
        touch, b = condition.touch, self.layout.scene.boundaries[condition.boundary]
        if b.kind == "heat_flux":
            flow = self._none()
            flow[1][condition.boundary] = touch.area * _part(touch, lower, upper)
            return flow
        if ("condition", c) in self.circuit.rows:
            return _scaled(self._branch(("condition", c), touch, touch.end is None, lower, upper), -1.0)
        if b.kind == "convection":
            return self._none()
        return _scaled(self._at_ends["condition", c], _part(touch, lower, upper))

    def _branch(
        self, key: tuple[str, int], touch: Touch, by_point: bool, lower: Point, upper: Point
    ) -> tuple[np.ndarray, np.ndarray]:
        """The flow through the branches of a joint or a condition, from its first line on, in a part of space."""
        flow, rows = self._none(), self.circuit.rows[key]
        if not by_point:
            flow[0][rows] = _part(touch, lower, upper)
            return flow
        axis, e = self.layout.lines[touch.line].axis, self.model.elements
        a, b = max(touch.start, lower[axis]), min(touch.stop, upper[axis])
        if b > a:
            inside = np.isin(e.inside(touch.line, touch.start, touch.stop), e.inside(touch.line, a, b))
            across = next(d for d in range(3) if d not in (axis, touch.normal))
            wide = min(touch.upper[across], upper[across]) - max(touch.lower[across], lower[across])
            flow[0][rows] = inside * max(wide, 0.0) / (touch.upper[across] - touch.lower[across])
        return flow

    @cached_property
    def _at_ends(self) -> dict[tuple[str, int], tuple[np.ndarray, np.ndarray]]:
        """The flow through each joint of two ends, and into each end that is held: the flows of least size, per area,
        that balance the flow along the line at every end."""
        keys: list[tuple[str, int]] = []
        columns: list[dict[tuple[int, int | None], float]] = []
        areas = []
        count = len(self.layout.lines)
        arriving = {(i, end): self._none() for i in range(count) for end in (0, 1)}
        for (i, end), row in arriving.items():
            row[0][self.branches + 2 * i + end] = 1.0 if end == 0 else -1.0
        for j, joint in enumerate(self.joints):
            one, other = (joint.one.line, joint.one.end), (joint.other.line, joint.other.end)
            if ("joint", j) not in self.circuit.rows:
                keys.append(("joint", j))
                columns.append({one: -1.0, other: 1.0})
                areas.append(joint.one.area)
                continue
            for at, sign in ((one, 1.0), (other, -1.0)):
                if at in arriving:
                    _add(arriving[at], self._joint(j, *EVERYWHERE), sign)  # type: ignore[arg-type]
        for c, condition in enumerate(self.conditions):
            at = (condition.touch.line, condition.touch.end)
            if at not in arriving:
                continue
            held = self.layout.scene.boundaries[condition.boundary].kind in ("temperature", "voltage")
            if held and ("condition", c) not in self.circuit.rows:
                keys.append(("condition", c))
                columns.append({at: 1.0})
                areas.append(condition.touch.area)
            else:
                _add(arriving[at], self._condition(c, *EVERYWHERE), -1.0)  # type: ignore[arg-type]
        if not keys:
            return {}
        order = {at: row for row, at in enumerate(arriving)}
        matrix = np.zeros((len(order), len(keys)))
        for k, column in enumerate(columns):
            for at, sign in column.items():
                matrix[order[at], k] = sign  # type: ignore[index]
        root = np.sqrt(np.array(areas) / max(areas))
        inverse = root[:, None] * np.linalg.pinv(matrix * root)
        flows, given = (np.array([row[side] for row in arriving.values()]) for side in (0, 1))
        return {key: (row @ flows, row @ given) for key, row in zip(keys, inverse, strict=True)}


def _plane(probe: Probe) -> tuple[int, float]:
    normal = next(d for d in range(3) if probe.lower[d] == probe.upper[d])
    return normal, probe.lower[normal]


def _area(lower: Point, upper: Point, normal: int) -> float:
    return math.prod(max(upper[d] - lower[d], 0.0) for d in range(3) if d != normal)


def _part(touch: Touch, lower: Point, upper: Point) -> float:
    """The part of a touch's area that lies in a part of space."""
    return _area(*common(lower, upper, touch), touch.normal) / touch.area


def _common(touch: Touch, line: Line) -> bool:
    axes = [d for d in range(3) if d != touch.normal]
    return all(max(touch.lower[d], line.lower[d]) < min(touch.upper[d], line.upper[d]) for d in axes)


def _moved(point: Point, axis: int, to: float) -> Point:
    x, y, z = (to if d == axis else c for d, c in enumerate(point))
    return x, y, z


def _scaled(row: tuple[np.ndarray, np.ndarray], factor: float) -> tuple[np.ndarray, np.ndarray]:
    return factor * row[0], factor * row[1]


def _add(to: tuple[np.ndarray, np.ndarray], row: tuple[np.ndarray, np.ndarray], factor: float) -> None:
    to[0][:] += factor * row[0]
    to[1][:] += factor * row[1]
