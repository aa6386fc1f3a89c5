"""What probes read off a temperature field: means, heat flows and extremes.

Means and heat flows are linear: a row for the rise, for a flow also what enters at no rise. The flow of a whole
boundary of given temperature is its reaction, which converges twice as fast as the gradient that is integrated
elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem3d import section, tensor
from fem3d.operators import HeatProblem
from fem3d.weights import mean_row
from meshes.bricks import Block, BrickMesh
from scenes.model import Boundary, Point, Probe, Scene

SAMPLES = 2  # times the degree plus one: points of an interval at which an extreme is looked for


@dataclass(frozen=True, eq=False)
class Linear:
    """value = per_rise @ rise + entering @ g + the flows of boundaries of given temperature; rows over all nodes."""

    per_rise: np.ndarray
    entering: np.ndarray
    boundaries: tuple[str, ...] = ()

    def row(self, heat: HeatProblem) -> np.ndarray:
        """(all nodes,): how the value follows the rise."""
        found: np.ndarray = sum((heat.held_rows[name][0] for name in self.boundaries), self.per_rise)
        return found


def linear(heat: HeatProblem, probe: Probe) -> Linear:
    """The mean rise (K) or the heat flow (W) of a probe."""
    still = np.zeros(heat.inputs.count)
    if probe.quantity == "temperature":
        return Linear(mean_row(heat, probe, heat.number, heat.size), still)
    within = [b for b in heat.scene.boundaries if b.kind != "voltage" and _overlap(heat, b, probe)]
    cut = any(b.kind == "temperature" and not covers(heat.mesh, probe, b) for b in within)
    if cut or not heat.mesh.faces(probe.lower, probe.upper, exposed=True):
        return Linear(_gradient(heat, probe), still)
    per_rise, entering = np.zeros(heat.size), still
    for b in within:
        if b.kind != "temperature":
            shared = _integral(heat, _meet(max, b.lower, probe.lower), _meet(min, b.upper, probe.upper))
            film, share = heat.films[b.name], shared.sum() / _integral(heat, b.lower, b.upper).sum()
            if isinstance(b.value, float | int) and b.kind == "convection":
                per_rise = per_rise - b.value * shared
            entering = entering + share * film.entering
    return Linear(per_rise, entering, tuple(b.name for b in within if b.kind == "temperature"))


def _gradient(heat: HeatProblem, probe: Probe) -> np.ndarray:
    """(all nodes,): the row of the heat flow from the gradient of the rise."""
    mesh = heat.mesh
    through = section.of(mesh, probe, mesh.blocks)
    row = section.gradient_row(
        mesh, through, mesh.blocks, [mesh.boxes[b.box].material.thermal_conductivity for b in mesh.blocks]
    )
    found = np.zeros(heat.size)
    keep = heat.number >= 0
    found[heat.number[keep]] = row[keep]
    return found


def starts_free(scene: Scene, probe: Probe) -> bool:
    """Whether a mean temperature is that of the start at t = 0: no part of the probe's box, of the same dimension, lies
    on a boundary of given temperature."""
    small = 1e-9 * max(b.upper[d] - b.lower[d] for b in scene.boxes for d in range(3))

    def shares(b: Boundary) -> bool:
        low, high = _meet(max, b.lower, probe.lower), _meet(min, b.upper, probe.upper)
        return all(high[d] - low[d] > (small if probe.upper[d] - probe.lower[d] > small else -small) for d in range(3))

    return not any(b.kind == "temperature" and shares(b) for b in scene.boundaries)


class Extreme:
    """The largest (or smallest) value over a probe's box, from samples that a parabola joins along each axis."""

    def __init__(self, heat: HeatProblem, probe: Probe, blocks: tuple[Block, ...], local: list[np.ndarray]) -> None:
        self._sign = 1.0 if probe.reduce == "max" else -1.0
        self._grids: list[tuple[list[np.ndarray], list[np.ndarray], np.ndarray]] = []
        for block, numbers in zip(blocks, local, strict=True):
            points, factors = [], []
            for d, (axis, span) in enumerate(zip(heat.mesh.axes, block.spans, strict=True)):
                at = _samples(axis.breaks, axis.degrees, span, probe.lower[d], probe.upper[d], axis.tolerance)
                points.append(at)
                part = axis.part(*span)
                factors.append(axis.interpolation(at)[:, part.node_slice] if len(at) else np.empty((0, 0)))
            if all(len(p) for p in points):
                self._grids.append((points, factors, numbers))

    def sampled(self, fields: np.ndarray) -> list[np.ndarray]:
        """For each block (points x, points y, points z, fields) the values of fields (all nodes, fields)."""
        return [
            np.stack([tensor.along(factors[0], factors[1], factors[2], u[numbers]) for u in fields.T], axis=-1)
            for _, factors, numbers in self._grids
        ]

    def of(self, sampled: list[np.ndarray], coefficients: np.ndarray) -> float:
        """The extreme of a combination of sampled fields."""
        return (
            max(
                self._peak(self._sign * (values @ coefficients), points)
                for values, (points, _, _) in zip(sampled, self._grids, strict=True)
            )
            * self._sign
        )

    def where(self, sampled: list[np.ndarray], coefficients: np.ndarray) -> tuple[float, float, float]:
        """The sample (m) at which it is."""
        best = None
        for values, (points, _, _) in zip(sampled, self._grids, strict=True):
            v = self._sign * (values @ coefficients)
            i = np.unravel_index(int(v.argmax()), v.shape)
            if best is None or v[i] > best[0]:
                best = (v[i], tuple(float(p[k]) for p, k in zip(points, i, strict=True)))
        assert best is not None
        return best[1]  # type: ignore[return-value]

    @staticmethod
    def _peak(v: np.ndarray, points: list[np.ndarray]) -> float:
        top = np.unravel_index(int(v.argmax()), v.shape)
        found = float(v[top])
        for d, at in enumerate(points):
            i = top[d]
            if 0 < i < len(at) - 1:
                low, high = (float(v[(*top[:d], j, *top[d + 1 :])]) for j in (i - 1, i + 1))
                a, b = at[i] - at[i - 1], at[i + 1] - at[i]
                left, right = (v[top] - low) / a, (v[top] - high) / b
                bend, slope = (left + right) / (a + b), (left * b - right * a) / (a + b)
                found += slope**2 / (4 * bend) if bend > 0 else 0.0
        return found


