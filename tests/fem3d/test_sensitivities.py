"""Sensitivities against closed forms, and against differences of solutions on meshes of their own."""

import math
import tomllib
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fem3d.runs import scene as scene_run
from fem3d.runs import sink as sink_run
from fem3d.runs.differences import Sensitivities
from fem3d.runs.sensitivities import need_whole, of_scene, of_sink
from scenes.faces import SIGMA
from scenes.free import from_dict
from scenes.loading import load_free
from scenes.result import Estimate
from scenes.sink import Sink
from scenes.varied import numbers, varied
from tests.meshes.grouped import boxes
from tests.validate.solve.test_mesh_cli import SCENE as WIRE

FILES = Path(__file__).parents[1] / "meshes" / "grouped" / "files"
LENGTH, SIDE = 1e-4, 1e-5


def bar(**changes: Any) -> Any:
    """A bar along y, both ends held at the start's temperature and at two voltages."""
    ends = {"near": ([0, 0, 0], [SIDE, 0, SIDE]), "far": ([0, LENGTH, 0], [SIDE, LENGTH, SIDE])}
    document: dict[str, Any] = {
        "scene": {"initial_temperature": 300.0},
        "run": {"steady": True, "accuracy": 1e-3},
        "material": [{"name": "m", "thermal_conductivity": 100.0, "resistivity": 1e-5, "density": 2000.0,
                      "specific_heat": 700.0}],
        "box": [{"name": "bar", "material": "m", "lower": [0, 0, 0], "upper": [SIDE, LENGTH, SIDE]}],
        "boundary": [
            {"name": f"{kind} {name}", "lower": low, "upper": high, kind: value}
            for (name, (low, high)), volts in zip(ends.items(), (0.1, 0.0), strict=True)
            for kind, value in (("temperature", 300.0), ("voltage", volts))
        ],
        "probe": [
            {"name": "peak", "at": [SIDE / 2, LENGTH / 2, SIDE / 2]},
            {"name": "mean", "lower": [0, 0, 0], "upper": [SIDE, LENGTH, SIDE]},
            {"name": "current", "quantity": "current", "lower": ends["near"][0], "upper": ends["near"][1]},
        ],
    }  # fmt: skip
    return from_dict(document | changes)


def solved(scene: Any, *keys: str) -> Sensitivities:
    return of_scene(scene, scene_run.solve(scene, None, True), keys or None)


def test_exponents_of_a_heated_bar():
    """The peak is V^2 / (8 k rho), whatever the sizes; the current V A / (rho L)."""
    slopes = solved(bar())
    expected = {
        "material.m.thermal_conductivity": (-1, 0),
        "material.m.resistivity": (-1, -1),
        "boundary.voltage near.voltage": (2, 1),
        "box.bar.upper.y": (0, -1),
        "box.bar.upper.x": (0, 1),
        "box.bar.lower.z": (0, -1),
    }
    for key, (rise, current) in expected.items():
        by_name = slopes.steady[key]
        for name, exponent in (("peak", rise), ("mean", rise), ("current", current)):
            assert by_name[name].value == pytest.approx(exponent, abs=1e-5), (key, name)
            assert abs(by_name[name].value - exponent) <= by_name[name].error < 1e-2
    still = slopes.steady["material.m.thermal_conductivity"]["current"]
    assert still.value == 0.0
    assert still.error == 0.0
    assert set(slopes.steady) == set(numbers(bar()))
    assert not slopes.left_out


@pytest.mark.parametrize("run", [{"steady": True}, {"end_time": 1e-3}])
def test_slopes_of_a_symmetric_part(run):
    """Numbers that keep all mirror planes have the slopes of the whole on an eighth."""
    scene = bar(run={"accuracy": 1e-3, **run})
    keys = ("material.m.thermal_conductivity", "boundary.voltage near.voltage", "box.bar.upper.y")
    assert not need_whole(scene, keys)
    assert need_whole(scene, ["boundary.temperature near.temperature"])
    eighth = scene_run.solve(scene)
    assert eighth.details["symmetry"] == "the eighth"
    part, whole = of_scene(scene, eighth, keys), solved(scene, *keys)
    for key in keys:
        for name, slope in part.steady[key].items():
            same = whole.steady[key][name]
            assert slope.value == pytest.approx(same.value, abs=slope.error + same.error), (key, name)
            assert slope.error < 2e-2


