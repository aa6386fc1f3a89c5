"""A scene that isn't solved yet, to look at from all sides: boxes, boundaries and probes with their names, stretched as
in its picture (`validate.report.figures.axonometry`), so that thin films are seen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from scenes.errors import SceneError
from scenes.formats import cut
from scenes.model import Boundary, Box, Probe, Scene
from validate.report.figures import INK
from validate.report.figures.labels import Label, columns, spread

Part = dict[str, Any]
SOLID = {Box: 1.0, Boundary: 0.35, Probe: 0.0}
"""Opacity of the faces of each kind of part."""
NAME_HIGH, NAME_WIDE, CHARACTERS = 19, 8.2, 42
"""Names in the window: pixels from one to the next, pixels of a character, the most characters."""


def of_boxes(scene: Any) -> Scene:
    """A scene of any kind as boxes; SceneError for one on a mesh."""
    if getattr(scene, "parts", "") == "bodies":
        raise SceneError(
            f"{scene.name} is on a mesh, and pictures are of boxes: look at {scene.file} in the program that made it"
        )
    return scene if scene.kind == "free" else scene.scene()


def parts(scene: Scene) -> dict[str, Any]:
    """What the window draws, as plain JSON types: ``parts`` with corners and colours, how solid they are, and their
    names; which ``axes`` go to the right, away and up; and the ``title``."""
    from matplotlib.colors import to_rgb

    from validate.report.figures.axonometry import drawing
    from validate.report.figures.scene_picture import colours, labels_of, title

    view, fill = drawing(scene), colours(scene)
    items: tuple[Box | Boundary | Probe, ...] = (*scene.boxes, *scene.boundaries, *scene.probes)
    given = []
    for label, item in zip(labels_of(scene, view), items, strict=True):
        corners = view.stretched(np.array([item.lower, item.upper]))
        colour = fill[item.material.name] if isinstance(item, Box) else to_rgb(label.colour)
        given.append({
            "lower": corners.min(axis=0).tolist(), "upper": corners.max(axis=0).tolist(), "colour": list(colour),
            "solid": SOLID[type(item)], "name": label.text, "ink": label.colour,
        })  # fmt: skip
    signs = ["" if planes[-1] > planes[0] else "-" for planes in view.planes]
    axes = [sign + "xyz"[axis] for sign, axis in zip(signs, view.axes, strict=True)]
    return {"parts": given, "axes": axes, "title": title(scene, view)}


def show(request: dict[str, Any]) -> None:
    """The window, or a picture of it: the mouse turns it, and the names stay beside it."""
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
            # Of faces in one plane those of boxes are a little farther from the eye than boundaries.
            mapper.SetResolveCoincidentTopologyToPolygonOffset()
            mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(0.0, 2.0 * part["solid"])
        plotter.add_mesh(box.extract_all_edges(), color=part["ink"], line_width=1.5, lighting=False)
    plotter.add_text(request["title"], font_size=10, color=INK)
    right, away, up = request["axes"]
    plotter.add_axes(xlabel=right, ylabel=away, zlabel=up, color=INK)
    plotter.enable_parallel_projection()
    plotter.view_vector((0.35, -0.8, 0.5), viewup=(0, 0, 1))
    # The names take a part of the width on either side.
    plotter.camera.zoom(0.85)
    names = Names(plotter, request["parts"])
    plotter.renderer.AddObserver("StartEvent", lambda *_: names.lay_out())
    if request["off_screen"]:
        plotter.screenshot(request["screenshot"])
    else:
        plotter.show(title=request["title"])


class Names:
    """Names of parts in two columns of a window, with lines to the parts' middles, however they are turned."""

    def __init__(self, plotter: Any, parts: list[Part]) -> None:
        from matplotlib.colors import to_rgb
        from vtkmodules.vtkRenderingCore import vtkActor2D, vtkPolyDataMapper2D

        self.plotter = plotter
        self.places = [np.mean([part["lower"], part["upper"]], axis=0) for part in parts]
        self.labels = [Label(cut(part["name"], CHARACTERS), part["ink"], (0.0, 0.0)) for part in parts]
        self.texts, self.lines = [], []
        for label in self.labels:
            text = plotter.add_text(label.text, position=(0, 0), font_size=8, color=label.colour, render=False)
            text.prop.justification_vertical = "center"
            self.texts.append(text)
            mapper, actor = vtkPolyDataMapper2D(), vtkActor2D()
            actor.SetMapper(mapper)
            actor.GetProperty().SetColor(*to_rgb(label.colour))
            plotter.renderer.AddViewProp(actor)
            self.lines.append(mapper)

    def lay_out(self) -> None:
        """Puts the names beside the scene as it is turned now."""
        import pyvista as pv

        renderer, (wide, high) = self.plotter.renderer, self.plotter.window_size
        at = []
        for place in self.places:
            renderer.SetWorldPoint(*place, 1.0)
            renderer.WorldToDisplay()
            at.append(renderer.GetDisplayPoint()[:2])
        labels = [replace(label, at=(x, y)) for label, (x, y) in zip(self.labels, at, strict=True)]
        for side, names in zip(("left", "right"), columns(labels, len(labels)), strict=True):
            edge, towards = (0.01 * wide, 1) if side == "left" else (0.99 * wide, -1)
            heights = spread([label.at[1] for label in names], NAME_HIGH, 0.1 * high, 0.92 * high)
            for label, y in zip(names, heights.tolist(), strict=True):
                n = next(i for i, neighbour in enumerate(labels) if neighbour is label)
                self.texts[n].position = (edge, y)
                self.texts[n].prop.justification_horizontal = side
                start = edge + towards * NAME_WIDE * len(label.text)
                line = np.array([(start, y, 0), (start + 20 * towards, y, 0), (*label.at, 0)])
                self.lines[n].SetInputData(pv.lines_from_points(line))
