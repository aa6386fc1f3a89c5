"""The 3D fields of a scene on a mesh file, on the cells and nodes of that file: quadratic cells stay quadratic."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from compare.fields import TIMES
from compare.scope import FIRST_TIME
from scenes.meshed.model import MeshScene
from scenes.result import Result


def write_own(folder: Path, scene: MeshScene, result: Result) -> list[str]:
    """Writes fem3d.pvd with fem3d_steady.vtu, or with a .vtu at each of some times, and returns the files' names.

    Point data "temperature" and "rise" in K and, of a steady state with electrodes, "potential" in V; cell data
    "material", the number of the material in the scene's order. The times are spaced evenly in their logarithm from
    10 us (or a hundredth of the end time) to the end, with the output times among them.
    """
    fields = result.details["fields"]
    if scene.steady:
        _write(folder / "fem3d_steady.vtu", fields, fields.own_steady(), scene.initial_temperature)
        return _collection(folder, {"fem3d_steady.vtu": 0.0})
    spaced = np.geomspace(min(FIRST_TIME, scene.end_time / 100), scene.end_time, TIMES)
    times = np.unique([*spaced, *(t for t in scene.output_times if t > 0)])
    files = {f"fem3d_{k:02d}.vtu": float(time) for k, time in enumerate(times)}
    for name, temperature in zip(files, fields.own_at(times), strict=True):
        _write(folder / name, fields, {"temperature": temperature}, scene.initial_temperature)
    return _collection(folder, files)


def _write(path: Path, fields: Any, data: dict[str, np.ndarray], initial: float) -> None:
    import meshio

    meshio.Mesh(
        fields.own_points,
        [(fields.cell_type, fields.cells)],
        point_data={**data, "rise": data["temperature"] - initial},
        cell_data={"material": [np.asarray(fields.material, np.int32)]},
    ).write(path)


def _collection(folder: Path, files: dict[str, float]) -> list[str]:
    rows = "\n".join(f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>' for name, time in files.items())
    text = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n"
    )
    (folder / "fem3d.pvd").write_text(text, encoding="utf-8")
    return ["fem3d.pvd", *files]
