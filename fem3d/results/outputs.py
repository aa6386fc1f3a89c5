"""Outputs of a solution, and the study: the quantities to compute for a scene with their accuracy.

A steady state and a transient give the same names, as numbers or as arrays over time:
``time`` (s), ``probe:<probe>`` (rise in K, potential in V, heat flow and power in W, current in A),
``flow:<boundary>`` (W, into the solid), ``doubt:<probe>`` (largest error of a heat flow whose boundary shares nodes
with another at an angle, or the remainder from the search for an extreme), ``current:<electrode>`` (A, into the solid),
``joule:<box>`` (W), ``power`` (W, supplied by the electrodes to the solved part, times the symmetric copies),
``generated`` (W, the heat sources'), ``dissipated`` (W, the Joule heat of all boxes, also outside the symmetric part);
for a steady state ``rounding`` (W, rounding error of flows that are zero).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial.legendre import legvander

from fem3d.problems.assembly import Surface
from fem3d.problems.conductors import box_of, share
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import CurrentField
from fem3d.results.probes import Reading, Voltmeter, potential_over_time, reading
from fem3d.solution.exponential import step_at
from fem3d.solution.march import FullResponse
from fem3d.solution.reduced import Reduced
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from meshes.symmetry import Symmetry
from scenes import laws
from statespace import channels

Quantities = dict[str, np.ndarray]  # numbers, or arrays over time
ROUNDING = 1e-10  # relative error that rounding in the solves leaves in every quantity


@dataclass(frozen=True, eq=False)
class Study:
    """A scene's part to be solved, and its quantities.

    ``steady`` and ``traces`` compute the reported quantities from the outputs. ``steady_scales`` and ``trace_scales``
    compute the references of relative errors from the outputs (of the steady state where available). ``goals`` and
    ``trace_goals`` name the probe of a steady quantity, or of a trace; ``ratios`` map quantities to the goal with the
    same relative error.
    ``extrapolated``: whether steady quantities include the estimated change by higher degrees, where available.
    ``field_accuracy``: of the steady field at any point, over its largest rise; None where the field is not used.
    Times in s: the ``end``, the ``earliest`` time at which the accuracy of traces holds, and ``instants`` that must be
    among the rows. Messages state the ``drive``, a voltage (V) or a current (A).
    ``from_start``: whether errors before ``earliest`` are needed, too.
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


Outputs = dict[str, np.ndarray]  # of shape () or (times,)
Response = Transient | FullResponse
"""A response in a reduced space or at full order."""


class _Part(NamedTuple):
    """Outputs of the solved part, as numbers or over time: heat flows, currents and Joule heats by name, the electric
    power and the power of the sources (W). Its functions evaluate a `Reading` without its boundaries, an extreme with
    its remainder, the potential of a probe, and the heat that enters at fields (k, all nodes)."""

    flows: Outputs
    currents: Outputs
    joule: Outputs
    power: np.ndarray
    generated: np.ndarray
    row: Callable[[Reading], np.ndarray]
    extreme: Callable[[Any], tuple[np.ndarray, np.ndarray]]
    potential: Callable[[Any], np.ndarray]
    entering: Callable[[np.ndarray], np.ndarray]


def of_steady(state: SteadyState, symmetry: Symmetry) -> Outputs:
    """The outputs of a steady state."""
    heat, rises, still = state.heat, state.rise[None], np.zeros((1, state.heat.size))
    currents, joule = ({name: np.array([v]) for name, v in each.items()} for each in (state.currents, state.joule))
    # The source balances the stiffness, which is linearized where properties follow the temperature.
    loads = (state.source + heat.outflow(state.rise) - heat.stiffness @ state.rise)[None]
    part = _of_fields(heat, np.zeros(1), rises, still, loads, [state.potential], currents, joule)
    # The flows are small differences of these terms; the matrix is symmetric: columns serve as rows.
    sizes = np.abs(state.rise)
    terms = (sizes @ abs(heat.stiffness[:, heat.free :])).sum()
    terms += sum(np.abs(film.entering).sum() + np.abs(film.per_kelvin) @ sizes for film in heat.films.values())
    out = _whole(symmetry, heat, np.zeros(1), part._replace(power=np.array([state.power])))
    return {name: value[0] for name, value in out.items()} | {"rounding": np.array(ROUNDING * symmetry.copies * terms)}


