"""The equations of a network: heat and current on its lines, each heating and slowing the other.

    C dT/dt + B^T flow(T) = load x + Joule heat,      B^T current = given currents,

with the branches of `reduced1d.network.circuit`. Temperatures are rises above the initial one. The Joule heat of a
branch, its resistance times the square of its current, is brought to the lines half by half, each half where it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from reduced1d.network.circuit import Circuit, current_circuit, factor, heat_circuit, weighted
from reduced1d.network.elements import Elements, nodes_of
from reduced1d.network.lines import Layout
from scenes import physics
from scenes.errors import NumericsError
from scenes.model import Scene, Schedule, Value, is_zero

REFINEMENTS = 30
"""The most iterations for potentials, with the matrix of resistances averaged over the times solved together."""
ROUNDING = 1e-14  # They end with a change below this part of the largest potential.


@dataclass(frozen=True)
class Inputs:
    """The inputs of a scene: the boundaries' values (of a film its ambient), then the boxes' heat sources. Given
    temperatures are rises above ``start`` (K)."""

    values: tuple[Value, ...]
    kelvin: tuple[bool, ...]
    electric: tuple[bool, ...]
    sources: dict[str, int]
    start: float

    @staticmethod
    def from_scene(scene: Scene) -> Inputs:
        boundaries = scene.boundaries
        hot = [box for box in scene.boxes if not is_zero(box.heat_source)]
        given = [b.ambient if b.kind == "convection" else b.value for b in boundaries]
        none = [False] * len(hot)
        return Inputs(
            (*given, *(box.heat_source for box in hot)),
            (*(b.kind in ("temperature", "convection") for b in boundaries), *none),
            (*(b.kind == "voltage" for b in boundaries), *none),
            {box.name: len(boundaries) + i for i, box in enumerate(hot)}, scene.initial_temperature,
        )  # fmt: skip

    def at(self, time: float) -> np.ndarray:
        """(inputs,) at a time (s), after a jump there; at infinity the last values."""
        values = []
        for value, kelvin in zip(self.values, self.kelvin, strict=True):
            values.append(_at(value, time) - (self.start if kelvin else 0.0))
        return np.array(values)

    @property
    def breaks(self) -> list[float]:
        """The times (s) at which an input jumps or bends, in order."""
        return sorted({t for v in self.values if isinstance(v, Schedule) for t in v.times})


def _at(value: Value, time: float) -> float:
    if not isinstance(value, Schedule):
        return float(value)
    times, values = value.times, value.values
    after = int(np.searchsorted(times, time, side="right"))
    if after in (0, len(times)):
        return float(values[min(after, len(times) - 1)])
    t0, t1, v0, v1 = times[after - 1], times[after], values[after - 1], values[after]
    return float(v0 + (v1 - v0) * (time - t0) / (t1 - t0))


@dataclass(frozen=True, eq=False)
class Model:
    """A network on its elements. ``heat`` and ``current`` are None where a scene needs none."""

    layout: Layout
    elements: Elements
    inputs: Inputs
    heat: Circuit | None
    current: Circuit | None

    @cached_property
    def capacity(self) -> sp.csr_matrix:
        """(n, n) in J/K."""
        e = self.elements
        each = np.zeros(len(e.weights))
        for i, line in enumerate(self.layout.lines):
            q = e.inside(i, line.start, line.stop)
            each[q] = line.box.material.heat_capacity * line.area * e.weights[q]
        return e.values.T @ weighted(e.values, each)

    @cached_property
    def conduction(self) -> np.ndarray:
        """(m,) in W/K: the conductance of each branch of the heat."""
        assert self.heat is not None
        k = np.array([line.box.material.thermal_conductivity for line in self.layout.lines])
        return 1 / self.heat.resistance(1 / k[self.heat.line])

    @cached_property
    def stiffness(self) -> sp.csr_matrix:
        """(n, n) in W/K."""
        assert self.heat is not None
        return self.heat.matrix(self.conduction)

    @cached_property
    def entering(self) -> sp.csr_matrix:
        """(n, inputs): the heat that inputs bring, by films and directly."""
        assert self.heat is not None
        return self.heat.load + self.heat.across.T @ weighted(self.heat.given, self.conduction)

    @cached_property
    def law(self) -> tuple[np.ndarray, np.ndarray]:
        """(h,) twice: of each half of the current's branches the resistivity at the start, and its slope with T."""
        assert self.current is not None
        cold, slope = np.zeros(len(self.layout.lines)), np.zeros(len(self.layout.lines))
        for i in np.unique(self.current.line).tolist():
            cold[i] = self.layout.resistivity(i)
            slope[i] = self.layout.resistivity(i, 1.0) - cold[i]
        return cold[self.current.line], slope[self.current.line]

    def thermal_resistivity(self, line: int) -> float:
        """Of a line's material, in m K/W."""
        return 1 / self.layout.lines[line].box.material.thermal_conductivity

    @property
    def couples(self) -> bool:
        """Whether resistances follow the temperature."""
        return self.current is not None and self.heat is not None and bool(np.any(self.law[1]))

    @property
    def by_current(self) -> bool:
        """Whether some electrode has a given current."""
        boundaries = self.layout.scene.boundaries
        return any(np.isinf(boundaries[number].series_resistance) for number in self.elements.terminals)

    @property
    def may_run_away(self) -> bool:
        """Whether heating may: some resistance falls as it warms, or rises at a given current."""
        return self.couples and bool((self.law[1] < 0).any() or (self.by_current and (self.law[1] > 0).any()))

    def resistances(self, rise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(h,) or (h, any) of the halves, and (m,) or (m, any) of the branches, in ohm, at rises (n,) or (n, any).

        Raises NumericsError where the law of the resistivity is left: a linear one ends where it reaches zero."""
        circuit = self.current
        assert circuit is not None
        cold, slope = self.law
        resistivity = (cold + slope * (circuit.halves @ rise).T).T
        if not (resistivity > 0).all():
            worst = int(np.argmin(resistivity.min(axis=tuple(range(1, resistivity.ndim)))))
            name = self.layout.lines[circuit.line[worst]].name
            kelvin = self.inputs.start - cold[worst] / slope[worst]
            raise NumericsError(f"the resistivity of {name} reaches zero at {kelvin:.4g} K")
        return (circuit.size * resistivity.T).T, circuit.resistance(resistivity)

    def potentials(self, rises: np.ndarray, x: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
        """(n, k): the potentials (V) at k rises (n, k) and inputs (inputs, k), by iteration with one factorization,
        of the mean conductances; where the rises differ too much, in two halves."""
        circuit = self.current
        assert circuit is not None
        resistance = self.resistances(rises)[1]
        lift = circuit.fixed @ x
        if not circuit.free.shape[1]:
            return np.asarray(lift)
        across, free = circuit.free_across, circuit.free
        matrix = across.T @ weighted(across, (1 / resistance).mean(axis=1))
        lu = factor(matrix)
        inner = np.zeros((free.shape[1], x.shape[1])) if guess is None else (free.T @ guess) / circuit.copies[:, None]
        given = circuit.across @ lift - circuit.given @ x
        entering, size = free.T @ (circuit.load @ x), np.inf
        for _ in range(REFINEMENTS):
            change = lu.solve(across.T @ ((across @ inner + given) / resistance) - entering)
            inner, before, size = inner - change, size, float(np.abs(change).max())
            largest = max(float(np.abs(inner).max()), float(np.abs(lift).max(initial=0.0)))
            if size <= ROUNDING * largest or (size <= 1e3 * ROUNDING * largest and size >= before / 2):
                return np.asarray(free @ inner + lift)
            if size > before or (x.shape[1] == 1 and size >= before / 2):
                break
        if x.shape[1] == 1:
            return np.asarray(free @ inner + lift)
        half = x.shape[1] // 2
        return np.hstack([self.potentials(rises[:, s], x[:, s]) for s in (slice(half), slice(half, None))])

    def solved(self, circuit: Circuit, matrix: sp.csr_matrix, x: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(n,): the u = free v + fixed x with free^T (matrix u - load) = 0."""
        lift = circuit.fixed @ x
        right = circuit.free.T @ (load - matrix @ lift)
        if not circuit.free.shape[1]:
            return np.asarray(lift)
        inner = factor(circuit.free.T @ matrix @ circuit.free).solve(right)
        return np.asarray(lift + circuit.free @ inner)

    def currents(self, resistance: np.ndarray, potential: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(m,) or (m, any): of the branches, in A."""
        assert self.current is not None
        return (self.current.across @ potential - self.current.given @ x) / resistance

    def joule(self, halves: np.ndarray, current: np.ndarray) -> np.ndarray:
        """(n,) or (n, any): the Joule heat as a load (W), of the halves' resistances and the branches' currents."""
        circuit = self.current
        assert circuit is not None
        return np.asarray(circuit.halves.T @ (current[circuit.branch] ** 2 * halves))


def build(layout: Layout, degree: int, shortest: Sequence[float]) -> Model:
    """The network of a layout on elements of a degree, the shortest of each line given (m)."""
    scene = layout.scene
    inputs = Inputs.from_scene(scene)
    terminals = {c.boundary for c in layout.electrodes if scene.boundaries[c.boundary].series_resistance}
    elements = Elements(nodes_of(layout, shortest), degree, sorted(terminals))
    count = len(inputs.values)
    heat = heat_circuit(layout, elements, count, inputs.sources) if physics.heat(scene) else None
    electric = physics.electric(scene) and layout.electrodes
    return Model(layout, elements, inputs, heat, current_circuit(layout, elements, count) if electric else None)


def scales(layout: Layout, time: float | None) -> list[float]:
    """Of each line the length (m) over which its rise changes: the healing length by its losses along its sides, and
    how far heat comes in a ``time`` (s)."""
    losses = np.zeros(len(layout.lines))
    for joint in layout.joints:
        if joint.kind == "along":
            each = [t.half / layout.lines[t.line].box.material.thermal_conductivity for t in (joint.one, joint.other)]
            for t in (joint.one, joint.other):
                losses[t.line] += t.area / (t.stop - t.start) / (sum(each) + joint.contact)
    for c in layout.conditions:
        t, b = c.touch, layout.scene.boundaries[c.boundary]
        if t.end is None and b.kind in ("temperature", "convection") and b.value:
            film = 1 / float(b.value) if b.kind == "convection" else 0.0  # type: ignore[arg-type]
            resistance = t.half / layout.lines[t.line].box.material.thermal_conductivity + film
            losses[t.line] += t.area / (t.stop - t.start) / resistance
    scales = []
    for line, loss in zip(layout.lines, losses.tolist(), strict=True):
        m = line.box.material
        lengths = [line.length]
        if loss:
            lengths.append(float(np.sqrt(m.thermal_conductivity * line.area / loss)))
        if time is not None:
            lengths.append(float(np.sqrt(m.thermal_conductivity / m.heat_capacity * time)))
        scales.append(min(lengths))
    return scales


def remarks(model: Model) -> dict[str, Any]:
    """The size of the network, for a result."""
    heat, current = model.heat, model.current
    return {
        "lines": len(model.layout.lines), "unknowns": heat.free.shape[1] if heat else 0,
        "electric_unknowns": current.free.shape[1] if current else 0, "degree": model.elements.degree,
    }  # fmt: skip
