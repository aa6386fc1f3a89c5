"""The observed orders in space of every element that is used, on manufactured solutions."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from validate.verify import paths
from validate.verify.answers import Row, observed_order, order_row
from validate.verify.manufactured import Heating, Manufactured

FAMILY = "order in space"
CUTS = {1: (4, 6), 2: (4, 6), 3: (5, 6), 4: (3, 4), 5: (3, 4), 6: (2, 3)}  # of two intervals an axis, by degree
COUPLED_CUTS = CUTS | {4: (4, 5)}  # the rise comes within the tolerance of its order from 4 cuts on only
TRANSIENT_CUTS = {1: (4, 8), 2: (3, 6), 3: (3, 4), 4: (2, 3)}
HEX_CUTS = {1: (3, 6), 2: (3, 5)}
HEX_TRANSIENT = {1: ((2, 4), (4, 8)), 2: ((2, 3), (4, 6))}  # cuts, and steps in time
MEANS = (1, 2, 4)  # degrees: those of twice their order take finer meshes at 3, and drown in rounding from 5 on


def bricks(solution: Manufactured | Heating, *degrees: int) -> Iterator[Row]:
    """This project's bricks on a steady solution, or on a transient, the worst of some instants."""
    for degree in degrees:
        if isinstance(solution, Manufactured):
            kind, cuts = "steady", (COUPLED_CUTS if solution.potential else CUTS)[degree]
            found = [paths.on_bricks(solution, degree, n) for n in cuts]
        else:
            kind, cuts = "transient", TRANSIENT_CUTS[degree]
            times = np.array([0.1, 0.5, 2.0]) / solution.modes[0][0]
            found = [paths.on_bricks_over_time(solution, degree, n, times) for n in cuts]
        yield from _rows(f"brick, {kind}, {solution.name}", degree, found, cuts)


def hexahedra(solution: Manufactured | Heating, *degrees: int) -> Iterator[Row]:
    """scikit-fem's hexahedra on a steady solution, or by the method of order 3 in time, space and time refined
    together."""
    for degree in degrees:
        if isinstance(solution, Manufactured):
            kind, cuts = "steady", HEX_CUTS[degree]
            found = [paths.on_hexahedra(solution, degree, n) for n in cuts]
        else:
            kind, (cuts, steps) = "transient", HEX_TRANSIENT[degree]
            end = 1 / solution.modes[0][0]
            found = [
                paths.on_hexahedra_over_time(solution, degree, n, end, m) for n, m in zip(cuts, steps, strict=True)
            ]
        yield from _rows(f"scikit-fem hexahedron, {kind}, {solution.name}", degree, found, cuts)


def theory(quantity: str, degree: int) -> int:
    """p + 1 in L2, p in H1, 2 p for the power and for means with a smooth weight (Strang and Fix, chapter 3)."""
    return {"L2": degree + 1, "H1": degree}.get(quantity[-2:], 2 * degree)


def _rows(case: str, degree: int, found: list[paths.Errors], cuts: tuple[int, int]) -> Iterator[Row]:
    coarse, fine = found
    for quantity in coarse:
        if degree == 3 and quantity.startswith("potential"):
            # Its part of the next order is as large: 4.21 in L2 from 2 to 3 cuts, 4.18 from 6 to 7, and 3.15 in H1.
            continue
        # The weight suits the dual problem of conduction; that of the coupled problem is less smooth with it.
        means = degree in MEANS and not ("power" in coarse and (quantity == "mean" or degree > 2))
        if means or quantity[-2:] in ("L2", "H1"):
            order = observed_order([coarse[quantity], fine[quantity]], cuts[1] / cuts[0])
            named = "weighted mean" if quantity == "mean" else quantity
            yield order_row(FAMILY, f"{case}, degree {degree}", named, theory(quantity, degree), order)
