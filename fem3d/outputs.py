"""What is read off a solution: probes, heat flows, currents and Joule heats of the whole structure.

The same names come out of a steady state and of a transient, as numbers or as arrays over time:
``probe:<probe>`` (rise in K, potential in V, heat flow in W, current in A), ``flow:<boundary>`` (W, into the solid),
``doubt:<probe>`` (W, by what a heat flow may be off because its boundary shares nodes with another at an angle),
``current:<electrode>`` (A, into the solid), ``joule:<box>`` (W), ``power`` (W, what the electrodes supply),
``generated`` (W, the heat sources'); of a steady state also ``dissipated`` (W, the Joule heat of all boxes, of those
too that symmetry leaves out).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fem3d import inputs, probes, voltmeter
from fem3d.conductor import Conductor
from fem3d.joule import Split
from fem3d.operators import HeatProblem
from fem3d.probes import Extreme, Linear
from fem3d.steady import SteadyState
from fem3d.transient import Transient
from fem3d.voltmeter import Voltmeter
from fem3d.weights import mean_row
from meshes.symmetry import Symmetry
from scenes.model import Probe

Outputs = dict[str, np.ndarray]  # of shape () or (times,)


def of_steady(state: SteadyState, symmetry: Symmetry) -> Outputs:
    """The outputs of a steady state."""
    heat = state.heat
    g, still = np.ones(1), np.zeros(heat.size)
    reaction = heat.reaction(state.rise, still, state.source)
    flows = {name: part @ reaction for name, part in heat.held.items()}
    for name, film in heat.films.items():
        flows[name] = film.entering[0] + film.per_kelvin @ state.rise
    read: Outputs = {}
    for probe in heat.scene.probes:
        if _is_linear(probe):
            row = _linear(heat, probe)
            read[probe.name] = row.per_rise @ state.rise + row.entering @ g + sum(flows[b] for b in row.boundaries)
        elif probe.quantity == "temperature":
            extreme = _extreme(heat, probe)
            read[probe.name] = np.array(extreme.of(extreme.sampled(state.rise[:, None]), g))
        elif probe.quantity == "potential":
            phi = None if state.conductor is None else state.hot_potential
            read[probe.name] = np.array(Voltmeter(heat, state.conductor, probe).read(phi, 0.0))
        elif probe.quantity == "current":
            read[probe.name] = np.array(_current(state.conductor, state.currents, probe))
    currents = {name: np.array(value) for name, value in state.currents.items()}
    joule = {name: np.array(value) for name, value in state.joule.items()}
    found = _whole(symmetry, np.zeros(1), read, flows, currents, joule)
    found |= {
        f"doubt:{name}": symmetry.copies * weights @ np.abs(reaction) for name, weights in _disputed(heat).items()
    }
    found["power"], found["generated"] = symmetry.copies * np.array(state.power), symmetry.copies * heat.generated[0]
    found["dissipated"] = symmetry.copies * np.array(sum(state.joule.values()))
    return found


def of_transient(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    base, reduced = transient.base, transient.reduced
    heat, basis, drive = base.heat, reduced.basis, base.heat.inputs
    g, changing = drive.at(times), drive.rates(times)
    a, sources = transient.trajectory(times)
    rates = sources - a * transient.trajectory.rates
    lifts = heat.lifts

    def along(row: np.ndarray, states: np.ndarray, inputs_now: np.ndarray) -> np.ndarray:
        found: np.ndarray = states @ (row[: heat.free] @ basis) + inputs_now @ (lifts @ row)
        return found

    c = reduced.currents(a, g) if base.patterns else np.zeros((len(times), 0))
    flows = {}
    for name, (per_rise, per_rate) in heat.held_rows.items():
        given = g @ (heat.loads @ heat.held_fields[name])
        flows[name] = along(per_rise, a, g) + along(per_rate, rates, changing) - given
        if name in reduced.at_held:
            flows[name] -= joule(reduced.at_held[name], c, a, g)
    for name, film in heat.films.items():
        flows[name] = g @ film.entering + along(film.per_kelvin, a, g)
    read: Outputs = {}
    currents = {
        name: c @ np.array([p.currents[name] for p in base.patterns])
        for name in (base.patterns[0].currents if base.patterns else {})
    }
    for probe in heat.scene.probes:
        if _is_linear(probe):
            row = _linear(heat, probe)
            read[probe.name] = along(row.per_rise, a, g) + g @ row.entering + sum(flows[b] for b in row.boundaries)
        elif probe.quantity == "temperature":
            extreme = _extreme(heat, probe)
            fields = np.concatenate([heat.whole(basis.T), lifts]).T
            sampled = extreme.sampled(fields)
            read[probe.name] = np.array([extreme.of(sampled, x) for x in np.concatenate([a, g], axis=1)])
        elif probe.name in reduced.potentials:
            shares, cold, warm = reduced.potentials[probe.name]
            read[probe.name] = g @ shares - np.einsum("ti,ti->t", c, g @ cold + a @ warm.T)
        elif probe.quantity == "potential":
            read[probe.name] = voltmeter.over_time(transient, probe, times)
        elif probe.quantity == "current":
            read[probe.name] = np.array(_current(base.conductor, currents, probe)) * np.ones(len(times))
    heats = {name: joule(tested, c, a, g) for name, tested in reduced.in_box.items()}
    found = _whole(symmetry, times, read, flows, currents, heats)
    for name, weights in _disputed(heat).items():
        of_nodes = np.zeros(len(times))
        for node in heat.free + np.flatnonzero(weights):
            one = np.zeros(heat.size)
            one[node] = 1.0
            # Joule heat at the node itself is left out: it is the load of one node, not of an edge.
            entering = along(heat.stiffness @ one, a, g) + along(heat.mass @ one, rates, changing)
            of_nodes += weights[node - heat.free] * np.abs(entering - g @ heat.loads[:, node])
        found[f"doubt:{name}"] = symmetry.copies * of_nodes
    power = np.einsum("tm,tm->t", c, g @ reduced.supply) if base.patterns else np.zeros(len(times))
    found["power"], found["generated"] = symmetry.copies * power, symmetry.copies * (g @ heat.generated)
    return found


def _disputed(heat: HeatProblem) -> dict[str, np.ndarray]:
    """For each probe of a heat flow that shares nodes with other boundaries its weights (`HeatSystem.disputed`)."""
    found = {}
    for probe in heat.scene.probes:
        if probe.quantity == "heat_flow":
            weights = heat.disputed(_linear(heat, probe).boundaries)
            if weights.any():
                found[probe.name] = weights
    return found


def joule(tested: Split, c: np.ndarray, a: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(times,): the Joule heat (W) of a box, or at held nodes, at states a and inputs g for current coefficients c."""
    cold, warm = tested
    pairs = c[:, :, None] * c[:, None, :]
    resistance = np.tensordot(g, cold, (-1, 0)) + np.tensordot(a, warm, (-1, -1))
    found: np.ndarray = np.einsum("tij,tij->t", pairs, resistance)
    return found


