"""The quantities and keys of a scene that columns of data may stand for."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Column
from scenes.model import values
from scenes.parameters import SECTION
from scenes.varied import every_number

_VOLTAGE = re.compile(r"[vu](_?(0|in|app|applied|dc|drive|src|source|tot))?", re.IGNORECASE)


class Target:
    """A sink, or a scene with probes and parameters, as the target of data.

    ``numbers`` are the keys that a column or a parameter may stand for, ``initial`` is the key of the temperature at
    the start.
    """

    def __init__(self, scene: Any) -> None:
        self.scene, self.quantities, self._is_sink = scene, quantities.of(scene), scene.kind == "sink"
        self.numbers = {k: n for k, n in every_number(scene).items() if self._is_sink or k.startswith(SECTION)}
        self.initial = "room_temperature" if self._is_sink else "scene.initial_temperature"

    def show(self, key: str, value: float) -> str:
        """Return an SI value of a key in words, to six digits."""
        return self.numbers[key].kind.dimension.show(float(f"{value:.6g}"))

    def find_key(self, name: str) -> str:
        """Return the key that ends with a name, of the scene's main section where there are several; "" for none."""
        wanted = "." + re.sub(r"\s+", "_", name.strip())
        for text, ends in ((wanted, str), (wanted.lower(), str.lower)):
            keys = [key for key in self.numbers if ends(f".{key}").endswith(text)]
            keys = [key for key in keys if ends(key) in (text[1:], f"sink{text}")] or keys
            if len(keys) == 1 and name not in self.quantities.units:
                return keys[0]
        return "drive.voltage" if self._is_sink and _VOLTAGE.fullmatch(name) else ""

    def find_quantity(self, column: Column) -> str:
        """Return the quantity that a column is called as, also as v(NAME), "NAME rise" or in traces.csv; or ""."""
        node = re.sub(r"^[vi]\((.*)\)$|^(.*)#branch$", r"\1\2", column.name, flags=re.IGNORECASE)
        spellings = {_plain(text) for text in (column.name, column.plain, node)}
        spellings |= {re.sub("^fem3d | rise$", "", text) for text in spellings}
        found = [name for word, name in self.quantities.names.items() if {_plain(word), _plain(name)} & spellings]
        return found[0] if len(found) == 1 else ""

    def sign(self, key: str) -> float:
        """Return the sign of a current: 1 at an electrode of the largest voltage, -1 of the smallest, otherwise 0."""
        if self._is_sink:
            return float(np.sign(self.scene.voltage if self.scene.current is None else self.scene.current))
        place = _place(next(probe for probe in self.scene.probes if probe.name == key))
        drives = {_place(b): b for b in self.scene.boundaries if b.kind == "voltage"}
        largest = {place: max(values(b.value), key=abs) for place, b in drives.items()}
        if place not in drives:
            return 0.0
        if drives[place].series_resistance == np.inf:  # a given current
            return float(np.sign(largest[place]))
        others = [largest[p] for p, b in drives.items() if p != place and b.series_resistance != np.inf]
        return float((largest[place] > max(others)) - (largest[place] < min(others)) if others else 0)


def _plain(name: str) -> str:
    return re.sub(r"[\s_]+", " ", name).strip().lower()


def _place(item: Any) -> object:
    return item.group if hasattr(item, "group") else (item.lower, item.upper)
