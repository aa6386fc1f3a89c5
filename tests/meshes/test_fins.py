"""The degrees that the first grid gives to fins."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import legendre

from meshes import grading
from meshes.grid import Grid
from scenes.model import Boundary, Box, Material, Scene

HIGHEST = grading.HIGHEST_DEGREE
LENGTH, THICK = 4e-4, 2e-6
SILICON = Material("silicon", 130.0, 2330.0, 700.0)


def fin(coefficient, thick=THICK):
    """A strip whose underside a film cools: its rise falls over sqrt(k t / h)."""
    strip = Box("strip", SILICON, (0.0, 0.0, 0.0), (5e-5, LENGTH, thick))
    film = Boundary("gas", "convection", (0.0, 0.0, 0.0), (5e-5, LENGTH, 0.0), coefficient, ambient=293.0)
    hot = Boundary("hot", "temperature", (0.0, 0.0, 0.0), (5e-5, 0.0, thick), 300.0)
    return Scene("fin", (strip,), (film, hot), ())


def degree(scene, accuracy):
    """That of the strip in one interval."""
    box = scene.boxes[0]
    grid = Grid(
        tuple(np.array([a, b]) for a, b in zip(box.lower, box.upper, strict=True)), (np.array([2]),) * 3, scene.boxes
    )
    return int(grading.fins.suited(grid, scene, accuracy, HIGHEST).degrees[1][0])


def missed(a, p):
    """The part of the energy of exp(a x) on (-1, 1) that degree p leaves, by the Legendre coefficients of its slope."""
    x, w = legendre.leggauss(60)
    slope = a * np.exp(a * x)
    coefficients = [(w * slope) @ legendre.legval(x, np.eye(n + 1)[n]) for n in range(p, 40)]
    left = sum(c**2 * (2 * n + 1) / 2 for n, c in enumerate(coefficients, start=p))
    return left / (w @ slope**2)


@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_fin_has_the_degrees_that_its_decay_takes(accuracy):
    coefficient = 13e3
    a = LENGTH / 2 / np.sqrt(130.0 * THICK / coefficient)
    p = degree(fin(coefficient), accuracy)
    assert 2 < p < HIGHEST
    assert missed(a, p) < accuracy
    assert missed(a, p - 2) > accuracy


def test_what_is_no_fin_keeps_its_degrees():
    assert degree(fin(1e-3), 1e-4) == 2
    assert degree(fin(2 * 130.0 / THICK), 1e-4) == 2
    assert degree(replace(fin(13e3), boundaries=fin(13e3).boundaries[1:]), 1e-4) == 2


def test_where_even_the_highest_degree_is_too_low_the_search_decides():
    assert degree(fin(13e3 * 100), 1e-5) == 2
