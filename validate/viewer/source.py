"""Read the states of a field from the folder of a run, a .pvd collection or a .vtu file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenes.errors import SceneError, quoted, reason
from validate.report.fields import ARRAYS
from validate.report.figures.render import exaggeration


def stored(path: Path) -> list[tuple[float | None, Path]]:
    """Return the time (s) and the file of each state; a single state has no time. Raises SceneError."""
    import pyvista as pv

    if path.is_dir():
        if not (path / "fem3d.pvd").exists():
            raise SceneError(f"{quoted(path)} has no fields (fem3d.pvd): run again with --fields, and give its folder")
        path = path / "fem3d.pvd"
    if path.suffix == ".vtu":
        return [(None, path)]
    if path.suffix != ".pvd":
        raise SceneError(f"{quoted(path)} is no file of a field: give a results folder, or a .pvd or .vtu file")
    try:
        files = [(state.time, path.parent / state.path) for state in pv.PVDReader(path).datasets]
    except Exception as error:  # a reader of a broken file may raise any
        raise SceneError(f"{quoted(path)} is not a .pvd collection: {reason(error)}") from None
    if not files:
        raise SceneError(f"{quoted(path)} lists no files")
    return [*sorted(files)] if len(files) > 1 else [(None, files[0][1])]


@dataclass(frozen=True)
class Field:
    """States of a field on one mesh.

    Attributes
    ----------
    name : shown in the title
    times : of each state (s), or ``None``
    grids : of each state, in um, with z enlarged
    factor : enlargement of z
    arrays : names of the arrays that can be shown
    """

    name: str
    times: tuple[float | None, ...]
    grids: tuple[Any, ...]
    factor: float
    arrays: tuple[str, ...]

    @classmethod
    def read(cls, name: str, files: list[tuple[float | None, Path]], factor: float | None) -> Field:
        """Read all states, and enlarge z by a factor or, if ``None``, by a round one. Raises SceneError."""
        grids = tuple(_grid(path, checked=n == 0) for n, (_, path) in enumerate(files))
        if len({(grid.n_points, grid.cells.tobytes(), grid.celltypes.tobytes()) for grid in grids}) > 1:
            raise SceneError(f"{quoted(name)} has states on different meshes: give a collection on one")
        factor = factor or exaggeration(grids[0].points)
        for grid in grids:
            grid.points = grid.points * [1e6, 1e6, 1e6 * factor]
        last = grids[-1]
        arrays = [name for name in ARRAYS.values() if name in last.array_names and np.isfinite(last[name]).any()]
        if not arrays:
            raise SceneError(f"{quoted(files[-1][1])} has none of the data {', '.join(ARRAYS.values())}")
        return cls(name, tuple(time for time, _ in files), grids, factor, tuple(arrays))

    def at(self, place: float, array: str) -> Any:
        """Return the grid of a state by its number; between two states, the array is interpolated linearly."""
        before = int(place)
        grid = self.grids[before].copy(deep=False)
        if place > before:
            data = grid.point_data if array in grid.point_data else grid.cell_data
            data[array] = grid[array] + (place - before) * (self.grids[before + 1][array] - grid[array])
        return grid

    def range(self, array: str) -> tuple[float, float]:
        """Return the least and largest value of all states, or a range of 1 for a constant."""
        values = np.concatenate([size(grid[array]) for grid in self.grids])
        low, high = float(np.nanmin(values)), float(np.nanmax(values))
        return low, high if high > low else low + 1.0


def size(values: np.ndarray) -> np.ndarray:
    """Return scalars as they are, and the lengths of vectors."""
    return values if values.ndim == 1 else np.asarray(np.linalg.norm(values, axis=1))


def _grid(path: Path, checked: bool) -> Any:
    import pyvista as pv

    try:
        grid: Any = pv.read(path)
        if not grid.n_cells:
            raise ValueError("it has no cells")
        if checked:  # VTK would end the process at these.
            grid.validate_mesh(["invalid_point_references", "wrong_number_of_points"], action="error")
    except Exception as error:  # a reader of a broken file may raise any
        raise SceneError(f"{quoted(path)} cannot be read: {reason(error)}") from None
    return grid
