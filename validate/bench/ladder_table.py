"""The table of the reductions against converged 3D: ``python -m validate.bench.ladder_table [--accuracy 1e-5]``.

Writes docs/reductions.md (``--out``), every number of which is found by the run: errors, times, and where the plate
ends. Takes a few minutes, nearly all of it for the 3D solutions.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fem3d.runs.sink import solve as solve_3d
from reduced1d import ladder
from reduced1d.ladder.few_states import over_time
from reduced1d.ladder.levels import Levels
from scenes.checks import FIRST_TIME
from scenes.formats import percent, quantity
from scenes.loading import load
from scenes.plan import Request
from scenes.result import Result
from scenes.sink import Sink
from validate.report.table import Table

REPEATS = 7
"""Runs of which a time is the smallest, for what else the machine does only adds to it."""
SCENES = {
    "The paper's sink": [],
    "Beam 20 um wide": ["sink.width=20um"],
    "Silicon 5 um thick": ["sink.thickness=5um"],
    "Oxide 100 um x 100 um": ["anchor.oxide_length=100um", "anchor.oxide_width=100um"],
    "Electrodes at the pads' outer faces": ["drive.electrodes=pad-edge"],
}
MODELS = ("paper", "anchored", "fin-massless", "fin", "plate", "moments:3", "moments:4")
PADS = ("100um", "150um", "300um", "600um", "1200um")
THICKNESSES = ("1um", "2um", "5um", "10um", "20um", "50um")
RESISTANCE = "anchor_resistance_K_per_W"

_HEAD = """\
# Reductions of the sink, from the paper's to the plate

Made by `python -m validate.bench.ladder_table --accuracy {accuracy}`; every number here is that command's output.

{models}
Errors are the largest distance from 3D at any time from 10 us on, relative to the final rise, for the current to its
change from the cold sink's; anchor resistance is the steady end rise over the heat through an end. The 3D solution's
own error bounds stand above each table: no difference is known more closely. *Build* is the time from a sink to the
model's matrices, then as a part of the time of the 3D steady state at an accuracy of 1e-3; *evaluate* is the time of a
transient of {times} times to the scene's end. Both are processor times, the shortest of {repeats} on one machine, after
imports.
"""
_THIN = """\
## Where the plate ends

The paper's sink with silicon of several thicknesses: how far the plate's anchor resistance is from 3D's, what the plate
says itself that it may be (`reduced1d/ladder/anchor.py`, first order of what it neglects), and whether it warns.
"""
_SLOW = """\
## Where the fin ends

