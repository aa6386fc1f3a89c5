"""Outputs of a solution, and the study: the quantities to compute for a scene with their accuracy.

A steady state and a transient give the same names, as numbers or as arrays over time:
``time`` (s), ``probe:<probe>`` (rise in K, potential in V, heat flow and power in W, current in A),
``flow:<boundary>`` (W, into the solid), ``doubt:<probe>`` (largest error of a heat flow whose boundary shares dofs
with another at an angle, or the remainder from the search for an extreme), ``current:<electrode>`` (A, into the solid),
``joule:<box>`` (W), ``power`` (W, all Joule heat), ``generated`` (W, the heat sources'); for a steady state also
``rounding`` (W, rounding error of flows that are zero).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander

from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import CurrentField, Label
from fem3d.results.extremes import Extreme, read_extremes
from fem3d.results.probes import Reading, Voltmeter, nonlinear_surfaces, reading
from fem3d.solution.exponential import step_at
from fem3d.solution.march import FullResponse
from fem3d.solution.reduced import Reduced
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, ReducedResponse
from meshes.symmetry import Symmetry
from scenes import laws
from scenes.model import AnyProbe
from statespace import channels

Outputs = dict[str, np.ndarray]  # of shape () or (times,)
Quantities = dict[str, np.ndarray]  # of a scene, likewise, by the names that are reported
Response = ReducedResponse | FullResponse
"""A response in a reduced space or at full order."""
SOLVE_ROUNDING = 1e-10  # relative error that rounding in the solves leaves in every quantity


@dataclass(frozen=True, eq=False)
class Study:
    """A scene's part to be solved, and its quantities.

    Attributes
    ----------
    accuracy : largest error of a quantity over its scale
    drive : voltage (V) or current (A), for messages
    end, earliest, instants : end of the transient, the time from which on the accuracy of traces holds, and times that
        must be among the rows (s)
    goals, trace_goals : by steady quantity and by trace the probe whose dual problem bounds the error
    ratios : the goal whose relative error a quantity has
    steady, traces : compute the reported quantities from the outputs
    steady_scales, trace_scales : compute the scales of errors from the outputs (of the steady state where available)
    field_accuracy : of the steady field at any point, over its largest rise; None where the field is not used
    extrapolated : whether steady quantities include the estimated change by higher degrees, where available
    from_start : whether errors before ``earliest`` are needed, too
    """

    part: Symmetry
    accuracy: float
    drive: float
    end: float
    earliest: float
    instants: tuple[float, ...]
    goals: dict[str, str]
    trace_goals: dict[str, str]
    ratios: dict[str, str]
    steady: Callable[[Outputs], Quantities]
    traces: Callable[[Outputs], Quantities]
    steady_scales: Callable[[Outputs], dict[str, float]]
    trace_scales: Callable[[Outputs], dict[str, float]]
    field_accuracy: float | None = None
    extrapolated: bool = True
    from_start: bool = False


def of_steady(state: SteadyState, symmetry: Symmetry) -> Outputs:
    """The outputs of a steady state."""
    heat, rises, at_rest = state.heat, state.rise[None], np.zeros((1, state.heat.size))
    currents, joule = _stacked([state.currents]), _stacked([state.joule])
    part = FullPart(heat, np.zeros(1), rises, at_rest, state.source[None], [state.potential], currents, joule)
    # The flows are small differences of these terms; the matrix is symmetric: columns serve as rows.
    sizes = np.abs(state.rise)
    terms = (sizes @ abs(heat.stiffness[:, heat.free :])).sum()
    terms += sum(np.abs(f.entering).sum() + np.abs(f.per_kelvin) @ sizes for f in heat.face_flows.values())
    out = {name: value[0] for name, value in of_part(part, symmetry).items()}
    return out | {"rounding": np.array(SOLVE_ROUNDING * symmetry.copies * terms)}


def of_transient(response: Response, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    if isinstance(response, FullResponse):
        return _of_steps(response, symmetry, times)
    return of_part(ReducedPart(response.base, response.reduced, times, *response.states(times)), symmetry)


def _of_steps(response: FullResponse, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs of a response at full order: in each step polynomials through their values at Chebyshev points."""
    count = 5  # of order 4 with the cubic rise, as its error
    points = (1 - np.cos(np.linspace(0, np.pi, count))) / 2
    to_legendre = np.linalg.inv(legvander(2 * points - 1, count - 1))
    which, out = step_at(response.steps, times), Outputs()
    for i in np.unique(which).tolist():
        step, during = response.steps[i], which == i
        if i not in response.outputs:
            # Inputs may jump at the end of the step.
            last = (step.start + step.length) * (1 - 8 * np.finfo(float).eps)
            response.outputs[i] = of_step(response, symmetry, np.minimum(step.start + points * step.length, last))
        x = 2 * (times[during] - step.start) / step.length - 1
        weights = legvander(x, count - 1) @ to_legendre
        for name, values in response.outputs[i].items():
            out.setdefault(name, np.empty(len(times)))[during] = weights @ values
    return out | {"time": times}


