"""The sink's steady state by a second, independent code, an optional extra: NGSolve's elements, assembly and solvers,
the electric problem in full, on bricks that are graded as this project's are, at two orders."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from scenes.sink import OF_A_SINK, Sink
from validate.verify.report import Row, skipped

FAMILY, CASE = "second code", "the sink at 1 V, steady"
ORDERS = (3, 4)
ACCURACY, GRADING = 1e-4, 1e-6
SETTLED = 1e-11  # of the rise


def sink_steady() -> Iterator[Row]:
    """This project's sink against NGSolve's, each with its estimated error; a skipped row where it isn't installed."""
    try:
        import ngsolve
    except ImportError:
        yield skipped(FAMILY, CASE, "NGSolve is not installed: pip install 'heated-microstructure-validation[ngsolve]'")
        return
    from fem3d.run import solve
    from scenes.plan import Request

    ours = solve(Sink(accuracy=ACCURACY), Request(transient=False)).steady
    lower, higher = (by_ngsolve(Sink(), order) for order in ORDERS)
    note = f"NGSolve {ngsolve.__version__}, orders {ORDERS[0]} and {ORDERS[1]}"
    for key, _, unit, name in OF_A_SINK.values():
        value, theirs = higher[key], abs(higher[key] - lower[key])
        yield Row(FAMILY, CASE, name, unit, value, ours[key].value, ours[key].error + theirs,
                  2 * ACCURACY * abs(value), note)  # fmt: skip


def by_ngsolve(sink: Sink, order: int) -> dict[str, float]:
    """The steady quantities of a whole sink with electrodes at the beam's ends and no air, in NGSolve at an order."""
    from meshes import grading, symmetry
    from validate.verify import methods, ngsolve_sink

    scene = symmetry.reduce(sink.scene()).scene
    first = grading.first_grid(scene, GRADING, grading.features(scene))
    grid = first.with_axes(first.breaks, [np.full(len(d), order) for d in first.degrees])
    problem = ngsolve_sink.Problem(sink, ngsolve_sink.mesh_of(grid), grid, order, order, "full", steady=True)
    peak, end, mean, current = problem.quantities(methods.settle(problem, SETTLED))
    # All heat leaves through the substrate, and the equations say so for any space that has the constants.
    power = current * sink.voltage
    found = (peak, end, mean, current, power, power, 2 * end / power)
    return dict(zip((asked.steady for asked in OF_A_SINK.values()), found, strict=True))
