"""A network as a table that a person can check by hand: of every line and link the formula with its numbers.

Lengths are in micrometres, as a person reads them; values in SI units. Resistances are those at the initial
temperature.
"""

from __future__ import annotations

from math import inf
from typing import Any

from reduced1d.network.lines import Layout, Line, Link, Touch
from scenes.model import Schedule, Value

Row = dict[str, Any]
"""``what`` it is, ``how`` it is joined, and by unit ("W/K", "J/K", "ohm", "W") the ``formula`` and its ``value``."""


def table(layout: Layout) -> dict[str, list[Row]]:
    """Write the rows of "lines", "joints" and "conditions"; with currents where the scene has any."""
    wires = {_key(link): link for link in layout.current if link.other}
    joints = [_joint(layout, link, wires.pop(_key(link), None)) for link in layout.heat if link.other]
    return {
        "lines": [_line(layout, i) for i in range(len(layout.lines))],
        "joints": joints + [_joint(layout, None, link) for link in wires.values()],
        "conditions": [_condition(layout, link, electric) for electric in (False, True)
                       for link in layout.links(electric) if not link.other],
    }  # fmt: skip


def _key(link: Link) -> tuple[Any, ...]:
    return *(touch.line for touch in link.touches), link.one.lower, link.one.upper


def _line(layout: Layout, i: int) -> Row:
    line = layout.lines[i]
    m, area, length = line.box.material, line.area, line.length
    across = " x ".join(map(_um, line.sides))
    row: Row = {"what": line.name, "how": f"along {'xyz'[line.axis]}, {_um(length)} long, {across}"}
    k = m.thermal_conductivity
    _put(row, "W/K", f"{k:g} W/(m K) x {_um2(area)} / {_um(length)}", k * area / length)
    if not layout.scene.steady:
        formula = f"{m.density:g} kg/m3 x {m.specific_heat:g} J/(kg K) x {_um2(area)} x {_um(length)}"
        _put(row, "J/K", formula, m.heat_capacity * area * length)
    if layout.current and line.conducts:
        r = layout.resistivity(i, True)
        _put(row, "ohm", f"{r:.6g} ohm m x {_um(length)} / {_um2(area)}", r * length / area)
    source = line.box.heat_source
    if source:
        _put(row, "W", f"{_value_text(source, 'W/m3')} x {_um2(area)} x {_um(length)}", _times(source, area * length))
    return row


def _joint(layout: Layout, heat: Link | None, wire: Link | None) -> Row:
    link = heat or wire
    assert link is not None
    row: Row = {"what": " | ".join(layout.lines[t.line].name for t in link.touches), "how": _how(layout, link)}
    sides = [(t, layout.lines[t.line]) for t in link.touches if t.end is None]
    if heat and (sides or heat.contact):
        parts = [f"{_um(t.half)}/{line.box.material.thermal_conductivity:g} W/(m K)" for t, line in sides]
        parts += [f"{heat.contact:g} m2 K/W"] if heat.contact else []
        resistance = sum(t.half * layout.resistivity(t.line, False) for t, _ in sides) + heat.contact
        _put(row, "W/K", f"{_um2(link.one.area)} / ({' + '.join(parts)})", link.one.area / resistance)
    if wire and sides:
        wired = [(t.half, layout.resistivity(t.line, True)) for t, _ in sides]
        halves = " + ".join(f"{_um(half)} x {r:.6g} ohm m" for half, r in wired)
        resistance = sum(half * r for half, r in wired) / link.one.area
        _put(row, "ohm", f"({halves}) / {_um2(link.one.area)}", resistance)
    return row


def _how(layout: Layout, link: Link) -> str:
    if link.kind == "ends":
        return "ends meet, a contact between" if link.contact else "ends meet, nothing between"
    places = [_place(layout.lines[touch.line], touch) for touch in link.touches]
    return ("point by point, " if link.kind == "along" else "means, ") + " and ".join(dict.fromkeys(places))


def _place(line: Line, touch: Touch) -> str:
    if touch.end is not None:
        return f"the end of {line.name}"
    return f"{'xyz'[line.axis]} = {_um(touch.start)} to {_um(touch.stop)} of {line.name}"


def _condition(layout: Layout, link: Link, electric: bool) -> Row:
    touch, b, film = link.one, layout.scene.boundaries[link.boundary], layout.film(link)
    line = layout.lines[touch.line]
    k, side, place = line.box.material.thermal_conductivity, touch.end is None, _place(line, touch)
    if side:
        place = f"a side of {line.name}, {place.removesuffix(f' of {line.name}')}"
    row: Row = {"what": f"{b.name} | {line.name}", "how": place}
    if electric:
        if b.series_resistance == inf:
            row["how"] = f"{place}; {_value_text(b.value, 'A')} enters"
        elif b.series_resistance:
            row["how"] = f"{place}; behind {b.series_resistance:g} ohm"
        if side:
            r = layout.resistivity(touch.line, True)
            _put(row, "ohm", f"{_um(touch.half)} x {r:.6g} ohm m / {_um2(touch.area)}", touch.half * r / touch.area)
    elif b.kind == "heat_flux":
        _put(row, "W", f"{_value_text(b.value, 'W/m2')} x {_um2(touch.area)}", _times(b.value, touch.area))
    elif film:
        half = f" + {_um(touch.half)}/{k:g} W/(m K)" if side else ""
        value = touch.area / (1 / film + touch.half / k)
        _put(row, "W/K", f"{_um2(touch.area)} / (1/{film:g} W/(m2 K){half})", value)
    elif side and film is None:
        _put(row, "W/K", f"{_um2(touch.area)} x {k:g} W/(m K) / {_um(touch.half)}", touch.area * k / touch.half)
    return row


def _put(row: Row, unit: str, formula: str, value: float | None) -> None:
    row[unit] = {"formula": formula, "value": value}


def _value_text(value: Value, unit: str) -> str:
    return f"(what varies, in {unit})" if isinstance(value, Schedule) else f"{value:g} {unit}"


def _times(value: Value, factor: float) -> float | None:
    return None if isinstance(value, Schedule) else value * factor


def _um(length: float) -> str:
    return f"{length * 1e6:.6g} um"


def _um2(area: float) -> str:
    return f"{area * 1e12:.6g} um2"
