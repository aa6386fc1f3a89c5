"""Probes that measure the links of a network in a full model: the mean temperatures (or potentials) on both sides and
the flow between.

Along a line the flow is k A dT/ds, exactly, for the mean temperature over the cross-section. The error of a network of
lines is therefore in its links, in their resistances and in how the flow spreads over them.
"""

from __future__ import annotations

from dataclasses import dataclass

from reduced1d.network.lines import Layout, Link, Touch
from scenes.model import Probe, Quantity


@dataclass(frozen=True)
class Place:
    """A link, by its ``key`` ("heat" | "current", number) and its name ``called``: the probes of either side (None for
    the value of a boundary, of number ``given``) and of the flow, and the ``sign`` of the flow out of the first side.
    """

    key: tuple[str, int]
    called: str
    one: Probe
    other: Probe | None
    given: int | None
    flow: Probe
    sign: float


def places(layout: Layout) -> list[Place]:
    """List every link that has a resistance, or may have one: no fluxes, and no electrodes of unknown potential."""
    kept, boundaries = [], layout.scene.boundaries
    for kind in ("heat", "current"):
        for number, link in enumerate(layout.links(kind == "current")):
            b = boundaries[link.boundary]
            if link.other or not (b.kind == "heat_flux" or (kind == "current" and b.series_resistance)):
                kept.append(_place(layout, (kind, number), link))
    return kept


def _place(layout: Layout, key: tuple[str, int], link: Link) -> Place:
    names = [layout.lines[t.line].name for t in link.touches]
    given, sign, other = None, 1.0, None
    if link.other is None:
        names.insert(0, layout.scene.boundaries[link.boundary].name)
        given, sign = link.boundary, _sign(layout, link.one)
    else:
        other = _side(layout, key, link.other, 1)
    called = " | ".join(names) + (", current" if key[0] == "current" else "")
    quantity: Quantity = "current" if key[0] == "current" else "heat_flow"
    flow = Probe(f"{key[0]} {key[1]} flow", link.one.lower, link.one.upper, quantity)
    return Place(key, called, _side(layout, key, link.one, 0), other, given, flow, sign)


def _sign(layout: Layout, touch: Touch) -> float:
    """Out of the line: a flow counts into the solid on its surface, along the axis inside."""
    line, n = layout.lines[touch.line], touch.normal
    inside = any(
        other is not line and touch.lower[n] in (other.lower[n], other.upper[n])
        and all(max(touch.lower[d], other.lower[d]) < min(touch.upper[d], other.upper[d]) for d in range(3) if d != n)
        for other in layout.lines
    )  # fmt: skip
    return -1.0 if not inside or line.lower[n] == touch.lower[n] else 1.0


def _side(layout: Layout, key: tuple[str, int], touch: Touch, number: int) -> Probe:
    """The mean over a line's cross-section where it is touched: over the whole end, or the length that is covered; on
    its own side of contacts, where there are any."""
    line = layout.lines[touch.line]
    lower, upper = list(line.lower), list(line.upper)
    lower[line.axis], upper[line.axis] = touch.start, touch.stop
    quantity: Quantity = "potential" if key[0] == "current" else "temperature"
    boxes = (line.box.name,) if any(link.contact for link in layout.heat) else ()
    (a, b, c), (d, e, f) = lower, upper
    return Probe(f"{key[0]} {key[1]} side {number}", (a, b, c), (d, e, f), quantity, boxes=boxes)
