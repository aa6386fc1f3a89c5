"""A scene before it is solved: boxes in their materials' colours, boundaries, electrodes and probes, with names."""

from __future__ import annotations

from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from compare.report.checks import with_mu
from scenes import physics
from scenes.formats import cut
from scenes.free.tables import CONDITIONS, CURRENT_CONTACT, HEAT_CONTACT, HEAT_SOURCE, SERIES
from scenes.functions import Surroundings, Varying
from scenes.kinds import KELVIN, Quantity
from scenes.laws import Law
from scenes.model import Boundary, Material, Point, Probe, Scene, Schedule, Value, values
from scenes.units import THERMAL_CONDUCTIVITY
from validate.report.figures import INK, PARTS
from validate.report.figures.axonometry import Drawing, drawing
from validate.report.figures.drawing import new_figure, style
from validate.report.figures.labels import Label, columns, spread

WIDE, COLUMN, HIGHEST = 13.0, 2.75, 14.0
"""Inches: width of the picture, width of a column of names, greatest height."""
AROUND, UNDER = np.array([1.6, 1.4]), 1.35
"""Inches around the drawing for the axes' numbers, and for title and legend."""
APART, CHARACTERS, SIZE = 0.2, 42, 8.5
"""Names: inches from one to the next, the most characters, points."""
MOST = 120
"""Names that two columns of 12 inches hold; the title counts the others."""
TICK = 0.44
"""The least inches between two numbers of an axis."""
SHADES = (0.84, 0.7, 1.0)
"""Lightness of the visible sides: front, right, top."""
AT_AXIS = (("right", "top"), ("left", "top"), ("right", "center"))
"""Alignment of the numbers at each axis."""
BOUNDARY = {
    "temperature": "#b3261e", "heat_flux": "#b35c00", "convection": "#00677f", "radiation": "#8a2a5b",
    "voltage": "#6a1fb0",
}  # fmt: skip
PROBE = "#1a7a2e"


def draw(scene: Scene) -> Figure:
    """The picture of a scene that was checked."""
    view = drawing(scene)
    labels = labels_of(scene, view)
    left, right = columns(labels[:MOST], MOST)
    more = f"; {len(labels) - MOST} of {len(labels)} names left out" if len(labels) > MOST else ""
    inner = WIDE - 2 * COLUMN - AROUND[0]
    wide, tall = view.extent[1] - view.extent[0]
    needed = max(inner * tall / wide + AROUND[1], APART * (max(len(left), len(right)) + 1))
    high = float(min(max(needed + UNDER, 5.0), HIGHEST))
    figure = new_figure(WIDE, high, title(scene, view) + more, [])
    figure.subplots_adjust(left=0.0, right=1.0, bottom=0.75 / high, top=1 - 0.6 / high)
    ax = figure.subplots()
    ax.set_axis_off()
    # One unit of the drawing in inches, the drawing in the middle between the columns of names.
    inch = float(max(wide / inner, tall / (high - UNDER - AROUND[1])))
    centre = (view.extent[0] + view.extent[1]) / 2 - np.array([0.0, 0.2 * inch])
    half = np.array([WIDE, high - UNDER]) / 2 * inch
    ax.set(xlim=(centre[0] - half[0], centre[0] + half[0]), ylim=(centre[1] - half[1], centre[1] + half[1]))
    _faces(ax, scene, view)
    _sheets(ax, scene, view)
    for axis in range(3):
        _axis(ax, view, axis, inch)
    for side, names in ((-1, left), (1, right)):
        _column(ax, names, side, inch)
    _legend(figure, scene)
    return figure


def save(scene: Scene, path: Path, pixels: int = 1430) -> None:
    """Draws a scene that was checked to a file, so many pixels wide."""
    with style():
        draw(scene).savefig(path, dpi=pixels / WIDE)


def colours(scene: Scene) -> dict[str, tuple[float, float, float]]:
    """Of each material by its name (red, green, blue), pale, so that lines and sheets stand out from it."""
    names = dict.fromkeys(material.name for material in physics.materials(scene))
    pale = (0.45 + 0.55 * np.array([to_rgb(PARTS[n % len(PARTS)]) for n in range(len(names))])).tolist()
    return {name: (red, green, blue) for name, (red, green, blue) in zip(names, pale, strict=True)}


