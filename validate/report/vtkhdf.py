"""All times of a field in one VTKHDF file, which VTK itself writes (9.4 or newer).

This is a program of its own (``python -P vtkhdf.py FILE``, with a pickled Field on standard input), since VTK ends the
process that writes where a disk is full. Its status is 0 where all of the file could be read back, and TOO_OLD where
VTK can't write such files.
"""

from __future__ import annotations

import pickle
import sys
from typing import Any, TypedDict

import numpy as np

TOO_OLD = 3  # Exit status where the installed VTK can't write such files.


class Field(TypedDict):
    """Points (n, 3), cells (m, k) by their points, VTK's number of their ``kind``; ``times`` in s, and for each the
    arrays over points and over cells by their names."""

    points: np.ndarray
    cells: np.ndarray
    kind: int
    times: list[float]
    at_points: list[dict[str, np.ndarray]]
    at_cells: list[dict[str, np.ndarray]]


def main() -> int:
    """Writes the file and reads it back."""
    field: Field = pickle.load(sys.stdin.buffer)
    try:
        _write(sys.argv[1], field["times"], _grids(field))
    except ImportError:
        return TOO_OLD
    return 0 if _holds(sys.argv[1], field) else 1


def _grids(field: Field) -> list[Any]:
    """VTK's grid of each time; points and cells are one thing in all of them, which VTK then writes once."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    count, corners = field["cells"].shape
    points, cells, grids = vtkPoints(), vtkCellArray(), []
    points.SetData(numpy_to_vtk(field["points"], deep=True))
    ends = np.arange(0, count * corners + 1, corners, dtype=np.int64)
    joined = field["cells"].astype(np.int64).ravel()
    cells.SetData(numpy_to_vtkIdTypeArray(ends, deep=True), numpy_to_vtkIdTypeArray(joined, deep=True))
    for at_points, at_cells in zip(field["at_points"], field["at_cells"], strict=True):
        grid = vtkUnstructuredGrid()
        grid.SetPoints(points)
        grid.SetCells(field["kind"], cells)
        for part, arrays in ((grid.GetPointData(), at_points), (grid.GetCellData(), at_cells)):
            for name, values in arrays.items():
                array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
                array.SetName(name)
                part.AddArray(array)
        grids.append(grid)
    return grids


def _write(path: str, times: list[float], grids: list[Any]) -> None:
    """Writes the grids at all times (s). Raises ImportError where VTK is too old for that."""
    from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
    from vtkmodules.vtkCommonDataModel import vtkDataObject, vtkUnstructuredGrid
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline
    from vtkmodules.vtkIOHDF import vtkHDFWriter

    if not hasattr(vtkHDFWriter, "SetWriteAllTimeSteps"):
        raise ImportError

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
            key = Pipeline.UPDATE_TIME_STEP()
            time = information.Get(key) if information.Has(key) else times[0]
            k = int(np.abs(np.array(times) - time).argmin())
            grid = vtkUnstructuredGrid.GetData(out)
            grid.ShallowCopy(grids[k])
            grid.GetInformation().Set(vtkDataObject.DATA_TIME_STEP(), times[k])
            return 1

    source, writer = Source(), vtkHDFWriter()
    writer.SetInputConnection(source.GetOutputPort())
    writer.SetFileName(path)
    writer.SetWriteAllTimeSteps(True)
    writer.SetCompressionLevel(4)
    # Large enough for few pieces, small enough not to fill a file of one coarse mesh with empty ones.
    writer.SetChunkSize(max(1000, grids[0].GetNumberOfPoints()))
    writer.Write()


def _holds(path: str, field: Field) -> bool:
    """Whether that is what the file holds, each array of each time."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    def same(array: Any, values: np.ndarray) -> bool:
        return array is not None and np.array_equal(vtk_to_numpy(array), values, equal_nan=values.dtype.kind == "f")

    reader = vtkHDFReader()
    if not reader.CanReadFile(path):
        return False
    reader.SetFileName(path)
    reader.UpdateInformation()
    if reader.GetNumberOfSteps() != len(field["times"]):
        return False
    for step, (at_points, at_cells) in enumerate(zip(field["at_points"], field["at_cells"], strict=True)):
        reader.SetStep(step)
        reader.Update()
        grid = reader.GetOutput()
        pairs = [
            (grid.GetPoints().GetData(), field["points"]),
            (grid.GetCells().GetConnectivityArray(), field["cells"].ravel()),
            *((grid.GetPointData().GetArray(name), values) for name, values in at_points.items()),
            *((grid.GetCellData().GetArray(name), values) for name, values in at_cells.items()),
        ]
        if not all(same(array, values) for array, values in pairs):
            return False
    return True


if __name__ == "__main__":
    sys.exit(main())
