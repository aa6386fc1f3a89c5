"""Why a reduction differs from 3D: the difference in parts, one for each assumption, that add up to it.

The models of the ladder stand between the two, each with one assumption less than the one before. A part is the
difference of two neighbours, so the parts telescope: their sum is the whole difference. What an assumption is charged
with is what dropping it changes after those before it have been dropped; in another order the parts would differ by
their interaction.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from compare.figure_checks import from_first
from compare.verdict import FIRST_TIME
from scenes.formats import percent, quantity, signed
from scenes.sink import OF_A_SINK

if TYPE_CHECKING:
    from reduced1d.ladder.levels import Levels, Rung
    from scenes.result import Result
    from scenes.sink import Sink

ITSELF = "current"
QUANTITIES = {name: OF_A_SINK[name] for name in ("peak", "end", "current")}


@dataclass(frozen=True)
class Part:
    """What one assumption does to one quantity: ``value`` and its numerical ``error`` in the quantity's unit; over time
    also the ``largest`` that it does from 10 us on, and ``when`` (s). The largest do not add up: each has its time."""

    blame: str
    value: float
    error: float
    largest: float | None = None
    when: float | None = None


@dataclass(frozen=True)
class Split:
    """A difference, reduction less 3D, with its numerical error and its parts; ``scale`` is the final rise, or the
    change of the current, that it is relative to. ``time`` (s) is when, ``None`` in the steady state."""

    quantity: str
    unit: str
    scale: float
    total: float
    error: float
    parts: tuple[Part, ...]
    time: float | None = None


@dataclass(frozen=True, eq=False)
class Budget:
    """The differences of the reduction ``start`` in the ``steady`` state, and ``transient`` at the time from 10 us on
    at which each is largest; ``over_time`` (parts, times) are the parts of each quantity at ``times`` (s).
    ``sentence`` says what the largest part of all is."""

    start: str
    steady: tuple[Split, ...]
    transient: tuple[Split, ...]
    times: np.ndarray | None
    over_time: dict[str, np.ndarray]
    sentence: str


def budget(
    sink: Sink, start: str, fem3d: Result, levels: Levels, progress: Callable[[str], None] = lambda _: None
) -> Budget:
    """The budget of the reduction ``start`` (its canonical name) against a 3D result, at the times of its traces.

    Raises RunawayError where a model of the ladder has no steady state.
    """
    from reduced1d.errors import RunawayError
    from reduced1d.ladder.levels import rungs, solve

    found = rungs(levels, start)
    at = None if fem3d.traces is None else fem3d.traces.time
    results = []
    for rung in found:
        progress(f"solving the ladder: {rung.name}")
        try:
            results.append(solve(levels, rung, at is None, at))
        except RunawayError as error:
            raise RunawayError(
                f"on the ladder from {start} to 3D, in the model {rung.name} (see --why): {error}", error.limit_voltage
            ) from None
    results.append(fem3d)
    times, steady, transient, over_time = None, [], [], {}
    if fem3d.traces is not None and fem3d.traces.time[-1] > FIRST_TIME:
        times = from_first(fem3d.traces.time)
    for name, asked in QUANTITIES.items():
        scale = scale_of(sink, name, fem3d, levels)
        known = [result.steady[asked.steady] for result in results]
        values = np.array([[estimate.value] for estimate in known])
        steady.append(_split(name, scale, found, values, [estimate.error for estimate in known], None))
        if times is not None:
            traces = [result.traces for result in results if result.traces is not None]
            values = np.array([np.interp(times, t.time, t.values[asked.trace]) for t in traces])
            transient.append(_split(name, scale, found, values, [t.errors[asked.trace] for t in traces], times))
            over_time[name] = values[:-1] - values[1:]
    sentence = _sentence(found, (*steady, *transient), of_current(sink))
    return Budget(start, tuple(steady), tuple(transient), times, over_time, sentence)


def scale_of(sink: Sink, name: str, fem3d: Result, levels: Levels) -> float:
    """What differences of a quantity are relative to: the final 3D rise; the change of the 3D current from the cold
    sink's, which is V over the cold resistance, or the current itself (`of_current`)."""
    value = fem3d.steady[QUANTITIES[name].steady].value
    if name != "current" or of_current(sink) == ITSELF:
        return abs(value)
    if fem3d.traces is not None:
        return abs(value - float(fem3d.traces.values["current_A"][0]))
    return abs(value - sink.voltage / levels.fine.plate.model.resistance)


def of_current(sink: Sink) -> str:
    """What differences of the current are relative to, in words: itself where it does not change, and of a row, whose
    islands add to the resistance whatever the temperature."""
    return "change of the current" if sink.silicon.temperature_coefficient and sink.spans == 1 else ITSELF


def _split(
    name: str, scale: float, found: Sequence[Rung], values: np.ndarray, errors: Sequence[float],
    times: np.ndarray | None,
) -> Split:  # fmt: skip
    """The parts of a quantity's ``values`` (models, times), each known to an error, when the difference is largest;
    without ``times`` those of the steady state."""
    i = int(np.argmax(np.abs(values[0] - values[-1])))
    drops = values[:-1] - values[1:]
    parts = [Part(rung.blame, float(drops[n, i]), errors[n] + errors[n + 1]) for n, rung in enumerate(found)]
    if times is not None:
        worst = np.argmax(np.abs(drops), axis=1)
        parts = [
            replace(part, largest=float(drops[n, at]), when=float(times[at]))
            for n, (part, at) in enumerate(zip(parts, worst, strict=True))
        ]
    total, when = float(values[0, i] - values[-1, i]), None if times is None else float(times[i])
    return Split(name, QUANTITIES[name].unit, scale, total, errors[0] + errors[-1], tuple(parts), when)


def _sentence(found: Sequence[Rung], splits: Sequence[Split], of_current: str) -> str:
    """The largest part, relative to its scale, in plain English."""
    split, n = max(
        ((split, n) for split in splits for n in range(len(found)) if split.scale),
        key=lambda pair: abs(pair[0].parts[pair[1]].value) / pair[0].scale,
    )
    part, unit = split.parts[n], split.unit
    whole = of_current if split.quantity == "current" else f"final {split.quantity} rise"
    when = "in the steady state" if split.time is None else f"at {quantity(split.time, 's', 3)}"
    left = split.total - part.value
    does = f"puts the current {signed(part.value, unit)} off"
    if split.quantity != "current":
        what = {"peak": "peak", "end": "ends"}[split.quantity]
        does = f"makes the {what} {quantity(abs(part.value), unit, 3)} too {'hot' if part.value > 0 else 'cold'}"
    if abs(part.value) <= part.error:
        return (
            "nothing is to blame: no part of the difference is larger than its numerical error, "
            f"{percent(part.error / split.scale)} of the {whole}"
        )
    return (
        f"the largest part is the {part.blame}: {found[n].says}, which alone {does} {when}, "
        f"{percent(abs(part.value) / split.scale)} of the {whole}; all the rest together makes {signed(left, unit)}"
    )
