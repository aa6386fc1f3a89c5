"""Probes in a network: temperatures, potentials and powers, and flows through flat boxes.

A probe reads the lines in its place, weighted by their part in it. On the side of a line it reads the face: the line,
less the drop over half the thickness towards the other side of the face. An extreme is taken along the lines.

Links at lines' sides have branches with a flow. Where ends meet, or an end is held, there is no branch, and the flow
follows from the flow that arrives along each line; where ends meet in a ring, in proportion to the areas.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from reduced1d.network.lines import Line, Link, Touch, common, joined
from reduced1d.network.model import Model
from scenes import physics
from scenes.free import graph
from scenes.model import Point, Probe

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
        asked = [p for p in probes if p.quantity in kinds]
        if asked and model.circuit(electric) is None:
            values |= {p.name: np.zeros(x.shape[1]) for p in asked}
        elif asked:
            reader = Reader(model, electric, rises, u, x)
            by_kind = dict(zip(kinds, (reader.value, reader.flow, reader.power), strict=False))
            values |= {p.name: by_kind[p.quantity](p) for p in asked if p.quantity != "resistance"}
            for name, one, other in model.layout.pairs if electric else ():
                between = reader.electrode(one) - reader.electrode(other)
                values[name] = graph.resistance(between, reader.entering(one), times)
    return {p.name: values[p.name] for p in probes}


class Reader:
    """The readings (times,) of one of a network's two circuits, at rises and unknowns (n, times) and inputs (inputs,
    times)."""

    def __init__(self, model: Model, electric: bool, rises: np.ndarray, u: np.ndarray, x: np.ndarray) -> None:
        self.electric, self.layout, self.e = electric, model.layout, model.elements
        circuit = model.circuit(electric)
        assert circuit is not None
        self.circuit, self.links, self.rises, self.u, self.x = circuit, self.layout.links(electric), rises, u, x
        differences = circuit.across @ u - circuit.given @ x
        if electric:
            self.halves, resistance = model.resistances(rises)
            self.branches = differences / resistance
        else:
            self.branches = differences * model.conduction[:, None]

    # Flows

    def along(self, lines: Sequence[int], places: Sequence[float]) -> np.ndarray:
        """(places, times): the flow along lines at places (m)."""
        values, slopes = self.e.at(lines, np.array(places))
        flow, warm = slopes @ self.u, values @ self.rises
        for k, i in enumerate(lines):
            line = self.layout.lines[i]
            if line.conducts or not self.electric:
                flow[k] *= -line.area / self.layout.resistivity(i, self.electric, warm[k])
        return np.asarray(flow)

    def flow(self, probe: Probe) -> np.ndarray:
        """(times,): the flow through a flat probe: into the solid on its surface, along the positive axis inside."""
        normal, at = _plane(probe)
        flow = np.zeros(self.x.shape[1])
        for i in self._cut(probe):
            line = self.layout.lines[i]
            lower, upper = common(line.lower, line.upper, probe)
            if line.axis == normal:
                flow += self.along([i], [at])[0] * _area(lower, upper, normal) / line.area
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
        """(times,): the flow into all lines at a boundary."""
        numbers = [number for number, link in enumerate(self.links) if link.boundary == boundary]
        return -np.sum([self.through(number, *EVERYWHERE) for number in numbers], axis=0)

    def through(self, number: int, lower: Point, upper: Point) -> np.ndarray:
        """(times,): the flow through a link, out of its first line, in a part of space."""
        link = self.links[number]
        touch, rows = link.one, self.circuit.rows.get(("link", number))
        part = _part(touch, lower, upper)
        if rows is None:
            if link.other is None and self.layout.scene.boundaries[link.boundary].kind == "heat_flux":
                return np.asarray(-touch.area * part * self.x[link.boundary])
            return part * self._at_ends.get(number, np.zeros(self.x.shape[1]))
        if link.kind != "along":
            return np.asarray(part * self.branches[rows][0])
        axis = self.layout.lines[touch.line].axis
        a, b = max(touch.start, lower[axis]), min(touch.stop, upper[axis])
        if b <= a:
            return np.zeros(self.x.shape[1])
        inside = np.isin(self.e.inside(touch.line, touch.start, touch.stop), self.e.inside(touch.line, a, b))
        across = next(d for d in range(3) if d not in (axis, touch.normal))
        wide = min(touch.upper[across], upper[across]) - max(touch.lower[across], lower[across])
        return np.asarray(max(wide, 0.0) / (touch.upper[across] - touch.lower[across]) * (inside @ self.branches[rows]))

    def _into(self, i: int, normal: int, at: float, lower: Point, upper: Point) -> np.ndarray:
        """The flow into a line through a part of one of its sides."""
        flow = np.zeros(self.x.shape[1])
        (a, b, c), (d, e, f) = ([at if n == normal else x for n, x in enumerate(corner)] for corner in (lower, upper))
        for number, link in enumerate(self.links):
            for touch, sign in zip(link.touches, (-1.0, 1.0), strict=False):
                if touch.line == i and touch.normal == normal and touch.lower[normal] == at:
                    flow += sign * self.through(number, (a, b, c), (d, e, f))
        return flow

    @cached_property
    def _at_ends(self) -> dict[int, np.ndarray]:
        """The flow through each link without a branch, out of its first line: the flows of least size, per area, that
        balance the flow along the line at every end."""
        boundaries, lines = self.layout.scene.boundaries, self.layout.lines
        free = [number for number, link in enumerate(self.links)
                if link.kind == "ends" and ("link", number) not in self.circuit.rows
                and (link.other or boundaries[link.boundary].kind in ("temperature", "voltage"))]  # fmt: skip
        if not free:
            return {}
        ends = [place for line in lines for place in (line.start, line.stop)]
        arriving = self.along(np.repeat(range(len(lines)), 2).tolist(), ends)
        arriving[1::2] *= -1.0
        matrix = np.zeros((len(arriving), len(free)))
        for number, link in enumerate(self.links):
            for touch, sign in zip(link.touches, (-1.0, 1.0), strict=False):
                if touch.end is not None:
                    row = 2 * touch.line + touch.end
                    if number in free:
                        matrix[row, free.index(number)] = sign
                    elif ("link", number) in self.circuit.rows or boundaries[link.boundary].kind == "heat_flux":
                        arriving[row] -= sign * self.through(number, *EVERYWHERE)
        areas = np.array([self.links[number].one.area for number in free])
        root = np.sqrt(areas / areas.max())
        return dict(zip(free, root[:, None] * np.linalg.pinv(matrix * root) @ arriving, strict=True))

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
                    if (line.upper if above else line.lower)[axis] == at and meet(touch, line)]  # fmt: skip
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

    def mean(self, line: int, a: float, b: float) -> np.ndarray:
        """(times,): the mean of a line between two places (m)."""
        return np.asarray((self.e.mean(line, a, b) @ self.u)[0])

    def value(self, probe: Probe) -> np.ndarray:
        """(times,): the value of a probe of a temperature or a potential."""
        shares = self._shares(probe)
        axes = [self.layout.lines[i].axis for i, *_ in shares]
        spans = [(i, lower[axis], upper[axis]) for (i, lower, upper), axis in zip(shares, axes, strict=True)]
        if probe.reduce == "mean" or probe.lower == probe.upper:
            sizes = np.array([_measure(lower, upper, probe) for _, lower, upper in shares])
            each = [self.mean(*span) - self._drop(*share) for span, share in zip(spans, shares, strict=True)]
            return np.asarray(sizes / sizes.sum() @ np.array(each))
        sign, pieces = 1.0 if probe.reduce == "max" else -1.0, []
        for i, a, b in spans:
            nodes = self.e.nodes[i]
            marks = np.array([a, *nodes[(nodes > a) & (nodes < b)], b])
            pieces += [(i, each) for each in np.linspace(marks[:-1], marks[1:], 33, axis=1)]
        lines, places = zip(*pieces, strict=True)
        samples = self.e.at(np.repeat(lines, 33).tolist(), np.concatenate(places))[0] @ self.u
        # A parabola goes through the best three of each piece.
        tops = top(sign * np.moveaxis(samples.reshape(len(places), 33, *samples.shape[1:]), 1, -1))
        return np.asarray(sign * tops.max(axis=0))

    def electrode(self, boundary: int) -> np.ndarray:
        """(times,): the potential of an electrode."""
        terminal = self.e.terminals.get(boundary)
        return np.asarray(self.x[boundary] if terminal is None else self.u[terminal])

    def power(self, probe: Probe) -> np.ndarray:
        """(times,): the Joule heat (W) in a probe's box."""
        heat = self.branches[self.circuit.branch] ** 2 * self.halves
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

    def _drop(self, i: int, lower: Point, upper: Point) -> np.ndarray:
        """(times,): the drop from a line to a place on its side, over half the thickness."""
        drops, axis = [np.zeros(self.x.shape[1])], self.layout.lines[i].axis
        for link in self.links:
            for touch in link.touches:
                n = touch.normal
                at_side = touch.line == i and touch.end is None and lower[n] == upper[n] == touch.lower[n]
                low, high = common(lower, upper, touch)
                corners = list(zip(low, high, lower, upper, strict=True))
                if at_side and not any(a > b or (a == b and c < d) for a, b, c, d in corners):
                    share = math.prod((b - a) / (d - c) for a, b, c, d in corners if d > c)
                    drops.append(share * self._over_half(link, touch, low[axis], high[axis]))
        # A place on the edge of several counts as on the first.
        return np.sum(drops[:2] if lower == upper else drops, axis=0)

    def _over_half(self, link: Link, touch: Touch, a: float, b: float) -> np.ndarray:
        """(times,): the drop from a line to the other side of a link between two places along it (m), the part over
        half the line's thickness."""
        half = touch.half * self.layout.resistivity(touch.line, self.electric)
        if link.other is not None:
            other = link.other if touch is link.one else link.one
            spans = [(a, b)] * 2 if link.kind == "along" else [(t.start, t.stop) for t in (touch, other)]
            difference = self.mean(touch.line, *spans[0]) - self.mean(other.line, *spans[1])
            beyond = other.half * self.layout.resistivity(other.line, self.electric) + link.contact
            return np.asarray(difference * half / (half + beyond))
        if self.layout.scene.boundaries[link.boundary].kind == "heat_flux":
            # It enters through half the thickness: the face is warmer than the line.
            return np.asarray(-half * self.x[link.boundary])
        difference = self.mean(touch.line, a, b) - self.electrode(link.boundary)
        film = self.layout.film(link)
        if film == 0.0:
            return np.zeros(self.x.shape[1])
        return np.asarray(difference * half / (half + (1 / film if film else 0.0)))


