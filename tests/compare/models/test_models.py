"""A model of one's own is judged alike whatever it is: a function, a netlist, an FMU, a table."""

import sys
from typing import Any

import numpy as np
import pytest

import compare
from compare.models.model import make_question
from scenes import load
from scenes.errors import SceneError
from validate.cli import main


def rises(times: np.ndarray | None) -> dict[str, Any]:
    rise = 100.0 if times is None else 100 * (1 - np.exp(-times / 1.6e-4))
    return {"tip": 300 + rise, "heat out": -2e-5 * rise}


def judged(scene: Any, given: Any) -> dict[str, Any]:
    return compare.solve(scene, model=given).checks


def test_values_of_3d_agree_and_three_percent_off_differ_at_two(steady):
    own = compare.solve(steady)
    exact = {name: estimate.value for name, estimate in own.steady.items()}

    def off(_: Any, times: Any, part: float = 0.03) -> dict[str, float]:
        return {
            n: (300 + (v - 300) * (1 + part)) if n in ("tip", "bar mean") else v * (1 + part) for n, v in exact.items()
        }

    assert {c.verdict for c in judged(steady, lambda _, times: exact).values()} == {"agrees"}
    for tolerance, verdict in ((0.02, "differs"), (0.03, "unresolved"), (0.04, "agrees")):
        scene = load(steady, [f"checks.tolerances.{name}={tolerance}" for name in exact])
        checks = judged(scene, off)
        assert {c.verdict for c in checks.values()} == {verdict}
        assert all(c.difference == pytest.approx(0.03, abs=1e-12) for c in checks.values())


@pytest.mark.long
def test_a_trace_of_3d_agrees_and_a_late_one_is_told_so(transient):
    course = compare.solve(transient).traces

    def later(_: Any, times: np.ndarray | None, shift: float = 4e-5) -> dict[str, Any]:
        return {} if times is None else {"tip": np.interp(times - shift, course["time_s"], course["tip"])}

    same = judged(transient, lambda _, times: later(_, times, 0.0))["tip_over_time"]
    assert same.verdict == "agrees"
    assert abs(same.difference) < 1e-12
    found = compare.solve(transient, model=later)
    assert found.check("tip_over_time").verdict == "differs"
    assert "it is 40 us late; shifted by that it is within" in found.answer


def test_a_kink_between_two_rows_of_3d_is_within_the_error(transient):
    """A model like 3D at all of its rows, and 10 K above it at one time between two of them."""
    course = compare.solve(transient).traces
    before, after = course["time_s"][40:42]
    top, half = before + 9 / 16 * (after - before), 7 / 16 * (after - before)

    def kinked(_: Any, times: np.ndarray | None) -> dict[str, Any]:
        if times is None:
            return {}
        same = np.interp(times, course["time_s"], course["tip"])
        return {"tip": same + 10 * np.maximum(1 - np.abs(times - top) / half, 0)}

    check, largest = judged(transient, kinked)["tip_over_time"], 10 / (course["tip"].max() - 300)
    assert abs(check.difference - largest) <= check.u_num < 0.2 * largest


def test_the_command_writes_both_models_beside_each_other(transient, model, tmp_path, ran):
    found, said = ran(f"solve {transient} --model {model}:bar")
    assert said.startswith("lumped.py:bar is ")
    assert 'has no value of "bar mean"' in said.replace("\n  ", " ")
    assert found["reduced1d"]["model"] == "lumped.py:bar"
    assert found["reduced1d"]["steady"]["tip"] == {"value": 400.0, "error": 0.0}
    rows = np.genfromtxt(tmp_path / "run" / "traces.csv", delimiter=",", names=True, deletechars="")
    assert rows.dtype.names[:3] == ("time_s", "tip", "reduced1d_tip")
    assert np.allclose(rows["reduced1d_tip"], 400 - 100 * np.exp(-rows["time_s"] / 1.6e-4), rtol=1e-12)
    check = next(c for c in found["checks"] if c["id"] == "tip_over_time")
    off = (rows["reduced1d_tip"] - rows["tip"]) / (rows["tip"].max() - 300)
    assert check["difference"] == pytest.approx(off[np.abs(off).argmax()], rel=1e-9)