def _faces(ax: Any, scene: Scene, view: Drawing) -> None:
    """Faces and their edges, those that are farther first, and what is hidden of boxes that can't be seen at all."""
    faces, fill = view.faces, colours(scene)
    polygons, fills, lines, widths = [], [], [], []
    tints = {(n, side): [shade * c for c in fill[box.material.name]] for n, box in enumerate(scene.boxes)
             for side, shade in enumerate(SHADES)}  # fmt: skip
    each = zip(faces.corners, faces.owner.tolist(), faces.side.tolist(), faces.edges, strict=True)
    for corners, owner, side, edges in each:
        rgb = tints[owner, side]
        polygons.append(corners)
        fills.append((*rgb, 1.0))
        lines.append((*rgb, 1.0))
        widths.append(0.4)
        for n in np.flatnonzero(edges):
            polygons.append(corners[[n - 1, n]])
            fills.append((0.0, 0.0, 0.0, 0.0))
            lines.append((0.2, 0.2, 0.2, 1.0))
            widths.append(0.8)
    # Smoothed rims of faces that touch would let what lies behind shine through.
    smooth = [len(polygon) == 2 for polygon in polygons]
    ax.add_collection(PolyCollection(
        polygons, facecolors=fills, edgecolors=lines, linewidths=widths, antialiaseds=smooth, joinstyle="round",
    ))  # fmt: skip
    for number, box in enumerate(scene.boxes):
        if number not in view.seen:
            _outline(ax, view, box.lower, box.upper, "#555555", ":", 1.0)


def _sheets(ax: Any, scene: Scene, view: Drawing) -> None:
    """Boundaries as tinted sheets, pale and dotted where they lie behind, probes as points or dashed outlines."""
    for boundary in scene.boundaries:
        look = (BOUNDARY[boundary.kind], "-", 1.4, 0.35)
        if not view.facing(boundary.lower, boundary.upper):
            look = (BOUNDARY[boundary.kind], ":", 1.1, 0.1)
        _outline(ax, view, boundary.lower, boundary.upper, *look)
    for probe in scene.probes:
        if probe.lower == probe.upper:
            (place,) = view.place(np.array([probe.lower]))
            ax.plot(*place, marker="o", ms=5, mfc="white", mec=PROBE, mew=1.6, zorder=5)
        else:
            _outline(ax, view, probe.lower, probe.upper, PROBE, "--", 0.9)


def _outline(
    ax: Any, view: Drawing, lower: Point, upper: Point, colour: str, style: str, wide: float, fill: float = 0.0
) -> None:  # fmt: skip
    """The edges of a box of any dimension, and of a flat one its tinted face."""
    corners = np.array([[(lower, upper)[n >> d & 1][d] for d in range(3)] for n in range(8)])
    places = view.place(corners)
    for n in range(8):
        for d in range(3):
            if not n >> d & 1 and not np.allclose(places[n], places[n | 1 << d], atol=1e-9):
                ax.plot(*places[[n, n | 1 << d]].T, color=colour, ls=style, lw=wide, zorder=3, solid_capstyle="round")
    flat = [d for d in range(3) if lower[d] == upper[d]]
    if fill and len(flat) == 1:
        a, b = (1 << d for d in range(3) if d != flat[0])
        ax.fill(*places[[0, a, a | b, b]].T, color=colour, alpha=fill, lw=0, zorder=2)


