"""The 3D fields as files: a .vtu for each stored time with a .pvd over them, and all of it in one VTKHDF file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.scope import FIRST_TIME
from scenes.result import Result
from scenes.sink import Sink

TIMES = 13
"""How many times are stored beside the start and those asked for."""


def write_fields(folder: Path, sink: Sink, result: Result, times: np.ndarray) -> list[str]:
    """Writes fem3d_steady.vtu, fem3d_<k>.vtu for each of ``times`` (s), fem3d.pvd and, where VTK can, fem3d.vtkhdf;
    returns the files' names.

    Cells are triquadratic hexahedra (27 points), so many that they follow the solution to a tenth of the accuracy.
    Point data: "temperature" and "rise" in K, "potential" in V (not a number where no current flows). Cell data:
    "material" (its number, 0 is silicon), "current_density" (A/m2) and "heat_source" (W/m3), means over each cell. The
    collections hold the times; without any they hold the steady state.
    """
    cells, rises = result.details["fields"].quadratic(times, sink.accuracy)
    room = sink.room_temperature

    def arrays(k: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        found = cells.snapshot(rises[k])
        point = {
            "temperature": found.temperature,
            "rise": found.temperature - room,
            "potential": found.potential,
        }
        return point, {
            "material": np.asarray(cells.material, np.int32),
            "current_density": found.current_density,
            "heat_source": found.heat_source,
        }

    steady = arrays(0)
    _write(folder / "fem3d_steady.vtu", cells, *steady)
    files = {f"fem3d_{k:02d}.vtu": float(time) for k, time in enumerate(times)}
    stored = [arrays(k + 1) for k in range(len(times))]
    for name, state in zip(files, stored, strict=True):
        _write(folder / name, cells, *state)
    (folder / "fem3d.pvd").write_text(_collection(files or {"fem3d_steady.vtu": 0.0}, cells.error), encoding="utf-8")
    names = ["fem3d.pvd", "fem3d_steady.vtu", *files]
    from compare import vtkhdf

    if vtkhdf.write(
        folder / "fem3d.vtkhdf", cells.points, cells.hexes, list(files.values()) or [0.0], stored or [steady]
    ):
        names.append("fem3d.vtkhdf")
    return names


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
