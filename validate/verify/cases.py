"""All cases by family, run side by side in processes of their own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from math import inf
from typing import NamedTuple

from benchmarks.rows import Row, failed
from compare.worker import DIED, map_tasks
from scenes.errors import NumericsError
from validate.verify import exact, orders, orders_in_time, published, second_path, surroundings
from validate.verify.manufactured import CAPACITIES, LAYERS, ONE_CAPACITY, ONE_K, heating, joule


class Case(NamedTuple):
    """A family of rows, a name for progress and messages, and the function that makes the rows."""

    family: str
    name: str
    run: Callable[[], Iterator[Row]]


def _cases(family: str, *functions: Callable[[], Iterator[Row]]) -> Iterator[Case]:
    """Yield the cases of functions, named after them."""
    yield from (Case(family, function.__name__.replace("_", " "), function) for function in functions)


CASES = (
    Case("orders", "bricks, coupled", lambda: orders.bricks(joule(), 1, 2, 3, 4)),
    Case("orders", "bricks, transient", lambda: chain(
        orders.bricks(heating(ONE_K, ONE_CAPACITY), 1, 2), orders.bricks(heating(LAYERS, CAPACITIES), 1, 2, 3, 4),
    )),
    Case("orders", "bricks, constant k", lambda: orders.bricks(heating(ONE_K, ONE_CAPACITY).at(inf), 1, 2, 3, 4)),
    Case("orders", "bricks, k in layers", lambda: orders.bricks(heating(LAYERS, CAPACITIES).at(inf), *range(1, 7))),
    Case("orders", "L-shaped conductor, tetrahedra", orders.rows),
    *_cases("orders", orders_in_time.exponential_collocation, orders_in_time.runge_kutta,
            orders_in_time.layer, orders_in_time.partitioned,
            orders_in_time.device_estimate),
    *_cases("exact", exact.slab_step, exact.slab_film, exact.heated_slab, exact.ramped_slab, exact.layers_steady,
            exact.layers_transient, exact.thin_layer, exact.brick, exact.joule_bar, exact.bend,
            exact.partial_electrodes, surroundings.contact_at_a_face, surroundings.given_current,
            surroundings.anisotropic_block, surroundings.following_conductivity, surroundings.radiation,
            surroundings.spreading),
    *_cases("published", published.nafems_t3, published.nafems_t4, published.iso_case_1, published.iso_case_2,
            published.iso_case_3, published.iso_case_4),
    Case("second", "Newton on hexahedra", second_path.rows),
)  # fmt: skip


def perform(number: int) -> list[Row]:
    """Return the rows of a case by its number; a case that ends in an error adds a row with the error."""
    case = CASES[number]
    rows: list[Row] = []
    try:
        for row in case.run():
            rows.append(row)
    except Exception as error:
        rows.append(failed(case.family, case.name, error))
    return rows


def run(families: Sequence[str], jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """The rows of all cases of some families, in the order of `CASES`, by ``jobs`` processes (1: this one)."""
    chosen = [number for number, case in enumerate(CASES) if case.family in families]
    results: dict[int, list[Row]] = {}
    progress(f"{len(chosen)} cases")

    def died(number: int) -> list[Row]:
        return [failed(CASES[number].family, CASES[number].name, NumericsError(DIED))]

    for number, rows in map_tasks(perform, chosen, jobs, died):
        results[number] = rows
        waiting = [CASES[n].name for n in chosen if n not in results]
        progress(f"{len(results)} of {len(chosen)} cases done; next {waiting[0]}" if waiting else "writing")
    return [row for number in chosen for row in results[number]]