def stored_heat(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> np.ndarray:
    """(times,): heat stored above the initial temperature (J), in the whole structure."""
    heat = transient.base.heat
    capacity = heat.mass @ np.ones(heat.size)
    stored = transient.trajectory(times)[0] @ (capacity[: heat.free] @ transient.reduced.basis)
    found: np.ndarray = symmetry.copies * (stored + heat.inputs.at(times) @ (heat.lifts @ capacity))
    return found


def passing(out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """The heat (W) that enters or is made, and that leaves or is taken, each without the other."""
    parts = [out["power"], out["generated"], *(v for name, v in out.items() if name.startswith("flow:"))]
    none = np.zeros_like(out["power"])
    return sum((np.maximum(v, 0.0) for v in parts), none), sum((np.maximum(-v, 0.0) for v in parts), none)


class Goal(NamedTuple):
    """What a thermal probe reads of the rise: ``row`` (free nodes,). Its dual solution z, K z = row, has the values
    ``trace`` (fixed nodes,) at the fixed nodes: the heat that enters at a boundary is tested with a field that doesn't
    vanish there."""

    row: np.ndarray
    trace: np.ndarray


def goal(heat: HeatProblem, probe: Probe, rise: np.ndarray) -> Goal | None:
    """The goal of a thermal probe, that of a point for an extreme; None for an electric one."""
    if probe.quantity not in ("temperature", "heat_flow"):
        return None
    still = np.zeros(heat.size - heat.free)
    if _is_linear(probe):
        linear = _linear(heat, probe)
        trace = sum((-heat.held[name] for name in linear.boundaries), still)
        return Goal(linear.row(heat)[: heat.free], trace)
    extreme = _extreme(heat, probe)
    at = extreme.where(extreme.sampled(rise[:, None]), np.ones(1))
    point = Probe(probe.name, at, at)
    return Goal(mean_row(heat, point, heat.number, heat.size)[: heat.free], still)


def reads_mean(probe: Probe) -> bool:
    """Whether a probe reads the mean of a temperature over its box."""
    return probe.quantity == "temperature" and probe.reduce == "mean"


def _is_linear(probe: Probe) -> bool:
    return probe.quantity == "heat_flow" or reads_mean(probe)


def _linear(heat: HeatProblem, probe: Probe) -> Linear:
    if probe.name not in heat.memo:
        heat.memo[probe.name] = probes.linear(heat, probe)
    found: Linear = heat.memo[probe.name]
    return found


def _extreme(heat: HeatProblem, probe: Probe) -> Extreme:
    if probe.name not in heat.memo:
        blocks = heat.mesh.blocks
        heat.memo[probe.name] = Extreme(heat, probe, blocks, [heat.number[heat.mesh.numbers(b)] for b in blocks])
    found: Extreme = heat.memo[probe.name]
    return found


def _current(conductor: Conductor | None, currents: dict, probe: Probe) -> np.ndarray | float:
    """The current of a probe: of the electrodes whose flat boxes it covers, or what passes through it."""
    if conductor is None:
        return 0.0
    mesh, section = conductor.heat.mesh, conductor.sections[probe.name]
    covered = [
        b.name
        for b in conductor.heat.scene.boundaries
        if b.kind == "voltage" and b.name in currents and probes.covers(mesh, probe, b)
    ]
    if covered and section.sign:
        found: np.ndarray | float = section.sign * sum(currents[name] for name in covered)
        return found
    return currents[f"through:{probe.name}"]  # type: ignore[no-any-return]


def _whole(
    symmetry: Symmetry, times: np.ndarray, read: Outputs, flows: Outputs, currents: Outputs, joule: Outputs
) -> Outputs:
    """From the part that was solved to the whole."""
    found = {}
    for name, value in read.items():
        factor, added = symmetry.probes[name]
        offset = sum((inputs.value(v, times) for v in added), np.zeros(len(times)))
        found[f"probe:{name}"] = factor * value + offset.reshape(np.shape(value))
    for name, flow in symmetry.flows.items():
        if flow.boundary in flows:
            found[f"flow:{name}"] = flow.heat * flows[flow.boundary]
        if flow.boundary in currents:
            found[f"current:{name}"] = flow.current * currents[flow.boundary]
    return found | {f"joule:{name}": symmetry.box_copies[name] * value for name, value in joule.items()}
