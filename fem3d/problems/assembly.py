"""The heat problem of a scene: matrices, loads and conditions, made of its domain; and those of lower degrees."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from fem3d.problems.cholesky import Ordering, part
from fem3d.problems.heat import Film, HeatProblem, above
from fem3d.spaces.domain import Domain
from fem3d.spaces.integrals import Faces
from scenes.model import Schedule, Value

Matrices = Callable[[csc_array], Sequence[csc_array]]
"""Stiffness and mass, in some order of the unknowns, by what films add to the former (functions, functions)."""
PLANE = 0.95  # of normals' lengths that their sum keeps: faces that bend by less pass for one plane


def assemble(domain: Domain, order: np.ndarray | None = None, matrices: Matrices | None = None) -> HeatProblem:
    """The heat problem of a domain, with its unknowns in an ``order`` and these ``matrices`` where they are known."""
    scene, space, channels = domain.scene, domain.space, domain.inputs
    initial = scene.initial_temperature
    held = [b for b in scene.boundaries if b.kind == "temperature"]
    faces = [domain.faces(b) for b in held]
    fixed, given = np.zeros(space.size, bool), np.zeros((channels.count, space.size))
    for b, face in zip(held, faces, strict=True):
        own = face.functions
        given[:, own] = np.outer(above(channels, b.value, initial), space.unit[own])
        fixed |= own
    torn = _torn([b.value for b in held], faces, space.unit)
    parts, edges = reactions([b.name for b in held], [b.value for b in held], faces, space.unit)
    loads, generated = np.zeros((channels.count, space.size)), np.zeros(channels.count)
    for value, cells in domain.sources:
        heating, on = channels.split(value), space.on(cells)
        loads += np.outer(heating, on.load(np.ones((len(cells), 1))))
        generated += heating * on.weights.sum()
    films: dict[str, tuple[np.ndarray, np.ndarray]] = {}
    cooled, cooling = np.zeros(space.size), csc_array((space.size,) * 2)
    for b in scene.boundaries:
        if b.kind not in ("convection", "heat_flux"):
            continue
        face = domain.faces(b)
        area, h = face.load(), float(b.value) if b.kind == "convection" else 0.0
        flux = channels.split(b.value) if b.kind == "heat_flux" else h * above(channels, b.ambient, initial)
        if h:
            cooling = csc_array(cooling + h * face.mass())
            cooled += h * area
        loads += np.outer(flux, area)
        films[b.name] = flux * float(face.areas.sum()), -h * area
    if order is None or matrices is None:
        # Lower spaces first, so that theirs are leading parts of the matrices.
        level = np.sum([~nested for nested in space.nested], axis=0)
        order = np.lexsort((np.arange(space.size), level, fixed))
        order = order[space.nested[-1][order]]
        capacity = domain.per_cell("density") * domain.per_cell("specific_heat")
        stiffness, mass = space.matrices(domain.per_cell("thermal_conductivity"), capacity)
        stiffness = csc_array(stiffness + cooling) if cooling.nnz else stiffness
        stiffness, mass = part(stiffness, order), part(mass, order)
        _conserve(stiffness, space.unit[order], cooled[order])
    else:
        stiffness, mass = matrices(cooling)
    free = int((~fixed[order]).sum())
    return HeatProblem(
        channels, free, stiffness, mass, loads[:, order],
        given[:, order[free:]], generated, {name: own[order[free:]] for name, own in parts.items()},
        part(edges, order[free:]),
        {name: Film(entering, row[order]) for name, (entering, row) in films.items()},
        domain.anchored, scene.end_time, space.unit[order], space.entity[order], Ordering(space.places), domain, order,
        torn[order],
    )  # fmt: skip


def _torn(values: Sequence[Value], faces: Sequence[Faces], unit: np.ndarray) -> np.ndarray:
    """(functions,): the largest difference of the temperatures (K) that boundaries give a vertex."""
    highest, lowest = np.full(len(unit), -np.inf), np.full(len(unit), np.inf)
    for value, face in zip(values, faces, strict=True):
        given, own = value.values if isinstance(value, Schedule) else (value,), face.functions & (unit == 1.0)
        highest[own], lowest[own] = np.maximum(highest[own], max(given)), np.minimum(lowest[own], min(given))
    count = np.sum([face.functions for face in faces], axis=0) if len(set(values)) > 1 else np.zeros(len(unit))
    return np.where((count > 1) & (unit == 1.0), np.maximum(highest, lowest) - np.minimum(highest, lowest), 0.0)


def reactions(
    names: Sequence[str], values: Sequence[Any], faces: Sequence[Any], unit: np.ndarray
) -> tuple[dict[str, np.ndarray], csc_array]:
    """For boundaries of given values their parts (functions,) of the reactions, and (functions, functions) what of the
    reactions belongs to the edges along which they meet at an angle, a row for each function there.

    The reactions are the integrals of a flux through all of these boundaries, times the functions there; that flux,
    projected on the functions, is integrated over each boundary. A boundary that touches no other takes the whole.
    Where values differ the later boundary gives the value, and takes the reaction. An edge's own is tested with the
    functions that have a value on it and are as small as can be elsewhere.
    """
    found = {name: np.where(face.functions, unit, 0.0) for name, face in zip(names, faces, strict=True)}
    count = np.sum([face.functions for face in faces], axis=0) if faces else np.zeros(len(unit))
    edges = csc_array((len(unit),) * 2)
    if not (count > 1).any():
        return found, edges
    normals = [face.normals() for face in faces]
    lengths = np.sum([np.linalg.norm(n, axis=1) for n in normals], axis=0)
    bent = (count > 1) & (np.linalg.norm(np.sum(normals, axis=0), axis=1) < PLANE * lengths)
    last = np.max([np.where(face.functions, i, -1) for i, face in enumerate(faces)], axis=0)
    for value in dict.fromkeys(values):
        group = [i for i, other in enumerate(values) if other == value]
        if len(group) > 1:
            on = np.flatnonzero(np.any([faces[i].functions for i in group], axis=0))
            mass = csc_array(sum((faces[i].mass() for i in group), csc_array((len(unit),) * 2))[on][:, on])
            scale = diags_array(1 / np.sqrt(mass.diagonal()))
            matrix = csc_array(scale @ mass @ scale)
            projected = splu(matrix)
            for i in group:
                found[names[i]][on] = scale @ projected.solve(scale @ faces[i].load()[on])
            at, rest = np.flatnonzero(bent[on]), np.flatnonzero(~bent[on])
            if len(at):
                beside = splu(part(matrix, rest)).solve((scale @ mass)[rest][:, at].toarray())
                own = np.zeros((len(at), len(on)))
                own[:, at], own[:, rest] = np.eye(len(at)), -(scale.diagonal()[rest, None] * beside).T
                pairs = np.repeat(on[at], len(on)), np.tile(on, len(at))
                edges = csc_array(edges + csc_array((own.ravel(), pairs), edges.shape))
        for i in group:
            # With those of other values the parts at what is left would not add up to one.
            taken = faces[i].functions & ~np.isin(last, group)
            found[names[i]][taken] = 0.0
    return found, edges


def _conserve(stiffness: csc_array, unit: np.ndarray, cooled: np.ndarray) -> None:
    """Set the diagonal such that a uniform rise drives no heat but to the air (``cooled``, W/K), to the last digit.

    Sums of large entries leave rounding there, which on thin layers would show in the heat balance.
    """
    stiffness.sort_indices()
    columns = np.repeat(np.arange(stiffness.shape[1]), np.diff(stiffness.indptr))
    on = np.flatnonzero((stiffness.indices == columns) & (unit[columns] == 1.0))
    # The matrix is symmetric: its columns serve as rows.
    sums = np.add.reduceat(stiffness.data.astype(np.longdouble) * unit[stiffness.indices], stiffness.indptr[:-1])
    stiffness.data[on] = (stiffness.data[on] - (sums - cooled)[columns[on]]).astype(float)
