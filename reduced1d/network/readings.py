"""Probes of a temperature or a potential in a network, as rows on its unknowns and inputs.

A probe reads the lines in its place, weighted by their part in it. On the side of a line it reads the face: the line,
less the drop over half the thickness towards the other side of the face. An extreme is taken along the lines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from reduced1d.network.lines import Condition, Line, Touch, common
from reduced1d.network.model import Model
from scenes.model import Point, Probe

Apart = tuple[sp.csr_matrix, np.ndarray, float]

FINE = 33
"""Places on an element at which an extreme is looked for; a parabola goes through the best three."""


@dataclass(frozen=True, eq=False)
class Reading:
    """A probe's value ``unknowns`` u + ``inputs`` x of rises or potentials; extremes have `FINE` rows per element."""

    unknowns: sp.csr_matrix
    inputs: np.ndarray
    reduce: str = "mean"
    elements: int = 0

    def value(self, u: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(times,) of unknowns (n, times) and inputs (inputs, times)."""
        rows = self.unknowns @ u + self.inputs @ x
        if self.reduce == "mean":
            return np.asarray(rows[0])
        sign = 1.0 if self.reduce == "max" else -1.0
        by_element = sign * rows.reshape(self.elements, FINE, -1).transpose(0, 2, 1)
        from reduced1d.ladder.few_states import top

        return np.asarray(sign * top(by_element).max(axis=0))


class Reader:
    """Makes the readings of one of a network's two circuits."""

    def __init__(self, model: Model, electric: bool) -> None:
        self.model, self.electric = model, electric
        self.layout, self.e = model.layout, model.elements
        self.joints = self.layout.wires if electric else self.layout.joints
        self.conditions = self.layout.electrodes if electric else self.layout.conditions
        self.count = len(model.inputs.values)

    def reading(self, probe: Probe) -> Reading:
        """The reading of a probe of a temperature or a potential."""
        inside = [(i, line) for i, line in enumerate(self.layout.lines)
                  if not self.electric or line.box.material.resistivity is not None]  # fmt: skip
        inside = [(i, line) for i, line in inside if line.box.name in (probe.boxes or (line.box.name,))]
        shares = [(i, *common(line.lower, line.upper, probe)) for i, line in inside if _covers(line, probe)]
        if probe.reduce != "mean" and probe.lower != probe.upper:
            return self._extreme(probe, [(i, lower, upper) for i, lower, upper in shares])
        u, x = sp.csr_matrix((1, self.e.size)), np.zeros((1, self.count))
        measures = [_measure(lower, upper, probe) for _, lower, upper in shares]
        for (i, lower, upper), measure in zip(shares, measures, strict=True):
            row, given = self._mean(i, lower, upper)
            u, x = u + row * (measure / sum(measures)), x + given * (measure / sum(measures))
        return Reading(u.tocsr(), x)

    def power(self, probe: Probe, heat: np.ndarray) -> np.ndarray:
        """(times,): the part that lies in a probe's box of the heat (W) of the halves (h, times) of a circuit's
        branches."""
        circuit = self.model.current
        assert circuit is not None
        share = np.zeros(len(circuit.line))
        low, high = circuit.span
        for i, line in enumerate(self.layout.lines):
            if _covers(line, probe):
                lower, upper = common(line.lower, line.upper, probe)
                a, b = lower[line.axis], upper[line.axis]
                sides = np.prod([upper[d] - lower[d] for d in range(3) if d != line.axis]) / line.area
                overlap = np.minimum(high, b) - np.maximum(low, a)
                part = np.where(high > low, overlap.clip(0.0) / np.where(high > low, high - low, 1.0), overlap >= 0)
                share[circuit.line == i] = (sides * part)[circuit.line == i]
        return np.asarray(share @ heat)

    def _mean(self, i: int, lower: Point, upper: Point) -> tuple[sp.csr_matrix, np.ndarray]:
        """The mean of a line over a part of its box, which may lie on a side of it."""
        line = self.layout.lines[i]
        row, given = self._along(i, lower[line.axis], upper[line.axis]), np.zeros((1, self.count))
        for (away, x, part), at in self._beyond(i, lower, upper):
            row, given = row - at * part * away, given - at * part * x
        return row, given

    def _along(self, i: int, a: float, b: float) -> sp.csr_matrix:
        return self.e.mean(i, a, b) if b > a else self.e.at([i], np.array([a]))[0]

    def _beyond(self, i: int, lower: Point, upper: Point) -> list[tuple[Apart, float]]:
        """For each contact of a line's side at a place: the difference from the line to the other side (as rows on
        unknowns and inputs) with the part of it over half the thickness, and the covered part of the place."""
        differences = []
        axis = self.layout.lines[i].axis
        for touch, other, contact in self._touches(i):
            if touch.end is not None or lower[touch.normal] != upper[touch.normal]:
                continue
            if lower[touch.normal] != touch.lower[touch.normal]:
                continue
            low, high = common(lower, upper, touch)
            if any(a > b or (a == b and c < d) for a, b, c, d in zip(low, high, lower, upper, strict=True)):
                continue
            share = np.prod([(b - a) / (d - c) for a, b, c, d in zip(low, high, lower, upper, strict=True) if d > c])
            differences.append((self._apart(touch, other, contact, low[axis], high[axis]), float(share)))
        # A place on the edge of several counts as on the first.
        return differences[:1] if lower == upper else differences

    def _touches(self, i: int) -> list[tuple[Touch, Touch | Condition, float]]:
        touches: list[tuple[Touch, Touch | Condition, float]] = []
        for j in self.joints:
            both = (j.one, j.other), (j.other, j.one)
            touches += [(touch, other, j.contact) for touch, other in both if touch.line == i]
        return touches + [(c.touch, c, 0.0) for c in self.conditions if c.touch.line == i]

    def _apart(self, touch: Touch, other: Touch | Condition, contact: float, a: float, b: float) -> Apart:
        given, half_resistance = np.zeros((1, self.count)), touch.half * self._resistivity(touch.line)
        if isinstance(other, Touch):
            alike = other.end is None and self.layout.lines[other.line].axis == self.layout.lines[touch.line].axis
            if alike:
                row = self._along(touch.line, a, b) - self._along(other.line, a, b)
            else:
                outside = self._along(other.line, other.start, other.stop)
                row = self.e.mean(touch.line, touch.start, touch.stop) - outside
            beyond_it = other.half * self._resistivity(other.line) + contact
            return row, given, half_resistance / (half_resistance + beyond_it)
        boundary = self.layout.scene.boundaries[other.boundary]
        if boundary.kind == "heat_flux":
            # It enters through half the thickness: the face is warmer than the line.
            given[0, other.boundary] = -half_resistance
            return sp.csr_matrix((1, self.e.size)), given, 1.0
        if self.electric and other.boundary in self.e.terminals:
            return self._along(touch.line, a, b) - self.e.terminal(other.boundary), given, 1.0
        given[0, other.boundary] = -1.0
        film = 1 / float(boundary.value) if boundary.kind == "convection" and boundary.value else 0.0  # type: ignore[arg-type]
        bare = boundary.kind == "convection" and not boundary.value
        return self._along(touch.line, a, b), given, 0.0 if bare else half_resistance / (half_resistance + film)

    def _resistivity(self, line: int) -> float:
        """Of a line's material, at the start: m K/W or ohm m."""
        return self.layout.resistivity(line) if self.electric else self.model.thermal_resistivity(line)

    def _extreme(self, probe: Probe, shares: list[tuple[int, Point, Point]]) -> Reading:
        """The largest or smallest along the lines in a probe, sampled element by element."""
        rows = []
        for i, lower, upper in shares:
            axis = self.layout.lines[i].axis
            a, b = lower[axis], upper[axis]
            nodes = self.e.nodes[i]
            marks = np.unique([a, *nodes[(nodes > a) & (nodes < b)], b])
            for low, high in zip(marks, marks[1:] if len(marks) > 1 else marks, strict=False):
                rows.append(self.e.at([i] * FINE, np.linspace(low, high, FINE))[0])
        return Reading(sp.vstack(rows, "csr"), np.zeros((1, self.count)), probe.reduce, len(rows))


def _covers(line: Line, probe: Probe) -> bool:
    """Whether some of a probe, of its own dimension, lies in a line or on it."""
    pairs = zip(line.lower, line.upper, probe.lower, probe.upper, strict=True)
    return all(max(a, c) < min(b, d) or (c == d and a <= c <= b) for a, b, c, d in pairs)


def _measure(lower: Point, upper: Point, probe: Probe) -> float:
    """A length, an area or a volume, as the probe has it."""
    each = zip(lower, upper, probe.lower, probe.upper, strict=True)
    return float(np.prod([b - a for a, b, c, d in each if c < d]))
