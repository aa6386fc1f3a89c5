"""Assemble the conductors of a domain: the cells and contacts that carry current, their electrodes and labels."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Ordering
from fem3d.problems.current import SOLVED, Conductor
from fem3d.problems.heat import HeatProblem
from fem3d.problems.material_laws import CellProperty, cells_with_law, table_points
from fem3d.problems.paths import Crossing, Label, RowIntegrals, Section, Terminal, crossings
from fem3d.problems.reactions import share_reactions
from fem3d.spaces.domain import Domain
from scenes import laws
from scenes.model import Material


def assemble_conductor(heat: HeatProblem, solved: float = SOLVED) -> Conductor | None:
    """Assemble the cells that carry current; None where no part touches two voltages. ``solved`` as of `Conductor`."""
    domain, space = heat.domain.electric, heat.domain.electric.space
    cells = np.flatnonzero(domain.live)
    if not len(cells):
        return None
    voltages, fixed, terminals, electrodes = _electrodes(domain)
    free = np.flatnonzero(space.functions_of(cells) & ~fixed & space.nested[-1])
    # Rows are the cells, then the facets of each contact that the current crosses.
    crossed, body = crossings(heat.domain), domain.body[cells]
    ratios = np.array([m.resistivity_ratios for m in domain.materials]).T[:, body, None]
    more = table_points(domain, "resistivity")
    on = RowIntegrals(heat.domain.space.on(cells, more), space.on(cells, more), crossed, np.sqrt(ratios))
    initial, counts = domain.scene.initial_temperature, [len(c.warmed[0].areas) for c in crossed]
    lines = np.array([linear_resistivity(m, initial) for m in domain.materials])
    cold = np.vstack([lines[body, :1], np.repeat([c.resistance for c in crossed], counts)[:, None]])
    warm = np.vstack([lines[body, 1:], np.zeros((sum(counts), 1))])
    across = (c.potential.mass() / c.resistance for c in crossed)
    matrix = sum(across, space.stiffness(on.conductivity(cold), cells))
    follows = len(np.intersect1d(cells_with_law(domain, "resistivity"), cells)) > 0
    torn = [(joint.facets, r) for joint in domain.contacts if (r := joint.contact.electrical_resistance)]
    probes = (p for p in domain.scene.probes if p.quantity == "current")
    sections = {probe.name: Section(domain, probe, domain.live, torn) for probe in probes}
    # The order of elimination of the heat problem serves where it has the same unknowns.
    of_heat = heat.domain.space.entity[heat.order[: heat.free]]
    shared = space is heat.domain.space and not terminals and np.isin(space.entity[free], of_heat).all()
    ends = [np.mean(space.places[space.entity[t.unit > 0]], axis=0) for t in terminals]
    return Conductor(
        heat=heat, cells=cells, on=on, free=free, cold=cold, warm=warm, voltages=voltages, electrodes=electrodes,
        sections=sections, matrix=csc_array(matrix), labels=_labels(domain, cells, crossed),
        elimination=heat.elimination if shared else Ordering(np.vstack([space.places, *ends])), solved=solved,
        terminals=terminals, law=CellProperty(domain, "resistivity", cells) if follows else None, more=more,
    )  # fmt: skip


def _electrodes(domain: Domain) -> tuple[np.ndarray, np.ndarray, tuple[Terminal, ...], dict[str, np.ndarray]]:
    """The values given at all electrodes (`Conductor.voltages`), the functions (functions,) that they fix, terminals of
    unknown potential, and the weights of the charges in each electrode's current."""
    space = domain.space
    electrodes = [b for b in domain.scene.boundaries if b.kind == "voltage" and len(domain.facets(b))]
    faces = [domain.faces(b) for b in electrodes]
    fixed, voltages = np.zeros(space.size, bool), np.zeros((domain.inputs.count, space.size))
    for b, face in zip(electrodes, faces, strict=True):
        voltages[:, face.functions] = np.outer(domain.inputs.split(b.value), space.unit[face.functions])
        fixed |= face.functions
    terminals, currents = list[Terminal](), list[np.ndarray]()
    for b, face in zip(electrodes, faces, strict=True):
        if b.series_resistance and (unit := np.where(face.functions, space.unit, 0.0)).any():
            at = int(np.flatnonzero(unit)[0])
            for cells, electrode in domain.still:  # which have its potential, as no current passes
                if electrode == b.name:
                    unit = np.where(space.functions_of(cells), space.unit, unit)
            terminals.append(Terminal(b.name, unit, at, b.series_resistance))
            currents.append(domain.inputs.split(b.value) / (1.0 if b.series_resistance == inf else b.series_resistance))
            voltages[:, unit > 0] = 0.0
    shares, _ = share_reactions([b.name for b in electrodes], [b.value for b in electrodes], faces, space.unit)
    voltages = np.column_stack([voltages, *currents])
    return voltages, fixed, tuple(terminals), shares


def linear_resistivity(material: Material, initial: float) -> tuple[float, float]:
    """Return rho_0 (ohm m), along x at the initial temperature, and a (ohm m/K) of rho = rho_0 + a u (equation 7 of the
    paper), with a = 0 for any other law. Without conduction rho_0 is infinite."""
    given = material.law("resistivity")
    if given is None or isinstance(given, tuple):  # a tuple has one law for each axis, and `Material.law` takes x
        return inf, 0.0
    cold = float(given(initial) if callable(given) else given)
    return cold, float(given.slope(initial)) if isinstance(given, laws.Line) else 0.0


def _labels(domain: Domain, conducting: np.ndarray, crossed: Sequence[Crossing]) -> np.ndarray:
    """(rows,): the labels of the ``conducting`` cells, then of the facets of the crossings."""
    labels = np.array([Label(name) for name in domain.names], object)[domain.body]
    beside = [np.full(crossing.cells.shape[1], Label(crossing.name), object) for crossing in crossed]
    for probe in domain.scene.probes:
        if probe.quantity == "power":
            inside = np.zeros(len(labels))
            for cells, _, _ in domain.patches(probe):
                inside[cells] = 1.0
            shares = [inside, *(inside[crossing.cells].mean(axis=0) for crossing in crossed)]
            for each, share in zip([labels, *beside], shares, strict=True):
                for part in (0.5, 1.0):
                    within = np.flatnonzero(share == part)
                    new = {label: Label(label.body, label.shares | {probe.name: part}) for label in {*each[within]}}
                    each[within] = [new[label] for label in each[within]]
    return np.concatenate([labels[conducting], *beside])
