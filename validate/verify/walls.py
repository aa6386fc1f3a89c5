"""Scenes that are one-dimensional: layers along y, solved in 3D."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from scenes.model import Boundary, Box, Material, Point, Probe, Scene, Value
from validate.verify.answers import ACCURACY
from validate.verify.laplace import Layer

WIDTH, DEPTH = 20e-6, 2e-6  # m: the section along x and z


def wall(
    name: str, layers: Sequence[Layer], boundaries: Sequence[Boundary], times: Sequence[float] = (),
    probes: Sequence[Probe] = (), initial: float = 293.0, section: tuple[float, float] = (WIDTH, DEPTH),
    heat_source: Value = 0.0,
) -> Scene:  # fmt: skip
    """Layers side by side, steady where no ``times`` (s) are given; probes of the faces between are "face 0" onwards,
    besides those that are given."""
    planes = np.concatenate([[0.0], np.cumsum([layer.thickness for layer in layers])]).tolist()
    boxes = tuple(
        Box(f"layer {i}", _material(i, layer), (0.0, planes[i], 0.0), (section[0], planes[i + 1], section[1]),
            heat_source)
        for i, layer in enumerate(layers)
    )  # fmt: skip
    faces = tuple(Probe(f"face {i}", *flat(y, section)) for i, y in enumerate(planes))
    return Scene(
        name, boxes, tuple(boundaries), (*faces, *probes), initial, max(times, default=1.0), ACCURACY,
        not times, tuple(times),
    )  # fmt: skip


def end(
    kind: Literal["temperature", "heat_flux", "convection", "voltage"], y: float, value: Any, ambient: Value = 293.0,
    section: tuple[float, float] = (WIDTH, DEPTH),
) -> Boundary:  # fmt: skip
    """A condition on the plane at y (m)."""
    return Boundary(f"{kind} {y:g}", kind, *flat(y, section), value, ambient)


def flat(y: float, section: tuple[float, float] = (WIDTH, DEPTH)) -> tuple[Point, Point]:
    """The flat box across a wall at y (m)."""
    return (0.0, y, 0.0), (section[0], y, section[1])


def point(name: str, y: float) -> Probe:
    """A temperature probe on the axis of a wall at y (m)."""
    return Probe(name, (WIDTH / 2, y, DEPTH / 2), (WIDTH / 2, y, DEPTH / 2))


def _material(number: int, layer: Layer) -> Material:
    return Material(f"layer {number}", layer.conductivity, 1.0, layer.heat_capacity)