def of_transient(response: Response, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    if isinstance(response, FullResponse):
        return _of_steps(response, symmetry, times)
    return of_states(response.base, response.reduced, symmetry, times, *response.states(times))


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
            response.outputs[i] = _of_step(response, symmetry, np.minimum(step.start + points * step.length, last))
        x = 2 * (times[during] - step.start) / step.length - 1
        weights = legvander(x, count - 1) @ to_legendre
        for name, values in response.outputs[i].items():
            out.setdefault(name, np.empty(len(times)))[during] = weights @ values
    return out | {"time": times}


def _of_step(response: FullResponse, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs of a response at full order at some times (s)."""
    heat, conductor, g = response.heat, response.conductor, response.heat.inputs.at(times)
    rises, rates = (np.array(each) for each in zip(*map(response.at, times.tolist()), strict=True))
    loads, potentials, currents, joule = g @ heat.loads, list[CurrentField](), Outputs(), Outputs()
    if conductor is not None:
        for rise, voltage in zip(rises, g @ conductor.voltages, strict=True):
            potentials.append(conductor.solve(rise, voltage, potentials[-1].potential if potentials else None))
        loads += [conductor.joule_load(p.density, rise) for p, rise in zip(potentials, rises, strict=True)]
        currents = _stacked([p.currents for p in potentials])
        joule = _stacked([conductor.joule(p.density, rise) for p, rise in zip(potentials, rises, strict=True)])
    known: Sequence[np.ndarray | None] = [p.potential for p in potentials] or [None] * len(times)
    return _whole(symmetry, heat, times, _of_fields(heat, times, rises, rates, loads, known, currents, joule))


def _stacked(each: Sequence[dict[str, float]]) -> Outputs:
    return {name: np.array([values[name] for values in each]) for name in each[0]}


def _of_fields(
    heat: HeatProblem,
    times: np.ndarray,
    rises: np.ndarray,
    rates: np.ndarray,
    loads: np.ndarray,
    potentials: Sequence[np.ndarray | None],
    currents: Outputs,
    joule: Outputs,
) -> _Part:
    """The outputs of rises, their rates and loads (each (times, all nodes)) and of the potentials."""
    g, fields = heat.inputs.at(times), heat.field(rises)
    leaving = np.array([heat.outflow(u) + heat.stored(u, w) for u, w in zip(rises, rates, strict=True)])
    reaction = (leaving - loads)[:, heat.free :]
    flows = {name: reaction @ part[heat.free :] for name, part in heat.shares.items()}
    flows |= {name: g @ film.entering + rises @ film.per_kelvin for name, film in heat.films.items()}
    for term in (each for each in heat.terms if isinstance(each, Surface)):
        for b in term.boundaries:
            tangents = [(u, *term.entering(u, heat.domain.faces(b))) for u in fields]
            flows[b.name] = np.array([still + per_kelvin @ u for u, still, per_kelvin in tangents])

    def read(how: Reading) -> np.ndarray:
        flow = rises @ how.row + g @ how.entering
        if how.by_law is not None:
            flow = flow + [how.by_law(heat, u) @ rise for u, rise in zip(fields, rises, strict=True)]
        return np.asarray(flow)

    def potential(probe: Any) -> np.ndarray:
        meter = Voltmeter(heat.domain, probe)
        return np.array([meter.read(phi, t) for phi, t in zip(potentials, times.tolist(), strict=True)])

    return _Part(
        flows, currents, joule, sum(joule.values(), np.zeros(len(times))), g @ heat.generated, read,
        lambda extreme: extreme(fields, np.eye(len(times))), potential,
        lambda disputed: disputed[:, heat.free :] @ reaction.T,
    )  # fmt: skip


def of_states(
    base: Base, reduced: Reduced, symmetry: Symmetry, times: np.ndarray, a: np.ndarray, rates: np.ndarray
) -> Outputs:
    """The outputs of a reduced problem at some times (s), for its states (times, r) and their rates (1/s)."""
    heat, basis, drive, lifts = base.heat, reduced.basis, base.heat.inputs, base.heat.lifts
    g, changing = drive.at(times), drive.rates(times)

    def along(row: np.ndarray, states: np.ndarray, inputs_now: np.ndarray) -> np.ndarray:
        return states @ (row[: heat.free] @ basis) + inputs_now @ (lifts @ row)

    def entering(field: np.ndarray, per_rise: np.ndarray, per_rate: np.ndarray) -> np.ndarray:
        return along(per_rise, a, g) + along(per_rate, rates, changing) - g @ (heat.loads @ field)

    def potential(probe: Any) -> np.ndarray:
        if probe.name not in reduced.potentials:
            return potential_over_time(base, lambda: heat.whole(a @ basis.T) + g @ lifts, probe, times)
        shares, drop = reduced.potentials[probe.name]
        return g @ shares - np.einsum("ti,ti->t", c, z @ drop.T)

    def joule(tested: np.ndarray) -> np.ndarray:
        return np.asarray((pairs * (z @ tested.reshape(-1, z.shape[1]).T)).sum(axis=1))

    c = reduced.currents(a, g) if base.patterns else np.zeros((len(times), 0))
    z, pairs = np.concatenate([g, a], axis=1), (c[:, :, None] * c[:, None]).reshape(len(times), -1)
    flows = {name: entering(heat.shares[name], *rows) for name, rows in heat.reaction_rows.items()}
    for name, tested in reduced.at_held.items():
        flows[name] = flows[name] - joule(tested)
    for name, film in heat.films.items():
        flows[name] = g @ film.entering + along(film.per_kelvin, a, g)
    names = base.patterns[0].currents if base.patterns else {}
    currents = {name: c @ np.array([p.currents[name] for p in base.patterns]) for name in names}
    heats = {name: joule(tested) for name, tested in reduced.in_box.items()}
    power = sum(heats.values(), np.zeros(len(times)))
    whole = cache(lambda: heat.field(np.concatenate([heat.whole(basis.T), lifts])))
    return _whole(symmetry, heat, times, _Part(
        flows, currents, heats, power, g @ heat.generated, lambda how: along(how.row, a, g) + g @ how.entering,
        lambda extreme: extreme(whole(), np.concatenate([a, g], axis=1)), potential,
        # Joule heat at an edge itself is left out: it is the load of an edge, not of a face.
        lambda fields: np.array([entering(f, heat.stiffness @ f, heat.mass @ f) for f in fields]),
    ))  # fmt: skip


def stored_heat(response: Response, symmetry: Symmetry, times: np.ndarray) -> np.ndarray:
    """(times,): heat stored above the initial temperature (J), in the whole structure."""
    heat, rises = response.heat, response.rises(times)
    stored = rises @ (heat.mass @ heat.unit)
    if heat.storage is not None:
        stored = stored + [heat.storage.heat(u) for u in heat.field(rises)]
    return np.asarray(symmetry.copies * stored)


def unbalanced(out: Outputs) -> tuple[float, float]:
    """Return the heat imbalance of a steady state (W), absolute and relative to the total throughput by boundaries,
    sources and currents. Without thermal outputs the imbalance is the electrodes' power less the dissipated power. The
    relative imbalance is 0 where the throughput is within the rounding error of a uniform temperature."""
    entered, left = (float(heat) for heat in passing(out))
    gap, through = abs(entered - left), (entered + left) / 2
    if not any(name.startswith("flow:") for name in out):
        gap, through = abs(float(out["power"] - out["dissipated"])), float(out["power"])
    return gap, gap / through if through > float(out["rounding"]) else 0.0


def passing(out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """The heat (W) that enters or is made, and that leaves or is taken, each without the other."""
    parts = [out["power"], out["generated"], *(v for name, v in out.items() if name.startswith("flow:"))]
    none = np.zeros_like(out["power"])
    return sum((np.maximum(v, 0.0) for v in parts), none), sum((np.maximum(-v, 0.0) for v in parts), none)


def _whole(symmetry: Symmetry, heat: HeatProblem, times: np.ndarray, part: _Part) -> Outputs:
    """From the part that was solved to the whole."""
    out, zero, copies = {"time": times}, np.zeros(times.shape), symmetry.copies
    for probe in (each for each in heat.domain.scene.probes if each.name in symmetry.probes):
        if probe.quantity == "potential":
            value = part.potential(probe)
        elif probe.quantity == "power":
            value = sum((share(name, probe.name) * heat for name, heat in part.joule.items()), zero)
        elif (how := reading(heat, probe)).extreme is not None:
            value, out[f"doubt:{probe.name}"] = part.extreme(how.extreme)
        elif probe.quantity == "current":
            names = how.boundaries or (f"through:{probe.name}",)
            value = how.sign * sum((part.currents.get(name, zero) for name in names), zero)
        else:
            value = sum((part.flows[name] for name in how.boundaries), part.row(how))
        factor, added = symmetry.probes[probe.name]
        out[f"probe:{probe.name}"] = sum((channels.value(each, times) for each in added), factor * value)
        if probe.quantity == "heat_flow" and len(fields := heat.disputed(how.boundaries)):
            out[f"doubt:{probe.name}"] = copies * np.abs(part.entering(fields)).sum(axis=0)
    for name, flow in symmetry.flows.items():
        if flow.boundary in part.flows:
            out[f"flow:{name}"] = flow.heat * part.flows[flow.boundary]
        if flow.boundary in part.currents:
            out[f"current:{name}"] = flow.current * part.currents[flow.boundary]
    for name, value in part.joule.items():
        box = box_of(name)
        if box in symmetry.box_copies:
            out[f"joule:{box}"] = out.get(f"joule:{box}", zero) + symmetry.box_copies[box] * value
    dissipated = sum(part.joule.values(), zero)
    return out | {
        "power": copies * part.power, "generated": copies * part.generated, "dissipated": copies * dissipated
    }  # fmt: skip


def tables(heat: HeatProblem, rises: np.ndarray, keys: tuple[str, ...]) -> list[str]:
    """Return a warning for each property table whose range the fields (k, all nodes), rises in K, exceed."""
    domain, sentences = heat.domain, list[str]()
    space, start, fields = domain.space, domain.scene.initial_temperature, heat.field(np.atleast_2d(rises))
    for body, material in enumerate(domain.materials):
        cells = np.flatnonzero(domain.body == body)
        every = [(key, getattr(law, "table", law)) for key in keys for law in laws.of(getattr(material, key))]
        given = [(key, table) for key, table in every if isinstance(table, laws.Table)]
        if not given or not len(cells):
            continue
        # Inside the cells, and at their vertices, where the coefficient of a function is its value.
        vertices = np.flatnonzero(space.of(cells) & (space.unit > 0))
        reached = np.concatenate([fields[:, vertices].ravel(), *(space.on(cells).value(u).ravel() for u in fields)])
        low, high = start + float(reached.min()), start + float(reached.max())
        slack = 1e-3 * (high - low)  # the accuracy of given temperatures at the ends of tables
        for key, table in given:
            first, last = table.temperatures[0], table.temperatures[-1]
            if low < first - slack or high > last + slack:
                known = f"{key} of {material.name} is a table from {first:,.0f} to {last:,.0f} K"
                sentences.append(
                    f"{known}, and {low:,.0f} to {high:,.0f} K are reached: beyond its ends it is constant"
                )
    return list(dict.fromkeys(sentences))
