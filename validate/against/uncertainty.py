"""What data are known to, as `--data-uncertainty` says it: a number, a part, or a column of the file."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compare.against import QUANTITIES, Data
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.sink import Sink
from scenes.units import UnitError, parse_quantity

_FORM = 'give 0.5K, 1%, peak=0.5K, or peak="a column of the file"'


def data_uncertainty(sink: Sink, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """The standard uncertainties (times of the data,) by quantity, from what ``--data-uncertainty`` says: a number with
    a unit for all quantities that have it, a part in percent (of the rise, for temperatures), or a column of the file;
    a quantity in front means that one alone. Raises SceneError."""
    found: dict[str, np.ndarray] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if equals and name.strip() not in QUANTITIES:
            known = ", ".join(QUANTITIES)
            raise SceneError(
                f"--data-uncertainty {quoted(text)}: {printable(name)} is no quantity: give {known}"
                f"{did_you_mean(name.strip(), QUANTITIES)}"
            )
        said = (value if equals else text).strip()
        keys = [QUANTITIES[name.strip()]] if equals else [k for k in QUANTITIES.values() if k in data.values]
        own = {key: u for key in keys if (u := _known_to(sink, data, key, said)) is not None}
        if not own:
            raise SceneError(f"--data-uncertainty {quoted(text)} is one of no quantity of {data.name}: {_FORM}")
        if any((u <= 0).any() or not np.isfinite(u).all() for u in own.values()):
            raise SceneError(f"--data-uncertainty {quoted(text)}: an uncertainty must be more than nothing: {_FORM}")
        found |= own
    return found


def _known_to(sink: Sink, data: Data, key: str, said: str) -> np.ndarray | None:
    """(times of the data,): the uncertainty of a quantity, None where what is said is of another kind."""
    if key not in data.values:
        return None
    if said in data.others:
        return data.others[said]
    try:
        number, unit = parse_quantity(said)
    except UnitError:
        return None
    if said.endswith("%"):
        start = sink.room_temperature if key.endswith("_K") else 0.0
        # At the start a rise is nothing: half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - start), np.sign(number) * 1e-12)
    kind = {"K": (0, 0, 0, 0, 1), "A": (0, 0, 0, 1, 0), "W": (2, 1, -3, 0, 0)}[key.rpartition("_")[2]]
    if unit is None or unit.powers != kind:
        return None
    return np.full(len(data.time), number - 273.15 if unit.celsius else number)
