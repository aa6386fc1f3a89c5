"""What two scenes differ in, put on a third: how a scene follows a parameter, whatever was changed in it since it was
read from its file.
"""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from numbers import Real
from typing import Any


def transferred(value: Any, before: Any, after: Any, part: float = 1.0) -> Any:
    """A scene, or a value of one, with a part of what another has between ``before`` and ``after``: numbers change by
    that part of the difference, all else becomes as it is afterwards. Nothing that is alike in both changes."""
    if before == after:
        return value
    if part == 1 and value == before:
        return after
    if isinstance(value, tuple) and isinstance(after, tuple) and len(value) == len(before) == len(after):
        return tuple(transferred(*each, part) for each in zip(value, before, after, strict=True))
    if is_dataclass(value) and not isinstance(value, type) and type(value) is type(before) is type(after):
        parts = ((f.name, *(getattr(x, f.name) for x in (value, before, after))) for f in fields(value) if f.compare)
        return replace(value, **{name: transferred(g, b, a, part) for name, g, b, a in parts})
    if all(isinstance(x, Real) and not isinstance(x, bool) for x in (value, before, after)):
        return value + part * (after - before)
    return after
