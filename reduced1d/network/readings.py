"""Probes in a network: temperatures and potentials as rows on its unknowns and inputs, and flows through flat boxes.

A probe reads the lines in its place, weighted by their part in it. On the side of a line it reads the face: the line,
less the drop over half the thickness towards the other side of the face. An extreme is taken along the lines.

Links at lines' sides have branches with a flow. Where ends meet, or an end is held, there is no branch, and the flow
follows from the flow that arrives along each line; where ends meet in a ring, in proportion to the areas.
"""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from reduced1d.ladder.few_states import top
from reduced1d.network.lines import Line, Link, Touch, common, joined
from reduced1d.network.model import Model
from scenes import physics
from scenes.free import graph
from scenes.model import Point, Probe

Row = tuple[sp.csr_matrix, np.ndarray]
"""A reading of the unknowns (rows, n) and of the inputs (rows, inputs)."""

EVERYWHERE: tuple[Point, Point] = (-np.inf, -np.inf, -np.inf), (np.inf, np.inf, np.inf)


def read(
    model: Model, rises: np.ndarray, potentials: np.ndarray, x: np.ndarray, times: np.ndarray
) -> dict[str, np.ndarray]:
    """Read every probe of a model's scene.

    Parameters
    ----------
    model : Model
    rises, potentials : (n, times) array
        In K and V.
    x : (inputs, times) array
    times : (times,) array
        In s.

    Returns
    -------
    dict
        (times,) of each probe: rises, potentials, flows, currents, powers and resistances.
    """
    values, probes = dict[str, np.ndarray](), model.layout.scene.probes
    for electric, u in ((False, rises), (True, potentials)):
        kinds = ("potential", "current", "power", "resistance") if electric else ("temperature", "heat_flow")
        asked = tuple(p for p in probes if p.quantity in kinds)
        if asked and model.circuit(electric) is None:
            values |= {p.name: np.zeros(x.shape[1]) for p in asked}
        elif asked:
            reader = Reader(model, electric, tuple(p for p in asked if p.quantity == kinds[1]))
            flows = reader.flows(rises, u, x)
            for p in asked:
                if p.quantity == kinds[1]:
                    values[p.name] = reader.flow(p) @ flows
                elif p.quantity == kinds[0]:
                    values[p.name] = reader.value(p, u, x)
                elif p.quantity == "power":
                    values[p.name] = reader.power(p, rises, u, x)
            for name, one, other in model.layout.pairs if electric else ():
                between = reader.electrode(one, u, x) - reader.electrode(other, u, x)
                values[name] = graph.resistance(between, reader.entering(one) @ flows, times)
    return {p.name: values[p.name] for p in probes}