@pytest.mark.parametrize("outputs", [[], ['model.outputs={tip = "tip rise"}']])
def test_rises_in_a_table_count_from_the_initial_temperature(outputs, steady, transient, tmp_path):
    (tmp_path / "steady.csv").write_text("tip rise (K)\n90\n" if outputs else "tip rise, 90 K\n", encoding="utf-8")
    times = np.linspace(0, 5e-4, 400)
    rows = "".join(f"{t:.9g},{rise:.9g}\n" for t, rise in zip(times, rises(times)["tip"] - 300, strict=True))
    (tmp_path / "traces.csv").write_text(f"time (s),tip rise (K)\n{rows}", encoding="utf-8")
    assert judged(load(steady, outputs), str(tmp_path / "steady.csv"))["tip"].predicted == pytest.approx(90)
    found = compare.solve(load(transient, outputs), model=str(tmp_path / "traces.csv")).traces
    assert found["reduced1d tip"] == pytest.approx(rises(found["time_s"])["tip"], abs=0.01)
    # Before the first row its value holds, which is an error.
    (tmp_path / "late.csv").write_text("time (s),tip rise (K)\n" + "\n".join(rows.split()[20:]), encoding="utf-8")
    checks = compare.solve(load(transient, outputs), model=str(tmp_path / "late.csv")).checks
    assert checks["tip_over_time"].verdict == "unresolved"


@pytest.mark.parametrize(
    ("scene", "text", "lowest"),
    [("steady", "tip,100 K\n", "100.0 K"), ("transient", "time (s),tip (K)\n0,0\n2e-4,71\n5e-4,96\n", "0 K")],
)
def test_a_rise_in_place_of_a_temperature_is_a_warning(scene, text, lowest, tmp_path, request):
    (tmp_path / "rise.csv").write_text(text, encoding="utf-8")
    said = compare.solve(request.getfixturevalue(scene), model=tmp_path / "rise.csv").outcome.warnings
    assert f'rise.csv has {lowest} for "tip", and absolute kelvins are compared: add the' in " ".join(said)


def test_probes_whose_names_differ_by_a_sign_are_told_apart(steady, tmp_path):
    scene = steady.read_text(encoding="utf-8").replace('"tip"', '"bar-1"').replace('"bar mean"', '"bar+1"')
    steady.write_text(scene, encoding="utf-8")
    (tmp_path / "both.csv").write_text("bar-1, 400 K\nbar+1, 366 K\n", encoding="utf-8")
    checks = judged(load(steady), str(tmp_path / "both.csv"))
    assert (checks["bar-1"].predicted, checks["bar+1"].predicted) == (100, 66)


def test_a_declared_difference_is_no_surprise(steady, model, tmp_path):
    out = ["--out", str(tmp_path / "o"), "--no-figures", "--quiet"]
    asked = ["solve", str(steady), "--model", f"{model}:bar", *out]
    off = ["--set", "box.bar.heat_source=2e12", "--set", "material.film.thermal_conductivity=60"]
    assert main([*asked, "--strict"]) == 0
    assert main([*asked, *off]) == 0
    assert main([*asked, *off, "--strict"]) == 1
    assert main([*asked, *off, "--strict", "--set", 'checks.expect_differs=["tip"]']) == 0
    assert main([*asked, "--set", 'checks.expect_differs=["tip"]']) == 1


def test_a_row_without_a_number_is_named(transient, tmp_path):
    (tmp_path / "gap.csv").write_text("time (ms);tip (degC)\n0;20\n0.1;\n0.2;40\n0.5;80\n", encoding="utf-8")
    with pytest.raises(SceneError, match=r'"tip" at 100\.0 us is not a finite number'):
        compare.solve(transient, model=str(tmp_path / "gap.csv"))


def test_a_function_imports_what_lies_beside_it(steady, tmp_path):
    """At the top of its file, and when it is called."""
    (tmp_path / "top_of_it.py").write_text("VALUE = 300.0\n", encoding="utf-8")
    (tmp_path / "within_it.py").write_text("VALUE = 100.0\n", encoding="utf-8")
    (tmp_path / "own.py").write_text(
        "from top_of_it import VALUE\n\n\ndef bar(scene, times):\n    import within_it\n\n"
        "    return {'tip': VALUE + within_it.VALUE}\n",
        encoding="utf-8",
    )
    before = sys.path.copy()
    assert judged(steady, f"{tmp_path / 'own.py'}:bar")["tip"].predicted == pytest.approx(100)
    assert sys.path == before


def test_a_scene_runs_no_program_by_itself(steady, model, tmp_path, capfd):
    with steady.open("a", encoding="utf-8") as file:
        file.write('\n[model]\nfile = "lumped.py:bar"\n')
    out = ["--out", str(tmp_path / "o"), "--no-figures"]
    assert main(["solve", str(steady), *out]) == 0
    said = capfd.readouterr()
    assert "asked" not in said.err
    assert "--model scene" in said.out
    assert main(["solve", str(steady), "--model", "scene", *out]) == 0
    assert "asked" in capfd.readouterr().err


