"""The 3D fields as files: a .vtu for each stored time, and a .pvd collection over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scenes.checks import FIRST_TIME
from scenes.result import Result

_TYPES = {"tetra10": 24, "hexahedron27": 29}
"""VTK's cell types by meshio's names."""
TIMES = 13
"""Number of times that are stored beside the start and those asked for."""

ARRAYS = {
    "temperature": "temperature_K",
    "rise": "rise_K",
    "potential": "potential_V",
    "current_density": "current_density_A_per_m2",
    "heat_source": "heat_source_W_per_m3",
}
"""Names of the fields in files, which end in their units, as programs show nothing else."""


def write_fields(folder: Path, result: Result, times: np.ndarray, ambient: float) -> list[str]:
    """Write fem3d_steady.vtu if there is a steady state, fem3d_<k>.vtu for each of ``times`` (s), and fem3d.pvd.

    Returns the names of the files.

    Cells are triquadratic hexahedra (27 points), as many along a brick as half of its degree, or those of the mesh, of
    second order. fem3d.pvd states their largest distance from the finite-element temperature. ``ARRAYS`` has the names
    of the arrays. Point data: temperature, rise above ``ambient`` (K), potential (not a number where no current flows).
    Cell data: the number of the material, current density and heat source, means over each cell. Field data:
    "material_<name>", its number. The collections hold the times; without any they hold the steady state.
    """
    import pyvista as pv

    fields = result.details["fields"]
    bare = pv.UnstructuredGrid({_TYPES[fields.cell_type]: fields.cells}, fields.points)
    for number, material in enumerate(fields.material_names):
        bare.field_data[f"material_{material}"] = np.array([number], np.int32)
    moments = [*[None] * fields.has_steady, *map(float, times)]
    names = [*["fem3d_steady.vtu"] * fields.has_steady, *(f"fem3d_{k:02d}.vtu" for k in range(len(times)))]
    distance = 0.0
    for name, time in zip(names, moments, strict=True):
        snapshot, grid = fields.snapshot(time), bare.copy(deep=False)
        distance = max(distance, snapshot.distance)
        rise = snapshot.temperature - ambient
        point = {"temperature": snapshot.temperature, "rise": rise, "potential": snapshot.potential}
        for array, values in point.items():
            grid.point_data[ARRAYS[array]] = values
        grid.cell_data["material"] = np.asarray(fields.material, np.int32)
        for array in ("current_density", "heat_source"):
            grid.cell_data[ARRAYS[array]] = getattr(snapshot, array)
        (folder / name).write_text(_as_xml(grid), encoding="utf-8")
    first = int(fields.has_steady and len(times) > 0)
    shown = [time or 0.0 for time in moments[first:]]
    rows = "".join(
        f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>\n'
        for name, time in zip(names[first:], shown, strict=True)
    )
    comment = f"<!-- the quadratic cells are within {distance:.2g} K of the finite-element solution -->\n"
    (folder / "fem3d.pvd").write_text(
        f'<?xml version="1.0"?>\n{comment}'
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}  </Collection>\n</VTKFile>\n",
        encoding="utf-8",
    )
    return ["fem3d.pvd", *names]


def stored_times(end_time: float, wanted: tuple[float, ...] = ()) -> np.ndarray:
    """Return the times (s) whose fields are kept: the start, times spaced evenly in their logarithm from 10 us (or a
    hundredth of the end) to the end, and ``wanted``."""
    spaced = np.geomspace(min(FIRST_TIME, end_time / 100), end_time, TIMES)
    # geomspace is a rounding error off the end, which a reader looks up exactly.
    spaced[-1] = end_time
    return np.unique(np.concatenate([[0.0], spaced, np.asarray(wanted, dtype=float)]))


def _as_xml(grid: Any) -> str:
    """The text of a .vtu file: VTK's own writing would end the process where a disk is full."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(grid)
    writer.SetDataModeToBinary()
    writer.SetWriteToOutputString(True)
    writer.Write()
    return writer.GetOutputString()
