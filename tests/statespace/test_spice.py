"""The SPICE subcircuit in ngspice, against the compact model in Python."""

import subprocess
from pathlib import Path
from typing import Any

import pytest

from statespace.document import names
from statespace.export import as_spice
from statespace.runtime import CompactModel
from tests.statespace.test_runtime import document

pytestmark = pytest.mark.needs("ngspice")


def run(
    folder: Path, made: dict[str, Any], sources: list[str], analysis: str = "op", text: str = ""
) -> dict[str, float]:
    """Return the last voltage at each output's node."""
    (folder / "model.cir").write_text(text or as_spice(made), encoding="utf-8")
    nodes = [entry["spice"] for entry in names(made)]
    reads = [node for node in nodes if node.startswith("out_")]
    index = "" if analysis == "op" else f"[length(v({reads[0]}))-1]"
    lines = [
        "* test", ".include model.cir", *sources, f"X1 {' '.join(nodes)} compact_model",
        ".options reltol=1e-7 vntol=1e-12 abstol=1e-15 method=gear", ".control", "set numdgt=14", analysis,
        *(f"let last = v({node}){index}\nprint last" for node in reads), "quit", ".endc", ".end",
    ]  # fmt: skip
    (folder / "run.cir").write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = subprocess.run(["ngspice", "-b", "run.cir"], cwd=folder, capture_output=True, encoding="utf-8", timeout=60)
    values = [float(line.split("=")[1]) for line in done.stdout.splitlines() if line.startswith("last = ")]
    assert len(values) == len(reads), done.stdout + done.stderr
    return dict(zip((node.lower() for node in reads), values, strict=True))


def test_steady_extreme_of_two_current_fields(tmp_path):
    made = document(steady=True)
    expected = CompactModel(made).steady({"V": 1.2, "T": 2.6})
    sources = ["V1 V 0 1.2", "V2 T 0 0.6"]
    found = run(tmp_path, made, sources)
    assert found["out_y"] == pytest.approx(expected["y"], rel=1e-8)
    assert found["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
    wrong = run(tmp_path, made, sources, text=as_spice(made).replace("Rb2 b2 0 1", "Rb2 b2 0 1.01"))
    assert wrong["out_t"] != pytest.approx(expected["t"] - 2.0, rel=1e-8)


def test_ramp_over_time(tmp_path):
    """All states start at zero (uic); the first output follows the rate of an input, too."""
    made = document()
    model = CompactModel(made)
    given = {"V": 1.0, "T": ([0.0, 2.0], [2.0, 4.0])}
    expected = model.simulate([1.0], given)
    found = run(tmp_path, made, ["V1 V 0 1", "V2 T 0 PWL(0 0 2 2)"], "tran 5m 1 0 5m uic")
    model.W[:] = 0
    still = model.simulate([1.0], given)
    assert found["out_t"] == pytest.approx(expected["t"][0] - 2.0, rel=1e-3)
    assert found["out_t"] != pytest.approx(still["t"][0] - 2.0, rel=1e-3)


def test_heat_into_pin(tmp_path):
    """Watts into the pin of a heat source are its density times its volume."""
    made = document(steady=True)
    made["inputs"][1] |= {"kind": "heat_source", "unit": "W/m3", "port": {"row": 1, "unit": "K", "size": 4.0}}
    expected = CompactModel(made).steady({"V": 1.2, "T": 0.6})
    found = run(tmp_path, made, ["V1 V 0 1.2", "Iheat 0 T 2.4"])
    assert found["out_t"] == pytest.approx(expected["t"] - 2.0, rel=1e-8)