def _samples(
    breaks: np.ndarray, degrees: np.ndarray, span: tuple[int, int], low: float, high: float, small: float
) -> np.ndarray:
    """Coordinates at which an extreme is looked for along an axis, from low to high inside a block."""
    start, stop = max(low, breaks[span[0]]), min(high, breaks[span[1]])
    if start > stop + small:
        return np.empty(0)
    if stop - start <= small:
        return np.array([start])
    found = [
        np.linspace(max(a, start), min(b, stop), SAMPLES * int(p) + 2)
        for a, b, p in zip(
            breaks[span[0] : span[1]], breaks[span[0] + 1 : span[1] + 1], degrees[span[0] :], strict=False
        )
        if min(b, stop) - max(a, start) > small
    ]
    return np.unique(np.concatenate(found))


def _overlap(heat: HeatProblem, b: Boundary, probe: Probe) -> bool:
    """Whether a boundary and a flat probe share some area."""
    return all(
        (max(p, q) < min(r, s)) if r > p or s > q else p == q
        for (p, r), (q, s) in zip(
            heat.mesh.spans(b.lower, b.upper), heat.mesh.spans(probe.lower, probe.upper), strict=True
        )
    )


def covers(mesh: BrickMesh, probe: Probe, b: Boundary) -> bool:
    """Whether a flat probe covers the whole of a boundary."""
    spans = zip(mesh.spans(b.lower, b.upper), mesh.spans(probe.lower, probe.upper), strict=True)
    return all(q <= p and r <= s for (p, r), (q, s) in spans)


def _meet(which: Callable[..., float], a: Point, b: Point) -> Point:
    x, y, z = (which(p, q) for p, q in zip(a, b, strict=True))
    return x, y, z


def _integral(heat: HeatProblem, lower: Point, upper: Point) -> np.ndarray:
    """(all nodes,): the integral of each basis function over the exposed part of a flat box."""
    found = np.zeros(heat.size)
    for face in heat.mesh.faces(lower, upper, exposed=True):
        found[heat.number[heat.mesh.numbers(face)].ravel()] += tensor.integral(heat.mesh.parts(face)).ravel()
    return found
