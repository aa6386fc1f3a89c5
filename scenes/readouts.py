"""Resistances of probes: the electrode of each, and the other electrode of its conductor."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from math import inf
from typing import Any

import numpy as np

from scenes.errors import SceneError, listed, quoted
from scenes.model import ROUNDING, AnyScene, Scene, Schedule, Value

# Where the current is below this fraction of its largest, V/I is 0/0: the resistance there is interpolated between the
# times beside it.
NO_CURRENT = 1e-9

Pair = tuple[Any, Any]
"""An electrode, and the other one of its conductor: boundaries."""


def pairs(scene: AnyScene, conductors: Iterable[Collection[str]]) -> dict[str, Pair]:
    """Return the electrode and the other one for each probe of a resistance, by its name.

    ``conductors``: the names of the electrodes of each conductor. Raises SceneError for a probe on no electrode, for a
    conductor with one or several others, and where no current passes for some time.
    """
    joined = list(conductors)
    return {p.name: _pair(scene, p, joined) for p in scene.probes if p.quantity == "resistance"}


def resistance(between: np.ndarray, current: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the resistance (ohm) at times (s) with these voltages and currents; 0 without any current."""
    passing = np.abs(current) > NO_CURRENT * np.abs(current).max()
    if not passing.any():
        return np.zeros(current.shape)
    if passing.all():
        return between / current
    return np.interp(time, time[passing], between[passing] / current[passing])


def _pair(scene: AnyScene, probe: Any, conductors: list[Collection[str]]) -> Pair:
    said = f"probe {quoted(probe.name)} asks for a resistance"
    electrodes = {b.name: b for b in scene.boundaries if b.kind == "voltage"}
    electrode = next((b for b in electrodes.values() if _same(scene, probe, b)), None)
    if electrode is None:
        place = "the corners" if isinstance(scene, Scene) else "the group"
        raise SceneError(f"{said}, and no electrode is there: give {place} of one, of {listed(list(electrodes))}")
    others = {n for names in conductors if electrode.name in names for n in names} - {electrode.name}
    if len(others) != 1:
        has = f"{len(others)} others, {listed(sorted(others))}" if others else "no other"
        raise SceneError(
            f"{said}, which is between two electrodes, and the conductor of {quoted(electrode.name)} has {has}: give "
            "an electrode of a conductor with two"
        )
    partner = electrodes[others.pop()]
    if _idle(scene, electrode, partner):
        drive = (
            "current passes"
            if inf in (electrode.series_resistance, partner.series_resistance)
            else "voltage drives one"
        )
        raise SceneError(
            f"{said}, and for some time no {drive} between {quoted(electrode.name)} and {quoted(partner.name)}: give "
            "them a small one, as one would to measure"
        )
    return electrode, partner


def _same(scene: AnyScene, probe: Any, boundary: Any) -> bool:
    """Whether a probe is on the place of a boundary."""
    if not isinstance(scene, Scene):
        return bool(probe.group == boundary.group)
    size = max(u - v for b in scene.boxes for u, v in zip(b.upper, b.lower, strict=True))
    both = (*zip(probe.lower, boundary.lower, strict=True), *zip(probe.upper, boundary.upper, strict=True))
    return all(abs(a - b) <= ROUNDING * size for a, b in both)


def _idle(scene: AnyScene, electrode: Any, partner: Any) -> bool:
    """Whether nothing drives a current from one electrode to the other, always or for some time."""
    by_current = [b for b in (electrode, partner) if b.series_resistance == inf]
    plus, minus = (by_current[0].value, 0.0) if by_current else (electrode.value, partner.value)
    ends = {0.0, 0.0 if scene.steady else scene.end_time}
    times = sorted(ends | {t for v in (plus, minus) if isinstance(v, Schedule) for t in v.times if t < max(ends)})
    starts, lengths = np.array(times[:-1] or [0.0]), np.diff(times) if len(times) > 1 else np.zeros(1)
    # A line that is zero at two places between its ends is zero.
    drops = [at(plus, starts + part * lengths) - at(minus, starts + part * lengths) for part in (1 / 3, 2 / 3)]
    return bool(((drops[0] == 0) & (drops[1] == 0)).any())


def at(value: Value, times: np.ndarray) -> np.ndarray:
    """Return (times,): a value at times (s) that are no jumps."""
    if isinstance(value, Schedule):
        return np.interp(times, value.times, value.values)
    return np.full(times.shape, float(value))
