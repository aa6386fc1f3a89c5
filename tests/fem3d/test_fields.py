"""Fields of the whole structure from its symmetric part, and matrices that no factorization takes."""

import numpy as np
import pytest
from scipy.sparse import csc_array

from fem3d.problems.cholesky import Factors, Ordering
from fem3d.runs import sink as sink_run
from scenes.errors import NumericsError
from scenes.sink import Sink


def volumes(points, hexes):
    """Signed volumes of bricks in VTK's order."""
    corners = points[hexes]
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 3, 4))
    return np.einsum("ij,ij->i", np.cross(a, b), c)


@pytest.fixture(scope="module")
def result():
    return sink_run.solve(Sink(accuracy=1e-2, voltage=3.0))


def test_hexahedra_fill_the_structure(result):
    fields = result.details["fields"]
    found = volumes(fields.points, fields.hexes)
    assert found.min() > 0
    exact = {"silicon": 2e-6 * (1000 * 100 + 2 * 150 * 150) * 1e-12, "oxide": 2 * 50 * 50 * 2e-18}
    for number, name in enumerate(fields.material_names):
        assert abs(found[fields.material == number].sum() / exact[name] - 1) < 1e-12
    assert volumes(fields.points, np.roll(fields.hexes, 4, axis=1)).max() < 0


def test_field_is_symmetric_and_has_solution_peak(result):
    fields, rise = result.details["fields"], result.details["profile"]
    points, steady = fields.points, fields.steady
    assert abs(steady.max() - 293.0 - rise["rise_K"].max()) < 1e-2 * rise["rise_K"].max()
    assert steady.min() == 293.0
    key = np.round(points / 1e-11).astype(np.int64)
    at = {tuple(k): t for k, t in zip(key, steady, strict=True)}
    mirrored = np.round((points * [-1, 1, 1]) / 1e-11).astype(np.int64)
    assert max(abs(at[tuple(k)] - t) for k, t in zip(mirrored, steady, strict=True)) < 1e-9
    over_time = fields.at(np.array([0.0, 0.02]))
    assert over_time.shape == (2, len(points))
    assert np.abs(over_time[0] - 293.0).max() < 1e-9
    # At 20 ms the peak is at its end but for a part in 10^4.
    assert abs((over_time[1].max() - 293.0) / (steady.max() - 293.0) - 1) < 1e-2


def test_a_steady_run_has_no_fields_over_time():
    fields = sink_run.solve(Sink(accuracy=1e-2), transient=False).details["fields"]
    with pytest.raises(ValueError, match="no transient"):
        fields.at(np.array([0.0]))


def test_an_indefinite_matrix_is_refused():
    matrix = csc_array(np.diag([1.0, 2.0, -1e-9, 1.0]))
    with pytest.raises(NumericsError, match="rounding leaves no solution"):
        Factors(matrix, np.arange(4), Ordering(np.eye(4, 3)))


def test_factors_refuse_coupling_unknown_to_ordering():
    """Against numpy, for matrices of groups of several unknowns; with one more coupling an ordering made for another
    matrix solved some of them wrong."""
    for seed in range(40):
        random = np.random.default_rng(seed)
        count = 80
        groups = np.repeat(np.arange(count), random.integers(1, 5, count))
        places = np.column_stack([np.arange(count), random.random(count), random.random(count)])
        near = np.abs(places[:, None, 0] - places[None, :, 0]) <= 3
        near &= random.random((count, count)) < 0.5
        coupled = (near | near.T | np.eye(count, dtype=bool))[np.ix_(groups, groups)]
        dense = np.where(coupled, -random.random(coupled.shape), 0.0)
        dense = dense + dense.T + np.diag(3.0 * coupled.sum(axis=1))
        u, ordering = random.random(len(groups)), Ordering(places)
        for matrix in (dense, dense + np.diag(random.random(len(groups)))):
            factors = Factors(csc_array(matrix), groups, ordering)
            assert np.abs(factors.solve(matrix @ u) - np.linalg.solve(matrix, matrix @ u)).max() < 1e-12
        wrong = dense.copy()
        i, j = np.flatnonzero(groups == 0)[0], np.flatnonzero(groups == count - 1)[0]
        wrong[i, j] = wrong[j, i] = -0.5
        with pytest.raises(NumericsError, match="couples unknowns"):
            Factors(csc_array(wrong), groups, ordering)
        assert np.abs(Factors(csc_array(wrong), groups, Ordering(places)).solve(wrong @ u) - u).max() < 1e-12
