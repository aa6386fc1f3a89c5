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
from fem3d.assembly import assemble
from fem3d.device.model import Structure
from fem3d.device.solve import Model, steady
from fem3d.domain import Domain
from fem3d.motion import moved
from fem3d.reduced import project
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
        beside = [_read(s, v) for s, v in zip(_beside(other, domain, model.structures), fields, strict=True)]
        fine, low = (
            {q: (now[q] - was[q]) / (STEP * was[q]) for q in known if was[q]}
            for now, was in zip(beside, still, strict=True)
        )
        found[key] = {q: Estimate(s, model.edges * abs(s - low.get(q, s)) + known[q] + STEP) for q, s in fine.items()}
    return found, left_out


def _beside(other: Device, domain: Domain, structures: Sequence[Structure]) -> Iterator[Structure]:
    """The structures of another device, each solved by the factors of its own one."""
    heat, last = assemble(domain), len(domain.space.nested) - 1
    conductor = conductors.find(heat)
    assert conductor is not None
    for number, own in enumerate(structures):
        level = heat.lower(last - number) if number else heat
        level = replace(level, near=own.heat.solve_steady)
        there = conductor.lower(last - number, level) if number else conductor
        yield Structure(other, level, replace(there, heat=level, near=own.conductor.solve_cold), own.copies)


def _fields(structure: Structure) -> np.ndarray:
    """(free nodes, r): the steady fields, and the dual ones of what is read besides."""
    heat = structure.heat
    rows = structure.polymer[0][:, : heat.free]
    return np.column_stack([structure.base().fields, *(heat.solve_steady(row) for row in rows)])


def _read(structure: Structure, fields: np.ndarray) -> dict[str, float]:
    """The steady state of a structure on some fields."""
    reduced = project(structure.heat, structure.conductor, fields, structure.patterns)
    device = structure.device
    found = steady(structure.modal(reduced, structure.patterns, device.accuracy_3d), device)
    return {q: float(getattr(found, q)) for q in FOLLOWED}
