"""Draw a scene before a solve: boxes, boundaries, electrodes and probes, with numbers that lead to their names.

Gaps between neighbouring faces of boxes are widened, so that no part is too thin to be seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import cycle
from typing import Any

import numpy as np

from scenes import physics
from scenes.errors import SceneError
from scenes.formats import cut
from scenes.free.grid import grid_of
from scenes.free.tables import CONDITIONS, CURRENT_CONTACT, HEAT_CONTACT, HEAT_SOURCE
from scenes.functions import Surroundings
from scenes.kinds import KELVIN, Quantity
from scenes.laws import Law
from scenes.model import Boundary, Scene, Schedule, Value, values
from validate.report.figures import INK, PARTS, with_mu

THIN = 0.03
"""Least gap between faces, as a part of the longest extent."""
BOUNDARY = {
    "temperature": "#b3261e", "heat_flux": "#b35c00", "convection": "#00677f", "radiation": "#8a2a5b",
    "voltage": "#6a1fb0",
}  # fmt: skip
PROBE = "#1a7a2e"


def of_boxes(scene: Any) -> Scene:
    """Return a scene of any kind as boxes; SceneError for one on a mesh."""
    if getattr(scene, "parts", "") == "bodies":
        raise SceneError(
            f"{scene.name} is on a mesh, and pictures are of boxes: look at {scene.file} in the program that made it"
        )
    return scene if scene.kind == "free" else scene.scene()


def request(scene: Scene) -> dict[str, Any]:
    """Return plain data for the process that draws: the title and each part's corners, colour, opacity and name.

    Corners are in parts of the longest extent.
    """
    planes = grid_of(replace(scene, boundaries=(), probes=())).planes
    gaps = [np.diff(each) / max(map(np.ptp, planes)) for each in planes]
    places = [np.cumsum([0.0, *np.maximum(each, THIN)]) for each in gaps]
    thickened = any((each < THIN).any() for each in gaps)
    parts = [
        {
            "corners": [
                np.interp(ends, *axis).tolist()
                for ends, axis in zip(zip(lower, upper, strict=True), zip(planes, places, strict=True), strict=True)
            ],
            "colour": colour, "opacity": opacity, "name": with_mu(name),
        }
        for name, lower, upper, colour, opacity in _parts(scene)
    ]  # fmt: skip
    counts = f"boxes: {len(scene.boxes)}, boundaries: {len(scene.boundaries)}, probes: {len(scene.probes)}"
    return {"title": f"{scene.name} ({counts}{'; thin parts are drawn thicker' * thickened})", "parts": parts}


def _parts(scene: Scene) -> Iterator[tuple[str, Any, Any, str, float]]:
    """Yield the name, corners (m), colour and opacity of each part."""
    fill = dict(zip((material.name for material in physics.materials(scene)), cycle(PARTS), strict=False))
    for box in scene.boxes:
        source = [_value(box.heat_source, HEAT_SOURCE.quantity)] if any(values(box.heat_source)) else []
        said = f"{box.name}: {', '.join([box.material.name, *source])}"
        yield said, box.lower, box.upper, fill[box.material.name], 1.0
    for boundary in scene.boundaries:
        yield f"{boundary.name}: {_condition(boundary)}", boundary.lower, boundary.upper, BOUNDARY[boundary.kind], 0.35
    for probe in scene.probes:
        yield f"{probe.name}: {probe.quantity.replace('_', ' ')}", probe.lower, probe.upper, PROBE, 0.0
    boxes = {box.name: box for box in scene.boxes}
    for contact in scene.contacts:
        one, other = (boxes[name] for name in contact.between)
        middle = (np.maximum(one.lower, other.lower) + np.minimum(one.upper, other.upper)) / 2
        pairs = (HEAT_CONTACT, contact.thermal_resistance), (CURRENT_CONTACT, contact.electrical_resistance)
        shown = ", ".join(kind.show(value) for kind, value in pairs if value) or "perfect"
        yield f"{contact.name}: {shown}", middle, middle, INK, 0.0


def _condition(boundary: Boundary) -> str:
    """The value of a condition, with its surroundings."""
    kind, value = CONDITIONS[boundary.key], boundary.value
    if isinstance(kind, Surroundings):
        shown = "a law of the temperature" if isinstance(value, Law) else _value(value, kind.quantity)
        return f"{boundary.key} {shown} to {_value(boundary.ambient, KELVIN)}"
    return _value(boundary.ambient if boundary.kind == "convection" else value, kind.quantity)


def _value(value: Value, kind: Quantity) -> str:
    """A value, or the range of one that varies in time."""
    ends = (min(value.values), max(value.values)) if isinstance(value, Schedule) else (value,)
    return " to ".join(dict.fromkeys(kind.dimension.show(float(f"{end:.5g}")) for end in ends))


def draw(request: dict[str, Any]) -> list[str]:
    """Open the window or write its picture; the names are listed at its left by the numbers at their parts."""
    import pyvista as pv

    plotter: Any = pv.Plotter(off_screen=request["off_screen"], window_size=request["size"])
    plotter.set_background("white")
    numbers: dict[tuple[float, ...], list[int]] = {}
    for number, part in enumerate(request["parts"], 1):
        corners, colour = np.array(part["corners"]), part["colour"]
        numbers.setdefault(tuple(corners.mean(axis=1).round(3)), []).append(number)
        box = pv.Box(corners.ravel())
        if not np.ptp(corners, axis=1).any():
            plotter.add_mesh(pv.PolyData(corners.T[:1]), color=colour, point_size=12, render_points_as_spheres=True)
            continue
        if part["opacity"]:
            # Boxes are pale, so that lines and sheets stand out.
            fill = 0.45 + 0.55 * np.array(pv.Color(colour).float_rgb) if part["opacity"] == 1.0 else colour
            mapper = plotter.add_mesh(box, color=fill, opacity=part["opacity"], lighting=False).mapper
            # In one plane, faces of boxes are a little farther from the eye than boundaries.
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, 2.0 * part["opacity"])
        plotter.add_mesh(box.extract_all_edges(), color=INK if part["opacity"] == 1.0 else colour, line_width=1.5)
    plotter.add_point_labels(
        np.array(list(numbers)), [", ".join(map(str, each)) for each in numbers.values()], font_size=14,
        text_color=INK, shape_color="white", shape_opacity=0.7, show_points=False, always_visible=True,
    )  # fmt: skip
    names = "\n".join(f"{number}  {cut(part['name'], 42)}" for number, part in enumerate(request["parts"], 1))
    plotter.add_text(names, position="left_edge", font_size=8, color=INK)
    plotter.add_text(request["title"], position="upper_edge", font_size=8, color=INK)
    plotter.add_axes(color=INK, viewport=(0.8, 0.0, 1.0, 0.2))
    plotter.enable_parallel_projection()
    along_x, along_y, _ = np.ptp([part["corners"] for part in request["parts"]], axis=(0, 2))
    plotter.view_vector((0.8, -0.35, 0.4) if along_y > along_x else (0.35, -0.8, 0.4), viewup=(0, 0, 1))
    # The names take the left, and the scene 0.65 of the width or height.
    plotter.renderer.ResetCameraScreenSpace(0.65)
    plotter.camera.SetWindowCenter(-0.3, 0.0)
    if request["screenshot"]:
        plotter.screenshot(request["screenshot"])
    else:
        plotter.show(title=request["title"])
    return []
