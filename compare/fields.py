"""Temperature fields as .vtu files and the .pvd collection over time that ParaView and pyvista open."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.scope import FIRST_TIME
from scenes.result import Result
from scenes.sink import Sink

TIMES = 13


def write_fields(folder: Path, sink: Sink, result: Result, transient: bool) -> list[str]:
    """Writes fem3d.pvd, fem3d_steady.vtu and, with a transient, fem3d_<k>.vtu at times spaced evenly in their logarithm
    from 10 us (or a hundredth of the end time) to the end; returns the files' names.

    Point data "temperature" and "rise" in K; cell data "material", the number of the material (0 is
    silicon). The collection holds the times; only without a transient is it the steady state.
    """
    fields = result.details["fields"]
    _write(folder / "fem3d_steady.vtu", fields, fields.steady, sink)
    if not transient:
        (folder / "fem3d.pvd").write_text(_collection({"fem3d_steady.vtu": 0.0}), encoding="utf-8")
        return ["fem3d.pvd", "fem3d_steady.vtu"]
    times = np.geomspace(min(FIRST_TIME, sink.end_time / 100), sink.end_time, TIMES)
    files = {f"fem3d_{k:02d}.vtu": float(time) for k, time in enumerate(times)}
    for name, temperature in zip(files, fields.at(times), strict=True):
        _write(folder / name, fields, temperature, sink)
    (folder / "fem3d.pvd").write_text(_collection(files), encoding="utf-8")
    return ["fem3d.pvd", "fem3d_steady.vtu", *files]


def _write(path: Path, fields: Any, temperature: np.ndarray, sink: Sink) -> None:
    import meshio

    meshio.Mesh(
        fields.points,
        [("hexahedron", fields.hexes)],
        point_data={"temperature": temperature, "rise": temperature - sink.room_temperature},
        cell_data={"material": [np.asarray(fields.material, np.int32)]},
    ).write(path)


def _collection(files: dict[str, float]) -> str:
    rows = "\n".join(f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>' for name, time in files.items())
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n"
    )
