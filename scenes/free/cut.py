"""Where a current is cut by what does not conduct."""

from __future__ import annotations

import numpy as np

from scenes.errors import listed
from scenes.free.grid import Grid


def cut(grid: Grid) -> str:
    """Where insulating boxes cut the current between electrodes of different voltages, in words; else ""."""
    labels, voltages = grid.electrified()
    insulating = grid.parts(grid.solid & ~grid.conducting)
    touched: dict[int, set[int]] = {}
    between: dict[int, set[int]] = {}
    for axis in range(3):
        insulator, conductor, owner = (np.moveaxis(a, axis, 0) for a in (insulating, labels, grid.owner))
        for a, b in ((slice(None, -1), slice(1, None)), (slice(1, None), slice(None, -1))):
            at = (insulator[a] > 0) & (conductor[b] > 0)
            for part, label, box in np.unique(
                np.stack([insulator[a][at], conductor[b][at], owner[a][at]]), axis=1
            ).T.tolist():
                if label in voltages:
                    touched.setdefault(part, set()).add(label)
                    between.setdefault(part, set()).add(box)
    for part, conductors in touched.items():
        if len(set().union(*(voltages[label] for label in conductors))) > 1:
            names = [grid.scene.boxes[n].name for n in sorted(between[part])]
            which = "box {}, which does" if len(names) == 1 else "boxes {}, which do"
            return f"the current is cut at {which.format(listed(names))} not conduct"
    return ""