@pytest.mark.long
def test_a_large_scene_is_solved_again_to_a_percent(monkeypatch):
    scene = load_free("bridge")
    result = scene_run.solve(scene)
    fine = of_scene(scene, result)
    monkeypatch.setattr("fem3d.runs.sensitivities.LARGE", 0)
    coarse = of_scene(scene, result)
    assert fine.steady.keys() == coarse.steady.keys()
    for key, by_name in coarse.steady.items():
        for name, slope in by_name.items():
            better = fine.steady[key][name]
            assert abs(slope.value - better.value) <= slope.error + better.error, (key, name)
    errors = [max(e.error for by_name in each.steady.values() for e in by_name.values()) for each in (fine, coarse)]
    assert 2 * errors[0] < errors[1] < 1e-2


@pytest.mark.long
def test_slopes_on_a_coarse_mesh_are_within_their_errors():
    """The slope by the height missed 2.9 errors, as the error itself follows the height of the cells."""
    scene = load_free("plate")
    coarse, fine = (
        of_scene(each, scene_run.solve(each), ["parameters.h", "parameters.w"]).steady
        for each in (replace(scene, accuracy=1e-2), replace(scene, accuracy=1e-4))
    )
    for key, by_name in fine.items():
        for name, slope in by_name.items():
            assert abs(slope.value - coarse[key][name].value) <= coarse[key][name].error + slope.error, (key, name)


def test_a_wire_that_radiates_alone():
    """All heat leaves by radiation: eps sigma A (T^4 - T_a^4) = P, so that d T / d ln eps = -(T^4 - T_a^4) / (4 T^3),
    and by the power of a source the same with the other sign."""
    side, ambient, source = 1e-3, 300.0, 1e8
    scene = from_dict({
        "scene": {"initial_temperature": ambient},
        "run": {"steady": True, "accuracy": 1e-3},
        "material": [{"name": "m", "thermal_conductivity": 1e6}],
        "box": [{"name": "b", "material": "m", "lower": [0, 0, 0], "upper": [side] * 3, "heat_source": source}],
        "boundary": [{"name": "r", "lower": [0, 0, side], "upper": [side] * 3,
                      "radiation": {"emissivity": 0.5, "ambient": ambient}}],
        "probe": [{"name": "t", "at": [0, 0, side]}],
    })  # fmt: skip
    slopes = solved(scene, "boundary.r.radiation.emissivity", "box.b.heat_source")
    fourth = source * side / (0.5 * SIGMA)
    t = (fourth + ambient**4) ** 0.25
    exact = fourth / (4 * t**3)
    for key, sign in (("boundary.r.radiation.emissivity", -1), ("box.b.heat_source", 1)):
        slope = slopes.steady[key]["t"]
        # The conductivity leaves q L / k = 1e-3 of the rise inside.
        assert slope.value * slopes.values["t"].value == pytest.approx(sign * exact, rel=1e-5)
        assert slope.error < 1e-2
    # Held for a film of the coefficient there, the rise would follow the whole of it.
    assert exact < 0.5 * (t - ambient)


