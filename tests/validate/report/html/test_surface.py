"""The surface for the page's scene: the shape exact at any thinning, every value that of its place."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from validate.report.figures import table
from validate.report.html.surface import Surface, packed, surface


def bricks(*boxes: tuple[tuple[float, float], ...], cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """Boxes cut into cubes, their points not shared between boxes."""
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    numbers = np.arange((cuts + 1) ** 3).reshape(3 * (cuts + 1,))
    one = np.stack([numbers[i : i + cuts, j : j + cuts, k : k + cuts].ravel() for i, j, k in corners], axis=1)
    grids = [np.meshgrid(*(np.linspace(*side, cuts + 1) for side in box), indexing="ij") for box in boxes]
    points = [np.stack(grid, axis=-1).reshape(-1, 3) for grid in grids]
    return np.concatenate(points), np.concatenate([one + n * numbers.size for n in range(len(boxes))])


def area(found: Surface) -> float:
    sides = np.sort(np.ptp(found.points[found.faces], axis=1), axis=1)
    return float((sides[:, 1] * sides[:, 2]).sum())


BEAM, PAD = ((0.0, 1.0), (0.0, 4.0), (0.0, 0.5)), ((0.0, 1.0), (4.0, 6.0), (0.0, 0.5))


@pytest.mark.parametrize("most", [10_000, 100, 20])
def test_shape_and_values_are_exact(most: int) -> None:
    """Two boxes that touch: their common face is inside. Area of the whole: 2 (1 x 6 + 1 x 0.5 + 6 x 0.5)."""
    points, hexes = bricks(BEAM, PAD, cuts=8)

    def value(p: np.ndarray) -> np.ndarray:
        return np.sin(p[:, 1]) + p[:, 0] + 2 * p[:, 2]

    found = surface(points, hexes, value(points), most)
    assert area(found) == pytest.approx(19.0, rel=1e-12)
    assert found.values == pytest.approx(value(found.points), abs=1e-12)
    assert found.values.max() == value(points).max()
    assert len(found.points) <= max(most, 40)


def test_a_shape_that_is_not_closed_has_another_area() -> None:
    points, hexes = bricks(BEAM, PAD, cuts=8)
    inside = 4 * 64 + 4 * 8 + 4
    assert area(surface(points, np.delete(hexes, inside, axis=0), points[:, 0])) != pytest.approx(19.0, rel=1e-6)


def test_edges_are_where_the_surface_bends() -> None:
    points, hexes = bricks(BEAM, cuts=4)
    found = surface(points, hexes, points[:, 0])
    ends = found.points[found.edges]
    assert np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum() == pytest.approx(4 * (1.0 + 4.0 + 0.5))


def test_packed_is_what_the_script_reads() -> None:
    points, hexes = bricks(BEAM, cuts=4)
    found = surface(points, hexes, points[:, 1])
    data = json.loads(packed(found, table(), 20.0))
    places = np.frombuffer(base64.b64decode(data["places"]), "<u2").reshape(-1, 3)
    values = np.frombuffer(base64.b64decode(data["values"]), "<u2")
    assert places / 65535 * np.array(data["size"]) * 1e-6 == pytest.approx(found.points, abs=1e-4)
    assert values / 65535 * 4.0 == pytest.approx(found.values, abs=1e-4)
    triangles = np.frombuffer(base64.b64decode(data["triangles"]), "<u4")
    assert (triangles.max(), len(triangles)) == (len(found.points) - 1, 6 * len(found.faces))
    assert len(base64.b64decode(data["colours"])) == 768
