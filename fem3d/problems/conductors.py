"""The conductors of a domain that carry current, as a `fem3d.problems.current.Conductor`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Ordering
from fem3d.problems.current import SOLVED, Conductor, Resistivity, Section
from fem3d.problems.following import OfCells, following
from fem3d.problems.heat import HeatProblem
from fem3d.problems.paths import Crossing, OfPaths, Paths, across, crossings
from fem3d.problems.reactions import SharedReactions
from fem3d.problems.terminals import Terminal
from fem3d.spaces.domain import Domain
from scenes import laws
from scenes.model import Material

AND = "\x1f"  # between the names of a box and of probes in it: a separator of units, which no file has in a name


def find(heat: HeatProblem, solved: float = SOLVED) -> Conductor | None:
    """The conductors of a domain that carry current; ``None`` where no part touches two voltages. ``solved`` is how
    small the residual of a potential must be."""
    domain, space = heat.domain.electric, heat.domain.electric.space
    cells = np.flatnonzero(domain.live)
    if not len(cells):
        return None
    initial = domain.scene.initial_temperature
    lines = np.array([law(m, initial) if m.resistivity else (np.inf, 0.0) for m in domain.materials])
    lines = lines[domain.body]
    voltages, fixed, terminals, reactions = _electrodes(domain)
    ratios = np.array([m.resistivity_ratios for m in domain.materials]).T[:, domain.body, None]
    along = None if (ratios[:, cells] == 1.0).all() else ratios
    sections, jumps = _sections(heat, lines, along)
    cold, warm = lines[cells, :1], lines[cells, 1:]
    conductivity = 1 / cold[:, 0] if along is None else 1 / (cold * along[:, cells])[..., 0]
    matrix = space.stiffness(conductivity, cells)
    on: Any = space.on(cells)
    crossed = crossings(heat.domain)
    names = _named(domain, cells, crossed)
    if crossed or domain is not heat.domain or along is not None:
        on = Paths(heat.domain.space.on(cells), on, crossed, None if along is None else np.sqrt(along[:, cells]))
        counts = [len(c.warmed[0].areas) for c in crossed]
        matrix = sum((c.potential.mass() / c.resistance for c in crossed), matrix)
        cold = np.vstack([cold, np.repeat([c.resistance for c in crossed], counts)[:, None]])
        warm = np.vstack([warm, np.zeros((sum(counts), 1))])
    following_law: OfCells | OfPaths | None = None
    if len(np.intersect1d(following(domain, "resistivity"), cells)):
        following_law = OfCells(domain, "resistivity", cells)
        if isinstance(on, Paths):
            following_law = OfPaths(following_law, cold[len(cells) :])
    return Conductor(
        heat, cells, on, np.flatnonzero(space.of(cells) & ~fixed & space.nested[-1]), cold, warm, voltages, reactions,
        sections, jumps, csc_array(matrix), names, Ordering(space.places), solved, terminals,
        following_law,
    )  # fmt: skip


def _electrodes(domain: Domain) -> tuple[np.ndarray, np.ndarray, tuple[Terminal, ...], Any]:
    """The voltages (channels, functions) of all electrodes, the functions (functions,) that they fix, the terminals of
    unknown potential, and the weights of the charges in each electrode's current."""
    space = domain.space
    electrodes = [b for b in domain.scene.boundaries if b.kind == "voltage" and len(domain.on(b))]
    faces = [domain.faces(b) for b in electrodes]
    fixed, voltages = np.zeros(space.size, bool), np.zeros((domain.inputs.count, space.size))
    for b, face in zip(electrodes, faces, strict=True):
        voltages[:, face.functions] = np.outer(domain.inputs.split(b.value), space.unit[face.functions])
        fixed |= face.functions
    terminals = []
    for b, face in zip(electrodes, faces, strict=True):
        if b.series_resistance and (unit := np.where(face.functions, space.unit, 0.0)).any():
            at = int(np.flatnonzero(unit)[0])
            for cells, electrode in domain.still:  # which have its potential, as no current passes
                if electrode == b.name:
                    unit = np.where(space.of(cells), space.unit, unit)
            terminals.append(Terminal(b.name, unit, at, b.series_resistance))
    shared = SharedReactions.of([b.name for b in electrodes], [b.value for b in electrodes], faces, space.unit)
    return voltages, fixed, tuple(terminals), shared.shares


