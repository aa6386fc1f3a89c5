"""Which key of a scene is likely why its numerics failed: the one that is farthest from the built-in scene's."""

from __future__ import annotations

import math
from operator import attrgetter

from scenes.keys import type_of
from scenes.kinds import Quantity

FAR = 30.0
"""Times the built-in scene's value: what is nearer is no extreme."""
_ROOM = {"environment.convection_coefficient": 1e3}  # W/(m2 K): the built-in scene has none


def cause(scene: object, instead: str = "") -> str:
    """What to append to the sentence of a failure: the key, its value, how far it is out and what to do, with
    ``instead`` after it; nothing where no key of the scene is far from the built-in one's."""
    kind = type_of(scene)
    found = []
    for path, key in kind.schema.paths.items():
        if not isinstance(key.kind, Quantity) or not key.physical:
            continue
        value, usual = (attrgetter(key.attribute)(s) for s in (scene, kind.default))
        usual = _ROOM.get(path, usual)
        if value and usual:
            found.append((abs(math.log(abs(value / usual))), path, key.kind, value, usual))
    far, path, quantity, value, usual = max(found, key=lambda each: each[0])
    if far < math.log(FAR):
        return ""
    ratio = abs(value / usual)
    times, way = (ratio, "more") if ratio > 1 else (1 / ratio, "less")
    shown = f"{times:,.0f}" if times < 1e6 else f"{times:.0e}".replace("e+0", "e").replace("e+", "e")
    return (
        f"; {path} = {quantity.show(value)} is {shown} times {way} than in the built-in {kind.name}, and so is likely "
        f"beyond what double precision resolves beside the rest: give a value nearer to {quantity.show(usual)}{instead}"
    )