def test_a_table_and_a_film_on_a_mesh_file(tmp_path):
    """A bar of tetrahedra between a cold end and a film: the flow through both, theta(T_end) / L = h (T_a - T_end),
    and differentiated by the law as a whole and by the coefficient gives the slopes."""
    document = {
        "scene": {"initial_temperature": 300.0},
        "run": {"steady": True, "accuracy": 1e-2},
        "material": [{"name": "m", "thermal_conductivity": {"temperatures": [300.0, 500.0], "values": [1.0, 2.0]}}],
        "box": [{"name": "bar", "material": "m", "lower": [0, 0, 0], "upper": [1e-4, 2e-5, 2e-5]}],
        "boundary": [
            {"name": "cold", "lower": [0, 0, 0], "upper": [0, 2e-5, 2e-5], "temperature": 300.0},
            {"name": "film", "lower": [1e-4, 0, 0], "upper": [1e-4, 2e-5, 2e-5],
             "convection": {"coefficient": {"value": 1e4, "at": 300.0, "exponent": 1.0}, "ambient": 500.0}},
        ],
        "probe": [{"name": "end", "lower": [1e-4, 0, 0], "upper": [1e-4, 2e-5, 2e-5]}],
    }  # fmt: skip
    whole = from_dict(deepcopy(document))
    boxes.write(boxes.grouped(whole, "tetra", 1), tmp_path / "m.msh", 1e-6)
    slopes = solved(from_dict(boxes.document(document, "m.msh", 1e-6), folder=str(tmp_path)))
    rise = slopes.values["end"].value
    t = 300.0 + rise
    h = 1e4 * t / 300.0
    # G = theta(T) / L - h(T) (T_a - T) = 0, theta = u + u^2 / 400 with u the rise.
    conducted = (rise + rise**2 / 400) / 1e-4
    assert conducted == pytest.approx(h * (500.0 - t), rel=1e-2)
    steep = (1 + rise / 200) / 1e-4 + h - 1e4 / 300.0 * (500.0 - t)
    expected = {
        "material.m.thermal_conductivity": -conducted / steep,
        "boundary.film.convection.coefficient": conducted / steep,
        "boundary.film.convection.coefficient.exponent": conducted / steep * math.log(t / 300.0),
    }
    for key, change in expected.items():
        slope = slopes.steady[key]["end"]
        assert abs(slope.value - change / rise) <= slope.error < 2e-2
        assert abs(change / rise) > 10 * slope.error


PAIR: dict[str, Any] = {
    "scene": {"initial_temperature": 293.0},
    "run": {"steady": True, "accuracy": 1e-3},
    "material": [{"name": "si", "thermal_conductivity": 100.0, "resistivity": 1e-4}],
    "box": [
        {"name": "a", "material": "si", "lower": [0, 0, 0], "upper": [100e-6, 20e-6, 10e-6]},
        {"name": "b", "material": "si", "lower": [100e-6, 0, 0], "upper": [180e-6, 20e-6, 10e-6]},
    ],
    "contact": [{"name": "ab", "between": ["a", "b"], "thermal_resistance": 2e-7, "electrical_resistance": 3e-9}],
    "boundary": [
        {"name": "cold", "lower": [0, 0, 0], "upper": [0, 20e-6, 10e-6], "temperature": 293.0},
        {"name": "in", "lower": [0, 0, 0], "upper": [0, 20e-6, 10e-6], "voltage": 1.0, "series_resistance": 30.0},
        {"name": "out", "lower": [180e-6, 0, 0], "upper": [180e-6, 20e-6, 10e-6], "voltage": 0.0},
        {"name": "sun", "lower": [180e-6, 0, 0], "upper": [180e-6, 20e-6, 10e-6], "heat_flux": 1e8},
    ],
    "probe": [{"name": "side", "box": "b", "lower": [100e-6, 0, 0], "upper": [100e-6, 20e-6, 10e-6]},
              {"name": "current", "quantity": "current", "lower": [0, 0, 0], "upper": [0, 20e-6, 10e-6]}],
}  # fmt: skip


