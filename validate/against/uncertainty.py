"""What data are known to, as `--data-uncertainty` says it: a number, a part, or a column of the file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from compare import quantities
from compare.against import Data
from compare.quantities import Quantities
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.units import UnitError, parse_quantity, parse_unit


def data_uncertainty(scene: Any, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """The standard uncertainties (times of the data,) by quantity, from what ``--data-uncertainty`` says: a number with
    a unit for all quantities that have it, a part in percent (of the rise, for temperatures), or a column of the file;
    a quantity in front means that one alone. Raises SceneError."""
    uncertainties: dict[str, np.ndarray] = {}
    catalogue = quantities.of(scene)
    names = catalogue.names
    example = next((word for word, name in names.items() if catalogue.units[name] == "K"), next(iter(names)))
    form = f'give 0.5K, 1%, {example}=1%, or {example}="a column of the file"'
    for text in given:
        name, equals, value = text.partition("=")
        if equals and name.strip() not in names:
            raise SceneError(
                f"--data-uncertainty {quoted(text)}: {printable(name)} is no quantity: give {', '.join(names)}"
                f"{did_you_mean(name.strip(), names)}"
            )
        said = (value if equals else text).strip()
        keys = [names[name.strip()]] if equals else [k for k in names.values() if k in data.values]
        by_key = {key: u for key in keys if (u := _known_to(catalogue, data, key, said)) is not None}
        if not by_key:
            raise SceneError(f"--data-uncertainty {quoted(text)} is one of no quantity of {data.name}: {form}")
        if any((u <= 0).any() or not np.isfinite(u).all() for u in by_key.values()):
            raise SceneError(f"--data-uncertainty {quoted(text)}: an uncertainty must be more than nothing: {form}")
        uncertainties |= by_key
    return uncertainties


def _known_to(catalogue: Quantities, data: Data, key: str, said: str) -> np.ndarray | None:
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
        # At the start a rise is nothing: half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - catalogue.base(key)), np.sign(number) * 1e-12)
    if unit is None or unit.powers != parse_unit(catalogue.units[key]).powers:
        return None
    return np.full(len(data.time), number - 273.15 if unit.celsius else number)
