"""How the steady state of the device in 3D, under its controllers, follows its keys.

For each key the structure is assembled on the cells that are there, moved, and projected on the steady fields of this
one and on the dual ones of the heat through the polymer. Powers and rises are read with the weights that make them, so
that the error of the projection is of second order in the step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fem3d.device.model import Structure
from fem3d.device.solve import Model
from fem3d.problems.current import Conductor, Pattern
from fem3d.problems.heat import HeatProblem
from fem3d.sensitivity.motion import STEP, moved
from fem3d.sensitivity.neighbour import Beside, Projected
from fem3d.sensitivity.steady import Table
from fem3d.solution.reduced import orthonormal
from meshes import symmetry
from scenes.device import Device
from scenes.errors import SceneError
from scenes.result import Estimate
from scenes.varied import neighbour, numbers
from statespace.result import QUANTITIES
from statespace.stability import steady

FOLLOWED = tuple(q for q in QUANTITIES if not q.endswith("_K"))
"""Temperatures are what the controllers make them."""
OF_STORAGE = (".density", ".specific_heat")
"""Keys that no steady state follows."""


def of_device(device: Device, model: Model) -> tuple[Table, dict[str, str]]:
    """d ln quantity / d ln key of the steady state after the outer step, of quantities that are not zero, and why there
    is none by some keys; errors by the next lower space, as for the quantities."""
    part, left_out, table = symmetry.reduce(device.scene()), dict[str, str](), Table()
    besides = [_beside(structure) for structure in model.structures]
    still = [_read(s, b.original) for s, b in zip(model.structures, besides, strict=True)]
    known = {q: error / abs(still[0][q]) for q, error in model.steady_errors(device).items() if still[0].get(q)}
    for key in numbers(device):
        if key.endswith(OF_STORAGE):
            table[key] = {q: Estimate(0.0, 0.0) for q in known}
            continue
        other = neighbour(device, key, STEP)
        try:
            domain = moved(model.structures[0].heat.domain, part, symmetry.reduce(other.scene()), STEP)
        except SceneError as error:
            left_out[key] = str(error)
            continue
        fine, low = dict[str, float](), dict[str, float]()
        conductor = None
        for structure, beside, was, into in zip(model.structures, besides, still, (fine, low), strict=True):
            nearby = beside.projected(domain, conductor)
            conductor, now = nearby.conductor, _read(replace(structure, device=other), nearby)
            into |= {q: (now[q] - was[q]) / (STEP * was[q]) for q in known if was[q]}
        table[key] = {q: Estimate(s, model.edges * abs(s - low.get(q, s)) + known[q] + STEP) for q, s in fine.items()}
    return table, left_out


def _beside(structure: Structure) -> Beside:
    """The structure beside, on orthonormal steady fields and dual fields of the other quantities."""
    heat = structure.heat
    rows = structure.polymer[0][:, : heat.free]
    fields = np.column_stack([structure.base().fields, *(heat.solve_steady(row) for row in rows)])

    def patterns(heat: HeatProblem, conductor: Conductor) -> Sequence[Pattern]:
        return replace(structure, heat=heat, conductor=conductor).patterns

    return Beside(heat, structure.conductor, orthonormal(heat, fields), patterns)


def _read(structure: Structure, problem: Projected) -> dict[str, float]:
    """The steady state of a structure by a problem on some fields, orthonormal in a mass next to its own."""
    assert problem.conductor is not None
    nearby, device = replace(structure, heat=problem.heat, conductor=problem.conductor), structure.device
    reduced = problem.reduced.changed(np.linalg.inv(np.linalg.cholesky(problem.mass)).T)
    state = steady(nearby.modal(reduced, problem.patterns, device.accuracy_3d), device)
    return {q: float(getattr(state, q)) for q in FOLLOWED}
