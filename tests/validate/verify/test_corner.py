"""Refining an L-shaped conductor where its current is missed."""

from validate.verify import orders


def test_a_mesh_of_few_cells_is_refined_although_halving_most_of_them_is_followed_by_too_many():
    """On 30 cells each trial but the last is followed by so many that the search once ended there."""
    levels = orders.levels(2_000)
    assert levels[-1][0] >= 2_000
    assert levels[-1][1] < levels[0][1] / 5
