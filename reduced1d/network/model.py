"""The equations of a network, heat and current on its lines, each heating and slowing the other; and its table.

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

from reduced1d.network.circuit import Circuit, assemble, factor, weighted
from reduced1d.network.lines import Layout, Line, Link, Touch, graded_nodes
from reduced1d.numerics import Elements
from scenes import physics
from scenes.errors import NumericsError
from scenes.model import Schedule, Value, is_zero
from statespace.channels import value


@dataclass(frozen=True, eq=False)
class Inputs:
    """The inputs of a scene: the boundaries' values (of a film its ambient), then the boxes' heat sources, with the
    input of each box by its name. Given temperatures are rises above that at the start, which is in ``base`` (K).
    ``electric`` marks voltages and given currents."""

    values: tuple[Value, ...]
    base: np.ndarray
    electric: np.ndarray
    sources: dict[str, int]

    def at(self, time: float | np.ndarray) -> np.ndarray:
        """(inputs,) or (inputs, times) at a time or times (s), after a jump there; at infinity the last values."""
        times = np.minimum(np.atleast_1d(time), 1e300)
        values = np.array([value(v, times) for v in self.values]).reshape(len(self.values), -1) - self.base[:, None]
        return values if np.ndim(time) else values[:, 0]

    @property
    def breaks(self) -> list[float]:
        """The times (s) at which an input jumps or bends, in order."""
        return sorted({t for v in self.values if isinstance(v, Schedule) for t in v.times})


def inputs_of(layout: Layout) -> Inputs:
    """Collect the inputs of a layout's scene."""
    scene = layout.scene
    hot = [box for box in scene.boxes if not is_zero(box.heat_source)]
    given = [b.ambient if b.kind == "convection" else b.value for b in scene.boundaries]
    kinds = [*(b.kind for b in scene.boundaries), *("source" for _ in hot)]
    return Inputs(
        (*given, *(box.heat_source for box in hot)),
        np.array([scene.initial_temperature if kind in ("temperature", "convection") else 0.0 for kind in kinds]),
        np.array([kind == "voltage" for kind in kinds]),
        {box.name: len(given) + i for i, box in enumerate(hot)},
    )


