"""The picture of a temperature field, rendered in a process of its own.

VTK without a working OpenGL may end the process, and its start-up overlaps the solution.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pyvista as pv

from validate.report.figures import table

SIZE = [1400, 700]  # Pixels.
LIGHT = (0.45, -0.3, 0.84)  # The direction that light comes from, of length 1.
AMBIENT = 0.65  # The part of a face's colour that does not depend on the light.


def warm_up() -> None:
    """Renders next to nothing, so that the graphics library is ready before the solution is."""
    plotter = pv.Plotter(off_screen=True, window_size=[16, 16])
    plotter.add_mesh(pv.Plane(i_resolution=1, j_resolution=1))
    plotter.screenshot(return_img=True)
    plotter.close()


def render(points: np.ndarray, cells: np.ndarray, rise: np.ndarray, factor: float) -> np.ndarray:
    """Return the image (rows, columns, 3) uint8 without white margins, seen from above one side.

    ``points`` (n, 3) are in m, ``cells`` as in `render.Field`, ``rise`` (n,) in K; z is drawn ``factor`` times as
    large. Faces to the top have the scale's own colours, others are darker by where they face.
    """
    drawn = points * [1e6, 1e6, 1e6 * factor]
    kind = pv.CellType.QUADRATIC_TETRA if cells.shape[1] == 10 else pv.CellType.TRIQUADRATIC_HEXAHEDRON
    grid = pv.UnstructuredGrid({kind: cells}, drawn)
    grid.point_data["rise"] = rise
    surface = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    colours = table()
    lookup = pv.LookupTable(n_values=len(colours))
    lookup.values = np.column_stack([colours, np.full(len(colours), 255)]).astype(np.uint8)
    lookup.scalar_range = (0.0, float(rise.max()))
    # Any, because pyvista's decorators hide the signatures of its methods.
    plotter: Any = pv.Plotter(off_screen=True, window_size=SIZE)
    plotter.set_background("white")
    plotter.add_mesh(
        surface, scalars="rise", cmap=lookup, show_scalar_bar=False, interpolate_before_map=True,
        ambient=AMBIENT, diffuse=(1 - AMBIENT) / LIGHT[2], specular=0.0,
    )  # fmt: skip
    plotter.remove_all_lights()
    plotter.add_light(pv.Light(position=LIGHT, light_type="scene light"))
    edges = surface.extract_feature_edges(30, boundary_edges=False, manifold_edges=False)
    plotter.add_mesh(edges, color="#404040", line_width=1.5, lighting=False)
    plotter.enable_parallel_projection()
    plotter.view_vector((1.0, -0.22, 0.5), viewup=(0, 0, 1))
    plotter.enable_anti_aliasing("ssaa")
    image = np.asarray(plotter.screenshot(return_img=True))[..., :3]
    plotter.close()
    ink = np.any(image < 255, axis=2)
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
