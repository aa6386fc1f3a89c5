"""Sources of fields: the states of a run's folder, a .pvd collection, or a single file of a field.

The current view, as a value, and the keys that change it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from scenes.errors import SceneError, quoted, reason
from validate.report.fields import ARRAYS

SINGLE = (".vtu", ".vtk")
"""Files that hold one field."""
QUANTITIES = {
    "rise": ("rise", "K"),
    "temperature": ("temperature", "K"),
    "potential": ("potential", "V"),
    "current_density": ("current density", "A/m2"),
    "heat_source": ("heat source", "W/m3"),
}
"""What can be shown: the data's name, its label and unit."""
_CUTS = {"": "x", "x": "y", "y": "z", "z": ""}


@dataclass
class Source:
    """States of one geometry: their ``times`` (s; ``None`` for a steady state), each loaded when it is first needed."""

    name: str
    times: tuple[float | None, ...]
    _load: Callable[[int], Any]
    _loaded: dict[int, Any] = field(default_factory=dict)

    def grid(self, k: int) -> Any:
        """The k-th state as a pyvista grid whose point data have at least "rise" (K)."""
        if k not in self._loaded:
            grid = self._load(k)
            short = {name: short for short, name in ARRAYS.items()}
            for data in (grid.point_data, grid.cell_data):
                for name in set(data.keys()) & short.keys():
                    data[short[name]] = data.pop(name)
            if "rise" not in grid.point_data:
                if "temperature" not in grid.point_data:
                    names = ", ".join(grid.point_data.keys()) or "none"
                    raise SceneError(f"{quoted(self.name)} has no point data rise or temperature, but {names}")
                # Of a field without a run, above its coldest place.
                grid.point_data["rise"] = grid["temperature"] - np.min(grid["temperature"])
            self._loaded[k] = grid
        return self._loaded[k]

    def evenly(self, count: int, quantity: str) -> Source:
        """The same transient at evenly spaced times, with one quantity, linear between the stored states."""
        stored = np.array(self.times, dtype=float)
        times = np.linspace(stored[0], stored[-1], count)
        places = np.interp(times, stored, np.arange(len(stored)))

        def load(k: int) -> Any:
            first = int(places[k])
            part = places[k] - first
            before, after = (self.grid(n) for n in (first, min(first + 1, len(stored) - 1)))
            state = before.copy()
            for data, later in ((state.point_data, after.point_data), (state.cell_data, after.cell_data)):
                for name in {"rise", quantity} & set(data.keys()):
                    data[name] = (1 - part) * data[name] + part * later[name]
            return state

        return Source(self.name, tuple(times.tolist()), load)


def present(path: Path) -> str:
    """Words on a folder of fields beside a path, or nothing; SceneError where nothing is at the path itself."""
    beside = path.parent / f"{path.name}-fields"
    nearby = f"; there is {quoted(beside)}" if path.name and beside.is_dir() else ""
    if not path.exists():
        raise SceneError(f"{quoted(path)} does not exist{nearby}: give a results folder, or a .pvd or .vtu file")
    return nearby


def find(path: Path) -> Source:
    """Return the source at a path; raise SceneError, with a hint, where there are no fields."""
    nearby = present(path)
    if path.is_dir():
        for name in ("fem3d.pvd", "fem3d_steady.vtu"):
            if (path / name).exists():
                return find(path / name)
        hint = "run again with --fields" if (path / "summary.json").exists() else "give a run's folder"
        raise SceneError(f"{quoted(path)} has no fields (fem3d.pvd){nearby}: {hint}")
    folder = path.parent
    name = folder.name if path.name in ("fem3d.pvd", "fem3d_steady.vtu") else path.name
    if path.suffix == ".pvd":
        files = _collection(path)
        # A collection of the steady state alone calls it time 0.
        alone = [file.name for _, file in files] == ["fem3d_steady.vtu"]
        times = tuple(None if alone else time for time, _ in files)
        return Source(name, times, lambda k: _grid(files[k][1]))
    if path.suffix not in SINGLE:
        raise SceneError(f"{quoted(path)} is no file of a field: give a folder, .pvd, {', '.join(SINGLE)}")
    return Source(name, (_time_of(path),), lambda _: _grid(path))