@dataclass(frozen=True, eq=False)
class Model:
    """A network on its elements. ``heat`` and ``current`` are None where a scene needs none."""

    layout: Layout
    elements: Elements
    inputs: Inputs
    heat: Circuit | None
    current: Circuit | None

    def circuit(self, electric: bool) -> Circuit | None:
        return self.current if electric else self.heat

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
        each = np.array([self.layout.resistivity(i, False) for i in range(len(self.layout.lines))])
        return 1 / self.heat.resistance(each[self.heat.line])

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
        lines = self.layout.lines
        cold, warm = (np.array([self.layout.resistivity(i, True, rise) if line.conducts else 0.0
                                for i, line in enumerate(lines)]) for rise in (0.0, 1.0))  # fmt: skip
        return cold[self.current.line], (warm - cold)[self.current.line]

    @property
    def couples(self) -> bool:
        """Whether resistances follow the temperature."""
        return self.current is not None and self.heat is not None and bool(np.any(self.law[1]))

    @property
    def by_current(self) -> bool:
        """Whether some electrode has a given current."""
        boundaries = self.layout.scene.boundaries
        return any(np.isinf(boundaries[number].series_resistance) for number in self.elements.terminals)

    def drive(self, x: np.ndarray) -> float:
        """The largest difference of the electrodes (V), or of given currents (A), at some inputs."""
        return float(np.ptp(x[self.inputs.electric])) if self.inputs.electric.any() else 0.0

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
            kelvin = self.layout.scene.initial_temperature - cold[worst] / slope[worst]
            raise NumericsError(f"the resistivity of {name} reaches zero at {kelvin:.4g} K")
        return (circuit.size * resistivity.T).T, circuit.resistance(resistivity)

    def potentials(self, rises: np.ndarray, x: np.ndarray, guess: np.ndarray | None = None) -> np.ndarray:
        """(n, k): the potentials (V) at k rises (n, k) and inputs (inputs, k), by iteration with one factorization,
        of the mean conductances; where the rises differ too much, in two halves."""
        circuit = self.current
        if circuit is None:
            return np.zeros_like(rises)
        resistance, lift = self.resistances(rises)[1], circuit.fixed @ x
        across, free = circuit.free_across, circuit.free
        if not free.shape[1]:
            return np.asarray(lift)
        lu = factor(across.T @ weighted(across, (1 / resistance).mean(axis=1)))
        inner = np.zeros((free.shape[1], x.shape[1])) if guess is None else (free.T @ guess) / circuit.copies[:, None]
        given = circuit.across @ lift - circuit.given @ x
        entering, size, alone = free.T @ (circuit.load @ x), np.inf, x.shape[1] == 1
        while True:
            change = lu.solve(across.T @ ((across @ inner + given) / resistance) - entering)
            inner, before, size = inner - change, size, float(np.abs(change).max())
            largest = max(float(np.abs(inner).max()), float(np.abs(lift).max(initial=0.0)))
            stalls = size >= before / 2
            if size <= 1e-14 * largest or (stalls and (alone or size <= 1e-11 * largest)):
                return np.asarray(free @ inner + lift)
            if stalls:
                break
        half = x.shape[1] // 2
        return np.hstack([self.potentials(rises[:, s], x[:, s]) for s in (slice(half), slice(half, None))])

    def solved(self, x: np.ndarray, heat: np.ndarray) -> np.ndarray:
        """(n,): the steady rise at some inputs, and the ``heat`` (n,) of a current (W)."""
        circuit = self.heat
        assert circuit is not None
        lift = circuit.fixed @ x
        if not circuit.free.shape[1]:
            return np.asarray(lift)
        right = circuit.free.T @ (self.entering @ x + heat - self.stiffness @ lift)
        return np.asarray(lift + circuit.free @ factor(circuit.free.T @ self.stiffness @ circuit.free).solve(right))

    def currents(self, resistance: np.ndarray, potential: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(m,) or (m, any): of the branches, in A."""
        assert self.current is not None
        return (self.current.across @ potential - self.current.given @ x) / resistance

    def joule(self, rise: np.ndarray, potential: np.ndarray, x: np.ndarray) -> np.ndarray:
        """(n,) or (n, any): the Joule heat as a load (W)."""
        circuit = self.current
        if circuit is None:
            return np.zeros_like(rise)
        halves, resistance = self.resistances(rise)
        return np.asarray(circuit.halves.T @ (self.currents(resistance, potential, x)[circuit.branch] ** 2 * halves))


def build(layout: Layout, degree: int, shortest: Sequence[float]) -> Model:
    """Build the network of a layout on elements of a degree, the shortest of each line given (m)."""
    scene, inputs = layout.scene, inputs_of(layout)
    electrodes = {link.boundary for link in layout.current if link.other is None}
    terminals = sorted(number for number in electrodes if scene.boundaries[number].series_resistance)
    elements = Elements(graded_nodes(layout, shortest), degree, terminals)
    count = len(inputs.values)
    heat = assemble(layout, elements, count, False, inputs.sources) if physics.heat(scene) else None
    current = assemble(layout, elements, count, True) if electrodes else None
    return Model(layout, elements, inputs, heat, current)


def scales(layout: Layout, time: float | None) -> list[float]:
    """Compute the length (m) over which the rise of each line changes: the healing length by its losses along its
    sides, and how far heat comes in a ``time`` (s)."""
    losses = np.zeros(len(layout.lines))
    for link in layout.heat:
        held = link.other is not None or layout.scene.boundaries[link.boundary].kind != "heat_flux"
        film = layout.film(link)
        if link.kind == "along" and held and film != 0.0:
            resistance = link.contact + (1 / film if film else 0.0)
            resistance += sum(t.half * layout.resistivity(t.line, False) for t in link.touches)
            for t in link.touches:
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


Row = dict[str, Any]
"""``what`` it is, ``how`` it is joined, and by unit ("W/K", "J/K", "ohm", "W") its ``value``."""


def table(layout: Layout) -> dict[str, list[Row]]:
    """Return the rows of "lines", "joints" and "conditions", as they are at the initial temperature."""
    model = build(layout, 3, [line.length for line in layout.lines])
    rows: dict[str, dict[Any, Row]] = {"lines": {}, "joints": {}, "conditions": {}}
    for i, line in enumerate(layout.lines):
        sizes = f"along {'xyz'[line.axis]}, {_um(line.length)} long, {' x '.join(map(_um, line.sides))}"
        row = rows["lines"][i] = {"what": line.name, "how": sizes}
        m, volume = line.box.material, line.area * line.length
        row["W/K"] = {"value": m.thermal_conductivity * line.area / line.length}
        if not layout.scene.steady:
            row["J/K"] = {"value": m.heat_capacity * volume}
        if layout.current and line.conducts:
            row["ohm"] = {"value": layout.resistivity(i, True) * line.length / line.area}
        if not is_zero(line.box.heat_source):
            row["W"] = {"value": _times(line.box.heat_source, volume)}
    for unit, circuit in (("W/K", model.heat), ("ohm", model.current)):
        electric = unit == "ohm"
        if circuit is not None:
            cold = np.zeros(model.elements.size)
            conductance = 1 / model.resistances(cold)[1] if electric else model.conduction
            for number, link in enumerate(layout.links(electric)):
                names, b = [layout.lines[t.line].name for t in link.touches], None
                if link.other is None:
                    b = layout.scene.boundaries[link.boundary]
                    names.insert(0, b.name)
                row = {"what": " | ".join(names), "how": _how(layout, link)}
                key = *row.values(), link.one.lower, link.one.upper
                row = rows["conditions" if b else "joints"].setdefault(key, row)
                if b is not None and b.kind == "heat_flux":
                    row["W"] = {"value": _times(b.value, link.one.area)}
                elif at := circuit.rows.get(("link", number)):
                    total = float(conductance[at].sum())
                    row[unit] = {"value": 1 / total if electric else total}
    return {name: list(part.values()) for name, part in rows.items()}


def _how(layout: Layout, link: Link) -> str:
    if link.kind == "ends" and link.other:
        return "ends meet, a contact between" if link.contact else "ends meet, nothing between"
    places = [_place(layout.lines[touch.line], touch) for touch in link.touches]
    if link.other is None:
        return places[0]
    return ("point by point, " if link.kind == "along" else "means, ") + " and ".join(dict.fromkeys(places))


def _place(line: Line, touch: Touch) -> str:
    if touch.end is not None:
        return f"the end of {line.name}"
    return f"{'xyz'[line.axis]} = {_um(touch.start)} to {_um(touch.stop)} of {line.name}"


def _times(value: Value, factor: float) -> float | None:
    return None if isinstance(value, Schedule) else value * factor


def _um(length: float) -> str:
    return f"{length * 1e6:.6g} um"
