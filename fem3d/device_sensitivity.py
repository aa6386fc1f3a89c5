"""How the steady state of the device in 3D, under its controllers, follows its keys.

For each key the structure is assembled on the cells that are there, moved, and projected on the steady fields of this
one and on the dual ones of the heat through the polymer. Powers and rises are read by what they are made by, so that
what such a projection leaves out is of second order in the step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from fem3d import conductor as conductors
from fem3d.assembly import Beside, assemble
from fem3d.device.model import Structure
from fem3d.device.solve import Model, steady
from fem3d.domain import Domain
from fem3d.motion import moved
from fem3d.reduced import on_basis, orthonormal
from fem3d.sensitivity import Table
from fem3d.sensitivity_over_time import STEP
from meshes import symmetry
from scenes.device import Device
from scenes.errors import SceneError
from scenes.loop.result import QUANTITIES
from scenes.result import Estimate
from scenes.varied import numbers, varied

FOLLOWED = tuple(q for q in QUANTITIES if not q.endswith("_K"))
"""Temperatures are what the controllers make them."""
OF_STORAGE = (".density", ".specific_heat")
"""Keys that no steady state follows."""


def of_device(device: Device, model: Model) -> tuple[Table, dict[str, str]]:
    """d ln quantity / d ln key of the steady state after the outer step, of quantities that are not zero, and why there
    is none by some keys; errors by the next lower space, as those of the quantities."""
    part, left_out, found = symmetry.reduce(device.scene()), dict[str, str](), Table()
    besides = [Beside(structure.heat) for structure in model.structures]
    fields = [_fields(structure) for structure in model.structures]
    still = [_read(s, v) for s, v in zip(model.structures, fields, strict=True)]
    known = {q: error / abs(still[0][q]) for q, error in model.steady_errors(device).items() if still[0].get(q)}
    for key in numbers(device):
        if key.endswith(OF_STORAGE):
            found[key] = {q: Estimate(0.0, 0.0) for q in known}
            continue
        other = varied(device, key, 1 + STEP)
        try:
            domain = moved(model.structures[0].heat.domain, part, symmetry.reduce(other.scene()), STEP)
        except SceneError as error:
            left_out[key] = str(error)
            continue
        beside = [_read(s, v) for s, v in zip(_beside(other, domain, model.structures, besides), fields, strict=True)]
        fine, low = (
            {q: (now[q] - was[q]) / (STEP * was[q]) for q in known if was[q]}
            for now, was in zip(beside, still, strict=True)
        )
        found[key] = {q: Estimate(s, model.edges * abs(s - low.get(q, s)) + known[q] + STEP) for q, s in fine.items()}
    return found, left_out


def _beside(
    other: Device, domain: Domain, structures: Sequence[Structure], besides: Sequence[Beside]
) -> Iterator[Structure]:
    """The structures of another device, each solved by the factors of its own one."""
    last, conductor = len(domain.space.nested) - 1, None
    for number, (own, beside) in enumerate(zip(structures, besides, strict=True)):
        heat = assemble(domain, beside)
        conductor = conductor or conductors.find(heat)
        assert conductor is not None
        there = replace(conductor.lower(last - number, heat), near=own.conductor.solve_cold)
        yield Structure(other, heat, there, own.copies)


def _fields(structure: Structure) -> np.ndarray:
    """(free nodes, r): the steady fields and the dual ones of what is read besides, made orthonormal."""
    heat = structure.heat
    rows = structure.polymer[0][:, : heat.free]
    fields = np.column_stack([structure.base().fields, *(heat.solve_steady(row) for row in rows)])
    return orthonormal(heat, fields)


def _read(structure: Structure, fields: np.ndarray) -> dict[str, float]:
    """The steady state of a structure on some fields, orthonormal in a mass next to its own."""
    root = np.linalg.cholesky(fields.T @ (structure.heat.inner_mass @ fields))
    basis = np.linalg.solve(root, fields.T).T
    reduced = on_basis(structure.heat, structure.conductor, basis, structure.patterns)
    device = structure.device
    found = steady(structure.modal(reduced, structure.patterns, device.accuracy_3d), device)
    return {q: float(getattr(found, q)) for q in FOLLOWED}