def of_step(response: FullResponse, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs of a response at full order at some times (s)."""
    heat, conductor, g = response.heat, response.conductor, response.heat.inputs.at(times)
    rises, rates = (np.array(each) for each in zip(*map(response.at, times.tolist()), strict=True))
    loads, potentials, currents, joule = g @ heat.loads, list[CurrentField](), Outputs(), dict[Label, np.ndarray]()
    if conductor is not None:
        for rise, voltage in zip(rises, g @ conductor.voltages, strict=True):
            potentials.append(conductor.solve(rise, voltage, potentials[-1].potential if potentials else None))
        loads += [conductor.joule_load(p.density, rise) for p, rise in zip(potentials, rises, strict=True)]
        currents = _stacked([p.currents for p in potentials])
        joule = _stacked([conductor.joule(p.density, rise) for p, rise in zip(potentials, rises, strict=True)])
    solved: Sequence[np.ndarray | None] = [p.potential for p in potentials] or [None] * len(times)
    return of_part(FullPart(heat, times, rises, rates, loads, solved, currents, joule), symmetry)


def _stacked(each: Sequence[Mapping[Any, float]]) -> dict[Any, np.ndarray]:
    return {name: np.array([values[name] for values in each]) for name in each[0]}


class SolvedPart(ABC):
    """The solved part at some times: the readings from which `of_part` makes the outputs.

    Attributes
    ----------
    heat, times, g : the heat problem, the times (s), and the inputs then (times, channels)
    currents : (times,) by electrode and probe, in A
    joule : Joule heat (times,) by the labels of rows, in W
    """

    def __init__(
        self, heat: HeatProblem, times: np.ndarray, currents: Outputs, joule: Mapping[Label, np.ndarray]
    ) -> None:
        self.heat, self.times, self.g = heat, times, heat.inputs.at(times)
        self.currents, self.joule = currents, joule

    @abstractmethod
    def along(self, row: np.ndarray) -> np.ndarray:
        """(times,): the product of a row (all dofs,) with the rises."""

    @abstractmethod
    def entering(self, fields: np.ndarray) -> np.ndarray:
        """(k, times): the heat (W) that enters at the fixed dofs, tested with fields (k, all dofs)."""

    @abstractmethod
    def extremes(self, every: Sequence[Extreme]) -> tuple[np.ndarray, np.ndarray]:
        """(extremes, times) each: some extremes and their remainders."""

    @abstractmethod
    def potentials(self) -> Sequence[np.ndarray | None]:
        """At each time the potential (functions,) of the parts with current, in V."""

    def potential(self, probe: AnyProbe) -> np.ndarray:
        """(times,): the potential (V) at a probe."""
        meter = Voltmeter(self.heat.domain, probe)
        return np.array([meter.read(phi, t) for phi, t in zip(self.potentials(), self.times.tolist(), strict=True)])

    @abstractmethod
    def flows(self) -> Outputs:
        """The heat (W) that enters at each boundary of given temperature, or with a law of its own."""

    def by_law(self, how: Reading) -> np.ndarray:
        """(times,): the heat (W) that laws add to a reading; none in a reduced problem, which is linear."""
        return np.zeros(len(self.times))


class FullPart(SolvedPart):
    """By the rises, their rates and loads (each (times, all dofs)) and the potentials (functions,) at the times."""

    def __init__(
        self, heat: HeatProblem, times: np.ndarray, rises: np.ndarray, rates: np.ndarray, loads: np.ndarray,
        potentials: Sequence[np.ndarray | None], currents: Outputs, joule: Mapping[Label, np.ndarray],
    ) -> None:  # fmt: skip
        super().__init__(heat, times, currents, joule)
        self.rises, self._potentials, self.fields = rises, potentials, heat.field(rises)
        leaving = np.array([heat.outflow(u) + heat.stored(u, w) for u, w in zip(rises, rates, strict=True)])
        self.reaction = (leaving - loads)[:, heat.free :]

    def along(self, row: np.ndarray) -> np.ndarray:
        return self.rises @ row

    def entering(self, fields: np.ndarray) -> np.ndarray:
        return fields[:, self.heat.free :] @ self.reaction.T

    def extremes(self, every: Sequence[Extreme]) -> tuple[np.ndarray, np.ndarray]:
        return read_extremes(every, self.fields, np.eye(len(self.times)))

    def potentials(self) -> Sequence[np.ndarray | None]:
        return self._potentials

    def flows(self) -> Outputs:
        heat = self.heat
        flows = {name: self.reaction @ part[heat.free :] for name, part in heat.shares.items()}
        for name, term in nonlinear_surfaces(heat).items():
            flows[name] = np.array([term.entering(u, term.on.facets) for u in self.fields])
        return flows

    def by_law(self, how: Reading) -> np.ndarray:
        none = super().by_law(how)
        return none if how.by_law is None else np.array([how.by_law(self.heat, u) for u in self.fields])


class ReducedPart(SolvedPart):
    """By the states ``a`` (times, r) of a reduced problem and their rates (1/s)."""

    def __init__(self, base: Base, reduced: Reduced, times: np.ndarray, a: np.ndarray, rates: np.ndarray) -> None:
        self.base, self.reduced, self.a, self.rates = base, reduced, a, rates
        g = base.heat.inputs.at(times)
        self.z = np.concatenate([g, a], axis=1)
        self.c = reduced.currents(a, g) if base.patterns else np.zeros((len(times), 0))
        self.pairs = (self.c[:, :, None] * self.c[:, None]).reshape(len(times), -1)
        names = base.patterns[0].currents if base.patterns else {}
        currents = {name: self.c @ np.array([p.currents[name] for p in base.patterns]) for name in names}
        super().__init__(base.heat, times, currents, {n: self._heat(tested) for n, tested in reduced.by_label.items()})

    def _heat(self, tested: np.ndarray) -> np.ndarray:
        """(times,): the Joule heat (W) of the pairs of current fields, ``tested``."""
        return np.asarray((self.pairs * (self.z @ tested.reshape(-1, self.z.shape[1]).T)).sum(axis=1))

    def _along(self, row: np.ndarray, states: np.ndarray, g: np.ndarray) -> np.ndarray:
        return states @ (row[: self.heat.free] @ self.reduced.basis) + g @ (self.heat.lifts @ row)

    def _reaction(self, field: np.ndarray, per_rise: np.ndarray, per_rate: np.ndarray) -> np.ndarray:
        stored = self._along(per_rate, self.rates, self.heat.inputs.rates(self.times))
        return self.along(per_rise) + stored - self.g @ (self.heat.loads @ field)

    def along(self, row: np.ndarray) -> np.ndarray:
        return self._along(row, self.a, self.g)

    def entering(self, fields: np.ndarray) -> np.ndarray:
        # Joule heat at an edge itself is left out: it is the load of an edge, not of a face.
        return np.array([self._reaction(f, self.heat.stiffness @ f, self.heat.mass @ f) for f in fields])

    def extremes(self, every: Sequence[Extreme]) -> tuple[np.ndarray, np.ndarray]:
        fields = self.heat.field(np.concatenate([self.heat.whole(self.reduced.basis.T), self.heat.lifts]))
        return read_extremes(every, fields, np.concatenate([self.a, self.g], axis=1))

    def potentials(self) -> Sequence[np.ndarray | None]:
        heat, conductor, solved = self.heat, self.base.conductor, list[np.ndarray]()
        if conductor is None:
            return [None] * len(self.times)
        if not conductor.warms:
            return [*(self.g @ conductor.cold_potentials)]
        rises = heat.whole(self.a @ self.reduced.basis.T) + self.g @ heat.lifts
        for rise, voltage in zip(rises, self.g @ conductor.voltages, strict=True):
            solved.append(conductor.solve(rise, voltage, solved[-1] if solved else None).potential)
        return solved

    def potential(self, probe: AnyProbe) -> np.ndarray:
        if probe.name not in self.reduced.potentials:  # an extreme, or in parts without current
            return super().potential(probe)
        shares, drop = self.reduced.potentials[probe.name]
        return self.g @ shares - np.einsum("ti,ti->t", self.c, self.z @ drop.T)

    def flows(self) -> Outputs:
        flows = {name: self._reaction(self.heat.shares[name], *rows) for name, rows in self.heat.reaction_rows.items()}
        return flows | {name: flows[name] - self._heat(tested) for name, tested in self.reduced.at_given.items()}


def of_part(part: SolvedPart, symmetry: Symmetry) -> Outputs:
    """The outputs of the whole structure."""
    out, zero, copies, heat = {"time": part.times}, np.zeros(part.times.shape), symmetry.copies, part.heat
    linear = {name: part.g @ f.entering + part.along(f.per_kelvin) for name, f in heat.face_flows.items()}
    flows = linear | part.flows()  # with the flows of nonlinear boundaries in place of their linear ones
    probes = [each for each in heat.domain.scene.probes if each.name in symmetry.probes]
    values, remainders = _read_probes(part, probes, flows)
    out |= {f"doubt:{name}": remainder for name, remainder in remainders.items()}
    for probe in probes:
        factor, added = symmetry.probes[probe.name]
        out[f"probe:{probe.name}"] = sum((channels.value(v, part.times) for v in added), factor * values[probe.name])
        if probe.quantity == "heat_flow" and len(fields := heat.disputed(reading(heat, probe).boundaries)):
            out[f"doubt:{probe.name}"] = copies * np.abs(part.entering(fields)).sum(axis=0)
    for name, flow in symmetry.flows.items():
        if flow.boundary in flows:
            out[f"flow:{name}"] = flow.heat * flows[flow.boundary]
        if flow.boundary in part.currents:
            out[f"current:{name}"] = flow.current * part.currents[flow.boundary]
    for label, value in part.joule.items():
        if (box := label.body) in symmetry.box_copies:
            out[f"joule:{box}"] = out.get(f"joule:{box}", zero) + symmetry.box_copies[box] * value
    return out | {
        "power": copies * sum(part.joule.values(), zero), "generated": copies * (part.g @ heat.generated)
    }  # fmt: skip


def _read_probes(part: SolvedPart, probes: Sequence[AnyProbe], flows: Outputs) -> tuple[Outputs, Outputs]:
    """By probe its value in the solved part, and by extreme the remainder of its search; ``flows`` by boundary (W)."""
    zero, values = np.zeros(part.times.shape), Outputs()
    readings = {p.name: reading(part.heat, p) for p in probes if p.quantity not in ("potential", "power")}
    extremes = {name: how.extreme for name, how in readings.items() if how.extreme is not None}
    found, remainders = part.extremes([*extremes.values()]) if extremes else ((), ())
    values.update(zip(extremes, found, strict=True))
    for probe in (p for p in probes if p.name not in extremes):
        if probe.quantity == "potential":
            value = part.potential(probe)
        elif probe.quantity == "power":
            value = sum((label.shares.get(probe.name, 0.0) * joule for label, joule in part.joule.items()), zero)
        elif (how := readings[probe.name]) and probe.quantity == "current":
            names = how.boundaries or (f"through:{probe.name}",)
            value = how.sign * sum((part.currents.get(name, zero) for name in names), zero)
        else:
            linear = part.along(how.row) + part.g @ how.entering
            value = sum((flows[name] for name in how.boundaries), linear + part.by_law(how))
        values[probe.name] = value
    return values, dict(zip(extremes, remainders, strict=True))


def stored_heat(response: Response, symmetry: Symmetry, times: np.ndarray) -> np.ndarray:
    """(times,): heat stored above the initial temperature (J), in the whole structure."""
    heat, rises = response.heat, response.rises(times)
    stored = rises @ (heat.mass @ heat.unit)
    if heat.storage is not None:
        stored = stored + [heat.storage.heat(u) for u in heat.field(rises)]
    return np.asarray(symmetry.copies * stored)


def heat_imbalance(out: Outputs) -> tuple[float, float]:
    """Return the heat imbalance of a steady state (W), absolute and relative to the total throughput by boundaries,
    sources and currents; both are 0 without thermal outputs. The relative imbalance is 0 where the throughput is within
    the rounding error of a uniform temperature."""
    if not any(name.startswith("flow:") for name in out):
        return 0.0, 0.0
    entered, left = (float(heat) for heat in heat_in_and_out(out))
    gap, through = abs(entered - left), (entered + left) / 2
    return gap, gap / through if through > float(out["rounding"]) else 0.0


def heat_in_and_out(out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """The heat (W) that enters or is made, and that leaves or is taken, each without the other."""
    parts = [out["power"], out["generated"], *(v for name, v in out.items() if name.startswith("flow:"))]
    none = np.zeros_like(out["power"])
    return sum((np.maximum(v, 0.0) for v in parts), none), sum((np.maximum(-v, 0.0) for v in parts), none)


def warn_of_tables(heat: HeatProblem, rises: np.ndarray, keys: tuple[str, ...]) -> list[str]:
    """Return a warning for each property table whose range the fields (k, all dofs), rises in K, exceed."""
    domain, sentences = heat.domain, list[str]()
    space, start, fields = domain.space, domain.scene.initial_temperature, heat.field(np.atleast_2d(rises))
    for material in dict.fromkeys(domain.materials):
        bodies = [body for body, each in enumerate(domain.materials) if each == material]
        cells = np.flatnonzero(np.isin(domain.body, bodies))
        every = [(key, getattr(law, "table", law)) for key in keys for law in laws.of(getattr(material, key))]
        given = [(key, table) for key, table in every if isinstance(table, laws.Table)]
        if not given or not len(cells):
            continue
        # Inside the cells, and at their vertices, where the coefficient of a function is its value.
        vertices = np.flatnonzero(space.functions_of(cells) & (space.unit > 0))
        reached = np.concatenate([fields[:, vertices].ravel(), *(space.on(cells).value(u).ravel() for u in fields)])
        low, high = start + float(reached.min()), start + float(reached.max())
        slack = 1e-3 * (high - low)  # the accuracy of given temperatures at the ends of tables
        for key, table in given:
            first, last = table.temperatures[0], table.temperatures[-1]
            if low < first - slack or high > last + slack:
                known = f"{key} of {material.name} is a table from {first:,.0f} to {last:,.0f} K"
                reached_range = f"{low:,.0f} to {high:,.0f} K are reached"
                sentences.append(f"{known}, and {reached_range}: beyond its ends it is constant")
    return list(dict.fromkeys(sentences))
