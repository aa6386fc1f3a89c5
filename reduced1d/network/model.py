"""The equations of a network, heat and current on its lines, each heating and slowing the other; and its table by hand.

    C dT/dt + B^T flow(T) = load x + Joule heat,      B^T current = given currents,

with the branches of `reduced1d.network.circuit`. Temperatures are rises above the initial one. The Joule heat of a
branch, its resistance times the square of its current, is brought to the lines half by half, each half where it is. The
table has of every line and link the formula with its numbers at the initial temperature, lengths in micrometres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
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
"""``what`` it is, ``how`` it is joined, and by unit ("W/K", "J/K", "ohm", "W") the ``formula`` and its ``value``."""


def table(layout: Layout) -> dict[str, list[Row]]:
    """Write the rows of "lines", "joints" and "conditions"; with currents where the scene has any."""
    wires = {_key(link): link for link in layout.current if link.other}
    joints = [_joint(layout, link, wires.pop(_key(link), None)) for link in layout.heat if link.other]
    return {
        "lines": [_line(layout, i) for i in range(len(layout.lines))],
        "joints": joints + [_joint(layout, None, link) for link in wires.values()],
        "conditions": [_condition(layout, link, electric) for electric in (False, True)
                       for link in layout.links(electric) if not link.other],
    }  # fmt: skip


def _key(link: Link) -> tuple[Any, ...]:
    return *(touch.line for touch in link.touches), link.one.lower, link.one.upper


def _line(layout: Layout, i: int) -> Row:
    line = layout.lines[i]
    m, area, length = line.box.material, line.area, line.length
    across = " x ".join(map(_um, line.sides))
    row: Row = {"what": line.name, "how": f"along {'xyz'[line.axis]}, {_um(length)} long, {across}"}
    k = m.thermal_conductivity
    _put(row, "W/K", f"{k:g} W/(m K) x {_um2(area)} / {_um(length)}", k * area / length)
    if not layout.scene.steady:
        formula = f"{m.density:g} kg/m3 x {m.specific_heat:g} J/(kg K) x {_um2(area)} x {_um(length)}"
        _put(row, "J/K", formula, m.heat_capacity * area * length)
    if layout.current and line.conducts:
        r = layout.resistivity(i, True)
        _put(row, "ohm", f"{r:.6g} ohm m x {_um(length)} / {_um2(area)}", r * length / area)
    source = line.box.heat_source
    if source:
        _put(row, "W", f"{_value_text(source, 'W/m3')} x {_um2(area)} x {_um(length)}", _times(source, area * length))
    return row


def _joint(layout: Layout, heat: Link | None, wire: Link | None) -> Row:
    link = heat or wire
    assert link is not None
    row: Row = {"what": " | ".join(layout.lines[t.line].name for t in link.touches), "how": _how(layout, link)}
    sides = [(t, layout.lines[t.line]) for t in link.touches if t.end is None]
    if heat and (sides or heat.contact):
        parts = [f"{_um(t.half)}/{line.box.material.thermal_conductivity:g} W/(m K)" for t, line in sides]
        parts += [f"{heat.contact:g} m2 K/W"] if heat.contact else []
        resistance = sum(t.half * layout.resistivity(t.line, False) for t, _ in sides) + heat.contact
        _put(row, "W/K", f"{_um2(link.one.area)} / ({' + '.join(parts)})", link.one.area / resistance)
    if wire and sides:
        wired = [(t.half, layout.resistivity(t.line, True)) for t, _ in sides]
        halves = " + ".join(f"{_um(half)} x {r:.6g} ohm m" for half, r in wired)
        resistance = sum(half * r for half, r in wired) / link.one.area
        _put(row, "ohm", f"({halves}) / {_um2(link.one.area)}", resistance)
    return row


def _how(layout: Layout, link: Link) -> str:
    if link.kind == "ends":
        return "ends meet, a contact between" if link.contact else "ends meet, nothing between"
    places = [_place(layout.lines[touch.line], touch) for touch in link.touches]
    return ("point by point, " if link.kind == "along" else "means, ") + " and ".join(dict.fromkeys(places))


def _place(line: Line, touch: Touch) -> str:
    if touch.end is not None:
        return f"the end of {line.name}"
    return f"{'xyz'[line.axis]} = {_um(touch.start)} to {_um(touch.stop)} of {line.name}"


def _condition(layout: Layout, link: Link, electric: bool) -> Row:
    touch, b, film = link.one, layout.scene.boundaries[link.boundary], layout.film(link)
    line = layout.lines[touch.line]
    k, side, place = line.box.material.thermal_conductivity, touch.end is None, _place(line, touch)
    if side:
        place = f"a side of {line.name}, {place.removesuffix(f' of {line.name}')}"
    row: Row = {"what": f"{b.name} | {line.name}", "how": place}
    if electric:
        if b.series_resistance == inf:
            row["how"] = f"{place}; {_value_text(b.value, 'A')} enters"
        elif b.series_resistance:
            row["how"] = f"{place}; behind {b.series_resistance:g} ohm"
        if side:
            r = layout.resistivity(touch.line, True)
            _put(row, "ohm", f"{_um(touch.half)} x {r:.6g} ohm m / {_um2(touch.area)}", touch.half * r / touch.area)
    elif b.kind == "heat_flux":
        _put(row, "W", f"{_value_text(b.value, 'W/m2')} x {_um2(touch.area)}", _times(b.value, touch.area))
    elif film:
        half = f" + {_um(touch.half)}/{k:g} W/(m K)" if side else ""
        value = touch.area / (1 / film + touch.half / k)
        _put(row, "W/K", f"{_um2(touch.area)} / (1/{film:g} W/(m2 K){half})", value)
    elif side and film is None:
        _put(row, "W/K", f"{_um2(touch.area)} x {k:g} W/(m K) / {_um(touch.half)}", touch.area * k / touch.half)
    return row


def _put(row: Row, unit: str, formula: str, value: float | None) -> None:
    row[unit] = {"formula": formula, "value": value}


def _value_text(value: Value, unit: str) -> str:
    return f"(what varies, in {unit})" if isinstance(value, Schedule) else f"{value:g} {unit}"


def _times(value: Value, factor: float) -> float | None:
    return None if isinstance(value, Schedule) else value * factor


def _um(length: float) -> str:
    return f"{length * 1e6:.6g} um"


def _um2(area: float) -> str:
    return f"{area * 1e12:.6g} um2"
