"""A scene before a solve, drawn by pyvista: boxes, boundaries, electrodes and probes with their names.

Each axis is stretched so that nothing is too thin to be seen: as a whole by a round factor, and between two
neighbouring faces of boxes to a least width.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import cycle
from math import inf
from typing import Any

import numpy as np

from compare.report.checks import with_mu
from scenes import physics
from scenes.errors import SceneError
from scenes.formats import cut
from scenes.free.grid import grid_of
from scenes.free.tables import CONDITIONS, CURRENT_CONTACT, HEAT_CONTACT, HEAT_SOURCE, SERIES
from scenes.functions import Surroundings
from scenes.kinds import KELVIN, Quantity
from scenes.laws import Law
from scenes.model import Boundary, Box, Probe, Scene, Schedule, Value, values
from scenes.units import THERMAL_CONDUCTIVITY
from validate.report.figures import INK, PARTS
from validate.report.figures.render import exaggeration

Part = dict[str, Any]
"""What the window draws of a part: corners, colours, opacity and name, as plain JSON types."""
SOLID = {Box: 1.0, Boundary: 0.35, Probe: 0.0}
"""Opacity of the faces of each kind of part."""
NAME_HIGH, CHARACTERS = 19, 42
"""Names in the window: pixels from one to the next, and the most characters."""
MOST = 40
"""Names that fit beside the scene; the title counts the others."""
THIN, SHARE = 0.02, 0.35
"""Least gap between faces, over the longest extent; share of the extent for all gaps."""
BOUNDARY = {
    "temperature": "#b3261e", "heat_flux": "#b35c00", "convection": "#00677f", "radiation": "#8a2a5b",
    "voltage": "#6a1fb0",
}  # fmt: skip
PROBE = "#1a7a2e"


@dataclass(frozen=True)
class Stretch:
    """Map from coordinates of a scene (m) to the drawing.

    Attributes
    ----------
    axes : which of x, y, z goes to the right, away and up
    planes : faces of boxes (m) along each of these, ascending in the drawing
    drawn : their places in the drawing, over the longest horizontal extent
    factors : by which each axis is stretched as a whole
    thickened : whether any gap is wider beyond that
    """

    axes: tuple[int, int, int]
    planes: tuple[np.ndarray, ...]
    drawn: tuple[np.ndarray, ...]
    factors: tuple[float, ...]
    thickened: bool

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Return the places (n, 3) of points (n, 3); points outside of the scene go to its rim."""
        places = []
        for axis, planes, drawn in zip(self.axes, self.planes, self.drawn, strict=True):
            order = np.argsort(planes)
            places.append(np.interp(points[:, axis], planes[order], drawn[order]))
        return np.column_stack(places)


def stretch(scene: Scene) -> Stretch:
    """Choose the stretch of a scene that was checked."""
    all_planes = grid_of(replace(scene, boundaries=(), probes=())).planes
    extents = [float(np.ptp(planes)) for planes in all_planes]
    along = 0 if extents[0] >= extents[1] else 1
    # With y to the right it is -x that goes away, so that the three stay a right-handed system.
    axes, signs = ((0, 1, 2), (1, 1, 1)) if along == 0 else ((1, 0, 2), (1, -1, 1))
    length = extents[along]
    planes, drawn, factors, thickened = [], [], [], False
    for axis, sign in zip(axes, signs, strict=True):
        at = all_planes[axis][::sign]
        factor = exaggeration(np.array([[0.0, 0.0, 0.0], [length, length, extents[axis]]]))
        gaps = np.abs(np.diff(at)) * factor
        least = min(THIN, SHARE / len(gaps)) * length
        thickened |= bool((gaps < 0.98 * least).any())
        planes.append(at)
        drawn.append(np.concatenate([[0.0], np.cumsum(np.maximum(gaps, least))]) / length)
        factors.append(factor)
    return Stretch(axes, tuple(planes), tuple(drawn), tuple(factors), thickened)


