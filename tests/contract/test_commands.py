"""Exit statuses, numbers and summary keys of the command lines in ``commands.json``, and of the Python interface.

``python -m tests.contract.test_commands`` records the file anew: run it only where a change of the contract is meant.
"""

import io
import json
import os
import shlex
import shutil
import tempfile
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

import compare
from scenes import free
from scenes.keys import DEVICE, SINK
from scenes.loading import as_dict, from_dict
from validate.cli import main

RECORD = Path(__file__).with_name("commands.json")
RECORDED: dict[str, dict[str, Any]] = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
TYPES = {"sink": SINK, "device": DEVICE}
MODEL = "def bridge(scene, times):\n    return {'middle': 310.0, 'current': 0.01}\n"


def prepare(folder: Path) -> None:
    """Write the files that the command lines name."""
    (folder / "model.csv").write_text("probe,value\nmiddle,320\n")
    (folder / "data.csv").write_text("probe,value\nmiddle,305 K\nbeam mean,300 K\n")
    (folder / "peak.csv").write_text("time_s,peak_K\n1e-3,310\n2e-3,312\n4e-3,313\n")
    (folder / "lumped.py").write_text(MODEL)
    shutil.copy(Path(__file__).parents[2] / "examples" / "lumped.py", folder / "plate.py")


def run(command: str) -> tuple[int, str, str, dict[str, Any]]:
    """Exit status, standard output and error, and summary.json (empty without one) of a command line."""
    shutil.rmtree("results", ignore_errors=True)
    out, error = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(error):
        status = main(shlex.split(command))
    found = next((f for name in ("summary.json", "sweep.json") for f in Path().glob(f"results/*/{name}")), None)
    return (
        status,
        out.getvalue(),
        error.getvalue(),
        {} if found is None else json.loads(found.read_text(encoding="utf-8")),
    )


def numbers(summary: dict[str, Any]) -> dict[str, list[Any]]:
    """Steady values with their errors, and differences with theirs and the verdicts, by a short name."""
    found: dict[str, list[Any]] = {}
    for model in ("fem3d", "reduced1d"):
        for name, entry in ((summary.get(model) or {}).get("steady") or {}).items():
            if isinstance(entry, dict):
                found[f"{model} {name}"] = [entry.get("value"), entry.get("error", 0.0), ""]
    for check in summary.get("checks") or ():
        found[f"check {check['id']}"] = [check["difference"], check["u_num"], check["verdict"]]
    return found


def keys(value: Any, path: str = "") -> set[str]:
    """Paths of all keys of a document; the items of a list are one."""
    if isinstance(value, dict):
        return {path}.union(*(keys(item, f"{path}/{key}") for key, item in value.items()))
    if isinstance(value, list):
        return {path}.union(*(keys(item, f"{path}[]") for item in value))
    return {path}


def schema(summary: dict[str, Any]) -> list[str]:
    """The key paths that programs may rely on: all but the scene, the times of stages and versions."""
    loose = ("/scene/", "/timing_s/", "/provenance/", "/fem3d/mesh", "/reduced1d/details")
    return sorted(path for path in keys(summary) if not path.startswith(loose))


@pytest.fixture(scope="module", autouse=True)
def _folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contract")
    prepare(folder)
    with chdir(folder):
        yield


@pytest.mark.parametrize("command", RECORDED)
def test_command_line_keeps_its_contract(command):
    """Numbers stay within the sum of the recorded and the new error; a verdict changes only through "unresolved"."""
    expected = RECORDED[command]
    status, out, error, summary = run(command)
    assert status == expected["status"], error
    if status >= 2:
        assert error.startswith("validate: ")
        assert error.count("\n") == 1
    if "--dry-run" in command:
        assert out.startswith("Plan\n")
        assert not Path("results").exists()
    found = numbers(summary)
    assert found.keys() == expected["numbers"].keys()
    for name, (value, bound, verdict) in expected["numbers"].items():
        new, error_now, verdict_now = found[name]
        if value is None or new is None:
            assert value == new, name
            continue
        # An imbalance so small is rounding, whatever was recorded.
        least = 2e-11 if name == "check energy" else 1e-12
        assert abs(new - value) <= (bound or 0.0) + (error_now or 0.0) + 1e-6 * abs(value) + least, name
        assert verdict_now == verdict or "unresolved" in (verdict, verdict_now), name
    if "schema" in expected:
        assert schema(summary) == expected["schema"]
    if "scene" in summary:
        assert summary["command"] == f"validate {command}"
        (folder,) = Path("results").iterdir()
        assert set(summary["files"]) == {entry.name for entry in folder.iterdir()}
        kind = command.split()[0]
        again = free.from_dict(summary["scene"]) if kind == "solve" else from_dict(summary["scene"], TYPES[kind])
        assert (free.as_dict if kind == "solve" else as_dict)(again) == summary["scene"]


def test_python_interface_keeps_its_shape():
    sink = compare.run("sink", accuracy=1e-2, steady=True)
    assert sink.fem3d.steady["peak_rise_K"].value == pytest.approx(20.33, rel=2e-2)
    assert sink.reduced1d.steady["peak_rise_K"].value == pytest.approx(19.00, rel=1e-3)
    assert sink.check("eq13").verdict == "agrees"
    bridge = compare.solve("bridge", accuracy=1e-2, model=lambda scene, times: {"middle": 310.0})
    assert set(bridge.checks) == {"middle"}
    assert bridge["middle"].error > 0
    device = compare.device(accuracy=1e-2, about=("figure9",))
    assert device.check("fig9_balance").verdict == "agrees"
    assert list(device.traces)[:2] == ["time_s", "reduced1d_sink_K"]


def record() -> None:
    """Write the record of every command line that it has, with the schemas that it has."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        prepare(Path())
        for command, entry in RECORDED.items():
            status, _, error, summary = run(command)
            entry |= {"status": status, "numbers": numbers(summary)}
            entry |= {"schema": schema(summary)} if "schema" in entry else {}
            print(status, command, error.strip()[:100])
    lines = ",\n".join(f"{json.dumps(command)}: {json.dumps(entry)}" for command, entry in RECORDED.items())
    RECORD.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")


if __name__ == "__main__":
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    record()
