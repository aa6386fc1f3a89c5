"""All fields of a run in one VTKHDF file, written by VTK itself (9.4 or newer)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

State = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]  # point data and cell data by name

_TYPES = {"tetra": 10, "hexahedron": 12, "tetra10": 24, "hexahedron20": 25, "hexahedron27": 29}
"""VTK's numbers of meshio's types."""


def write(
    path: Path, points: np.ndarray, cells: np.ndarray, kind: str, times: Sequence[float], states: Sequence[State]
) -> bool:
    """Writes points (n, 3), cells (m, nodes) of meshio's ``kind`` and a state for each time (s); False where VTK here
    cannot."""
    try:
        from vtkmodules.vtkIOHDF import vtkHDFWriter
    except ImportError:
        return False
    if not hasattr(vtkHDFWriter, "SetWriteAllTimeSteps"):
        return False
    writer = vtkHDFWriter()
    source = _source(_grid(points, cells, _TYPES[kind]), list(times), states)
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(str(path))
    writer.SetWriteAllTimeSteps(True)
    writer.SetCompressionLevel(4)
    # Large enough for few pieces, small enough not to fill a file of one coarse mesh with empty ones.
    writer.SetChunkSize(max(1000, len(points)))
    return bool(writer.Write())


def _grid(points: np.ndarray, cells: np.ndarray, kind: int) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    grid, place, rows = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
    place.SetData(numpy_to_vtk(points, deep=True))
    offsets = np.arange(0, cells.size + 1, cells.shape[1], dtype=np.int64)
    rows.SetData(
        numpy_to_vtkIdTypeArray(offsets, deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(cells, dtype=np.int64).ravel(), deep=True),
    )
    grid.SetPoints(place)
    grid.SetCells(kind, rows)
    return grid


def _source(grid: Any, times: list[float], states: Sequence[State]) -> Any:
    """What VTK's pipeline asks for the grid at each of its times; the geometry stays one object, written once."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkUnstructuredGrid
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

    class Source(VTKPythonAlgorithmBase):
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
            found.ShallowCopy(grid)
            for data, arrays in zip((found.GetPointData(), found.GetCellData()), states[k], strict=True):
                for name, values in arrays.items():
                    array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
                    array.SetName(name)
                    data.AddArray(array)
            found.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), times[k])
            return 1

    return Source()