class Reader:
    """The readings of one of a network's two circuits.

    Flows are the vector (through the circuit's branches, along lines at ``sections``, inputs), and a reading is a row
    on it.
    """

    def __init__(self, model: Model, electric: bool, probes: tuple[Probe, ...] = ()) -> None:
        self.model, self.electric, self.layout, self.e = model, electric, model.layout, model.elements
        circuit = model.circuit(electric)
        assert circuit is not None
        self.circuit, self.links, self.inputs = circuit, self.layout.links(electric), len(model.inputs.values)
        # Both ends of every line, then where probes cut one.
        self.sections = [(i, place) for i, line in enumerate(self.layout.lines) for place in (line.start, line.stop)]
        for probe in probes:
            normal, at = _plane(probe)
            self.sections += [(i, at) for i in self._cut(probe) if self.layout.lines[i].axis == normal]
        numbers, places = zip(*self.sections, strict=True)
        self.values, self.slopes = self.e.at(numbers, np.array(places))
        self.branches = len(circuit.extra)
        self.size = self.branches + len(self.sections) + self.inputs

    # Flows

    def flows(self, rise: np.ndarray, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(size, times): the flows at rises and unknowns (n, times) and inputs (inputs, times)."""
        circuit = self.circuit
        resistance = self.model.resistances(rise)[1] if self.electric else 1 / self.model.conduction[:, None]
        along, warm = self.slopes @ u, self.values @ rise
        for k, (i, _) in enumerate(self.sections):
            line = self.layout.lines[i]
            if line.conducts or not self.electric:
                along[k] *= -line.area / self.layout.resistivity(i, self.electric, warm[k])
        return np.concatenate([(circuit.across @ u - circuit.given @ x) / resistance, along, x])

    def flow(self, probe: Probe) -> np.ndarray:
        """(size,): the flow through a flat probe: into the solid on its surface, along the positive axis inside."""
        normal, at = _plane(probe)
        flow, ends = np.zeros(self.size), 2 * len(self.layout.lines)
        for i in self._cut(probe):
            line = self.layout.lines[i]
            lower, upper = common(line.lower, line.upper, probe)
            if line.axis == normal:
                number = ends + self.sections[ends:].index((i, at))
                flow[self.branches + number] += _area(lower, upper, normal) / line.area
                continue
            # Alongside a line, between the flows through its two faces.
            part = (at - line.lower[normal]) / (line.upper[normal] - line.lower[normal])
            flow += (1 - part) * self._into(i, normal, line.lower[normal], lower, upper)
            flow -= part * self._into(i, normal, line.upper[normal], lower, upper)
        for number, link in enumerate(self.links):
            if link.one.normal == normal and link.one.lower[normal] == at:
                sign = 1.0 if link.other else -self._sign(link.one)
                flow += sign * self.through(number, probe.lower, probe.upper)
        return flow

    def entering(self, boundary: int) -> np.ndarray:
        """(size,): the flow into all lines at a boundary."""
        flow = np.zeros(self.size)
        for number, link in enumerate(self.links):
            if link.boundary == boundary:
                flow -= self.through(number, *EVERYWHERE)
        return flow

    def through(self, number: int, lower: Point, upper: Point) -> np.ndarray:
        """(size,): the flow through a link, out of its first line, in a part of space."""
        link, flow = self.links[number], np.zeros(self.size)
        touch, rows = link.one, self.circuit.rows.get(("link", number))
        if rows is None:
            if link.other is None and self.layout.scene.boundaries[link.boundary].kind == "heat_flux":
                flow[self.size - self.inputs + link.boundary] = -touch.area * _part(touch, lower, upper)
            elif self.layout.film(link) is None:
                flow += _part(touch, lower, upper) * self._at_ends[number]
            return flow
        if link.kind != "along":
            flow[rows] = _part(touch, lower, upper)
            return flow
        axis = self.layout.lines[touch.line].axis
        a, b = max(touch.start, lower[axis]), min(touch.stop, upper[axis])
        if b > a:
            inside = np.isin(self.e.inside(touch.line, touch.start, touch.stop), self.e.inside(touch.line, a, b))
            across = next(d for d in range(3) if d not in (axis, touch.normal))
            wide = min(touch.upper[across], upper[across]) - max(touch.lower[across], lower[across])
            flow[rows] = inside * max(wide, 0.0) / (touch.upper[across] - touch.lower[across])
        return flow

    def _into(self, i: int, normal: int, at: float, lower: Point, upper: Point) -> np.ndarray:
        """The flow into a line through a part of one of its sides."""
        flow = np.zeros(self.size)
        lower, upper = (_moved(corner, normal, at) for corner in (lower, upper))
        for number, link in enumerate(self.links):
            for touch, sign in zip(link.touches, (-1.0, 1.0), strict=False):
                if touch.line == i and touch.normal == normal and touch.lower[normal] == at:
                    flow += sign * self.through(number, lower, upper)
        return flow

    @cached_property
    def _at_ends(self) -> dict[int, np.ndarray]:
        """The flow through each link without a branch, out of its first line: the flows of least size, per area, that
        balance the flow along the line at every end."""
        held = ("temperature", "voltage")
        free = [number for number, link in enumerate(self.links)
                if link.kind == "ends" and ("link", number) not in self.circuit.rows
                and (link.other or self.layout.scene.boundaries[link.boundary].kind in held)]  # fmt: skip
        arriving = np.zeros((2 * len(self.layout.lines), self.size))
        matrix = np.zeros((len(arriving), len(free)))
        for row in range(len(arriving)):
            arriving[row, self.branches + row] = -1.0 if row % 2 else 1.0
        for number, link in enumerate(self.links):
            for touch, sign in zip(link.touches, (-1.0, 1.0), strict=False):
                if touch.end is not None:
                    row = 2 * touch.line + touch.end
                    if number in free:
                        matrix[row, free.index(number)] = sign
                    else:
                        arriving[row] -= sign * self.through(number, *EVERYWHERE)
        if not free:
            return {}
        areas = np.array([self.links[number].one.area for number in free])
        root = np.sqrt(areas / areas.max())
        inverse = root[:, None] * np.linalg.pinv(matrix * root)
        return dict(zip(free, inverse @ arriving, strict=True))

    def _cut(self, probe: Probe) -> list[int]:
        """The lines inside which a flat probe lies."""
        normal, at = _plane(probe)
        return [i for i, line in enumerate(self.layout.lines) if line.lower[normal] < at < line.upper[normal]
                and _area(*common(line.lower, line.upper, probe), normal) > 0]  # fmt: skip

    def _sign(self, touch: Touch) -> float:
        """The sign of the flow into a line at a boundary: into the solid on its surface; inside along the axis, as
        the mean of both sides that carry something."""
        axis, at = touch.normal, touch.lower[touch.normal]
        above = self.layout.lines[touch.line].lower[axis] == at
        opposite = [i for i, line in enumerate(self.layout.lines)
                    if (line.upper if above else line.lower)[axis] == at and _meet(touch, line)]  # fmt: skip
        if not opposite:
            return 1.0
        both = not self.electric or (touch.line in self._live and any(i in self._live for i in opposite))
        return (1.0 if above else -1.0) * (0.5 if both else 1.0)

    @cached_property
    def _live(self) -> set[int]:
        """The lines that are joined to electrodes of two voltages."""
        label = joined(len(self.layout.lines), [(x.one.line, x.other.line) for x in self.links if x.other]).tolist()
        voltages: dict[int, set[object]] = {}
        for link in self.links:
            if link.other is None:
                potential = physics.potential_of(self.layout.scene.boundaries[link.boundary])
                voltages.setdefault(label[link.one.line], set()).add(potential)
        return {i for i, x in enumerate(label) if len(voltages.get(x, ())) > 1}

    # Temperatures, potentials and powers

    def value(self, probe: Probe, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(times,): the value of a probe of a temperature or a potential; arguments as of `flows`."""
        if probe.reduce == "mean" or probe.lower == probe.upper:
            unknowns, inputs = self.mean(probe)
            return np.asarray((unknowns @ u + inputs @ x)[0])
        sign, largest = 1.0 if probe.reduce == "max" else -1.0, []
        for i, lower, upper in self._shares(probe):
            axis, nodes = self.layout.lines[i].axis, self.e.nodes[i]
            a, b = lower[axis], upper[axis]
            marks = np.unique([a, *nodes[(nodes > a) & (nodes < b)], b])
            for low, high in zip(marks, marks[1:] if len(marks) > 1 else marks, strict=False):
                samples = self.e.at([i] * 33, np.linspace(low, high, 33))[0] @ u
                # A parabola goes through the best three.
                largest.append(top(sign * samples.T))
        return np.asarray(sign * np.max(largest, axis=0))

    def mean(self, probe: Probe) -> Row:
        """The row of a probe's mean."""
        u, x = sp.csr_matrix((1, self.e.size)), np.zeros((1, self.inputs))
        shares = self._shares(probe)
        measures = [_measure(lower, upper, probe) for _, lower, upper in shares]
        for (i, lower, upper), measure in zip(shares, measures, strict=True):
            axis = self.layout.lines[i].axis
            row, given = self.e.mean(i, lower[axis], upper[axis]), np.zeros((1, self.inputs))
            for (across, beyond), part in self._beyond(i, lower, upper):
                row, given = row - part * across, given - part * beyond
            u, x = u + row * (measure / sum(measures)), x + given * (measure / sum(measures))
        return u.tocsr(), x

    def electrode(self, boundary: int, potentials: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(times,): the potential of an electrode."""
        terminal = self.e.terminals.get(boundary)
        return np.asarray(x[boundary] if terminal is None else potentials[terminal])

    def power(self, probe: Probe, rises: np.ndarray, potentials: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(times,): the Joule heat (W) in a probe's box."""
        halves, resistance = self.model.resistances(rises)
        heat = self.model.currents(resistance, potentials, x)[self.circuit.branch] ** 2 * halves
        share, (low, high) = np.zeros(len(self.circuit.line)), self.circuit.span
        for i, line in enumerate(self.layout.lines):
            if _covers(line, probe):
                lower, upper = common(line.lower, line.upper, probe)
                sides = _area(lower, upper, line.axis) / line.area
                inside = np.minimum(high, upper[line.axis]) - np.maximum(low, lower[line.axis])
                length = np.where(high > low, high - low, 1.0)
                part = np.where(high > low, inside.clip(0.0) / length, inside >= 0)
                share = np.where(self.circuit.line == i, sides * part, share)
        return np.asarray(share @ heat)

    def _shares(self, probe: Probe) -> list[tuple[int, Point, Point]]:
        """The lines in a probe's place, and the corners of the part of each."""
        return [
            (i, *common(line.lower, line.upper, probe)) for i, line in enumerate(self.layout.lines)
            if (line.conducts or not self.electric) and line.box.name in (probe.boxes or (line.box.name,))
            and _covers(line, probe)
        ]  # fmt: skip

    def _beyond(self, i: int, lower: Point, upper: Point) -> list[tuple[Row, float]]:
        """For each link of a line's side at a place: the difference from the line to the other side, and the part of
        it over half the thickness, times the covered part of the place."""
        differences = []
        axis = self.layout.lines[i].axis
        for link in self.links:
            for touch in link.touches:
                n = touch.normal
                at_side = touch.line == i and touch.end is None and lower[n] == upper[n] == touch.lower[n]
                low, high = common(lower, upper, touch)
                corners = list(zip(low, high, lower, upper, strict=True))
                if at_side and not any(a > b or (a == b and c < d) for a, b, c, d in corners):
                    share = math.prod((b - a) / (d - c) for a, b, c, d in corners if d > c)
                    row, part = self._difference(link, touch, low[axis], high[axis])
                    differences.append((row, part * share))
        # A place on the edge of several counts as on the first.
        return differences[:1] if lower == upper else differences

    def _difference(self, link: Link, touch: Touch, a: float, b: float) -> tuple[Row, float]:
        """The difference from a line to the other side of a link, between two places along it (m), and the part of the
        difference over half the line's thickness."""
        given, resistance = np.zeros((1, self.inputs)), touch.half * self.layout.resistivity(touch.line, self.electric)
        if link.other is not None:
            other = link.other if touch is link.one else link.one
            if link.kind == "along":
                row = self.e.mean(touch.line, a, b) - self.e.mean(other.line, a, b)
            else:
                mean = self.e.mean(touch.line, touch.start, touch.stop)
                row = mean - self.e.mean(other.line, other.start, other.stop)
            beyond = other.half * self.layout.resistivity(other.line, self.electric) + link.contact
            return (row, given), resistance / (resistance + beyond)
        along = self.e.mean(touch.line, a, b)
        if self.layout.scene.boundaries[link.boundary].kind == "heat_flux":
            # It enters through half the thickness: the face is warmer than the line.
            given[0, link.boundary] = -resistance
            return (sp.csr_matrix((1, self.e.size)), given), 1.0
        if self.electric and link.boundary in self.e.terminals:
            return (along - self.e.unit(self.e.terminals[link.boundary]), given), 1.0
        given[0, link.boundary] = -1.0
        film = self.layout.film(link)
        if film == 0.0:
            return (along, given), 0.0
        return (along, given), resistance / (resistance + (1 / film if film else 0.0))


def _plane(probe: Probe) -> tuple[int, float]:
    normal = next(d for d in range(3) if probe.lower[d] == probe.upper[d])
    return normal, probe.lower[normal]


def _area(lower: Point, upper: Point, normal: int) -> float:
    return math.prod(max(upper[d] - lower[d], 0.0) for d in range(3) if d != normal)


def _part(touch: Touch, lower: Point, upper: Point) -> float:
    """The part of a touch's area that lies in a part of space."""
    return _area(*common(lower, upper, touch), touch.normal) / touch.area


def _meet(touch: Touch, line: Line) -> bool:
    axes = [d for d in range(3) if d != touch.normal]
    return all(max(touch.lower[d], line.lower[d]) < min(touch.upper[d], line.upper[d]) for d in axes)


def _moved(point: Point, axis: int, to: float) -> Point:
    x, y, z = (to if d == axis else c for d, c in enumerate(point))
    return x, y, z


def _covers(line: Line, probe: Probe) -> bool:
    """Whether some of a probe, of its own dimension, lies in a line or on it."""
    pairs = zip(line.lower, line.upper, probe.lower, probe.upper, strict=True)
    return all(max(a, c) < min(b, d) or (c == d and a <= c <= b) for a, b, c, d in pairs)


def _measure(lower: Point, upper: Point, probe: Probe) -> float:
    """A length, an area or a volume, as the probe has it."""
    each = zip(lower, upper, probe.lower, probe.upper, strict=True)
    return math.prod(b - a for a, b, c, d in each if c < d)
