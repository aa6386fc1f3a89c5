"""The sink in FreeFEM (sink.edp): tetrahedra of order 1, 2 or 3, the bricks of the graded quarter cut in six.

``options``: ``order``, ``grading``, ``cuts`` (the cells), ``transient``, ``steps`` in each interval of
time, ``method`` (its order, 2 to 4).
The script takes the time itself, from where it has read the mesh; making the mesh file is not counted.
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from meshes.grid import Grid
from reduced1d.equations import room_resistivity
from scenes.loading import load
from scenes.sink import Sink
from validate.bench.problem import at_times, graded, numbers, quarter, step_times
from validate.verify import reference
from validate.verify.methods import METHODS

MICRO = 1e6
SUBSTRATE, END = 2, 3  # labels of triangles
COPIES = 4
TOLERANCE = 1e-6
SOLVER = "UMFPACK"
ELEMENTS = {1: ("P1", ""), 2: ("P2", ""), 3: ("P33d", 'load "Element_P3"\n')}
PLUGINS = ("freefem++", "ff++/*/lib")  # where they are, below the folder of libraries
Answer = tuple[np.ndarray, float]


def prepare(options: dict[str, Any]) -> tuple[Callable[[], Answer], Callable[[Answer], dict[str, Any]]]:
    """Run the script in a folder of its own; read what it wrote."""
    sink = load("sink", [])
    scene = quarter(sink)
    times = step_times(options["steps"]) if options["transient"] else np.empty(0)
    folder = Path(tempfile.mkdtemp())
    write_mesh(graded(scene, options["grading"], options["cuts"], 1), folder / "quarter.mesh")
    (folder / "input.txt").write_text(
        " ".join(map(repr, _inputs(sink, times, METHODS[options["method"]]))) + "\n", encoding="utf-8"
    )
    script = files("validate.bench.tools").joinpath("sink.edp").read_text(encoding="utf-8")
    element, plugin = ELEMENTS[options["order"]]
    script = script.replace("SOLVER", SOLVER).replace("ORDER);", f"{element});").replace("LOAD\n", plugin)
    (folder / "sink.edp").write_text(script, encoding="utf-8")

    def solve() -> Answer:
        before = _children_s()
        command = ["FreeFem++", "-nw", "-v", "0", "sink.edp"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=_environment())
        if done.returncode:
            raise ArithmeticError((done.stdout.strip() or "FreeFem++ failed").splitlines()[-1])
        lines = (folder / "output.txt").read_text(encoding="utf-8").splitlines()
        rows = np.array([[float(word) for word in line.split()] for line in lines[:-1]])
        unknowns, inside = lines[-1].split()
        return np.vstack([rows, [float(unknowns), float(inside), 0.0, 0.0]]), _children_s() - before

    def read(answer: Answer) -> dict[str, Any]:
        rows, whole = answer
        shutil.rmtree(folder)
        unknowns, inside = rows[-1, :2]
        found = rows[at_times(times)] if options["transient"] else rows[:1]
        peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
        return {
            **numbers(options, int(unknowns), found), "seconds": [inside], "start_up_s": whole - inside,
            "peak_MB": peak,
        }  # fmt: skip

    return solve, read


def _environment() -> dict[str, str]:
    """With the folder of the plugins, which some distributions' FreeFEM does not find by itself."""
    program = shutil.which("FreeFem++")
    libraries = Path(program or "/usr/bin").resolve().parent.parent / "lib"
    found = [str(f.parent) for folder in PLUGINS for f in sorted(libraries.glob(f"{folder}/Element_P3.so"))]
    return {**({"FF_LOADPATH": found[0]} if found else {}), **os.environ}


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _inputs(sink: Sink, times: np.ndarray, method: tuple[tuple[float, ...], ...]) -> list[float | int]:
    """What the script reads, in its order."""
    si, ox = sink.silicon, sink.oxide
    rho, coefficient = room_resistivity(si, sink.room_temperature)
    tableau = np.zeros((len(method), len(method)))
    for row, weights in zip(tableau, method, strict=True):
        row[: len(weights)] = weights
    centre = (0.0, sink.length / 2 * MICRO, sink.thickness / 2 * MICRO)
    return [
        si.thermal_conductivity, ox.thermal_conductivity, si.heat_capacity, ox.heat_capacity, rho,
        rho * coefficient, sink.voltage, sink.length, sink.cross_section, COPIES, TOLERANCE,
        *centre, len(method), *tableau.ravel().tolist(), len(times), *times.tolist(),
    ]  # fmt: skip


def write_mesh(grid: Grid, path: Path) -> None:
    """A grid of bricks as a file of tetrahedra in Medit's format, in micrometres: each brick in six, along the same
    diagonal everywhere, so that neighbours fit. The boxes' numbers from 1 are its regions, with triangles on the
    oxide's underside and the beam's end."""
    bricks, owner = reference.hexahedra(grid)
    mesh, regions = bricks.scaled(MICRO).to_meshtet(), np.tile(owner + 1, 6)
    corners, small = mesh.p[:, mesh.t], 1e-9
    flipped = np.linalg.det(np.moveaxis(corners[:, 1:] - corners[:, :1], 2, 0)) < 0
    tetrahedra = np.where(flipped, mesh.t[[0, 2, 1, 3]], mesh.t).T
    bottom = mesh.facets_satisfying(lambda x: np.abs(x[2] - mesh.p[2].min()) < small)
    ends = mesh.facets_satisfying(lambda x: np.abs(x[1]) < small)
    end = np.intersect1d(ends, mesh.t2f[:, regions == 1])
    labels = np.repeat([SUBSTRATE, END], [len(bottom), len(end)])
    cells = [("tetra", tetrahedra), ("triangle", mesh.facets[:, np.concatenate([bottom, end])].T)]
    meshio.Mesh(mesh.p.T, cells, cell_data={"medit:ref": [regions, labels]}).write(path, file_format="medit")
