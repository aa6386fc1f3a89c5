"""The 3D fields as files: a .vtu for each stored time with a .pvd over them, and all of it in one VTKHDF file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare import vtkhdf
from compare.scope import FIRST_TIME
from compare.vtkhdf import State
from scenes.result import Result
from scenes.sink import Sink

STEADY = "fem3d_steady.vtu"
TIMES = 13
"""How many times are stored beside the start and those asked for."""


def write_fields(folder: Path, sink: Sink, result: Result, times: np.ndarray) -> list[str]:
    """Writes fem3d_steady.vtu if there is a steady state, fem3d_<k>.vtu for each of ``times`` (s), fem3d.pvd and, where
    VTK can, fem3d.vtkhdf; returns the files' names.

    Cells are triquadratic hexahedra (27 points), so many that they follow the solution to a tenth of the accuracy.
    Point data: "temperature" and "rise" in K, "potential" in V (not a number where no current flows). Cell data:
    "material" (its number, 0 is silicon), "current_density" (A/m2) and "heat_source" (W/m3), means over each cell. The
    collections hold the times; without any they hold the steady state.
    """
    fields = result.details["fields"]
    cells = fields.quadratic(times, sink.accuracy)
    material = np.asarray(cells.material, np.int32)

    def arrays(k: int) -> State:
        found = cells.snapshot(k)
        rise = found.temperature - sink.room_temperature
        point = {"temperature": found.temperature, "rise": rise, "potential": found.potential}
        cell = {"material": material, "current_density": found.current_density, "heat_source": found.heat_source}
        return point, cell

    first = 1 if fields.has_steady else 0
    files = {f"fem3d_{k:02d}.vtu": float(time) for k, time in enumerate(times)}
    stored = [arrays(k + first) for k in range(len(times))]
    for name, state in zip(files, stored, strict=True):
        _write(folder / name, cells, *state)
    names = list(files)
    if first:
        steady = arrays(0)
        _write(folder / STEADY, cells, *steady)
        names.insert(0, STEADY)
        files, stored = files or {STEADY: 0.0}, stored or [steady]
    (folder / "fem3d.pvd").write_text(_collection(files, cells.error), encoding="utf-8")
    if vtkhdf.write(folder / "fem3d.vtkhdf", cells.points, cells.hexes, list(files.values()), stored):
        names.append("fem3d.vtkhdf")
    return ["fem3d.pvd", *names]


def stored_times(end_time: float, asked: tuple[float, ...] = ()) -> np.ndarray:
    """The times (s) whose fields are kept: the start, times spaced evenly in their logarithm from 10 us (or a hundredth
    of the end) to the end, and those asked for."""
    spaced = np.geomspace(min(FIRST_TIME, end_time / 100), end_time, TIMES)
    # Powers come out a rounding error off the end, which a reader would ask for by its own name.
    spaced[-1] = end_time
    return np.unique(np.concatenate([[0.0], spaced, np.asarray(asked, dtype=float)]))


def _write(path: Path, cells: Any, point: dict[str, np.ndarray], cell: dict[str, np.ndarray]) -> None:
    import meshio

    meshio.Mesh(
        cells.points,
        [("hexahedron27", cells.hexes)],
        point_data=point,
        cell_data={name: [values] for name, values in cell.items()},
    ).write(path)


def _collection(files: dict[str, float], error: float) -> str:
    rows = "\n".join(f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>' for name, time in files.items())
    return (
        '<?xml version="1.0"?>\n'
        f"<!-- the quadratic cells are within {error:.2g} K of the finite-element solution -->\n"
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n"
    )