@pytest.mark.parametrize(
    "line",
    [
        ".control\nshell touch escaped\n.endc", ".include other.cir", "Vx a 0 `touch escaped`",
        "A1 [a] [b] clk p\n.model p d_process(process_file=/bin/true)", ".options rawfile=escaped",
        '.model s other (input_file="escaped")',
    ],
)  # fmt: skip
def test_a_netlist_is_a_circuit_and_nothing_else(steady, tmp_path, line):
    for text in (f"title\nR1 tip 0 1\n{line}\n.end\n", f"title\nR1 tip 0 1\n.end\n{line}\n"):
        (tmp_path / "bad.cir").write_text(text, encoding="utf-8")
        with pytest.raises(SceneError, match="runs commands, starts programs or reads files"):
            judged(steady, str(tmp_path / "bad.cir"))
    assert not (tmp_path / "escaped").exists()


@pytest.mark.needs("ngspice")
@pytest.mark.parametrize("own", ["i(V1)", "-I(v1)", "v1#branch"])
def test_the_current_of_a_source_has_the_sign_of_the_drive(own, tmp_path):
    """SPICE counts it as negative where the source delivers."""
    (tmp_path / "bridge.cir").write_text("title\nV1 a 0 1\nR1 a 0 210\n.end\n", encoding="utf-8")
    outputs = {"model.outputs": f'{{current = "{own}"}}'}
    run = compare.solve("bridge", steady=True, model=tmp_path / "bridge.cir", overrides=outputs)
    assert run.check("current").predicted == pytest.approx(1 / 210, rel=1e-6)


@pytest.mark.needs("ngspice")
def test_an_output_is_a_node_a_parameter_or_an_expression(steady, tmp_path):
    (tmp_path / "bar.cir").write_text("title\n.param T=350\nV1 hot 0 {T}\nR1 hot 0 1\n.end\n", encoding="utf-8")
    for own in ("Hot", "V(hot)", "T", "v(hot) + 0"):
        scene = load(steady, [f'model.outputs={{tip = "{own}"}}'])
        assert judged(scene, str(tmp_path / "bar.cir"))["tip"].predicted == pytest.approx(50, rel=1e-6)
    for own, node in (("cold", "v.cold."), ("i(V2)", "i.v2.")):
        with pytest.raises(SceneError, match=f'for "tip" it has no node "{node}": give "v.hot."'):
            judged(load(steady, [f'model.outputs={{tip = "{own}"}}']), str(tmp_path / "bar.cir"))


@pytest.mark.needs("ngspice")
def test_a_command_broken_over_two_lines_is_not_run(steady, tmp_path):
    (tmp_path / "bad.cir").write_text("title\nR1 tip 0 1\n.cont\n+rol\n.end\n", encoding="utf-8")
    with pytest.raises(SceneError, match="ngspice has no"):
        judged(steady, str(tmp_path / "bad.cir"))


@pytest.mark.needs("ngspice")
def test_comments_and_titles_that_are_commands_do_nothing(steady, tmp_path):
    """ngspice runs text after *# , and takes a file that begins with *ng_script for commands."""
    escaped = tmp_path / "escaped"
    text = f"*ng_script\n*#shell touch {escaped}\nV1 tip 0 dc 350 sin(1 1 1k)\n.op\n.end\n"
    (tmp_path / "lump.cir").write_text(text, encoding="utf-8")
    assert judged(steady, str(tmp_path / "lump.cir"))["tip"].predicted == pytest.approx(50, rel=1e-6)
    assert not escaped.exists()
    (tmp_path / "lump.cir").write_text("title\nV1 tip 0 pulse(0 350 0 1n)\n.end\n", encoding="utf-8")
    with pytest.raises(SceneError, match='"V1" varies in time: give "dc VALUE"'):
        judged(steady, str(tmp_path / "lump.cir"))


def test_a_models_parameters_are_made_of_the_scenes():
    given = ["model.parameters.half=w/2", "model.parameters.end=box.beam.upper.y", "model.parameters.R=300 ohm"]
    assert make_question(load("bridge", [*given, "parameters.w=12um"])).parameters == {
        "half": 6e-6, "end": 200e-6, "R": 300.0,
    }  # fmt: skip
    mixed = ["model.parameters.arm=box.beam.upper.y/2 + w", "model.parameters.V=2*boundary.left electrode.voltage"]
    parameters = make_question(load("bridge", [*mixed, "parameters.w=12um"])).parameters
    assert (parameters["arm"], parameters["V"]) == (pytest.approx(112e-6), 2.0)
    with pytest.raises(SceneError, match="neither a quantity"):
        make_question(load("bridge", ["model.parameters.odd=w + boundary.substrate.temperature"]))
    assert make_question(load("bridge")).document["parameters"]["gap"] == 2e-6
