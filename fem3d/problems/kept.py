"""Values that a problem computes on first use: kept, preset by a nearby problem, or released."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any


class Kept:
    """Values by name: solutions of a problem, its factors, blocks of its matrices."""

    def __init__(self) -> None:
        self._values: dict[Hashable, Any] = {}

    def get(self, name: Hashable, work_out: Callable[[], Any]) -> Any:
        """The value of a name, worked out if it isn't there."""
        if name not in self._values:
            self._values[name] = work_out()
        return self._values[name]

    def tell(self, **values: Any) -> None:
        """Values that need not be worked out."""
        self._values.update(values)

    def like(self, other: Kept) -> None:
        """All values that another has by now."""
        self._values.update(other._values)

    def let_go(self, *names: Hashable) -> None:
        """Release values; later uses compute them anew."""
        for name in names:
            self._values.pop(name, None)
