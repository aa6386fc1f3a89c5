"""The closed loop of the 1D device, for several resolutions in space and time at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reduced1d.device.lumped import Lumped
from reduced1d.device.modes import Modes, modes
from scenes.loop import march as sampled
from scenes.loop.controller import Law, Timetable
from scenes.loop.march import Start

INSULATOR_GRID = np.array([0.0, 1.0])
POLYMER_GRID = np.array([0.0, 0.1, 0.5, 1.0])
GRIDS = (INSULATOR_GRID, POLYMER_GRID)


@dataclass(frozen=True)
class Resolution:
    """Degree of the elements in space, and number of unknown powers per element and interval in time."""

    degree: int
    nodes: int


@dataclass(frozen=True)
class March:
    """A run: traces (samples, resolutions, 7) in the order of QUANTITIES, as rises; the modes of its first resolution,
    and all else that the loop gives."""

    traces: np.ndarray
    modes: Modes
    run: sampled.March


def march(
    lumped: Lumped, law: Law, table: Timetable, resolutions: Sequence[Resolution], tolerance: float,
    start: Start | None = None, watched: int | None = None,
) -> March:  # fmt: skip
    """Run the closed loop of a device, as `scenes.loop.march.march` does."""
    spectra = [modes(lumped, r.degree, GRIDS) for r in resolutions]
    models = [sampled.Resolution(m.modal, r.nodes) for m, r in zip(spectra, resolutions, strict=True)]
    run = sampled.march(models, law, table, tolerance, start, watched)
    return March(np.concatenate([run.rises, run.voltages, run.powers, run.flows], axis=2), spectra[0], run)