The paper's sink with larger square pads: the largest distances from the plate, the fin's own estimate for its ends
(`one_node_remainder` in the same file), and whether it warns.
"""
_THIN_HEADS = ("thickness", "plate less 3D", "3D's own error", "the plate's estimate", "warns")
_SLOW_HEADS = ("pads", "fin, peak", "fin, end", "moments:4, peak", "moments:4, end", "the fin's estimate", "warns")
_HEADS = ("model", "states", "peak", "end", "current", "anchor resistance", "build", "build / 3D steady", "evaluate")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--accuracy", default="1e-5", help="of the 3D solutions (default 1e-5)")
    parser.add_argument("--out", default="docs/reductions.md", help="the page (default docs/reductions.md)")
    arguments = parser.parse_args()
    models = _table(("model", "what it is"), [[f"`{name}`", ladder.describe(name)] for name in MODELS])
    parts = [_HEAD.format(accuracy=arguments.accuracy, models=models, times=len(grid(0.02)), repeats=REPEATS)]
    for title, settings in SCENES.items():
        print(title, file=sys.stderr, flush=True)
        parts.append(scene(title, settings, arguments.accuracy))
    print("thicknesses and pads", file=sys.stderr, flush=True)
    parts += [_THIN, _table(_THIN_HEADS, list(map(thin_row, THICKNESSES)))]
    parts += [_SLOW, _table(_SLOW_HEADS, list(map(slow_row, PADS)))]
    Path(arguments.out).write_text("\n".join(parts).rstrip("\n") + "\n", encoding="utf-8")


def _table(heads: tuple[str, ...], rows: list[list[str]]) -> str:
    return "\n".join(Table(heads, rows, "<" * len(heads)).markdown())


def scene(title: str, settings: list[str], accuracy: str) -> str:
    """The part of the page on one sink."""
    sink, coarse = load("sink", [*settings, f"run.accuracy={accuracy}"]), load("sink", settings)
    fem3d, levels = solve_3d(sink, Request()), Levels(sink)
    steady = timed(lambda: solve_3d(coarse, Request(transient=False)))
    rows = []
    for name in MODELS:
        result = ladder.solve(sink, name, times=fem3d.over_time.time, levels=levels)
        build, evaluate = times_of(sink, name)
        built = (f"{1e3 * build:.0f} ms", f"{build / steady:.2f}") if build else ("-", "-")
        states = f"{result.details['states']}" + (f" (of {result.details['unknowns']})" if name == "plate" else "")
        off = percent(result.steady[RESISTANCE].value / fem3d.steady[RESISTANCE].value - 1, sign=True)
        rows.append(
            [f"`{name}`", states, *map(percent, errors(result, fem3d)), off, *built, f"{1e3 * evaluate:.1f} ms"]
        )
    shown = f" (`{' '.join(f'--set {text}' for text in settings)}`)" if settings else ""
    return f"## {title}{shown}\n\n{own_error(fem3d)}\n\n{_table(_HEADS, rows)}"


def scales(fem3d: Result) -> dict[str, float]:
    """What differences are relative to, by trace."""
    cold = float(fem3d.over_time.values["current_A"][0])
    final = {name: estimate.value for name, estimate in fem3d.steady.items()}
    return {
        "peak_K": final["peak_rise_K"], "end_K": final["end_rise_K"], "current_A": abs(final["current_A"] - cold),
    }  # fmt: skip


def errors(result: Result, fem3d: Result) -> list[float]:
    return [_apart(result, fem3d, key) / scale for key, scale in scales(fem3d).items()]


def _apart(one: Result, other: Result, key: str) -> float:
    """The largest distance of two traces at the same times from FIRST_TIME on."""
    a, b = one.over_time, other.over_time
    return float(np.abs(a.values[key] - b.values[key])[b.time >= FIRST_TIME].max())


def times_of(sink: Sink, name: str) -> tuple[float | None, float]:
    """Seconds to build a reduction (``None`` for the paper's, which has nothing to build) and to evaluate it."""
    times = grid(sink.end_time)
    if name == "paper":
        return None, timed(lambda: ladder.solve(sink, name, times=times))
    model = ladder.build(Levels(sink).fine, name)
    return timed(lambda: ladder.build(Levels(sink).fine, name)), timed(lambda: over_time(model, times))


def timed(call: Callable[[], object]) -> float:
    """The processor time of a call, the shortest of some (s)."""
    seconds = []
    for _ in range(REPEATS):
        started = time.process_time()
        call()
        seconds.append(time.process_time() - started)
    return min(seconds)


def grid(end: float) -> np.ndarray:
    """The times (s) of a transient whose evaluation is timed."""
    return np.concatenate([[0.0], np.geomspace(FIRST_TIME / 10, end, 200)])


def own_error(fem3d: Result) -> str:
    """The 3D solution's estimated errors, in the measure of the table."""
    peak, end, current = (percent(fem3d.over_time.errors[key] / scale) for key, scale in scales(fem3d).items())
    R = fem3d.steady[RESISTANCE]
    return (
        f"3D: final rises {quantity(fem3d.steady['peak_rise_K'].value, 'K', 5)} (peak) and "
        f"{quantity(fem3d.steady['end_rise_K'].value, 'K', 5)} (end), anchor resistance {quantity(R.value, 'K/W', 6)}; "
        f"own error at most {peak} in the peak, {end} in the end, {current} in the current, "
        f"{percent(R.error / R.value)} in the anchor resistance ({fem3d.details['unknowns']} unknowns)."
    )


def thin_row(thickness: str, accuracy: str = "1e-4") -> list[str]:
    sink = load("sink", [f"sink.thickness={thickness}", f"run.accuracy={accuracy}"])
    exact = solve_3d(sink, Request(transient=False)).steady[RESISTANCE]
    plate = ladder.solve(sink, "plate", steady_only=True)
    return [
        thickness.replace("um", " um"), percent(plate.steady[RESISTANCE].value / exact.value - 1, sign=True),
        percent(exact.error / exact.value), percent(plate.details["thin_plate_remainder"]),
        "yes" if plate.details["warnings"] else "no",
    ]  # fmt: skip


def slow_row(size: str) -> list[str]:
    """A row of the table of pads; without 3D, for the plate is that to all that is shown."""
    sink = load("sink", [f"anchor.pad_length={size}", f"anchor.pad_width={size}"])
    levels, times = Levels(sink), grid(sink.end_time)
    plate, fin, few = (ladder.solve(sink, name, times=times, levels=levels) for name in ("plate", "fin", "moments:4"))
    off = [
        percent(_apart(model, plate, f"{key}_K") / plate.steady[f"{key}_rise_K"].value)
        for model in (fin, few)
        for key in ("peak", "end")
    ]
    warns = "yes" if any("one node" in text for text in fin.details["warnings"]) else "no"
    return [size.replace("um", " um"), *off, percent(levels.fine.one_node), warns]


if __name__ == "__main__":
    main()
