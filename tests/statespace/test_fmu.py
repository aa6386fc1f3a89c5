"""The FMU, run by fmpy, and the files beside it."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from statespace import export
from statespace.runtime import CompactModel
from tests.statespace.test_runtime import document

needs_fmu = pytest.mark.skipif(
    not export.fmu_available() or importlib.util.find_spec("fmpy") is None,
    reason="pythonfmu and fmpy are not installed (pip install '.[fmu]')",
)


def run(made: dict[str, Any], folder: Path, drive: dict[str, Any]) -> Any:
    import fmpy

    export.write(made, folder)
    signals = np.array([(0.0, 1.5, 0.0), (0.5, 1.5, 0.0), (0.5, -1.0, 0.0), (1.0, -1.0, 0.0)],
                       dtype=[("time", float), ("V", float), ("T", float)])  # fmt: skip
    return fmpy.simulate_fmu(str(folder / "model.fmu"), stop_time=1.0, output_interval=0.1, input=signals, **drive)


@needs_fmu
def test_over_time(tmp_path):
    """A jump at a communication point; each file of a folder in its own."""
    made = document()
    expected = CompactModel(made).simulate([0.5, 1.0], {"V": ([0.5, 0.5], [1.5, -1.0]), "T": 0.0})["t"]
    found = run(made, tmp_path / "a", {"output": ["t"]})
    # Steps of a millionth each, and the sum of ten.
    assert found["t"][-1] == pytest.approx(expected[-1], abs=1e-4 * np.abs(expected).max())
    made["matrices"]["F"]["values"][3] *= 1.01
    again = run(made, tmp_path / "b", {"output": ["t"]})
    assert again["t"][-1] != pytest.approx(expected[-1], abs=1e-4 * np.abs(expected).max())


@needs_fmu
def test_a_steady_state(tmp_path):
    made = document(steady=True)
    found = run(made, tmp_path, {"output": ["y"]})
    assert found["y"][-1] == pytest.approx(CompactModel(made).steady({"V": -1.0, "T": 0.0})["y"], rel=1e-9)


def test_without_pythonfmu_the_rest_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(export, "fmu_available", lambda: False)
    export.write(document(), tmp_path)
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["model.cir", "model.json", "model.py"]


@needs_fmu
def test_every_variable_has_a_unit_of_si(tmp_path):
    import fmpy

    export.write(document(), tmp_path)
    found = fmpy.read_model_description(str(tmp_path / "model.fmu"), validate=True)
    assert {v.name: v.unit for v in found.modelVariables} == {"V": "V", "T": "K", "y": "W", "t": "K"}
    powers = {unit.name: unit.baseUnit for unit in found.unitDefinitions}
    assert powers["K"].K == 1
    assert (powers["W"].kg, powers["W"].m, powers["W"].s) == (1, 2, -3)
