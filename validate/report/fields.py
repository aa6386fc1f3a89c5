"""The 3D fields as files: a .vtu for each stored time with a .pvd over them, and all of it in one VTKHDF file, which
VTK itself writes (9.4 or newer)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import numpy as np

from compare.verdict import FIRST_TIME
from scenes.result import Result

if TYPE_CHECKING:
    from reduced1d.painted import Reduction

State = tuple[dict[str, np.ndarray], dict[str, np.ndarray]]  # point data and cell data by name

_TYPES = {"tetra": 10, "hexahedron": 12, "tetra10": 24, "hexahedron20": 25, "hexahedron27": 29}
"""VTK's numbers of meshio's types."""
STEADY = "fem3d_steady.vtu"
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
    fields = result.details["fields"]
    cells = fields.quadratic(times, accuracy)
    material = np.asarray(cells.material, np.int32)

    def arrays(k: int, time: float | None) -> State:
        found = cells.snapshot(k)
        point = {
            "temperature": found.temperature,
            "rise": found.temperature - ambient,
            "potential": found.potential,
        }
        if reduction is not None:
            point["rise_1d"] = reduction.rise(cells.points, time)
            point["difference"] = point["rise_1d"] - point["rise"]
        cell = {"material": material, "current_density": found.current_density, "heat_source": found.heat_source}
        return {ARRAYS[name]: v for name, v in point.items()}, {ARRAYS.get(name, name): v for name, v in cell.items()}

    first = 1 if fields.has_steady else 0
    files = {f"fem3d_{k:02d}.vtu": float(time) for k, time in enumerate(times)}
    stored = [arrays(k + first, float(time)) for k, time in enumerate(times)]
    for name, state in zip(files, stored, strict=True):
        _write(folder / name, cells, *state)
    names = list(files)
    if first:
        steady = arrays(0, None)
        _write(folder / STEADY, cells, *steady)
        names.insert(0, STEADY)
        files, stored = files or {STEADY: 0.0}, stored or [steady]
    (folder / "fem3d.pvd").write_text(_collection(files, cells.error), encoding="utf-8")
    if _write_all(folder / "fem3d.vtkhdf", cells.points, cells.hexes, _type(cells), list(files.values()), stored):
        names.append("fem3d.vtkhdf")
    return ["fem3d.pvd", *names]


def stored_times(end_time: float, asked: tuple[float, ...] = ()) -> np.ndarray:
    """The times (s) whose fields are kept: the start, times spaced evenly in their logarithm from 10 us (or a hundredth
    of the end) to the end, and those asked for."""
    spaced = np.geomspace(min(FIRST_TIME, end_time / 100), end_time, TIMES)
    # Powers come out a rounding error off the end, which a reader would ask for by its own name.
    spaced[-1] = end_time
    return np.unique(np.concatenate([[0.0], spaced, np.asarray(asked, dtype=float)]))


def _type(cells: Any) -> str:
    return str(getattr(cells, "cell_type", "hexahedron27"))


def _write(path: Path, cells: Any, point: dict[str, np.ndarray], cell: dict[str, np.ndarray]) -> None:
    import meshio

    meshio.Mesh(
        cells.points,
        [(_type(cells), cells.hexes)],
        point_data=point,
        cell_data={name: [values] for name, values in cell.items()},
    ).write(path)
    # Field data, which meshio reads and doesn't write; names as texts it would not read.
    kind = 'type="Int32" NumberOfTuples="1" format="ascii"'
    names = [quoteattr(f"material_{name}") for name in cells.material_names]
    rows = "".join(f"<DataArray {kind} Name={name}>{k}</DataArray>" for k, name in enumerate(names))
    whole, start = path.read_bytes(), b"<UnstructuredGrid>"
    path.write_bytes(whole.replace(start, start + f"<FieldData>{rows}</FieldData>".encode(), 1))


def _collection(files: dict[str, float], error: float | None) -> str:
    rows = "\n".join(f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>' for name, time in files.items())
    within = (
        ""
        if error is None
        else (f"<!-- the quadratic cells are within {error:.2g} K of the finite-element solution -->\n")
    )
    return (
        '<?xml version="1.0"?>\n'
        f"{within}"
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n"
    )


def _write_all(
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