def top(values: np.ndarray) -> np.ndarray:
    """(...,): the top of a profile at equally spaced places (..., places), by the parabola through three."""
    at = np.clip(values.argmax(axis=-1), 1, values.shape[-1] - 2)[..., None]
    low, top, high = (np.take_along_axis(values, at + d, axis=-1)[..., 0] for d in (-1, 0, 1))
    bend = 2 * top - low - high
    inside = (bend > 0) & (np.abs(high - low) <= 2 * bend)
    above = np.where(inside, (high - low) ** 2 / (8 * np.where(inside, bend, 1.0)), np.maximum(low, high) - top)
    return top + np.maximum(above, 0.0)


def _plane(probe: Probe) -> tuple[int, float]:
    normal = next(d for d in range(3) if probe.lower[d] == probe.upper[d])
    return normal, probe.lower[normal]


def _area(lower: Point, upper: Point, normal: int) -> float:
    return math.prod(max(upper[d] - lower[d], 0.0) for d in range(3) if d != normal)


def _part(touch: Touch, lower: Point, upper: Point) -> float:
    """The part of a touch's area that lies in a part of space."""
    return _area(*common(lower, upper, touch), touch.normal) / touch.area


def meet(touch: Touch, line: Line) -> bool:
    """Return whether a touch and a line overlap across the axis of the touch."""
    axes = [d for d in range(3) if d != touch.normal]
    return all(max(touch.lower[d], line.lower[d]) < min(touch.upper[d], line.upper[d]) for d in axes)


def _covers(line: Line, probe: Probe) -> bool:
    """Whether some of a probe, of its own dimension, lies in a line or on it."""
    pairs = zip(line.lower, line.upper, probe.lower, probe.upper, strict=True)
    return all(max(a, c) < min(b, d) or (c == d and a <= c <= b) for a, b, c, d in pairs)


def _measure(lower: Point, upper: Point, probe: Probe) -> float:
    """A length, an area or a volume, as the probe has it."""
    each = zip(lower, upper, probe.lower, probe.upper, strict=True)
    return math.prod(b - a for a, b, c, d in each if c < d)
