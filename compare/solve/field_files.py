"""The temperature fields of a free scene as .vtu files, and the .pvd collection of them over time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from scenes.model import Scene
from scenes.result import Result

TIMES = 13
"""Of a transient without output times: how many instants are stored, evenly spaced from start to end."""


def write_fields(folder: Path, scene: Scene, result: Result) -> list[str]:
    """Writes fem3d.pvd with fem3d_steady.vtu, or with fem3d_<k>.vtu for the start, each output time and the end.

    Point data "temperature" and "rise", above the initial temperature, in K; cell data "material", the number of the
    material in the order in which the boxes have them. Returns the files' names.
    """
    fields = result.details["fields"]
    if scene.steady:
        files, found = {"fem3d_steady.vtu": 0.0}, fields.steady[None]
    else:
        times = stored_times(scene)
        files = {f"fem3d_{k:0{len(str(len(times)))}d}.vtu": float(time) for k, time in enumerate(times)}
        found = fields.at(times)
    for name, temperature in zip(files, found, strict=True):
        _write(folder / name, fields, temperature, scene.initial_temperature)
    (folder / "fem3d.pvd").write_text(_collection(files), encoding="utf-8")
    return ["fem3d.pvd", *files]


def stored_times(scene: Scene) -> np.ndarray:
    """The instants (s) whose fields are kept."""
    asked = scene.output_times or tuple(np.linspace(0.0, scene.end_time, TIMES).tolist())
    return np.array(sorted({0.0, *asked, scene.end_time}))


def _write(path: Path, fields: Any, temperature: np.ndarray, initial: float) -> None:
    import meshio

    meshio.Mesh(
        fields.points,
        [("hexahedron", fields.hexes)],
        point_data={"temperature": temperature, "rise": temperature - initial},
        cell_data={"material": [np.asarray(fields.material, np.int32)]},
    ).write(path)


def _collection(files: dict[str, float]) -> str:
    rows = "\n".join(f'    <DataSet timestep="{time!r}" part="0" file="{name}"/>' for name, time in files.items())
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{rows}\n  </Collection>\n</VTKFile>\n"
    )