def _collection(path: Path) -> list[tuple[float, Path]]:
    from xml.etree import ElementTree

    try:
        rows = ElementTree.parse(path).getroot().findall("./Collection/DataSet")
        files = [(float(row.attrib["timestep"]), path.parent / row.attrib["file"]) for row in rows]
    except (ElementTree.ParseError, KeyError, ValueError, OSError) as error:
        raise SceneError(f"{quoted(path)} is not a .pvd collection: {reason(error)}") from None
    if not files:
        raise SceneError(f"{quoted(path)} lists no files")
    return sorted(files)


def _time_of(path: Path) -> float | None:
    """The time that the collection beside a file gives it."""
    collection = path.with_name("fem3d.pvd")
    if path.name == "fem3d_steady.vtu" or not collection.exists():
        return None
    return next((time for time, file in _collection(collection) if file.name == path.name), None)


def _grid(path: Path) -> Any:
    import pyvista as pv

    if not path.exists():
        raise SceneError(f"{quoted(path)} is listed but does not exist")
    try:
        data = pv.read(path)
    except Exception as error:  # whatever a reader of a broken file may raise
        raise SceneError(f"{quoted(path)} cannot be read: {reason(error)}") from None
    if not getattr(data, "n_cells", 0) or not hasattr(data, "cast_to_unstructured_grid"):
        raise SceneError(f"{quoted(path)} holds no field")
    grid = data.cast_to_unstructured_grid()
    if not _consistent(grid):
        raise SceneError(f"{quoted(path)} has cells of points that it does not have: the file is damaged")
    return grid


def _consistent(grid: Any) -> bool:
    """Return whether all cells have as many existing points as their type: VTK does not check before it reads."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkGenericCell

    points, sizes = grid.cell_connectivity, np.diff(vtk_to_numpy(grid.GetCells().GetOffsetsArray()))
    if len(points) and not 0 <= points.min() <= points.max() < grid.n_points:
        return False
    for kind in np.unique(grid.celltypes).tolist():
        cell = vtkGenericCell.InstantiateCell(kind)
        # For types with any number of points VTK gives none, or the least.
        if cell is not None and sizes[grid.celltypes == kind].min() < cell.GetNumberOfPoints():
            return False
    return True


@dataclass(frozen=True)
class View:
    """The state of the viewer.

    ``step`` of ``steps`` states; ``factor`` exaggerates the thickness; ``cut`` is the axis ("x", "y", "z" or none) of
    the clipping plane and ``place`` where it is, as a part of the extent. ``own_scale`` colours each time by its own
    range; else all have one, so that they can be compared.
    """

    quantities: tuple[str, ...]
    steps: int
    factor: float
    step: int = 0
    quantity: str = "rise"
    edges: bool = False
    cut: str = ""
    place: float = 0.5
    probe: bool = False
    own_scale: bool = False
    playing: bool = False

    def at(self, step: int) -> View:
        """At another state, from the first after the last."""
        return replace(self, step=step % self.steps)


def _next_quantity(view: View) -> View:
    k = view.quantities.index(view.quantity)
    return replace(view, quantity=view.quantities[(k + 1) % len(view.quantities)])


KEYS: dict[str, tuple[str, str, Callable[[View], View]]] = {
    "space": ("space", "play, stop", lambda view: replace(view, playing=not view.playing)),
    "Right": ("right", "later", lambda view: view.at(view.step + 1)),
    "Left": ("left", "earlier", lambda view: view.at(view.step - 1)),
    "t": ("t", "next quantity", _next_quantity),
    "x": ("x", "clip", lambda view: replace(view, cut=_CUTS[view.cut], place=0.5)),
    "l": ("l", "line probe", lambda view: replace(view, probe=not view.probe)),
    "r": ("r", "reset the camera", lambda view: view),
    "q": ("q", "close", lambda view: view),
}
"""By VTK's name of a key: label, words, function. VTK itself closes the window (q) and resets the camera (r)."""


def title(view: View, name: str, time: float | None) -> str:
    """Return the title of a view, in one line that states the exaggeration."""
    label = QUANTITIES[view.quantity][0]
    when = "steady" if time is None else f"{time * 1e3:.4g} ms"
    drawn = f"thickness drawn x{view.factor:g}" if view.factor != 1 else "true proportions"
    clip = f", clipped across {view.cut}" if view.cut else ""
    return f"{name}: {label}, {when}, {drawn}{clip}"
