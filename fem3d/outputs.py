"""What is read off a solution: probes, heat flows, currents and Joule heats of the whole structure.

The same names come out of a steady state and of a transient, as numbers or as arrays over time:
``probe:<probe>`` (rise in K, potential in V, heat flow in W, current in A), ``flow:<boundary>`` (W, into the solid),
``doubt:<probe>`` (by what a heat flow may be off because its boundary shares nodes with another at an angle, or what
the search for an extreme may have left),
``current:<electrode>`` (A, into the solid), ``joule:<box>`` (W), ``power`` (W, what the electrodes supply to what is
solved),
``generated`` (W, the heat sources'); of a steady state also ``dissipated`` (W, the Joule heat of all boxes, of those
too that symmetry leaves out).
"""

from __future__ import annotations

import numpy as np

from fem3d import inputs, voltmeter
from fem3d.heat import HeatProblem
from fem3d.joule import Split
from fem3d.probes import reading
from fem3d.steady import SteadyState
from fem3d.transient import Transient
from fem3d.voltmeter import Voltmeter
from meshes.symmetry import Symmetry

Outputs = dict[str, np.ndarray]  # of shape () or (times,)


def of_steady(state: SteadyState, symmetry: Symmetry) -> Outputs:
    """The outputs of a steady state."""
    heat, currents = state.heat, state.currents
    reaction = heat.reaction(state.rise, np.zeros(heat.size), state.source)
    flows = {name: part @ reaction for name, part in heat.held.items()}
    flows |= {name: film.entering[0] + film.per_kelvin @ state.rise for name, film in heat.films.items()}
    read, left = {}, {}
    for probe in heat.domain.scene.probes:
        if probe.quantity == "potential":
            phi = None if state.conductor is None else state.hot_potential
            read[probe.name] = np.array(Voltmeter(heat.domain, probe).read(phi, 0.0))
            continue
        how = reading(heat, probe)
        if how.extreme is not None:
            value, doubt = how.extreme(heat.field(state.rise)[None], np.ones((1, 1)))
            read[probe.name], left[probe.name] = value[0], doubt[0]
        elif probe.quantity == "current":
            names = how.boundaries or (f"through:{probe.name}",)
            read[probe.name] = np.array(how.sign * sum(currents.get(name, 0.0) for name in names))
        else:
            read[probe.name] = how.row @ state.rise + how.entering[0] + sum(flows[name] for name in how.boundaries)
    found = _whole(
        symmetry, np.zeros(1), read, flows, {name: np.array(value) for name, value in currents.items()},
        {name: np.array(value) for name, value in state.joule.items()},
    )  # fmt: skip
    for name, fields in _disputed(heat).items():
        left[name] = symmetry.copies * np.abs(fields[:, heat.free :] @ reaction).sum()
    found |= {f"doubt:{name}": value for name, value in left.items()}
    found["power"], found["generated"] = symmetry.copies * np.array(state.power), symmetry.copies * heat.generated[0]
    found["dissipated"] = symmetry.copies * np.array(sum(state.joule.values()))
    return found


def of_transient(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    base, reduced = transient.base, transient.reduced
    heat, basis, drive, lifts = base.heat, reduced.basis, base.heat.inputs, base.heat.lifts
    g, changing = drive.at(times), drive.rates(times)
    a, sources = transient.trajectory(times)
    rates = sources - a * transient.trajectory.rates

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
    names = base.patterns[0].currents if base.patterns else {}
    currents = {name: c @ np.array([p.currents[name] for p in base.patterns]) for name in names}
    read, left, zero = {}, {}, np.zeros(len(times))
    for probe in heat.domain.scene.probes:
        if probe.name in reduced.potentials:
            shares, cold, warm = reduced.potentials[probe.name]
            read[probe.name] = g @ shares - np.einsum("ti,ti->t", c, g @ cold + a @ warm.T)
            continue
        if probe.quantity == "potential":
            read[probe.name] = voltmeter.over_time(transient, probe, times)
            continue
        how = reading(heat, probe)
        if how.extreme is not None:
            fields = heat.field(np.concatenate([heat.whole(basis.T), lifts]))
            read[probe.name], left[probe.name] = how.extreme(fields, np.concatenate([a, g], axis=1))
        elif probe.quantity == "current":
            each = (currents.get(name, zero) for name in how.boundaries or (f"through:{probe.name}",))
            read[probe.name] = how.sign * sum(each, zero)
        else:
            own = along(how.row, a, g) + g @ how.entering
            read[probe.name] = sum((flows[name] for name in how.boundaries), own)
    heats = {name: joule(tested, c, a, g) for name, tested in reduced.in_box.items()}
    found = _whole(symmetry, times, read, flows, currents, heats)
    for name, fields in _disputed(heat).items():
        # Joule heat at the edge itself is left out: it is the load of an edge, not of a face.
        given = g @ (heat.loads @ fields.T)
        entering = [along(heat.stiffness @ f, a, g) + along(heat.mass @ f, rates, changing) for f in fields]
        left[name] = symmetry.copies * np.abs(np.array(entering).T - given).sum(axis=1)
    found |= {f"doubt:{name}": value for name, value in left.items()}
    found["power"] = symmetry.copies * sum(heats.values(), zero)
    found["generated"] = symmetry.copies * (g @ heat.generated)
    return found


def _disputed(heat: HeatProblem) -> dict[str, np.ndarray]:
    """For each probe of a heat flow that shares edges with other boundaries the fields of `HeatProblem.disputed`."""
    flows = [p for p in heat.domain.scene.probes if p.quantity == "heat_flow"]
    found = {p.name: heat.disputed(reading(heat, p).boundaries) for p in flows}
    return {name: fields for name, fields in found.items() if len(fields)}


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
    capacity = heat.mass @ heat.unit
    stored = transient.trajectory(times)[0] @ (capacity[: heat.free] @ transient.reduced.basis)
    found: np.ndarray = symmetry.copies * (stored + heat.inputs.at(times) @ (heat.lifts @ capacity))
    return found


def passing(out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """The heat (W) that enters or is made, and that leaves or is taken, each without the other."""
    parts = [out["power"], out["generated"], *(v for name, v in out.items() if name.startswith("flow:"))]
    none = np.zeros_like(out["power"])
    return sum((np.maximum(v, 0.0) for v in parts), none), sum((np.maximum(-v, 0.0) for v in parts), none)


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
