"""The 3D fields as files: a .vtu for each stored time with a .pvd over them, and all of it in one VTKHDF file, which
VTK itself writes (9.4 or newer)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from reduced1d.painted import Reduction
from scenes.checks import FIRST_TIME
from scenes.result import Result

_TYPES = {"tetra": 10, "hexahedron": 12, "tetra10": 24, "hexahedron20": 25, "hexahedron27": 29}
"""VTK's numbers of meshio's types."""
TIMES = 13
"""How many times are stored beside the start and those asked for."""

ARRAYS = {
    "temperature": "temperature_K",
    "rise": "rise_K",
    "potential": "potential_V",
    "current_density": "current_density_A_per_m2",
    "heat_source": "heat_source_W_per_m3",
    "rise_1d": "rise_1d_K",
    "difference": "difference_K",
}
"""What the fields are called in the files, where programs show nothing but the name."""


def write_fields(
    folder: Path, result: Result, accuracy: float, times: np.ndarray, ambient: float, reduction: Reduction | None = None
) -> list[str]:
    """Writes fem3d_steady.vtu if there is a steady state, fem3d_<k>.vtu for each of ``times`` (s), fem3d.pvd and, where
    VTK can, fem3d.vtkhdf; returns the files' names.

    Cells are triquadratic hexahedra (27 points), so many that they follow the solution to a tenth of the ``accuracy``,
    or those of the user's mesh. Arrays are those of ``ARRAYS``. Point data: temperature, rise above ``ambient`` (K),
    potential (not a number where no current flows) and, with a ``reduction``, its rise painted on the same points and
    by how much that is above 3D. Cell data: the number of the material, current density and heat source, means over
    each cell. Field data: "material_<name>", its number. The collections hold the times; without any they hold the
    steady state.
    """
    import pyvista as pv

    fields = result.details["fields"]
    cells = fields.quadratic(times, accuracy)
    bare = pv.UnstructuredGrid({_TYPES[getattr(cells, "cell_type", "hexahedron27")]: cells.hexes}, cells.points)
    bare.cell_data["material"] = np.asarray(cells.material, np.int32)
    moments = [*[None] * fields.has_steady, *map(float, times)]
    names = [*["fem3d_steady.vtu"] * fields.has_steady, *(f"fem3d_{k:02d}.vtu" for k in range(len(times)))]
    grids = []
    for k, (name, time) in enumerate(zip(names, moments, strict=True)):
        found, grid = cells.snapshot(k), bare.copy(deep=False)
        rise = found.temperature - ambient
        point = {"temperature": found.temperature, "rise": rise, "potential": found.potential}
        if reduction is not None:
            painted = reduction.rise(cells.points, time)
            point |= {"rise_1d": painted, "difference": painted - rise}
        for array, values in point.items():
            grid.point_data[ARRAYS[array]] = values
        for array in ("current_density", "heat_source"):
            grid.cell_data[ARRAYS[array]] = getattr(found, array)
        grids.append(grid.copy(deep=False))
        for number, material in enumerate(cells.material_names):
            grid.field_data[f"material_{material}"] = np.array([number], np.int32)
        grid.save(folder / name)
    first = int(fields.has_steady and len(times) > 0)
    shown = [time or 0.0 for time in moments[first:]]
    rows = "".join(
        f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>\n'
        for name, time in zip(names[first:], shown, strict=True)
    )
    within = f"<!-- the quadratic cells are within {cells.error or 0:.2g} K of the finite-element solution -->\n"
    (folder / "fem3d.pvd").write_text(
        f'<?xml version="1.0"?>\n{within if cells.error is not None else ""}'
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}  </Collection>\n</VTKFile>\n",
        encoding="utf-8",
    )
    whole = ["fem3d.vtkhdf"] * _write_all(folder / "fem3d.vtkhdf", shown, grids[first:])
    return ["fem3d.pvd", *names, *whole]


def stored_times(end_time: float, asked: tuple[float, ...] = ()) -> np.ndarray:
    """The times (s) whose fields are kept: the start, times spaced evenly in their logarithm from 10 us (or a hundredth
    of the end) to the end, and those asked for."""
    spaced = np.geomspace(min(FIRST_TIME, end_time / 100), end_time, TIMES)
    # Powers come out a rounding error off the end, which a reader would ask for by its own name.
    spaced[-1] = end_time
    return np.unique(np.concatenate([[0.0], spaced, np.asarray(asked, dtype=float)]))


def _write_all(path: Path, times: list[float], grids: list[Any]) -> bool:
    """Writes the grids at all times (s) into one file, their geometry once; False where VTK here cannot."""
    try:
        from vtkmodules.vtkIOHDF import vtkHDFWriter
    except ImportError:
        return False
    if not hasattr(vtkHDFWriter, "SetWriteAllTimeSteps"):
        return False
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkUnstructuredGrid
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    class Source(VTKPythonAlgorithmBase):
        """What VTK's pipeline asks for the grid at each of its times."""

        def __init__(self) -> None:
            super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkUnstructuredGrid")

        def RequestInformation(self, request: Any, given: Any, out: Any) -> int:  # noqa: N802
            information = out.GetInformationObject(0)
            information.Set(Pipeline.TIME_STEPS(), times, len(times))
            information.Set(Pipeline.TIME_RANGE(), [times[0], times[-1]], 2)
            return 1

        def RequestData(self, request: Any, given: Any, out: Any) -> int:  # noqa: N802
            information = out.GetInformationObject(0)
            asked = Pipeline.UPDATE_TIME_STEP()
            time = information.Get(asked) if information.Has(asked) else times[0]
            k = int(np.abs(np.array(times) - time).argmin())
            found = vtkUnstructuredGrid.GetData(out)
            found.ShallowCopy(grids[k])
            found.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), times[k])
            return 1

    source, writer = Source(), vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(str(path))
    writer.SetWriteAllTimeSteps(True)
    writer.SetCompressionLevel(4)
    # Large enough for few pieces, small enough not to fill a file of one coarse mesh with empty ones.
    writer.SetChunkSize(max(1000, grids[0].n_points))
    return bool(writer.Write())