def labels_of(scene: Scene, view: Drawing) -> list[Label]:
    """The names of all parts, at places where these can be seen."""

    def middle(part: Any) -> tuple[float, float]:
        x, y = view.place(np.array([part.lower, part.upper])).mean(axis=0)
        return float(x), float(y)

    labels = []
    for number, box in enumerate(scene.boxes):
        at = view.seen.get(number)
        place = middle(box) if at is None else (float(at[0]), float(at[1]))
        source = _value(box.heat_source, HEAT_SOURCE.quantity) if any(values(box.heat_source)) else ""
        material = box.material.name if box.material.name != box.name else ""
        said = ", ".join(filter(None, (material, source)))
        labels.append(Label(f"{box.name} ({said})" if said else box.name, INK, place, at is None))
    boxes = {box.name: box for box in scene.boxes}
    for contact in scene.contacts:
        one, other = (boxes[name] for name in contact.between)
        x, y = view.place(np.array([np.maximum(one.lower, other.lower), np.minimum(one.upper, other.upper)])).mean(
            axis=0
        )
        heat, current = contact.thermal_resistance, contact.electrical_resistance
        shown = [kind.show(value) for kind, value in ((HEAT_CONTACT, heat), (CURRENT_CONTACT, current)) if value]
        labels.append(Label(f"{contact.name}: {', '.join(shown) or 'perfect'}", INK, (float(x), float(y))))
    labels += [Label(f"{b.name}: {_condition(b)}", BOUNDARY[b.kind], middle(b)) for b in scene.boundaries]
    for probe in scene.probes:
        reading = _reading(probe)
        name = reading if probe.name == reading else f"{probe.name}: {reading}"
        labels.append(Label(name, PROBE, middle(probe)))
    return labels