def of_boxes(scene: Any) -> Scene:
    """Return a scene of any kind as boxes; SceneError for one on a mesh."""
    if getattr(scene, "parts", "") == "bodies":
        raise SceneError(
            f"{scene.name} is on a mesh, and pictures are of boxes: look at {scene.file} in the program that made it"
        )
    return scene if scene.kind == "free" else scene.scene()


def parts(scene: Scene) -> dict[str, Any]:
    """Return the request for the window: ``parts``, a ``legend`` of materials, the ``axes`` and the ``title``."""
    from matplotlib.colors import to_rgb

    view, materials = stretch(scene), {material.name: material for material in physics.materials(scene)}
    # Pale, so that lines and sheets stand out.
    pale = (0.45 + 0.55 * np.array([to_rgb(colour) for colour in PARTS])).tolist()
    fill = dict(zip(materials, cycle(pale), strict=False))
    items: list[tuple[Any, str, str]] = [(box, _box_name(box), INK) for box in scene.boxes]
    items += [(b, f"{b.name}: {_condition(b)}", BOUNDARY[b.kind]) for b in scene.boundaries]
    items += [(probe, _probe_name(probe), PROBE) for probe in scene.probes]
    boxes = {box.name: box for box in scene.boxes}
    for contact in scene.contacts:
        one, other = (boxes[name] for name in contact.between)
        middle: Any = (np.maximum(one.lower, other.lower) + np.minimum(one.upper, other.upper)) / 2
        pairs = (HEAT_CONTACT, contact.thermal_resistance), (CURRENT_CONTACT, contact.electrical_resistance)
        shown = ", ".join(kind.show(value) for kind, value in pairs if value) or "perfect"
        items.append((Probe(contact.name, middle, middle), f"{contact.name}: {shown}", INK))
    given = []
    for item, name, ink in items:
        corners = view(np.array([item.lower, item.upper]))
        colour = fill[item.material.name] if isinstance(item, Box) else list(to_rgb(ink))
        given.append({
            "lower": corners.min(axis=0).tolist(), "upper": corners.max(axis=0).tolist(), "colour": colour,
            "solid": SOLID[type(item)], "name": name, "ink": ink,
        })  # fmt: skip
    signs = ["" if planes[-1] > planes[0] else "-" for planes in view.planes]
    axes = [sign + "xyz"[axis] for sign, axis in zip(signs, view.axes, strict=True)]
    conducts = physics.heat(scene)
    legend = [
        [f"{name}, {THERMAL_CONDUCTIVITY.show(m.thermal_conductivity)}" if conducts else name, fill[name]]
        for name, m in materials.items()
    ]
    return {"parts": given, "legend": legend, "axes": axes, "title": title(scene, view)}


def title(scene: Scene, view: Stretch) -> str:
    """Name the scene, count its parts, and state how much larger than in proportion it is drawn."""
    stretched = [
        f"{'xyz'[axis]} {factor:g} times" for axis, factor in zip(view.axes, view.factors, strict=True) if factor != 1
    ]
    said = [f"{', '.join(stretched)} as large"] * bool(stretched) + ["thin parts thicker"] * view.thickened
    drawn = f" (drawn with {' and '.join(said)})" if said else ""
    given = {"box": scene.boxes, "boundary": scene.boundaries, "probe": scene.probes}
    many = {"box": "boxes", "boundary": "boundaries", "probe": "probes"}
    counts = ", ".join(f"{len(items)} {one if len(items) == 1 else many[one]}" for one, items in given.items())
    return f"{scene.name}: {counts}{drawn}"


def _box_name(box: Box) -> str:
    source = _value(box.heat_source, HEAT_SOURCE.quantity) if any(values(box.heat_source)) else ""
    material = box.material.name if box.material.name != box.name else ""
    more = ", ".join(filter(None, (material, source)))
    return f"{box.name} ({more})" if more else box.name


def _probe_name(probe: Probe) -> str:
    what, point = probe.quantity.replace("_", " "), probe.lower == probe.upper
    reading = what if point or probe.quantity in ("heat_flow", "current") else f"{probe.reduce} {what}"
    return reading if probe.name == reading else f"{probe.name}: {reading}"


