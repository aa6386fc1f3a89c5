"""Tiles of a plan, and the triangles that they are cut into."""

from __future__ import annotations

import numpy as np
import pytest

from meshes.tiles import UNIT, WIDEST, Tiles

BREAKS = (np.array([0.0, 1.0, 1.1, 5.0, 40.0]), np.array([0.0, 2.0, 2.05, 9.0]))
# All, a rectangle inside, one that touches it, a line, and a point.
RECTANGLES = np.array([[[0, 4], [0, 3]], [[1, 3], [1, 2]], [[2, 4], [2, 3]], [[3, 3], [0, 1]], [[1, 1], [2, 2]]])


def checked(tiles: Tiles) -> np.ndarray:
    """The corners (n, 3, 2) of the triangles of tiles, which cover the plan once and have no wide angles."""
    triangles, of = tiles.triangles
    corners = tiles.points[triangles]
    (a, b), (c, d) = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    areas = (a * d - b * c) / 2
    assert areas.min() > 0
    assert np.allclose(np.bincount(of, areas), tiles.sizes.prod(axis=1), rtol=1e-9)
    # An edge belongs to two triangles, which traverse it in opposite directions, or lies on the outline.
    directed = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    assert len(np.unique(directed, axis=0)) == len(directed)
    alone = np.flatnonzero(~(directed[:, None] == directed[None, :, ::-1]).all(axis=2).any(axis=1))
    ends = tiles.places[directed[alone]]
    on_outline = (ends[:, 0] == ends[:, 1]) & ((ends[:, 0] == 0) | (ends[:, 0] == np.array([4, 3]) * UNIT))
    assert on_outline.any(axis=1).all()
    to, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    lengths = np.linalg.norm(to, axis=2) * np.linalg.norm(back, axis=2)
    assert ((to * back).sum(axis=2) / lengths).min() >= np.cos(WIDEST) - 1e-9
    return corners


def test_every_part_of_a_plan_is_made_of_tiles() -> None:
    tiles = Tiles.of(BREAKS, RECTANGLES)
    checked(tiles)
    for (x0, x1), (y0, y1) in RECTANGLES.tolist():
        low, high = np.array([x0, y0]) * UNIT, np.array([x1, y1]) * UNIT
        inside = (tiles.low >= low).all(axis=1) & (tiles.high <= high).all(axis=1)
        area = np.diff(BREAKS[0][[x0, x1]])[0] * np.diff(BREAKS[1][[y0, y1]])[0]
        assert np.isclose(tiles.sizes[inside].prod(axis=1).sum(), area)
        corners = {tuple(p) for p in tiles.places.tolist()}
        assert {tuple(low.tolist()), tuple(high.tolist())} <= corners


def test_a_tile_is_halved_along_the_axis_asked_for_and_stays_as_long_along_the_other() -> None:
    tiles = Tiles.of(BREAKS, RECTANGLES[:1])
    assert len(tiles.low) == 1
    for _ in range(3):
        tiles, parents = tiles.finer(np.tile([False, True], (len(tiles.low), 1)))
        assert set(np.bincount(parents).tolist()) == {2}
    checked(tiles)
    assert len(tiles.low) == 8
    assert np.allclose(tiles.sizes, [40.0, 9.0 / 8], rtol=2e-3)


@pytest.mark.parametrize(
    ("ends", "sizes"), [((0, 0), (20, 20)), ((1, 0), (10, 30)), ((0, 1), (30, 10)), ((1, 1), (20, 20))]
)
def test_a_tile_is_cut_near_the_end_that_has_a_sharp_edge(ends: tuple[int, int], sizes: tuple[float, float]) -> None:
    tiles = Tiles.of(BREAKS, RECTANGLES[:1])
    near = np.zeros((1, 2, 2), bool)
    near[0, 0] = ends
    finer, _ = tiles.finer(np.array([[True, False]]), near)
    checked(finer)
    assert np.allclose(finer.sizes[finer.low[:, 0].argsort()], [[x, 9.0] for x in sizes], rtol=1e-2)


def test_tiles_that_get_corners_from_others_are_cut_until_no_angle_is_wide() -> None:
    tiles, random = Tiles.of(BREAKS, RECTANGLES), np.random.default_rng(1)
    for _ in range(3):
        tiles, parents = tiles.finer(random.random((len(tiles.low), 2)) < 0.4)
        assert parents.max() < len(tiles.low)
        checked(tiles)
