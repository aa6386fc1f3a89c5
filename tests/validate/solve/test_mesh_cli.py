"""`validate solve` on a mesh file, as a user runs it."""

import math
from pathlib import Path

import meshio
import numpy as np
import pytest

from tests.validate.cli import summary
from validate.cli import main

WIRE = Path(__file__).parents[2] / "meshes" / "grouped" / "files" / "wire.msh"
SCENE = """
mesh = {file = "wire.msh", unit = "um"}
run.steady = true
run.accuracy = 1e-2
source = [{group = "lower", heat_source = 1e12}]
boundary = [
  {name = "cold", group = "near", temperature = 293},
  {name = "plus", group = "near", voltage = "10 mV"},
  {name = "minus", group = "far", voltage = 0},
]
probe = [
  {name = "end", group = "far"},
  {name = "out", group = "near", quantity = "heat_flow"},
  {name = "through", group = "joint", quantity = "heat_flow"},
  {name = "current", group = "near", quantity = "current"},
]
[[material]]
name = "metal"
groups = ["lower", "upper"]
thermal_conductivity = 100
density = 2000
specific_heat = 500
resistivity = 1e-5
"""

READOUTS = """
  {name = "resistance", group = "near", quantity = "resistance"},
  {name = "power", group = "lower", quantity = "power"},
]
[[material]]"""


@pytest.fixture(autouse=True)
def _files(_somewhere_else):
    Path("wire.toml").write_text(SCENE, encoding="utf-8")
    Path("wire.msh").write_bytes(WIRE.read_bytes())


def test_wire(capsys):
    """Cells of second order hold a circle's area to a part in a thousand on this mesh, straight cells to a tenth."""
    Path("wire.toml").write_text(SCENE.replace("]\n[[material]]", READOUTS), encoding="utf-8")
    # At this accuracy the mesh of the file is not refined.
    assert main(["solve", "wire.toml", "--no-figures", "--fields", "--explain", "--accuracy", "0.1"]) == 0
    text = capsys.readouterr().out
    assert max(map(len, text.splitlines())) <= 80
    assert "120 tetra10 cells of wire.msh" in text
    found = summary("results/wire-accuracy0.1-fields")
    area, length = math.pi * 25e-12, 20e-6
    joule = (1e-2 / length) ** 2 / 1e-5  # W/m3
    steady = {name: v["value"] for name, v in found["fem3d"]["steady"].items()}
    assert steady["current"] == pytest.approx(1e-2 / 1e-5 * area / length, rel=2e-3)
    assert steady["out"] == pytest.approx(-(joule * length + 1e12 * length / 2) * area, rel=2e-3)
    assert steady["resistance"] == pytest.approx(1e-2 / steady["current"], rel=1e-9)
    assert steady["power"] == pytest.approx(1e-2 * steady["current"] / 2, rel=1e-3)
    # Half of the Joule heat passes the joint, from the upper half to the lower one.
    assert abs(steady["through"]) == pytest.approx(joule * length / 2 * area, rel=2e-2)
    rise = (joule * length**2 / 2 + 1e12 * (length / 2) ** 2 / 2) / 100
    assert steady["end"] - 293 == pytest.approx(rise, rel=1e-2)
    written = meshio.read("results/wire-accuracy0.1-fields/fem3d_steady.vtu")
    assert {block.type for block in written.cells} == {"tetra10"}
    assert (
        np.abs(np.sort(written.points, axis=0) - np.sort(meshio.read("wire.msh").points, axis=0) * 1e-6).max() < 1e-15
    )
    far = written.points[:, 2] > 20e-6 * (1 - 1e-9)
    assert written.point_data["temperature_K"][far].mean() == pytest.approx(steady["end"], abs=1e-3)
    assert np.abs(written.point_data["potential_V"][far]).max() < 1e-15
    # The current is even and along z, but for a surface that is the circle's to a part in a thousand; the lower half is
    # heated from outside as well.
    (density,) = written.cell_data["current_density_A_per_m2"]
    assert np.abs(density - [0, 0, 5e7]).max() < 1e-3 * 5e7
    (source,) = written.cell_data["heat_source_W_per_m3"]
    lower = written.points[written.cells[0].data].mean(axis=1)[:, 2] < 10e-6
    assert source == pytest.approx(joule + 1e12 * lower, rel=2e-3)
    assert written.field_data == {"material_metal": np.array([0])}
