"""All cases by family, run side by side in processes of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from importlib.util import find_spec
from itertools import chain
from typing import NamedTuple

from compare.worker import map_tasks
from validate.verify import corner, exact, orders, published, second_path, surroundings
from validate.verify.manufactured import conduction, heating, joule
from validate.verify.report import Row, skipped


class Case(NamedTuple):
    """A family of rows, a name for progress and messages, and the function that makes the rows."""

    family: str
    name: str
    run: Callable[[], Iterator[Row]]


def _second_code() -> Iterator[Row]:
    """The sink by NGSolve; a skipped row where it isn't installed."""
    if find_spec("ngsolve") is None:
        why = "NGSolve is not installed: pip install 'heated-microstructure-validation[ngsolve]'"
        return iter([skipped("second code", "the sink at 1 V, steady", why)])
    from validate.verify import ngsolve_sink

    return ngsolve_sink.rows()


ONE_K, LAYERS = (2.0, 2.0), (1.5, 3.0)  # W/(m K)
ONE_CAPACITY, CAPACITIES = (1.5, 1.5), (1.2, 2.0)  # J/(m3 K)
CASES = (
    Case("orders", "bricks, coupled", lambda: orders.bricks(joule(), 1, 2, 3, 4)),
    Case("orders", "hexahedra", lambda: chain(
        orders.hexahedra(conduction(ONE_K), 1, 2), orders.hexahedra(conduction(LAYERS), 1, 2),
        orders.hexahedra(joule(), 1),
    )),
    Case("orders", "bricks, transient", lambda: chain(
        orders.bricks(heating(ONE_K, ONE_CAPACITY), 1, 2), orders.bricks(heating(LAYERS, CAPACITIES), 1, 2, 3, 4),
    )),
    Case("orders", "bricks, constant k", lambda: orders.bricks(conduction(ONE_K), 1, 2, 3, 4)),
    Case("orders", "bricks, k in layers", lambda: orders.bricks(conduction(LAYERS), 1, 2, 3, 4, 5, 6)),
    Case("orders", "hexahedra, transient", lambda: orders.hexahedra(heating(LAYERS, CAPACITIES), 1, 2)),
    Case("orders", "L-shaped conductor, tetrahedra", corner.rows),
    Case("orders", "exponential collocation", orders.exponential_collocation),
    Case("orders", "SDIRK", lambda: orders.diagonally_implicit(heating(LAYERS, CAPACITIES))),
    Case("orders", "Runge-Kutta", orders.runge_kutta),
    Case("orders", "Crank-Nicolson", orders.layer),
    Case("orders", "partitioned scheme", orders.partitioned),
    Case("orders", "device", orders.device_estimate),
    Case("exact", "slab, step", exact.slab_step),
    Case("exact", "slab, film", exact.slab_film),
    Case("exact", "heated slab", exact.heated_slab),
    Case("exact", "ramped slab", exact.ramped_slab),
    Case("exact", "two layers, steady", exact.layers_steady),
    Case("exact", "two layers, transient", exact.layers_transient),
    Case("exact", "thin layer", exact.thin_layer),
    Case("exact", "brick", exact.brick),
    Case("exact", "Joule-heated bar", exact.joule_bar),
    Case("exact", "L-shaped conductor", exact.bend),
    Case("exact", "partial electrodes", exact.partial_electrodes),
    Case("exact", "contacts at faces", surroundings.contact_at_a_face),
    Case("exact", "given current", surroundings.given_current),
    Case("exact", "three conductivities", surroundings.anisotropic_block),
    Case("exact", "conductivity by a law", surroundings.following_conductivity),
    Case("exact", "radiating slab", surroundings.radiation),
    Case("exact", "source on a plate", surroundings.spreading),
    Case("published", "NAFEMS T3", published.nafems_t3),
    Case("published", "NAFEMS T4", published.nafems_t4),
    Case("published", "ISO 10211 case 1", published.iso_case_1),
    Case("published", "ISO 10211 case 2", published.iso_case_2),
    Case("published", "ISO 10211 case 3", published.iso_case_3),
    Case("published", "ISO 10211 case 4", published.iso_case_4),
    Case("second", "Newton on hexahedra", second_path.rows),
    Case("second", "NGSolve", _second_code),
)  # fmt: skip


def perform(number: int) -> list[Row]:
    """The rows of a case by its number; one row that says so where the case ends in an error."""
    case = CASES[number]
    rows: list[Row] = []
    try:
        for row in case.run():
            rows.append(row)
    except Exception as error:
        said = f"ended with {type(error).__name__}: {error}"
        rows.append(Row(case.family, case.name, "whole case", "", math.nan, math.nan, math.nan, note=said))
    return rows


def run(families: Sequence[str], jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """The rows of all cases of some families, in the order of `CASES`, by ``jobs`` processes (1: this one)."""
    chosen = [number for number, case in enumerate(CASES) if case.family in families]
    results: dict[int, list[Row]] = {}
    progress(f"{len(chosen)} cases")
    for number, rows in map_tasks(perform, chosen, jobs):
        results[number] = rows
        waiting = [CASES[n].name for n in chosen if n not in results]
        progress(f"{len(results)} of {len(chosen)} cases done; next {waiting[0]}" if waiting else "writing")
    return [row for number in chosen for row in results[number]]
