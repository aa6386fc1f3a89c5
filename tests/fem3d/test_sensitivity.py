"""Derivatives by dual solutions, against differences of solutions on a mesh that moves, and of whole runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fem3d.adaptivity import nested
from fem3d.results import outputs
from fem3d.runs import sink as sink_run
from fem3d.runs import sink_quantities, sink_sensitivity
from fem3d.runs.sink_sensitivity import Slopes
from fem3d.sensitivity import steady as steady_slopes
from fem3d.sensitivity.motion import STEP, Motion
from fem3d.sensitivity.steady import Tangent
from fem3d.spaces.domain import boxes
from meshes import symmetry
from scenes.errors import SceneError
from scenes.result import Result
from scenes.sink import Sink
from scenes.varied import numbers, varied

# Everything that a derivative has a part for: films, pads in the circuit, current that crowds as it heats.
HOT = Sink(electrodes="pad-edge", convection_coefficient=2e4, voltage=3.0, accuracy=1e-2)
KEYS = (
    "sink.width", "sink.thickness", "anchor.pad_width", "anchor.oxide_length", "anchor.oxide_offset",
    "materials.silicon.resistivity",
    "materials.silicon.temperature_coefficient", "materials.oxide.thermal_conductivity", "drive.voltage",
    "environment.room_temperature", "environment.convection_coefficient",
)  # fmt: skip
SIZES = ("sink.length", "sink.width", "sink.thickness", "anchor.pad_length", "anchor.pad_width",
         "anchor.oxide_length", "anchor.oxide_width", "anchor.oxide_thickness")  # fmt: skip
DIFFERENCE = 1e-3


_KEPT: dict[tuple[str, str, bool], Any] = {}


def solved(sink: Sink, transient: bool = False) -> Result:
    key = "solved", repr(sink), transient
    if key not in _KEPT:
        _KEPT[key] = sink_run.solve(sink, transient=transient)
    found: Result = _KEPT[key]
    return found


def slopes(sink: Sink, transient: bool = False) -> Slopes:
    key = "slopes", repr(sink), transient
    if key not in _KEPT:
        _KEPT[key] = sink_sensitivity.of_sink(sink, solved(sink, transient), (1e-4, 1e-3, 1e-2))
    found: Slopes = _KEPT[key]
    return found


def by_hand(sink: Sink, key: str) -> tuple[Tangent, Motion]:
    study = sink_quantities.study(sink, symmetry.reduce(sink.scene()))
    state = solved(sink).details["answer"].fine.state
    here = state.heat.domain
    other = varied(sink, key, 1 + STEP)
    by, left_out = steady_slopes.motions(
        study, here, {key: lambda: replace(study, part=symmetry.reduce(other.scene()))}
    )
    assert not left_out
    return Tangent(study, state), by[key]


def on_moved_mesh(sink: Sink, key: str) -> dict[str, float]:
    """The same derivatives by central differences of solutions on the same cells, moved along."""
    tangent, by = by_hand(sink, key)
    grid = tangent.domain.space.grid
    values = []
    for step in (DIFFERENCE, -DIFFERENCE):
        other = varied(sink, key, 1 + step)
        part = symmetry.reduce(other.scene())
        moved = [b + step * v for b, v in zip(grid.breaks, by.breaks, strict=True)]
        there = replace(grid, breaks=tuple(moved), boxes=part.scene.boxes)
        study = sink_quantities.study(other, part)
        # The coupling is to be converged far below the difference.
        study = replace(study, accuracy=1e-7)
        values.append(nested.solution(study, nested.problems(boxes(part.scene, there), 1e-7)).quantities)
    more, less = values
    return {n: float((v - less[n]) / (v + less[n])) / DIFFERENCE for n, v in more.items()}


@pytest.mark.parametrize("key", KEYS)
def test_derivatives_are_those_of_the_discrete_solution(key: str) -> None:
    found, expected = slopes(HOT).steady[key], on_moved_mesh(HOT, key)
    for name, slope in found.items():
        # Central differences are off by their square, and the fixed point of the solution by 1e-5.
        assert slope.value == pytest.approx(expected[name], abs=3e-5), name


def test_a_mesh_that_stays_is_caught() -> None:
    tangent, by = by_hand(HOT, "anchor.pad_width")
    still = replace(by, stretch=np.zeros_like(by.stretch), breaks=tuple(np.zeros_like(v) for v in by.breaks))
    found = tangent.table(["end_rise_K"], {"as it is": by, "still": still})
    assert abs(found["still"]["end_rise_K"] - found["as it is"]["end_rise_K"]) > 1e-2


@pytest.mark.long
def test_errors_hold() -> None:
    sink = Sink(convection_coefficient=2e4, voltage=3.0)
    coarse, fine = slopes(replace(sink, accuracy=1e-2)), slopes(replace(sink, accuracy=1e-3))
    for key, of in coarse.steady.items():
        for name, slope in of.items():
            better = fine.steady[key][name]
            assert abs(slope.value - better.value) <= slope.error + better.error, (key, name)
    widest = max(slope.error for of in coarse.steady.values() for slope in of.values())
    assert widest < 0.02


def test_laws_of_scale() -> None:
    """All sizes times one factor change an anchor's resistance by its inverse, and so do all conductivities; the rises
    of a sink without air don't change with its sizes."""
    found = slopes(Sink()).steady
    resistance = {key: of["anchor_resistance_K_per_W"] for key, of in found.items()}
    error = sum(slope.error for slope in resistance.values())
    assert sum(resistance[key].value for key in SIZES) == pytest.approx(-1, abs=error)
    conductivities = [f"materials.{name}.thermal_conductivity" for name in ("silicon", "oxide")]
    assert sum(resistance[key].value for key in conductivities) == pytest.approx(-1, abs=error)
    assert sum(found[key]["peak_rise_K"].value for key in SIZES) == pytest.approx(0, abs=1e-3)