def test_a_contact_and_a_series_resistance():
    """The current is V / (R_s + r / A + rho L / A)."""
    area = 200e-12
    parts = {
        "boundary.in.series_resistance": 30.0,
        "contact.ab.electrical_resistance": 3e-9 / area,
        "material.si.resistivity": 1e-4 * 180e-6 / area,
    }
    slopes = solved(from_dict(deepcopy(PAIR)), *parts, "box.b.lower.x", "contact.ab.thermal_resistance")
    for key, part in parts.items():
        slope = slopes.steady[key]["current"]
        expected = -part / sum(parts.values())
        assert abs(slope.value - expected) <= slope.error
        assert slope.value == pytest.approx(expected, abs=1e-5)
    # The face moves with the boxes, both of the same material.
    moved = slopes.steady["box.b.lower.x"]["current"]
    assert moved.value == pytest.approx(0.0, abs=1e-5)
    assert slopes.steady["contact.ab.thermal_resistance"]["side"].value > 0.05


@pytest.mark.long
@pytest.mark.parametrize("key", ["parameters.h", "material.oxide.thermal_conductivity"])
def test_bridge_against_solutions_on_meshes_of_their_own(key):
    scene, step = load_free("bridge"), 0.02
    slopes = solved(scene, key)
    fine = replace(scene, accuracy=1e-5)
    more, less = (scene_run.solve(varied(fine, key, 1 + s), None, True).steady for s in (step, -step))
    for name, slope in slopes.steady[key].items():
        floor = 293.0 * (name in ("middle", "beam mean"))
        expected = math.log((more[name].value - floor) / (less[name].value - floor)) / (2 * step)
        # The step's square, and twice 1e-5 over the difference of both keys.
        assert slope.value == pytest.approx(expected, abs=slope.error + 1e-3), name


@pytest.mark.long
def test_boxes_that_move_take_tetrahedra_along():
    scene = load_free("bridge", ["run.accuracy=1e-2"])
    keys = ("parameters.w", "parameters.L")
    bricks, tetrahedra = (solved(replace(scene, mesh=mesh), *keys) for mesh in ("bricks", "tetrahedra"))
    assert not tetrahedra.left_out
    for key in keys:
        for name, one in bricks.steady[key].items():
            other = tetrahedra.steady[key][name]
            assert abs(one.value - other.value) <= one.error + other.error, (key, name)
    assert abs(tetrahedra.steady["parameters.L"]["current"].value) > 0.5


def test_a_mesh_file_has_no_coordinates():
    """Materials, conditions and sources have slopes, against solutions of changed scenes."""
    document = tomllib.loads(WIRE) | {"run": {"steady": True, "accuracy": 5e-2}}
    document["material"][0]["temperature_coefficient"] = 1e-3
    scene = from_dict(document, folder=str(FILES))
    assert not any(key.endswith((".x", ".y", ".z")) for key in numbers(scene))
    key, step = "source.source-1.heat_source", 1e-2
    slopes = solved(scene, key)
    more, less = (scene_run.solve(varied(scene, key, 1 + s)).steady for s in (step, -step))
    assert set(slopes.steady[key]) == {p.name for p in scene.probes}
    for name, slope in slopes.steady[key].items():
        expected = (more[name].value - less[name].value) / (2 * step) / slopes.values[name].value
        # The coupled iteration ends at 1e-5.
        assert slope.value == pytest.approx(expected, abs=2e-3), (key, name)


def test_a_mesh_of_a_file_that_is_not_refined_is_not_solved_again(monkeypatch):
    scene = from_dict(tomllib.loads(WIRE) | {"run": {"steady": True, "accuracy": 5e-3}}, folder=str(FILES))
    monkeypatch.setattr("fem3d.adaptivity.cell_mesh.MOST_UNKNOWNS", 1)
    result = scene_run.solve(scene)
    assert result.details["levels"] == 1
    monkeypatch.setattr("fem3d.runs.sensitivities.LARGE", 0)
    monkeypatch.setattr(scene_run, "solve", lambda *_, **__: pytest.fail("it is solved again"))
    assert of_scene(scene, result, ["source.source-1.heat_source"]).steady


def test_zero_has_no_percent():
    document = deepcopy(PAIR)
    document["probe"].append({"name": "floor", "lower": [0, 0, 0], "upper": [0, 20e-6, 10e-6]})
    assert set(solved(from_dict(document), "boundary.in.voltage").left_out) == {'probe "floor"'}


