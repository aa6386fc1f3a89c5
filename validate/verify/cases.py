"""All cases by family, each a named function without arguments, run side by side in processes of their own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from validate.processes import single_threaded
from validate.verify import exact_bodies, exact_walls, integrators, iso10211, manufactured, orders, published
from validate.verify.answers import Row
from validate.verify.second_code import sink_steady


@dataclass(frozen=True)
class Case:
    """A family of rows, a name for progress and messages, and the function that makes the rows."""

    family: str
    name: str
    run: Callable[[], Iterator[Row]]


def bricks_constant() -> Iterator[Row]:
    """Steady conduction on bricks."""
    return orders.steady(manufactured.conduction(layered=False), (1, 2, 3, 4))


def bricks_layered() -> Iterator[Row]:
    """Steady conduction in layers on bricks."""
    return orders.steady(manufactured.conduction(layered=True), (1, 2, 3, 4, 5, 6))


def bricks_joule() -> Iterator[Row]:
    """The coupled problem on bricks."""
    return orders.steady(manufactured.joule(), (1, 2, 3, 4))


def bricks_heating() -> Iterator[Row]:
    """The transient on bricks, of one material and in layers."""
    yield from orders.transient(manufactured.heating(layered=False), (1, 2))
    yield from orders.transient(manufactured.heating(layered=True), (1, 2, 3, 4))


def hexahedra_steady() -> Iterator[Row]:
    """Steady problems on scikit-fem's hexahedra."""
    for layered in (False, True):
        yield from orders.hexahedron(manufactured.conduction(layered), (1, 2))
    yield from orders.hexahedron(manufactured.joule(), (1,))


def hexahedra_transient() -> Iterator[Row]:
    """A transient on scikit-fem's hexahedra."""
    return orders.hexahedron_transient(manufactured.heating(layered=True))


CASES = (
    Case("orders", "bricks, coupled", bricks_joule),
    Case("orders", "hexahedra", hexahedra_steady),
    Case("orders", "bricks, transient", bricks_heating),
    Case("orders", "bricks, constant k", bricks_constant),
    Case("orders", "bricks, k in layers", bricks_layered),
    Case("orders", "hexahedra, transient", hexahedra_transient),
    Case("orders", "exponential collocation", integrators.exponential_collocation),
    Case("orders", "SDIRK", integrators.diagonally_implicit),
    Case("orders", "Runge-Kutta", integrators.runge_kutta),
    Case("orders", "Crank-Nicolson", integrators.layer),
    Case("orders", "partitioned scheme", integrators.partitioned),
    Case("orders", "device", integrators.device_estimate),
    Case("exact", "slab, step", exact_walls.slab_step),
    Case("exact", "slab, film", exact_walls.slab_film),
    Case("exact", "heated slab", exact_walls.heated_slab),
    Case("exact", "ramped slab", exact_walls.ramped_slab),
    Case("exact", "two layers, steady", exact_walls.layers_steady),
    Case("exact", "two layers, transient", exact_walls.layers_transient),
    Case("exact", "thin layer", exact_walls.thin_layer),
    Case("exact", "brick", exact_bodies.brick),
    Case("exact", "Joule-heated bar", exact_bodies.joule_bar),
    Case("exact", "L-shaped conductor", exact_bodies.bend),
    Case("exact", "partial electrodes", exact_bodies.partial_electrodes),
    Case("published", "NAFEMS T3", published.nafems_t3),
    Case("published", "NAFEMS T4", published.nafems_t4),
    Case("published", "ISO 10211 case 1", published.iso_case_1),
    Case("published", "ISO 10211 case 2", iso10211.case_2),
    Case("published", "ISO 10211 case 3", iso10211.case_3),
    Case("published", "ISO 10211 case 4", iso10211.case_4),
    Case("second", "NGSolve", sink_steady),
)


def perform(number: int) -> list[Row]:
    """The rows of a case by its number; one row that says so where the case ends in an error."""
    case = CASES[number]
    found: list[Row] = []
    try:
        for row in case.run():
            found.append(row)
    except Exception as error:
        said = f"ended with {type(error).__name__}: {error}"
        found.append(Row(case.family, case.name, "whole case", "", math.nan, math.nan, math.nan, note=said))
    return found


def run(families: Sequence[str], jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """The rows of all cases of some families, in the order of `CASES`, by ``jobs`` processes (1: this one)."""
    chosen = [number for number, case in enumerate(CASES) if case.family in families]
    found: dict[int, list[Row]] = {}

    def say() -> None:
        waiting = [CASES[number].name for number in chosen if number not in found]
        progress(f"{len(found)} of {len(chosen)} cases done; next {waiting[0]}" if waiting else "writing")

    say()
    if jobs == 1:
        for number in chosen:
            found[number] = perform(number)
            say()
    else:
        _side_by_side(chosen, jobs, found, say)
    return [row for number in chosen for row in found[number]]


def _side_by_side(chosen: list[int], jobs: int, found: dict[int, list[Row]], say: Callable[[], None]) -> None:
    from concurrent.futures import ProcessPoolExecutor, as_completed
    from multiprocessing import get_context

    with single_threaded(), ProcessPoolExecutor(jobs, get_context("spawn")) as pool:
        futures = {pool.submit(perform, number): number for number in chosen}
        for future in as_completed(futures):
            found[futures[future]] = future.result()
            say()
