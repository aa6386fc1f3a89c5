"""What is read off a solution: mean temperatures, heat flows, currents and Joule heats of the whole structure.

The same names come out of a steady state and of a transient, as numbers or as arrays over time:
``rise:<probe>`` (K), ``flow:<boundary>`` (W, into the solid), ``current:<electrode>`` (A, into the solid),
``joule:<box>`` (W), ``power`` (W, what the electrodes supply), ``source`` (W, heat sources and given fluxes).
"""

from __future__ import annotations

import numpy as np

from fem3d.steady import SteadyState
from fem3d.transient import Transient
from meshes.symmetry import Symmetry

Outputs = dict[str, np.ndarray]  # of shape () or (times,)


def of_steady(state: SteadyState, symmetry: Symmetry) -> Outputs:
    """The outputs of a steady state."""
    heat = state.heat
    reaction = heat.reaction(state.rise, np.zeros(heat.free), state.source)
    rises = {name: row @ state.rise for name, row in heat.probes.items()}
    fixed = {name: reaction[nodes - heat.free].sum() for name, nodes in heat.fixed_sets.items()}
    films = {
        name: constant + per_kelvin[: heat.free] @ state.rise for name, (constant, per_kelvin) in heat.films.items()
    }
    return _whole(symmetry, rises, {**fixed, **films}, state.currents, state.joule, np.array(state.power))


def of_transient(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> Outputs:
    """The outputs at some times (s)."""
    state, reduced = transient.state, transient.reduced
    heat, n = state.heat, state.heat.free
    a, sources = transient.trajectory(times)
    basis = reduced.basis
    rates = sources - a * transient.trajectory.rates
    rises = {name: a @ (row @ basis) for name, row in heat.probes.items()}
    fixed = {}
    for name, (per_rise, per_rate) in heat.fixed_rows.items():
        given = heat.constant_source[heat.fixed_sets[name]].sum()
        fixed[name] = a @ (per_rise @ basis) + rates @ (per_rate @ basis) - given
    films = {name: constant + a @ (per_kelvin[:n] @ basis) for name, (constant, per_kelvin) in heat.films.items()}
    c = reduced.currents(a) if state.patterns else np.zeros((len(times), 0))
    pairs = c[:, :, None] * c[:, None, :]
    joule = {
        name: np.einsum("tij,tij->t", pairs, cold + np.tensordot(a, warm, axes=(-1, -1)))
        for name, (cold, warm) in reduced.in_box.items()
    }
    electrodes = state.patterns[0].currents if state.patterns else {}
    currents = {name: c @ np.array([p.currents[name] for p in state.patterns]) for name in electrodes}
    power = c @ reduced.supply if state.patterns else np.zeros(len(times))
    return _whole(symmetry, rises, {**fixed, **films}, currents, joule, power)


def stored_heat(transient: Transient, symmetry: Symmetry, times: np.ndarray) -> np.ndarray:
    """(times,): heat stored since the start (J), in the whole structure."""
    heat = transient.state.heat
    capacity = (heat.mass @ np.ones(heat.size))[: heat.free]
    stored: np.ndarray = transient.trajectory(times)[0] @ (capacity @ transient.reduced.basis)
    return symmetry.copies * stored


def _whole(symmetry: Symmetry, rises: dict, flows: dict, currents: dict, joule: dict, power: np.ndarray) -> Outputs:
    """From the part that was solved to the whole."""
    found = {f"rise:{name}": value for name, value in rises.items()}
    for name, flow in symmetry.flows.items():
        if flow.boundary in flows:
            found[f"flow:{name}"] = flow.heat * flows[flow.boundary]
        if flow.boundary in currents:
            found[f"current:{name}"] = flow.current * currents[flow.boundary]
    found |= {f"joule:{name}": symmetry.box_copies[name] * value for name, value in joule.items()}
    found["power"] = symmetry.copies * power
    return found
