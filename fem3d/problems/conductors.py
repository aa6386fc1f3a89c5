"""The conductors of a domain, current fields of a reduced problem, and shares of flows where boundaries meet.

The reaction of a function v at given values is int q v, q being the flux through all the boundaries there. A boundary
that touches no other has the sum of its reactions. Where boundaries of one value touch, q is projected on the functions
of both: with the mass matrix M of their faces and the loads b_i = int_i v of boundary i, the flux through i is
b_i . M^-1 r, so that M^-1 b_i are its shares of the reactions r; the shares of all add up to one.

Where they meet at an angle, an edge's own reaction belongs to the function with a value on the edge and as small as
possible elsewhere: e minus the M-projection of e on the functions beside the edge.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from fem3d.problems.cholesky import Ordering, part
from fem3d.problems.current import SOLVED, Conductor
from fem3d.problems.following import CellProperty, following
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Crossing, CurrentField, Label, RowIntegrals, Section, Terminal, crossings
from fem3d.spaces.domain import Domain
from scenes import laws
from scenes.model import Material


def assemble_conductor(heat: HeatProblem, solved: float = SOLVED) -> Conductor | None:
    """Assemble the cells of a domain that carry current; ``None`` where no part touches two voltages. ``solved`` is the
    allowed relative residual of a potential."""
    domain, space = heat.domain.electric, heat.domain.electric.space
    cells = np.flatnonzero(domain.live)
    if not len(cells):
        return None
    voltages, fixed, terminals, electrodes = _electrodes(domain)
    free = np.flatnonzero(space.functions_of(cells) & ~fixed & space.nested[-1])
    # Rows are the cells, then the facets of each contact that the current crosses.
    crossed, body = crossings(heat.domain), domain.body[cells]
    ratios = np.array([m.resistivity_ratios for m in domain.materials]).T[:, body, None]
    on = RowIntegrals(heat.domain.space.on(cells), space.on(cells), crossed, np.sqrt(ratios))
    initial, counts = domain.scene.initial_temperature, [len(c.warmed[0].areas) for c in crossed]
    lines = np.array([linear_resistivity(m, initial) if m.resistivity else (np.inf, 0.0) for m in domain.materials])
    cold = np.vstack([lines[body, :1], np.repeat([c.resistance for c in crossed], counts)[:, None]])
    warm = np.vstack([lines[body, 1:], np.zeros((sum(counts), 1))])
    across = (c.potential.mass() / c.resistance for c in crossed)
    matrix = sum(across, space.stiffness(on.conductivity(cold), cells))
    follows = len(np.intersect1d(following(domain, "resistivity"), cells)) > 0
    torn = [(joint.facets, r) for joint in domain.contacts if (r := joint.contact.electrical_resistance)]
    probes = (p for p in domain.scene.probes if p.quantity == "current")
    sections = {probe.name: Section(domain, probe, domain.live, torn) for probe in probes}
    # The order of elimination of the heat problem serves where it has the same unknowns.
    of_heat = heat.domain.space.entity[heat.order[: heat.free]]
    shared = space is heat.domain.space and not terminals and np.isin(space.entity[free], of_heat).all()
    ends = [np.mean(space.places[space.entity[t.unit > 0]], axis=0) for t in terminals]
    return Conductor(
        heat=heat, cells=cells, on=on, free=free, cold=cold, warm=warm, voltages=voltages, electrodes=electrodes,
        sections=sections, matrix=csc_array(matrix), names=_labels(domain, cells, crossed),
        ordering=heat.ordering if shared else Ordering(np.vstack([space.places, *ends])), solved=solved,
        terminals=terminals, following=CellProperty(domain, "resistivity", cells) if follows else None,
    )  # fmt: skip


def _electrodes(domain: Domain) -> tuple[np.ndarray, np.ndarray, tuple[Terminal, ...], Any]:
    """The values given at all electrodes (`Conductor.voltages`), the functions (functions,) that they fix, terminals of
    unknown potential, and the weights of the charges in each electrode's current."""
    space = domain.space
    electrodes = [b for b in domain.scene.boundaries if b.kind == "voltage" and len(domain.on(b))]
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
    paper), with a = 0 for any other law. Raises ValueError for a material that doesn't conduct."""
    given = material.law("resistivity")
    if given is None or isinstance(given, tuple):
        raise ValueError(f"{material.name} doesn't conduct")
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


