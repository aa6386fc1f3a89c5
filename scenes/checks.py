"""The checks of the sink that a scene may set a tolerance for, or declare as expected to differ."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from scenes.dimensions import NUMBER
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.kinds import Quantity

EQUATIONS = ("eq12", "eq13", "eq14", "eq16", "eq18", "eq18_measured")
FIGURES = ("fig4", "fig5", "fig6_peak", "fig6_end", "fig7_current")

DEFAULT_TOLERANCES: dict[str, float] = {
    **dict.fromkeys(EQUATIONS, 0.02),
    **dict.fromkeys(FIGURES, 0.05),
    "energy": 1e-8,
}
"""The relative tolerance of every check, by its id, where a scene declares none."""

_TOLERANCE = Quantity(NUMBER, 1e-15, 100.0)


@dataclass(frozen=True)
class Tolerances:
    """A table of relative tolerances by check id; only those that a scene declares."""

    def read(self, path: str, given: object) -> dict[str, float]:
        """The tolerances as plain numbers."""
        if not isinstance(given, Mapping):
            raise SceneError(f"{path} = {quoted(given)} must be a table of tolerances such as {{eq12 = 0.02}}")
        return {_known(path, k): float(_TOLERANCE.read(f"{path}.{k}", v) or 0) for k, v in given.items()}

    def write(self, value: Any) -> Any:
        """A plain dictionary."""
        return {k: _TOLERANCE.write(v) for k, v in value.items()} if isinstance(value, Mapping) else value

    def show(self, value: Any) -> str:
        """The ids with their tolerances."""
        return ", ".join(f"{k} {v}" for k, v in value.items())


@dataclass(frozen=True)
class Differing:
    """A list of the checks that are expected to differ; ``word`` is what a file says for ``None``, nothing declared."""

    word: str = "undeclared"

    def read(self, path: str, given: object) -> tuple[str, ...] | None:
        """The ids, each once, in the order given; one text with commas between is a list as well."""
        if isinstance(given, str) and given == self.word:
            return None
        items = [part.strip() for part in given.split(",")] if isinstance(given, str) else given
        if not isinstance(items, (list, tuple)):
            raise SceneError(f'{path} = {quoted(given)} must be a list of checks such as ["eq14"], or "{self.word}"')
        return tuple(dict.fromkeys(_known(path, i) for i in items))

    def write(self, value: Any) -> Any:
        """A list, or the word for ``None``."""
        return self.word if value is None else list(value) if isinstance(value, (list, tuple)) else value

    def show(self, value: Any) -> str:
        """The ids."""
        return self.word if value is None else ", ".join(value)


def _known(path: str, check: object) -> str:
    if isinstance(check, str) and check in DEFAULT_TOLERANCES:
        return check
    hint = did_you_mean(check, DEFAULT_TOLERANCES) if isinstance(check, str) else ""
    raise SceneError(f"{path} names an unknown check {quoted(check)}: give {', '.join(DEFAULT_TOLERANCES)}{hint}")