def _condition(boundary: Boundary) -> str:
    kind = CONDITIONS[boundary.key]
    behind = f" behind {SERIES.show(boundary.series_resistance)}" if 0 < boundary.series_resistance < inf else ""
    if boundary.contact_resistance:
        assert isinstance(kind, Varying)
        given, per_area = (
            (boundary.value, CURRENT_CONTACT) if boundary.kind == "voltage" else (boundary.ambient, HEAT_CONTACT)
        )
        behind += f" behind {per_area.show(boundary.contact_resistance)}"
        return _value(given, kind.quantity) + behind
    if isinstance(kind, Surroundings):
        what = "emissivity " * (kind.name == "emissivity")
        if isinstance(boundary.value, Law):
            shown = cut((kind.law or kind.quantity).show(boundary.value), CHARACTERS // 2)
        else:
            shown = _value(boundary.value, kind.quantity)
        return f"{what}{shown} to {_value(boundary.ambient, KELVIN)}"
    assert isinstance(kind, Varying)
    return _value(boundary.value, kind.quantity) + behind


def _value(value: Value, kind: Quantity) -> str:
    """A value, or the range of one that varies in time."""
    ends = dict.fromkeys((min(value.values), max(value.values)) if isinstance(value, Schedule) else (value,))
    shown = [kind.dimension.show(float(f"{end:.5g}")) for end in ends]
    text = f"{' to '.join(shown)} over time" if len(shown) > 1 else shown[0]
    return with_mu(text)


def _reading(probe: Probe) -> str:
    what = probe.quantity.replace("_", " ")
    if probe.lower == probe.upper or probe.quantity in ("heat_flow", "current"):
        return what
    return f"{probe.reduce} {what}"


def _column(ax: Any, names: list[Label], side: int, inch: float) -> None:
    """A column of names, with lines to what they name."""
    low, high = ax.get_ylim()
    edge = ax.get_xlim()[0 if side < 0 else 1] - side * COLUMN * inch
    heights = spread([label.at[1] for label in names], APART * inch, low + 0.1 * inch, high - 0.1 * inch)
    for label, y in zip(names, heights, strict=True):
        text = cut(label.text + (", hidden" if label.hidden else ""), CHARACTERS)
        ax.text(
            edge, y, text, ha="right" if side < 0 else "left", va="center", color=label.colour, fontsize=SIZE, zorder=7,
        )  # fmt: skip
        bend = edge - side * 0.25 * inch
        ax.plot(
            [edge - side * 0.06 * inch, bend, label.at[0]], [y, y, label.at[1]], color=label.colour, lw=0.6, alpha=0.75,
            ls=":" if label.hidden else "-", zorder=4,
        )  # fmt: skip
        ax.plot(*label.at, ".", color=label.colour, ms=3.5, zorder=5)


def _axis(ax: Any, view: Drawing, axis: int, inch: float) -> None:
    """An axis along an edge of the drawing, with the coordinates of faces across it, as far as numbers fit."""
    planes, direction = view.planes[axis], view.axes[axis]
    unit, size = _unit(view)
    at = np.empty((len(planes), 3))
    # To the right along the lower front edge, away along the lower right one, up along the left front one.
    ends = [(0, 0, 0), (-1, 0, 0), (0, 0, 0)][axis]
    for place in range(3):
        at[:, view.axes[place]] = view.planes[place][ends[place]]
    at[:, direction] = planes
    places = view.place(at)
    out = np.array([(-0.35, -1.0), (1.0, -0.6), (-1.0, 0.0)][axis]) * inch
    ax.plot(*(places[[0, -1]] + 0.08 * out).T, color=INK, lw=0.8, zorder=3)
    for n in _apart(places, TICK * inch * (1.0 if axis < 2 else 0.5)):
        ax.plot(*np.array([places[n] + 0.08 * out, places[n] + 0.15 * out]).T, color=INK, lw=0.8, zorder=3)
        _text(ax, places[n] + 0.2 * out, f"{planes[n] / size:.5g}", SIZE - 0.5, *AT_AXIS[axis])
    # The name of the axis in the middle, of the upright one above its end.
    place = places[[0, -1]].mean(axis=0) + 0.62 * out if axis < 2 else places[-1] + np.array([-0.1, 0.3]) * inch
    _text(ax, place, f"{'xyz'[direction]} ({unit})", SIZE + 1, "center", "center")


def _text(ax: Any, place: np.ndarray, text: str, size: float, horizontal: str, vertical: str) -> None:
    """A text that what lies below it does not cross."""
    box = {"facecolor": "white", "edgecolor": "none", "pad": 0.6, "alpha": 0.85}
    ax.text(*place, text, color=INK, fontsize=size, ha=horizontal, va=vertical, bbox=box, zorder=6)


def _apart(places: np.ndarray, least: float) -> list[int]:
    """The first and the last place, and as many between them as are at least so far from one another."""
    kept = [0, len(places) - 1]
    for n in range(1, len(places) - 1):
        if min(float(np.linalg.norm(places[n] - places[k])) for k in kept) >= least:
            kept.append(n)
    return kept


def _unit(view: Drawing) -> tuple[str, float]:
    """The unit of the numbers, by the longest extent, and its size in m."""
    length = max(float(np.ptp(planes)) for planes in view.planes)
    return next(((u, s) for u, s in (("µm", 1e-6), ("mm", 1e-3)) if length < 2e4 * s), ("m", 1.0))


def title(scene: Scene, view: Drawing) -> str:
    """The name, what there is, and how much larger than in proportion it is drawn."""
    stretched = [
        f"{'xyz'[axis]} {factor:g} times" for axis, factor in zip(view.axes, view.factors, strict=True) if factor != 1
    ]
    said = [f"{', '.join(stretched)} as large"] * bool(stretched) + ["thin parts thicker"] * view.thickened
    drawn = f" (drawn with {' and '.join(said)})" if said else ""
    given = {"box": scene.boxes, "boundary": scene.boundaries, "probe": scene.probes}
    many = {"box": "boxes", "boundary": "boundaries", "probe": "probes"}
    counts = ", ".join(f"{len(items)} {one if len(items) == 1 else many[one]}" for one, items in given.items())
    return f"{scene.name}: {counts}{drawn}"


def _legend(figure: Figure, scene: Scene) -> None:
    """The materials with their conductivities, and what the colours of names mean."""
    materials = {material.name: material for material in physics.materials(scene)}
    fill = colours(scene)
    handles: list[Any] = [Patch(fc=fill[n], ec=INK, lw=0.6, label=_material(scene, m)) for n, m in materials.items()]
    kinds = {boundary.kind: BOUNDARY[boundary.kind] for boundary in scene.boundaries}
    handles += [Line2D([], [], color=colour, lw=2, label=kind.replace("_", " ")) for kind, colour in kinds.items()]
    if scene.probes:
        handles.append(Line2D([], [], color=PROBE, ls="--", marker="o", mfc="white", ms=5, label="probe"))
    rows = -(-len(handles) // 5)
    figure.legend(
        handles=handles, loc="lower center", ncols=-(-len(handles) // rows), fontsize=SIZE + 0.5, handlelength=1.6
    )


def _material(scene: Scene, material: Material) -> str:
    if not physics.heat(scene):
        return material.name
    return f"{material.name}, {THERMAL_CONDUCTIVITY.show(material.thermal_conductivity)}"
