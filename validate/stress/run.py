"""All tests of robustness, in order."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from validate.stress import compact_models, drives, extremes, steps, sweep
from validate.stress.report import Row, failed

QUICK_SCENES = 24


def run(quick: bool, scenes: int, seed: int, jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """The rows; ``quick`` takes fewer of each kind, ``scenes`` random ones from ``seed`` on."""
    parts: dict[str, Callable[[], Iterator[Row]]] = {
        "time steps": steps.rows,
        "explicit coupling": lambda: steps.coupling(quick),
        "aspect ratios": lambda: extremes.aspect_ratios(quick),
        "contrasts": lambda: extremes.contrasts(quick),
        "voltages": lambda: extremes.runaway(quick),
        "drives": lambda: drives.rows(quick),
        "accuracies": lambda: extremes.accuracies(quick),
        "compact models": lambda: compact_models.rows(quick, seed),
    }
    found: list[Row] = []
    for name, part in parts.items():
        progress(name)
        try:
            for row in part():
                found.append(row)
        except Exception as error:
            found.append(failed(name, name, error))
    return found + list(sweep.rows(sweep.sweep(seed, scenes, jobs, progress)))
