"""Tests of the 3D model: meshes and scenes that several of them solve."""

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from fem3d.problems import conductors
from fem3d.problems.assembly import assemble
from fem3d.problems.heat import HeatProblem
from fem3d.results import outputs
from fem3d.results.outputs import Quantities
from fem3d.runs import sink as sinks
from fem3d.solution import steady
from fem3d.solution.steady import SteadyState
from fem3d.spaces.domain import box_domain
from meshes import symmetry
from meshes.grid import Grid, graph
from meshes.symmetry import Symmetry
from scenes.free import from_dict
from scenes.model import Boundary, Box, Material, Probe, Scene
from scenes.result import Result
from scenes.sink import SILICON, Sink

BAR = (20e-6, 1000e-6, 2e-6)


def silicon(coefficient: float) -> Material:
    """Silicon of another temperature coefficient of the resistivity."""
    return replace(SILICON, temperature_coefficient=coefficient)


def plain_grid(scene: Scene, degree: int = 2, cuts: int = 1, also: tuple[tuple[int, float], ...] = ()) -> Grid:
    """The planes of a scene and some more (axis, coordinate), each interval longer than 100 um in ``cuts`` pieces that
    differ in length, one degree everywhere."""
    found = []
    for d in range(3):
        planes = np.union1d(graph(scene).planes[d], [c for axis, c in also if axis == d])
        pieces = [
            a + (b - a) * (1 - np.cos(np.linspace(0, np.pi, 2 * cuts + 1))[:-1]) / 2 if b - a > 1e-4 else [a]
            for a, b in pairwise(planes)
        ]
        found.append(np.concatenate([*pieces, planes[-1:]]))
    return grid_of(scene, found, degree)


def grid_of(scene: Scene, breaks: Sequence[Any], degree: int) -> Grid:
    """A scene's grid of some breakpoints (m) along each axis and one degree everywhere."""
    axes = tuple(np.asarray(b, dtype=float) for b in breaks)
    return Grid(axes, tuple(np.full(len(b) - 1, degree) for b in axes), scene.boxes)


def problem(scene: Scene, grid: Grid) -> HeatProblem:
    """The heat problem of a scene on a grid."""
    return assemble(box_domain(scene, grid))


def steady_on(scene: Scene, grid: Grid, voltage: float, accuracy: float = 1e-13) -> SteadyState:
    """The coupled steady state of a scene on a grid."""
    heat = problem(scene, grid)
    return steady.solve_steady(heat, conductors.assemble_conductor(heat), voltage, accuracy)


def whole(scene: Scene) -> Symmetry:
    """A scene that isn't reduced, whatever its symmetry."""
    return symmetry.uncut(scene, [b.name for b in scene.boxes])


def state_on(sink: Sink, grid: Grid, part: Symmetry | None = None) -> tuple[SteadyState, Quantities]:
    """The steady state on a grid, the current's pattern followed as far as it goes, and its quantities."""
    part = part or symmetry.reduce(sink.scene())
    state = steady_on(part.scene, grid, sink.voltage)
    return state, sinks.steady(sink, outputs.of_steady(state, part))


def bar(material: Material, *boundaries: Boundary, heat_source: float = 0.0, boxes: Any = None) -> Scene:
    """A bar along y of one material (or of some boxes), with probes of its middle and its mean."""
    box = Box("bar", material, (0.0, 0.0, 0.0), BAR, heat_source)
    middle = (0.0, BAR[1] / 2, 0.0)
    probes = (Probe("middle", middle, middle), Probe("mean", box.lower, box.upper))
    return Scene("bar", boxes or (box,), boundaries, probes)


def end(side: int, kind: Any, value: float, ambient: float = 293.0) -> Boundary:
    """A condition on the bar's end face at y = 0 (side 0) or at its length (side 1)."""
    y = BAR[1] * side
    return Boundary(f"{kind}-{side}", kind, (0.0, y, 0.0), (BAR[0], y, BAR[2]), value, ambient)


def bar_grid(scene: Scene, intervals: int, degree: int) -> Grid:
    """A grid of a bar with equal intervals along it (between the planes of the scene) and one across."""
    planes = graph(scene).planes[1]
    y = np.concatenate([np.linspace(a, b, intervals + 1)[:-1] for a, b in pairwise(planes)])
    return grid_of(scene, ([0.0, BAR[0]], np.append(y, planes[-1]), [0.0, BAR[2]]), degree)


def drawn(name: str) -> Scene:
    """A random scene that was hard for an earlier release, of ``drawn.json``, by its kind and seed."""
    documents = json.loads(Path(__file__).with_name("drawn.json").read_text(encoding="utf-8"))
    return from_dict(documents[name])


def gap(one: Result, two: Result, times: Sequence[float] = (), over: dict[str, float] | None = None) -> float:
    """The largest distance of two results over the sum of both errors, in the steady state or of traces at some times
    (s); of some numbers alone where ``over`` divides the second result's."""

    def numbers(result: Result) -> dict[str, tuple[Any, float]]:
        if not len(times):
            return {name: (estimate.value, estimate.error) for name, estimate in result.steady.items()}
        traces = result.over_time
        return {name: (np.interp(times, traces.time, v), traces.errors[name]) for name, v in traces.values.items()}

    mine, theirs = numbers(one), numbers(two)
    return max(
        float(np.abs(mine[name][0] - theirs[name][0] / f).max() / (mine[name][1] + theirs[name][1] / f + 1e-300))
        for name, f in (over or dict.fromkeys(mine, 1.0)).items()
    )


def off(found: Any, expected: Any) -> float:
    """The largest difference over the largest expected value: a relative error without any hidden tolerance."""
    found, expected = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
    return float(np.abs(found - expected).max() / np.abs(expected).max())