def _condition(boundary: Boundary) -> str:
    """The value of a condition, with its surroundings or the resistances in front of it."""
    kind, value, contact = CONDITIONS[boundary.key], boundary.value, boundary.contact_resistance
    if isinstance(kind, Surroundings):
        law = isinstance(value, Law)
        shown = cut(kind.coefficient.show(value), CHARACTERS // 2) if law else _value(value, kind.quantity)
        return f"{'emissivity ' * (kind.name == 'emissivity')}{shown} to {_value(boundary.ambient, KELVIN)}"
    given, per_area = (boundary.ambient, HEAT_CONTACT) if boundary.kind == "convection" else (value, CURRENT_CONTACT)
    before = [SERIES.show(boundary.series_resistance)] if 0 < boundary.series_resistance < inf else []
    before += [per_area.show(contact)] if contact else []
    return " behind ".join([_value(given, kind.quantity), *before])


def _value(value: Value, kind: Quantity) -> str:
    """A value, or the range of one that varies in time."""
    ends = dict.fromkeys((min(value.values), max(value.values)) if isinstance(value, Schedule) else (value,))
    shown = [kind.dimension.show(float(f"{end:.5g}")) for end in ends]
    text = f"{' to '.join(shown)} over time" if len(shown) > 1 else shown[0]
    return with_mu(text)


def show(request: dict[str, Any]) -> None:
    """Open the window or write its picture; the names are listed at its left by the numbers at their parts."""
    import pyvista as pv

    plotter: Any = pv.Plotter(off_screen=request["off_screen"], window_size=request["size"])
    plotter.set_background("white")
    for part in request["parts"]:
        ends = np.array([part["lower"], part["upper"]])
        if not np.ptp(ends, axis=0).any():
            point = pv.PolyData(ends[:1])
            plotter.add_mesh(point, color=part["ink"], point_size=12, render_points_as_spheres=True)
            continue
        box = pv.Box(ends.T.ravel())
        if part["solid"]:
            mapper = plotter.add_mesh(box, color=part["colour"], opacity=part["solid"], lighting=False).mapper
            # In one plane, faces of boxes are a little farther from the eye than boundaries.
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, 2.0 * part["solid"])
        plotter.add_mesh(box.extract_all_edges(), color=part["ink"], line_width=1.5, lighting=False)
    numbers: dict[tuple[float, ...], list[int]] = {}
    for number, part in enumerate(request["parts"][:MOST], 1):
        numbers.setdefault(tuple(np.mean([part["lower"], part["upper"]], axis=0).round(3)), []).append(number)
        row = request["size"][1] - 50 - NAME_HIGH * number
        plotter.add_text(f"{number}  {cut(part['name'], CHARACTERS)}", (10, row), 8, part["ink"])
    plotter.add_point_labels(
        np.array(list(numbers)), [", ".join(map(str, each)) for each in numbers.values()], font_size=14,
        text_color=INK, shape_color="white", shape_opacity=0.7, show_points=False, always_visible=True,
    )  # fmt: skip
    plotter.add_text(request["title"], font_size=10, color=INK)
    right, away, up = request["axes"]
    plotter.add_axes(xlabel=right, ylabel=away, zlabel=up, color=INK, viewport=(0.8, 0.0, 1.0, 0.2))
    plotter.enable_parallel_projection()
    plotter.view_vector((0.35, -0.8, 0.5), viewup=(0, 0, 1))
    # The names take the left.
    plotter.camera.SetWindowCenter(-0.25, 0.0)
    if request["legend"]:
        plotter.add_legend(
            [list(entry) for entry in request["legend"]], bcolor=None, face="rectangle", loc="lower center",
            size=(0.3, 0.028 * len(request["legend"])),
        )  # fmt: skip
    if request["off_screen"]:
        plotter.screenshot(request["screenshot"])
    else:
        plotter.show(title=request["title"])