def _sections(
    heat: HeatProblem, lines: np.ndarray, along: np.ndarray | None
) -> tuple[dict[str, Section], dict[str, np.ndarray]]:
    """For each probe of a current the facets that it passes, seen from both sides, and its row (functions,) on the jump
    of the potential at contacts; ``lines`` (cells, 2) are the resistivity of the cells and its change per kelvin,
    ``along`` (3, cells, 1) how many times as large they are along the axes."""
    domain, sections, jumps = heat.domain.electric, dict[str, Section](), dict[str, np.ndarray]()
    torn = [(joint.facets, r) for joint in domain.contacts if (r := joint.contact.electrical_resistance)]
    for probe in domain.scene.probes:
        if probe.quantity == "current":
            sides = domain.sides(probe, domain.live, [facets for facets, _ in torn])
            section = sections[probe.name] = []
            for faces, sign, cells in sides:
                times = 1.0 if along is None else along[:, cells]
                cold, warm = times * lines[cells, :1], times * lines[cells, 1:]
                resistivity = _resistivity(domain, cells, cold, warm, times)
                section.append((faces, faces.by(heat.domain.space), sign, cold, warm, resistivity))
            jumps[probe.name] = across(domain, probe, torn)
    return sections, jumps


def law(material: Material, initial: float) -> tuple[float, float]:
    """The resistivity along x at the initial temperature (ohm m) and its change per kelvin (ohm m/K), eq 7, of a law 0;
    ValueError for a material that doesn't conduct."""
    if material.resistivity is None:
        raise ValueError(f"{material.name} doesn't conduct")
    along_x = laws.along(material.resistivity)[0]
    if isinstance(along_x, laws.Law):
        return float(along_x(initial)), 0.0
    a = material.temperature_coefficient
    return along_x * (1 + a * (initial - material.reference_temperature)), along_x * a


def _named(domain: Domain, conducting: np.ndarray, crossed: Sequence[Crossing]) -> np.ndarray:
    """(rows,): the boxes of the ``conducting`` cells, then the names of the crossings of the facets, each with the
    probes of a power that it lies in: once for each half of its heat that enters cells there (`box_of`, `share`)."""
    names = np.array(domain.names)[domain.body].astype(object)
    beside = [np.full(crossing.cells.shape[1], crossing.name, object) for crossing in crossed]
    for probe in domain.scene.probes:
        if probe.quantity == "power":
            inside = np.zeros(len(names))
            for cells, _, _ in domain.patches(probe):
                inside[cells] = 1.0
            halves = [2 * inside, *(2 * inside[crossing.cells].mean(axis=0) for crossing in crossed)]
            for labels, count in zip([names, *beside], halves, strict=True):
                for n in (1, 2):
                    labels[count == n] += n * (AND + probe.name)
    return np.concatenate([names[conducting], *beside]).astype(str)


def box_of(name: str) -> str:
    """The box of cells with a name."""
    return name.split(AND)[0]


def share(name: str, probe: str) -> float:
    """Return the part of the heat of a named body that a probe of a power reads."""
    return name.split(AND)[1:].count(probe) / 2


def _resistivity(
    domain: Domain, cells: np.ndarray, cold: np.ndarray, warm: np.ndarray, times: np.ndarray | float
) -> Resistivity:
    """Return the resistivity of facets seen from some cells: ``cold`` and its change per kelvin, or ``times`` its law
    along x; arrays are (facets, 1), with axes in front where they differ along the axes."""
    if len(np.intersect1d(following(domain, "resistivity"), cells)):
        of_facets = OfCells(domain, "resistivity", cells)
        return lambda rise: times * of_facets.value(rise)
    return lambda rise: cold + warm * rise
