"""Evaluate each probe on a solution: means and heat flows are linear functionals, extremes are searched for.

The flow of a whole boundary of given temperature is its reaction: it converges twice as fast as integrated gradients.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fem3d.problems.assembly import Surface
from fem3d.problems.heat import HeatProblem
from fem3d.problems.linearized import LinearizedHeat
from fem3d.problems.material_laws import Conduction, at_faces
from fem3d.problems.paths import Conductivity, Section
from fem3d.results.extremes import Extreme, read_extremes
from fem3d.spaces.domain import Domain
from scenes.model import AnyBoundary, AnyProbe, bends
from statespace import channels


@dataclass(frozen=True, eq=False)
class Reading:
    """A probe's value: row @ rise + entering @ g + flows or currents of boundaries + by_law, or its extreme.

    Attributes
    ----------
    row, entering : (all dofs,), and (channels,)
    boundaries, sign : whose flows, or whose currents times the sign, belong to the value
    extreme : the search for an extreme
    by_law : the heat (W) that laws add at a field (functions,) of the problem, which is no attribute: it keeps readings
    """

    row: np.ndarray
    entering: np.ndarray
    boundaries: tuple[str, ...] = ()
    sign: float = 1.0
    extreme: Extreme | None = None
    by_law: Callable[[HeatProblem, np.ndarray], float] | None = None


def reading(heat: HeatProblem, probe: AnyProbe) -> Reading:
    """Return the `Reading` of a probe of a temperature, a heat flow or a current, from a cache."""
    return heat.cache.get_or_make(f"reading {probe.name}", lambda: _reading(heat, probe))


def keep_places(heat: HeatProblem) -> dict[str, Reading]:
    """Return the readings of extremes that are searched for once, for problems on the same cells beside this one."""
    extremes = {p.name: reading(heat, p) for p in heat.domain.scene.probes if p.quantity == "temperature"}
    return {
        f"reading {name}": replace(how, extreme=how.extreme.once())
        for name, how in extremes.items()
        if how.extreme is not None
    }


def _reading(heat: HeatProblem, probe: AnyProbe) -> Reading:
    domain, nothing, no_inputs = heat.domain, np.zeros(heat.size), np.zeros(heat.inputs.count)
    if probe.quantity == "temperature":
        if probe.reduce == "mean":
            return Reading(heat.take(domain.mean(probe)), no_inputs)
        return Reading(nothing, no_inputs, extreme=extreme(domain, probe))
    if probe.quantity == "current":
        return Reading(nothing, no_inputs, *_electrodes(domain, probe))
    facets = domain.locate(probe).numbers
    conditions = [
        (b, on, shared)
        for b in domain.scene.boundaries
        if b.kind != "voltage" and len(shared := np.intersect1d(on := domain.facets(b), facets))
    ]
    cut = any(b.kind == "temperature" and len(shared) < len(on) for b, on, shared in conditions)
    if not (domain.conditions_first and conditions) and (cut or not domain.exposed(facets).any()):
        return _of_gradient(heat, probe)
    return _of_conditions(heat, conditions)


def _of_gradient(heat: HeatProblem, probe: AnyProbe) -> Reading:
    """The heat flow through a flat probe by the gradient of the temperature."""
    domain, cold = heat.domain, heat.domain.per_cell("thermal_conductivity")

    def at(u: np.ndarray) -> np.ndarray:
        return gradient_row(domain, probe, lambda faces: at_faces(domain, "thermal_conductivity", u, faces))

    nothing = np.zeros(heat.inputs.count)
    if isinstance(heat, LinearizedHeat):
        return Reading(heat.take(at(heat.about)), nothing)
    row = gradient_row(domain, probe, lambda faces: cold[..., faces.cells, None])
    follows = any(isinstance(term, Conduction) for term in heat.terms)
    return Reading(heat.take(row), nothing, by_law=(lambda _, u: float((at(u) - row) @ u)) if follows else None)


def _of_conditions(heat: HeatProblem, conditions: list[tuple[AnyBoundary, np.ndarray, np.ndarray]]) -> Reading:
    """The heat flow through the ``shared`` facets of conditions (condition, its facets, shared) by their laws."""
    domain, row, entering = heat.domain, np.zeros(heat.size), np.zeros(heat.inputs.count)
    for b, on, shared in conditions:
        if bends(b) and isinstance(heat, LinearizedHeat):
            into, per_kelvin = nonlinear_surfaces(heat)[b.name].entering_by_tangent(heat.about, shared)
            row, entering = row + heat.take(per_kelvin), entering + heat.inputs.split(into)
        elif b.kind != "temperature" and not bends(b):
            area = domain.seen(shared).load()
            part = float(area @ domain.space.unit / domain.seen(on).areas.sum())
            entering = entering + part * heat.face_flows[b.name].entering
            if b.kind == "convection":
                row = row - b.value * heat.take(area)
    given = tuple(b.name for b, _, _ in conditions if b.kind == "temperature")
    bent = not isinstance(heat, LinearizedHeat) and any(bends(b) for b, _, _ in conditions)

    def by_law(heat: HeatProblem, u: np.ndarray) -> float:
        surfaces = nonlinear_surfaces(heat)
        return sum(surfaces[b.name].entering(u, shared) for b, _, shared in conditions if bends(b))

    return Reading(row, entering, given, by_law=by_law if bent else None)


def nonlinear_surfaces(heat: HeatProblem) -> dict[str, Surface]:
    """The nonlinear boundaries by name."""
    return {term.boundary.name: term for term in heat.terms if isinstance(term, Surface)}


def extreme(domain: Domain, probe: AnyProbe, inside: np.ndarray | None = None) -> Extreme:
    """The largest or smallest value over a probe, in some cells."""
    return Extreme(domain.space, domain.patches(probe, inside), 1.0 if probe.reduce == "max" else -1.0)


def gradient_row(domain: Domain, probe: AnyProbe, conductivity: Conductivity) -> np.ndarray:
    """(functions,): the heat (W) that passes a flat probe, per rise, for a conductivity of facets: on the surface into
    the solid, inside as of a `Section`."""
    facets = domain.locate(probe).numbers
    seen = domain.seen(facets[domain.exposed(facets)])
    jumping = [(joint.facets, r) for joint in domain.contacts if (r := joint.contact.thermal_resistance)]
    section = Section(domain, probe, np.ones(len(domain.body), bool), jumping)
    return section.row(conductivity) - seen.flux(conductivity(seen))


def _electrodes(domain: Domain, probe: AnyProbe) -> tuple[tuple[str, ...], float]:
    """The electrodes that a flat probe covers, if any, and the sign of the currents that enter there."""
    facets, electrodes = domain.locate(probe).numbers, [b for b in domain.scene.boundaries if b.kind == "voltage"]
    names = [b.name for b in electrodes if len(on := domain.facets(b)) and np.isin(on, facets).all()]
    if names and domain.conditions_first:
        return tuple(names), 1.0
    pairs = domain.space.mesh.f2t[:, facets]
    alive = (pairs >= 0) & domain.live[pairs]
    if not names or alive.all(axis=0).any():
        return (), 1.0
    touching = alive.any(axis=0)
    facets, alive = facets[touching], alive[:, touching]
    if domain.exposed(facets).all():
        return tuple(names), 1.0
    # Inside the solid: along the direction that counts, out of the electrode into the cell that conducts.
    out_of_first = domain.locate(probe).signs[touching]
    into = np.where(alive[0], -out_of_first, out_of_first)
    return (tuple(names), float(into[0])) if (into == into[0]).all() else ((), 1.0)


def starts_free(domain: Domain, probe: AnyProbe) -> bool:
    """Return whether a mean temperature equals the initial temperature at t = 0: no part of the probe, of the same
    dimension, lies on a boundary of given temperature."""
    given = [b for b in domain.scene.boundaries if b.kind == "temperature"]
    if domain.locate(probe).dimension == 2:
        return not any(np.isin(domain.facets(b), domain.locate(probe).numbers).any() for b in given)
    fixed = np.any([np.zeros(domain.space.size, bool), *(domain.faces(b).functions for b in given)], axis=0)
    return not fixed[np.flatnonzero(domain.mean(probe))].all()


class Voltmeter:
    """A potential probe on a mesh, restricted to cells at a potential: its ``value`` (V) for a field (functions,);
    ``still`` lists functions at given voltages."""

    def __init__(self, domain: Domain, probe: AnyProbe) -> None:
        self._domain = domain = domain.electric
        inside = np.any([domain.live, *(part for part, _ in domain.still)], axis=0)
        # The potential that is solved for knows a part at the potential of an electrode (str).
        given = [(cells, voltage) for cells, voltage in domain.still if not isinstance(voltage, str)]
        space = domain.space
        self.still = [(np.where(space.functions_of(cells), space.unit, 0.0), voltage) for cells, voltage in given]
        if probe.reduce == "mean":
            row = domain.mean(probe, inside)
            self.value: Callable[[np.ndarray], float] = lambda field: float(row @ field)
        else:
            search = extreme(domain, probe, inside)
            self.value = lambda field: float(read_extremes([search], field[None], np.ones((1, 1)))[0].item())

    def read(self, potential: np.ndarray | None, time: float) -> float:
        """The probe's value (V) for a potential (functions,) of the parts with current, at a time (s)."""
        field = np.zeros(self._domain.space.size) if potential is None else potential.copy()
        for functions, voltage in self.still:
            field = np.where(functions > 0, functions * channels.value(voltage, np.array([time]))[0], field)
        return self.value(field)