@pytest.mark.long
def test_over_time() -> None:
    sink, key = Sink(), "anchor.pad_length"
    course = slopes(sink, True).course
    assert course is not None
    instants = np.array([1e-4, 1e-3, 1e-2])
    values = []
    for factor in (1.005, 0.995):
        other = varied(sink, key, factor)
        response = solved(other, True).details["answer"].response
        out = outputs.of_transient(response.transient, symmetry.reduce(other.scene()), instants)
        values.append(sink_quantities.traces(other, out))
    for name in ("peak_K", "end_K", "mean_K"):
        more, less = (v[name] - sink.room_temperature for v in values)
        at = [int(np.abs(course.times - t).argmin()) for t in instants]
        found, expected = course.values[key][name][at], (more - less) / (more + less) / 0.005
        # What two runs at 1e-3 are off by, over the difference of their keys, falls out where their meshes are alike.
        assert found == pytest.approx(expected, abs=2e-3), name
        # At the end, 10 time constants on, it is the steady state.
        steady = slopes(sink).steady[key][name.replace("_K", "_rise_K")]
        assert course.values[key][name][-1] == pytest.approx(steady.value, abs=course.errors[key][name])


@pytest.mark.long
def test_heat_capacity_acts_over_time_alone() -> None:
    found = slopes(Sink(), True)
    assert found.course is not None
    key = "materials.silicon.density"
    assert found.steady[key]["peak_rise_K"].value == 0
    # Early on no heat has left: the rise is the energy over the heat capacity.
    assert found.course.values[key]["peak_K"][0] == pytest.approx(-1, abs=1e-2)


def test_keys_of_nothing_are_left_out() -> None:
    assert "environment.convection_coefficient" not in numbers(Sink())
    assert "materials.oxide.temperature_coefficient" not in numbers(Sink())
    assert len(numbers(Sink())) >= 14


def test_faces_that_would_part_are_named() -> None:
    """A beam as wide as its pads: a wider one and a narrower one have other cells."""
    found = slopes(Sink(width=150e-6, accuracy=1e-2))
    assert set(found.left_out) == {"sink.width", "anchor.pad_width"}
    assert "move apart" in found.left_out["sink.width"]
    assert "anchor.pad_length" in found.steady


def test_a_schedule_has_no_single_derivative() -> None:
    from fem3d.sensitivity.motion import _number
    from scenes.model import Schedule

    with pytest.raises(SceneError, match="varies in time"):
        _number(Schedule((0.0, 1.0), (0.0, 1.0)))
