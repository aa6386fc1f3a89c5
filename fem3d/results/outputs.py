"""What is read off a solution: probes, heat flows, currents and Joule heats of the whole structure.

The same names come out of a steady state and of a transient, as numbers or as arrays over time:
``time`` (s), ``probe:<probe>`` (rise in K, potential in V, heat flow and power in W, current in A),
``flow:<boundary>`` (W, into the solid),
``doubt:<probe>`` (by what a heat flow may be off because its boundary shares nodes with another at an angle, or what
the search for an extreme may have left),
``current:<electrode>`` (A, into the solid), ``joule:<box>`` (W), ``power`` (W, what the electrodes supply to what is
solved),
``generated`` (W, the heat sources'), ``dissipated`` (W, the Joule heat of all boxes, of those too that symmetry leaves
out); of a steady state ``rounding`` (W, what it leaves of flows that are nothing).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from fem3d.problems.conductors import box_of, share
from fem3d.problems.heat import HeatProblem
from fem3d.results import voltmeter
from fem3d.results.probes import Reading, reading
from fem3d.results.voltmeter import Voltmeter
from fem3d.solution.interpolated import Conducted, together
from fem3d.solution.joule_tensors import Split
from fem3d.solution.reduced import Reduced
from fem3d.solution.steady import SteadyState
from fem3d.solution.transient import Base, Transient
from fem3d.spaces import channels
from meshes.symmetry import Symmetry
from scenes.model import Value

ROUNDING = 1e-10  # relative error that rounding in the solves leaves in every quantity
Outputs = dict[str, np.ndarray]  # of shape () or (times,)


class _Part(NamedTuple):
    """What is known of the part that is solved, as numbers or over time: heat flows, currents and Joule heats by name,
    the electric power and that of the sources (W), and how the rest is read: a `Reading` without its boundaries, an
    extreme with its doubt, the potential of a probe, and the heat that enters at fields (k, all nodes)."""

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
    heat, field = state.heat, state.heat.field(state.rise)[None]
    reaction = heat.reaction(state.rise, np.zeros(heat.size), state.source)
    flows = {name: part @ reaction for name, part in heat.held.items()}
    flows |= {name: film.entering[0] + film.per_kelvin @ state.rise for name, film in heat.films.items()}

    def top(extreme: Any) -> tuple[np.ndarray, np.ndarray]:
        value, doubt = extreme(field, np.ones((1, 1)))
        return value[0], doubt[0]

    def potential(probe: Any) -> np.ndarray:
        phi = None if state.conductor is None else state.hot_potential
        return np.array(Voltmeter(heat.domain, probe).read(phi, 0.0))

    # What the flows are the small differences of.
    sizes = np.abs(state.rise)
    # The matrix is symmetric: columns, which it is stored by, serve as rows.
    terms = (sizes @ abs(heat.stiffness[:, heat.free :])).sum()
    terms += sum(np.abs(film.entering).sum() + np.abs(film.per_kelvin) @ sizes for film in heat.films.values())
    rounding = {"rounding": np.array(ROUNDING * symmetry.copies * terms)}
    return rounding | _whole(symmetry, heat, np.zeros(()), _Part(
        flows, {name: np.array(value) for name, value in state.currents.items()},
        {name: np.array(value) for name, value in state.joule.items()}, np.array(state.power), heat.generated[0],
        lambda how: how.row @ state.rise + how.entering[0], top, potential,
        lambda fields: fields[:, heat.free :] @ reaction,
    ))  # fmt: skip


def of_transient(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    return of_states(transient.base, transient.reduced, symmetry, times, *transient.states(times))


def of_states(
    base: Base, reduced: Reduced, symmetry: Symmetry, times: np.ndarray, a: np.ndarray, rates: np.ndarray
) -> Outputs:
    """The outputs of a reduced problem at some times (s), for its states (times, r) and their rates (1/s)."""
    heat, basis, drive, lifts = base.heat, reduced.basis, base.heat.inputs, base.heat.lifts
    g, changing = drive.at(times), drive.rates(times)

    def along(row: np.ndarray, states: np.ndarray, inputs_now: np.ndarray) -> np.ndarray:
        return states @ (row[: heat.free] @ basis) + inputs_now @ (lifts @ row)

    def entering(name: Hashable, field: np.ndarray, per_rise: np.ndarray, per_rate: np.ndarray) -> np.ndarray:
        linear = along(per_rise, a, g) + along(per_rate, rates, changing) - g @ (heat.loads @ field)
        by_laws = sum((by_law(law, name, field, a, g) for law in leaving), linear)
        return by_laws if capacity is None else by_laws + by_law(capacity, name, field, rates, changing)

    laws, x = reduced.laws, together(a, g)
    leaving, capacity = ([], None) if laws is None else (laws.leaving, laws.capacity)

    def by_law(law: Conducted, name: Hashable, field: np.ndarray, states: np.ndarray, now: np.ndarray) -> np.ndarray:
        """(times,): what a law adds to the heat (W) that enters at a field (all nodes), of rises or of rates."""
        return weighted(law, name, lambda u: heat.take(law.term.between(u, heat.field(field))), states, now)

    def weighted(
        law: Conducted, name: Hashable, row: Callable[[np.ndarray], np.ndarray], states: np.ndarray, now: np.ndarray
    ) -> np.ndarray:
        """(times,): what a ``row`` (all nodes) of each state (functions,) between which a law is interpolated tells of
        other states and inputs; it is worked out once for each ``name``."""

        def work_out() -> np.ndarray:
            rows = np.array([row(u) for u in law.fields]).reshape(-1, heat.size)
            return np.hstack([rows[:, : heat.free] @ basis, rows @ lifts.T])

        rows = law.kept.get(name, work_out)
        return told(law, rows, together(states, now))

    factors = {id(law): law.interpolation(x) for law in (*leaving, *([] if capacity is None else [capacity]))}

    def told(law: Conducted, rows: np.ndarray, others: np.ndarray) -> np.ndarray:
        """(times,): what rows (states, r + channels) of the states of a law tell of others (times, r + channels)."""
        return np.einsum("ts,ts->t", factors[id(law)], others @ rows.T)

    def read(how: Reading) -> np.ndarray:
        flow = along(how.row, a, g) + g @ how.entering
        for law in leaving:
            if (row := how.by_law(heat, law.term)) is not None:
                flow = flow + weighted(law, how, row, a, g)
        return flow

    def potential(probe: Any) -> np.ndarray:
        if probe.name not in reduced.potentials:
            return voltmeter.over_time(base, lambda: heat.whole(a @ basis.T) + g @ lifts, probe, times)
        shares, cold, warm = reduced.potentials[probe.name]
        return wide @ shares - np.einsum("ti,ti->t", c, wide @ cold + a @ warm.T)

    wide = reduced.wide(a, g)
    c = reduced.currents(a, wide) if base.patterns else np.zeros((len(times), 0))
    flows = {name: entering(name, heat.held_fields[name], *rows) for name, rows in heat.held_rows.items()}
    for name, tested in reduced.at_held.items():
        flows[name] = flows[name] - joule(tested, c, a, wide)
    for name, film in heat.films.items():
        flows[name] = g @ film.entering + along(film.per_kelvin, a, g)
    for law in leaving:
        for name, rows in law.through.items():
            flows[name] = flows[name] - told(law, rows, x)
    names = base.patterns[0].currents if base.patterns else {}
    currents = {name: c @ np.array([p.currents[name] for p in base.patterns]) for name in names}
    heats = {name: joule(tested, c, a, wide) for name, tested in reduced.in_box.items()}
    power = sum(heats.values(), np.zeros(len(times)))
    whole = cache(lambda: heat.field(np.concatenate([heat.whole(basis.T), lifts])))
    return _whole(symmetry, heat, times, _Part(
        flows, currents, heats, power, g @ heat.generated, read,
        lambda extreme: extreme(whole(), np.concatenate([a, g], axis=1)), potential,
        # Joule heat at an edge itself is left out: it is the load of an edge, not of a face.
        lambda fields: np.array([entering(f.tobytes(), f, heat.stiffness @ f, heat.mass @ f) for f in fields]),
    ))  # fmt: skip


def joule(tested: Split, c: np.ndarray, a: np.ndarray, g: np.ndarray) -> np.ndarray:
    """(times,): the Joule heat (W) of a box, or at held nodes, at states a and inputs g for current coefficients c."""
    cold, warm = tested
    pairs = c[:, :, None] * c[:, None, :]
    resistance = np.tensordot(g, cold, (-1, 0)) + np.tensordot(a, warm, (-1, -1))
    return np.einsum("tij,tij->t", pairs, resistance)


def stored_heat(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> np.ndarray:
    """(times,): heat stored above the initial temperature (J), in the whole structure."""
    heat = transient.base.heat
    capacity = heat.mass @ heat.unit
    stored = transient.trajectory(times)[0] @ (capacity[: heat.free] @ transient.reduced.basis)
    stored = stored + heat.inputs.at(times) @ (heat.lifts @ capacity)
    if heat.storage is not None:
        stored = stored + np.array([heat.storage.heat(heat.field(rise)) for rise in transient.rises(times)])
    return np.asarray(symmetry.copies * stored)


def unbalanced(out: Outputs) -> tuple[float, float]:
    """Of a steady state the heat that enters and does not leave (W), and its part of all that passes: by
    boundaries, sources and currents or, where nothing thermal is asked for, the power that the electrodes supply and
    that is not dissipated. The part is 0 where no more passes than rounding leaves of a uniform temperature."""
    flows = [float(v) for name, v in out.items() if name.startswith("flow:")]
    power, generated = float(out["power"]), float(out["generated"])
    gap, passing = abs(power - float(out["dissipated"])), power
    if flows:
        gap, passing = abs(sum(flows) + power + generated), (sum(map(abs, flows)) + power + abs(generated)) / 2
    return gap, gap / passing if passing > float(out["rounding"]) else 0.0


def passing(out: Outputs) -> tuple[np.ndarray, np.ndarray]:
    """The heat (W) that enters or is made, and that leaves or is taken, each without the other."""
    parts = [out["power"], out["generated"], *(v for name, v in out.items() if name.startswith("flow:"))]
    none = np.zeros_like(out["power"])
    return sum((np.maximum(v, 0.0) for v in parts), none), sum((np.maximum(-v, 0.0) for v in parts), none)


def _whole(symmetry: Symmetry, heat: HeatProblem, times: np.ndarray, part: _Part) -> Outputs:
    """From the part that was solved to the whole."""
    out, zero, copies = {"time": times}, np.zeros(times.shape), symmetry.copies
    for probe in heat.domain.scene.probes:
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
        out[f"probe:{probe.name}"] = factor * value + _added(added, times)
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


def _added(values: tuple[Value, ...], times: np.ndarray) -> np.ndarray:
    """The sum of some values at times of any shape."""
    at = times.reshape(-1)
    return sum((channels.value(v, at) for v in values), np.zeros(at.shape)).reshape(times.shape)
