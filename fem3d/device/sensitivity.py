"""Differentiate the steady state of the device in 3D, under its controllers, by its keys: differences on moved meshes.

For each key the structure is solved on its cells, moved, for its steady fields: they hold every steady state.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from fem3d.adaptivity.nested import problems
from fem3d.device.model import Structure
from fem3d.device.solve import Model
from fem3d.sensitivity.differences import TIGHT, Point, Table, Values, difference
from fem3d.sensitivity.moved_mesh import move
from meshes import symmetry
from scenes.device import Device
from scenes.errors import NumericsError, SceneError
from scenes.result import Estimate
from scenes.varied import neighbour, numbers
from statespace.result import QUANTITIES
from statespace.stability import steady

FOLLOWED = tuple(q for q in QUANTITIES if not q.endswith("_K"))
"""Quantities to differentiate; the controllers hold the temperatures."""
STORAGE = (".density", ".specific_heat")
"""Keys that no steady state depends on."""


def of_device(device: Device, model: Model, keys: Sequence[str] | None = None) -> tuple[Table, dict[str, str]]:
    """Return d ln quantity / d ln key of the steady state after the outer step, and why a key has none.

    ``keys`` are the keys to differentiate by, instead of all. Quantities that are zero are left out.
    """
    domain, part, accuracy = (
        model.structures[0].heat.domain,
        symmetry.reduce(device.scene()),
        TIGHT * device.accuracy_3d,
    )

    def point(key: str, step: float, lower: bool) -> Point:
        other = neighbour(device, key, step) if key else device
        given = problems(move(domain, part, symmetry.reduce(other.scene())), accuracy)
        values = []
        for heat, conductor in list(zip(given.heats, given.conductors, strict=True))[: -2 - lower : -1]:
            assert conductor is not None
            structure = Structure(other, heat, conductor, part.copies)
            base = structure.base()
            state = steady(structure.modal(base.project(base.fields), base.patterns, accuracy), other)
            values.append(Values({q: float(getattr(state, q)) for q in FOLLOWED}))
        return Point(*values)

    base, table, left_out = point("", 0.0, True), Table(), dict[str, str]()
    known = {q: Estimate(v, model.steady_errors(device)[q]) for q, v in base.fine.steady.items() if v}
    for key in numbers(device):
        if keys is not None and key not in keys:
            continue
        if key.endswith(STORAGE):
            table[key] = {q: Estimate(0.0, 0.0) for q in known}
            continue
        try:
            found = difference(base, partial(point, key), model.edges)
        except (SceneError, NumericsError) as error:
            left_out[key] = str(error)
            continue
        table[key] = {q: found.logarithmic(q, e) for q, e in known.items()}
    return table, left_out