SIZES = ("sink.length", "sink.width", "sink.thickness", "anchor.pad_length", "anchor.pad_width",
         "anchor.oxide_length", "anchor.oxide_width", "anchor.oxide_thickness")  # fmt: skip


def of(sink: Sink, *keys: str, transient: bool = False) -> Sensitivities:
    return of_sink(sink, sink_run.solve(sink, transient=transient), keys or None)


@pytest.mark.long
def test_laws_of_scale():
    """All sizes times one factor change an anchor's resistance by its inverse, and so do all conductivities; the rises
    of a sink without air don't change with its sizes; no steady state has a heat capacity."""
    slopes = of(Sink()).steady
    resistance = {key: by_name["anchor_resistance_K_per_W"].value for key, by_name in slopes.items()}
    assert sum(resistance[key] for key in SIZES) == pytest.approx(-1, abs=1e-5)
    conductivities = [f"materials.{name}.thermal_conductivity" for name in ("silicon", "oxide")]
    assert sum(resistance[key] for key in conductivities) == pytest.approx(-1, abs=1e-5)
    assert sum(slopes[key]["peak_rise_K"].value for key in SIZES) == pytest.approx(0, abs=1e-5)
    assert slopes["materials.silicon.density"]["peak_rise_K"] == Estimate(0.0, 0.0)


@pytest.mark.long
def test_errors_hold():
    """On coarse meshes, with films, a current that crowds and pads in the circuit."""
    sink = Sink(electrodes="pad-edge", convection_coefficient=2e4, voltage=3.0)
    keys = ("sink.width", "anchor.pad_width", "anchor.oxide_length", "anchor.oxide_offset", "drive.voltage",
            "environment.convection_coefficient", "environment.room_temperature")  # fmt: skip
    coarse, fine = (of(replace(sink, accuracy=accuracy), *keys).steady for accuracy in (1e-2, 1e-4))
    for key, by_name in coarse.items():
        for name, slope in by_name.items():
            assert abs(slope.value - fine[key][name].value) <= slope.error, (key, name)
    assert max(slope.error for by_name in coarse.values() for slope in by_name.values()) < 0.05


@pytest.mark.long
def test_sink_over_time_against_runs_of_their_own():
    sink, key, step = Sink(), "anchor.pad_length", 5e-3
    found = of(sink, key, "materials.silicon.density", transient=True)
    runs = [sink_run.solve(varied(sink, key, 1 + s)).over_time for s in (step, -step)]
    for name in ("peak_K", "end_K", "mean_K"):
        at = np.array([1e-4, 1e-3, 1e-2])
        more, less = (np.interp(at, run.time, run.values[name]) - sink.room_temperature for run in runs)
        relative = found.course.values[key][name] / found.course.traces[name]
        slope = np.interp(np.log(at), np.log(found.course.times), relative)
        # Both runs are off alike where their meshes are; straight lines between rows are off by 2.5e-4.
        assert slope == pytest.approx(np.log(more / less) / (2 * step), abs=1e-2), name
        steady = found.steady[key][name.replace("_K", "_rise_K")]
        error = steady.error + found.course.errors[key][name][-1] / found.course.traces[name][-1]
        assert relative[-1] == pytest.approx(steady.value, abs=error)
    # Early on no heat has left: the rise is the energy over the heat capacity.
    early = found.course.values["materials.silicon.density"]["peak_K"][0] / found.course.traces["peak_K"][0]
    assert early == pytest.approx(-1, abs=1e-2)


def test_faces_that_would_part_are_named():
    """A beam as wide as its pads: a wider one and a narrower one have other cells."""
    found = of(Sink(width=150e-6, accuracy=1e-2), "sink.width", "anchor.pad_width", "anchor.pad_length")
    assert set(found.left_out) == {"sink.width", "anchor.pad_width"}
    assert "move apart" in found.left_out["sink.width"]
    assert "anchor.pad_length" in found.steady
