"""Standard uncertainties of the keys of a scene, as given on a command line, and their correlations.

A standard uncertainty is one standard deviation (JCGM 100:2008, "GUM", 2.3.1); it is kept relative to the value.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scenes.errors import SceneError, printable, quoted, unknown
from scenes.keys import TYPES, type_of
from scenes.kinds import Quantity
from scenes.schema import locate, twin
from scenes.units import NUMBER, UnitError, parse_quantity
from scenes.varied import kind_of, numbers

if TYPE_CHECKING:
    import numpy as np

MATERIALS = "materials"
_FORM = "give KEY=5%, KEY=0.1um in the key's own unit, or materials for the scene's own table"


@dataclass(frozen=True)
class Uncertain:
    """``relative`` standard uncertainties by key, ``correlations`` by pairs of keys (in this order), and the options as
    ``given``."""

    relative: dict[str, float]
    correlations: dict[tuple[str, str], float] = field(default_factory=dict)
    given: tuple[str, ...] = ()

    def covariance(self) -> np.ndarray:
        """(keys, keys): of the relative deviations."""
        import numpy as np

        keys, u = list(self.relative), np.array(list(self.relative.values()))
        correlation = np.eye(len(keys))
        for (a, b), r in self.correlations.items():
            i, j = keys.index(a), keys.index(b)
            correlation[i, j] = correlation[j, i] = r
        return correlation * np.outer(u, u)


def read(scene: object, given: Sequence[str], correlated: Sequence[str] = ()) -> Uncertain:
    """Read ``--uncertain`` and ``--correlated``; a later one wins.

    Raises SceneError for an invalid uncertainty, a key without a number, and impossible correlations.
    """
    values, relative = numbers(scene), dict[str, float]()
    for text in given:
        if text.strip() == MATERIALS:
            # A device has the table of its sink.
            table: Mapping[str, float] = getattr(getattr(scene, "sink", scene), "uncertainties", {})
            for key, u in table.items():
                # Of three along the axes each.
                along = [f"{key}[{axis}]" for axis in "xyz"]
                relative |= {path: u for path in (key, *along, twin(key)) if path in values}
            continue
        key, equals, value = (part.strip() for part in text.partition("="))
        if not (key and equals and value):
            raise SceneError(f"--uncertain {quoted(text)} says nothing: {_FORM}")
        path = path_of(scene, key, values, "--uncertain")
        relative[path] = _relative(scene, path, value, values[path])
    correlations = dict[tuple[str, str], float]()
    for text in correlated:
        pair, _, value = text.partition("=")
        keys = [path_of(scene, key.strip(), values, "--correlated") for key in pair.split(",") if key.strip()]
        r = Quantity(NUMBER, 0.0, 1.0, signed=True).read(f"--correlated {printable(pair)}", value) or 0.0
        if len(keys) != 2 or keys[0] == keys[1]:
            raise SceneError(f"--correlated {quoted(text)} is no correlation of two keys: give KEY,KEY=0.9")
        for key in keys:
            if key not in relative:
                raise SceneError(f"--correlated {quoted(text)}: {key} is not uncertain: give it with --uncertain, too")
        first, second = sorted(keys, key=list(relative).index)
        correlations[first, second] = r
    uncertain = Uncertain(relative, correlations, (*given, *correlated))
    if correlations:
        import numpy as np

        correlation = uncertain.covariance() / np.outer(list(relative.values()), list(relative.values()))
        if np.linalg.eigvalsh(correlation).min() < -1e-9:
            raise SceneError("--correlated: these correlations contradict each other: no inputs can have all of them")
    return uncertain


def path_of(scene: object, key: str, known: Mapping[str, float], option: str) -> str:
    """Return the full name of a key with a nonzero number, from an unambiguous end of the name."""
    ends = [path for path in known if path == key or path.endswith(f".{key}")]
    if len(ends) == 1:
        return ends[0]
    if (given := getattr(scene, "parameters", None)) is not None:
        given.key(key)
    parametric = getattr(scene, "kind", "") in TYPES
    path = ".".join(filter(None, locate(key, None, type_of(scene).schema))) if parametric else ""
    if path in known:
        return path
    raise unknown(f"{option} names no number of this scene:", key, known)


def _relative(scene: object, path: str, text: str, value: float) -> float:
    kind = kind_of(scene, path)
    try:
        number, unit = parse_quantity(text)
    except UnitError as error:
        raise SceneError(f"--uncertain {path}={printable(text)}: {quoted(text)} {error}: {_FORM}") from None
    powers = kind.dimension.powers
    if text.endswith("%"):
        relative = number
    elif unit is not None and unit.powers == powers:
        # Of a temperature in degrees Celsius it is a difference.
        relative = (number - float(unit.offset)) / abs(value)
    else:
        raise SceneError(f"--uncertain {path}={printable(text)} is neither in percent nor in the key's unit: {_FORM}")
    if not 0 < relative <= 1:
        of = f"{kind.show(value)}: give more than nothing, and at most all of it"
        raise SceneError(f"--uncertain {path}={printable(text)} is no standard uncertainty of {of}")
    return relative
