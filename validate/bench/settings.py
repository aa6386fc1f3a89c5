"""The settings of each full-order tool, found by trial: those that none of its others clearly beats in both time and
error. Orders in time and steps are such that the error in time is no larger than that in space."""

from __future__ import annotations

UNIFORM, FULL = "uniform", "full"

# degree, that across thin layers, grading, accuracy of iterations and steps, generations of Krylov fields
GIVEN: dict[bool, tuple[tuple[int, int, float, float, int], ...]] = {
    True: (
        (2, 2, 1e-2, 1e-2, 3),
        (3, 2, 1e-2, 1e-2, 3),
        (3, 2, 1e-3, 1e-3, 4),
        (4, 3, 1e-3, 1e-4, 5),
        (5, 3, 1e-3, 1e-4, 6),
        (5, 3, 1e-4, 1e-5, 8),
        (6, 3, 1e-4, 1e-5, 8),
        (7, 4, 1e-5, 1e-5, 8),
    ),
    False: (
        (2, 2, 1e-2, 1e-2, 0),
        (3, 2, 1e-2, 1e-2, 0),
        (3, 2, 1e-3, 1e-2, 0),
        (4, 3, 1e-3, 1e-3, 0),
        (5, 3, 1e-3, 1e-3, 0),
        (5, 3, 1e-4, 1e-3, 0),
        (6, 3, 1e-4, 1e-4, 0),
        (7, 3, 1e-4, 1e-4, 0),
        (7, 4, 1e-5, 1e-4, 0),
    ),
}
# degree, grading, cuts, steps an octave, order in time, tolerance of the iterations
SCIKIT_FEM: dict[bool, tuple[tuple[int, float, int, int, int, float], ...]] = {
    True: (
        (2, 1e-2, 1, 1, 3, 1e-4),
        (2, 1e-2, 1, 1, 4, 1e-4),
        (2, 1e-3, 2, 1, 4, 1e-4),
        (2, 1e-3, 2, 2, 4, 1e-4),
        (2, 1e-3, 3, 2, 4, 1e-4),
        (2, 1e-3, 4, 2, 4, 1e-4),
        (2, 1e-4, 6, 3, 4, 1e-5),
    ),
    False: (
        (2, 1e-2, 1, 0, 3, 1e-4),
        (2, 1e-3, 1, 0, 3, 1e-4),
        (2, 1e-3, 2, 0, 3, 1e-5),
        (2, 1e-4, 2, 0, 3, 1e-5),
        (2, 1e-3, 3, 0, 3, 1e-5),
        (2, 1e-4, 4, 0, 3, 1e-6),
        (2, 1e-4, 6, 0, 3, 1e-6),
    ),
}
# order, that across thin layers, grading, electric problem, steps an octave, order in time, tolerance of the iterations
NGSOLVE: dict[bool, tuple[tuple[int, int, float, str, int, int, float], ...]] = {
    True: (
        (2, 1, 1e-2, UNIFORM, 1, 2, 1e-3),
        (2, 1, 1e-2, UNIFORM, 1, 3, 1e-3),
        (3, 1, 1e-2, UNIFORM, 1, 4, 1e-3),
        (3, 1, 1e-2, FULL, 1, 4, 1e-3),
        (3, 1, 1e-3, UNIFORM, 2, 4, 1e-4),
        (4, 2, 1e-2, UNIFORM, 2, 4, 1e-5),
        (4, 2, 1e-3, UNIFORM, 2, 4, 1e-4),
        (4, 2, 1e-3, FULL, 2, 4, 1e-4),
        (5, 2, 1e-3, UNIFORM, 2, 4, 1e-5),
        (5, 2, 1e-3, UNIFORM, 3, 4, 1e-6),
        (6, 2, 1e-3, UNIFORM, 3, 4, 1e-6),
        (6, 2, 1e-4, UNIFORM, 3, 4, 1e-6),
    ),
    False: (
        (2, 1, 1e-2, UNIFORM, 0, 2, 1e-4),
        (2, 1, 1e-3, UNIFORM, 0, 2, 1e-4),
        (2, 1, 1e-3, FULL, 0, 2, 1e-4),
        (3, 1, 1e-2, UNIFORM, 0, 2, 1e-4),
        (3, 1, 1e-3, UNIFORM, 0, 2, 1e-4),
        (3, 2, 1e-3, UNIFORM, 0, 2, 1e-5),
        (3, 2, 1e-3, FULL, 0, 2, 1e-5),
        (4, 2, 1e-3, UNIFORM, 0, 2, 1e-5),
        (4, 2, 1e-4, UNIFORM, 0, 2, 1e-5),
        (4, 2, 1e-5, UNIFORM, 0, 2, 1e-5),
        (4, 2, 1e-5, FULL, 0, 2, 1e-5),
        (5, 2, 1e-4, UNIFORM, 0, 2, 1e-6),
        (6, 2, 1e-4, UNIFORM, 0, 2, 1e-6),
    ),
}
# order, grading, cuts, steps an octave, order in time
FREEFEM: dict[bool, tuple[tuple[int, float, int, int, int], ...]] = {
    True: (
        (2, 1e-2, 1, 1, 3),
        (2, 1e-3, 1, 1, 4),
        (3, 1e-2, 1, 1, 4),
        (3, 1e-3, 1, 1, 4),
        (2, 1e-3, 2, 1, 4),
        (3, 1e-3, 2, 2, 4),
        (3, 1e-4, 3, 3, 4),
    ),
    False: (
        (2, 1e-2, 1, 0, 3),
        (2, 1e-3, 1, 0, 3),
        (3, 1e-2, 1, 0, 3),
        (2, 1e-3, 2, 0, 3),
        (3, 1e-3, 1, 0, 3),
        (3, 1e-3, 2, 0, 3),
        (3, 1e-4, 2, 0, 3),
        (3, 1e-4, 3, 0, 3),
    ),
}