def independent(conductor: Conductor, potentials: Sequence[CurrentField], least: float = 0.0) -> list[CurrentField]:
    """The current fields of some potentials, orthogonal to earlier fields in the cold resistance, scaled to the first.

    Fields whose independent part is relatively smaller than ``least`` are left out. So are parts below 1e-6: scaled up,
    the residuals of their potentials would violate the conservation of charge.
    """
    patterns: list[CurrentField] = []
    product = conductor.product
    for potential in potentials:
        new = potential
        whole = product(new.density, new.density)
        for pattern in patterns:
            share = product(pattern.density, new.density) / product(pattern.density, pattern.density)
            new = new.plus(-share, pattern, 1.0)
        remaining = product(new.density, new.density)
        if remaining > max(1e-6, least) ** 2 * whole:
            size = product(patterns[0].density, patterns[0].density) if patterns else remaining
            patterns.append(new.plus(0.0, new, np.sqrt(size / remaining)))
    return patterns


def combined_density(parts: Sequence[CurrentField], c: np.ndarray) -> np.ndarray:
    """The current density with coefficients c."""
    return np.sum([f * p.density for f, p in zip(c, parts, strict=True)], axis=0)


def share_reactions(
    names: Sequence[str], values: Sequence[Any], faces: Sequence[Any], unit: np.ndarray
) -> tuple[dict[str, np.ndarray], csc_array]:
    """Share reactions among boundaries of given values on some faces.

    ``unit`` (functions,) are the coefficients of the constant 1. Where values differ the later boundary gives the
    value, and takes the reaction. Returns for each boundary its part (functions,) of the reaction of each function, and
    (functions, functions) with the edge's own part in a row for each function where boundaries meet at an angle.
    """
    shares = {name: np.where(face.functions, unit, 0.0) for name, face in zip(names, faces, strict=True)}
    edges = csc_array((len(unit),) * 2)
    count = np.sum([face.functions for face in faces], axis=0) if faces else np.zeros(len(unit))
    if not (count > 1).any():
        return shares, edges
    # The normals of faces sum to less than 0.95 of their lengths: a bend of 36 degrees.
    normals = [face.normals() for face in faces]
    lengths = np.sum([np.linalg.norm(n, axis=1) for n in normals], axis=0)
    bent = (count > 1) & (np.linalg.norm(np.sum(normals, axis=0), axis=1) < 0.95 * lengths)
    last = np.max([np.where(face.functions, i, -1) for i, face in enumerate(faces)], axis=0)
    for value in dict.fromkeys(values):
        group = [i for i, other in enumerate(values) if other == value]
        if len(group) > 1:
            functions = np.flatnonzero(np.any([faces[i].functions for i in group], axis=0))
            mass = part(csc_array(sum(faces[i].mass_of() for i in group)), functions)
            solve = splu(mass).solve
            for i in group:
                shares[names[i]][functions] = solve(faces[i].load()[functions])
            edges = csc_array(edges + _edges(mass, functions, bent))
        for i in group:
            # Beside other given values the remaining shares would not add up to one.
            shares[names[i]][faces[i].functions & ~np.isin(last, group)] = 0.0
    return shares, edges


def _edges(mass: csc_array, functions: np.ndarray, bent: np.ndarray) -> csc_array:
    """(all functions, all functions): for each of the ``functions`` where ``bent`` (all functions,) the function as
    small as possible elsewhere: e minus its projection on the other functions, by their ``mass``."""
    at, rest = np.flatnonzero(bent[functions]), np.flatnonzero(~bent[functions])
    rows = np.zeros((len(at), len(functions)))
    if len(at):
        beside = splu(part(mass, rest)).solve(csc_array(mass[rest])[:, at].toarray())
        rows[:, at], rows[:, rest] = np.eye(len(at)), -beside.T
    pairs = np.repeat(functions[at], len(functions)), np.tile(functions, len(at))
    return csc_array((rows.ravel(), pairs), (len(bent),) * 2)
