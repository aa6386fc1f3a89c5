"""Joints of lines with each other and with given values, and the probes that measure them in a full model: the mean
temperatures (or potentials) on both sides and the flow between.

Along a line the flow is k A dT/ds, exactly, for the mean temperature over the cross-section. The error of a network of
lines gets wrong is therefore at its joints and conditions, in their resistances and in how the flow spreads over them.
"""

from __future__ import annotations

from dataclasses import dataclass

from reduced1d.network.lines import Condition, Joint, Layout, Touch
from scenes.model import Point, Probe, Quantity

Key = tuple[str, int]
"""("joint" | "condition" | "wire" | "electrode", its number in the layout)."""


@dataclass(frozen=True)
class Place:
    """A joint or a condition: its name ``called``, the probes of either side (None for the value of a boundary, of
    number ``given``) and of the flow, and the ``sign`` of the flow from the first side to the other."""

    key: Key
    called: str
    one: Probe
    other: Probe | None
    given: int | None
    flow: Probe
    sign: float


def places(layout: Layout, electric: bool) -> list[Place]:
    """Every joint and condition that has a resistance, or may have one: not fluxes."""
    places = [_joint(layout, ("joint", j), joint) for j, joint in enumerate(layout.joints)]
    places += [
        _condition(layout, ("condition", c), condition)
        for c, condition in enumerate(layout.conditions)
        if layout.scene.boundaries[condition.boundary].kind in ("temperature", "convection")
    ]
    if electric:
        places += [_joint(layout, ("wire", j), joint) for j, joint in enumerate(layout.wires)]
        places += [
            _condition(layout, ("electrode", c), condition)
            for c, condition in enumerate(layout.electrodes)
            if not layout.scene.boundaries[condition.boundary].series_resistance
        ]
    return places


def _joint(layout: Layout, key: Key, joint: Joint) -> Place:
    names = " | ".join(layout.lines[t.line].name for t in (joint.one, joint.other))
    one, other = (_side(layout, key, touch, n) for n, touch in enumerate((joint.one, joint.other)))
    # The flow through a face inside counts along the axis, from the first line to the other.
    return Place(key, _called(key, names), one, other, None, _flow(key, joint.one), 1.0)


def _condition(layout: Layout, key: Key, condition: Condition) -> Place:
    touch = condition.touch
    b, line = layout.scene.boundaries[condition.boundary], layout.lines[touch.line]
    at = touch.lower[touch.normal]
    inside = any(
        other is not line and at in (other.lower[touch.normal], other.upper[touch.normal])
        and all(max(touch.lower[d], other.lower[d]) < min(touch.upper[d], other.upper[d])
                for d in range(3) if d != touch.normal)
        for other in layout.lines
    )  # fmt: skip
    # Into the solid on its surface, along the axis inside: out of the line below its upper face.
    sign = -1.0 if not inside or line.lower[touch.normal] == at else 1.0
    called = _called(key, f"{b.name} | {line.name}")
    return Place(key, called, _side(layout, key, touch, 0), None, condition.boundary, _flow(key, touch), sign)


def _called(key: Key, names: str) -> str:
    return f"{names}, current" if key[0] in ("wire", "electrode") else names


def _side(layout: Layout, key: Key, touch: Touch, number: int) -> Probe:
    """The mean over a line's cross-section where it is touched: over the whole end, or the length that is covered; on
    its own side of contacts, where there are any."""
    line = layout.lines[touch.line]
    lower, upper = list(line.lower), list(line.upper)
    lower[line.axis], upper[line.axis] = touch.start, touch.stop
    quantity: Quantity = "potential" if key[0] in ("wire", "electrode") else "temperature"
    boxes = (line.box.name,) if any(joint.contact for joint in layout.joints) else ()
    return Probe(f"{key[0]} {key[1]} side {number}", _point(lower), _point(upper), quantity, boxes=boxes)


def _flow(key: Key, touch: Touch) -> Probe:
    quantity = "current" if key[0] in ("wire", "electrode") else "heat_flow"
    return Probe(f"{key[0]} {key[1]} flow", touch.lower, touch.upper, quantity)  # type: ignore[arg-type]


def _point(values: list[float]) -> Point:
    return values[0], values[1], values[2]
