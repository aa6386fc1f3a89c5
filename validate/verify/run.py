"""Running the cases side by side, in processes of their own."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence

from validate.verify.cases import CASES, perform
from validate.verify.rows import Row


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


@contextlib.contextmanager
def single_threaded() -> Iterator[None]:
    """Processes started inside use one thread each for linear algebra: more would only compete."""
    before = os.environ.get("OMP_NUM_THREADS")
    os.environ["OMP_NUM_THREADS"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["OMP_NUM_THREADS"]
        else:
            os.environ["OMP_NUM_THREADS"] = before


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
