"""A network as a table that a person can check by hand: of every line, joint and condition the formula with its
numbers.

Lengths are in micrometres, as a person reads them; values in SI units. Resistances are those at the initial
temperature.
"""

from __future__ import annotations

from math import inf
from typing import Any

from reduced1d.network.lines import Condition, Joint, Layout
from scenes.model import Schedule, Value

AXES = "xyz"
Row = dict[str, Any]
"""``what`` it is, ``how`` it is joined, and by unit ("W/K", "J/K", "ohm", "W") the ``formula`` and its ``value``."""


def table(layout: Layout, electric: bool) -> dict[str, list[Row]]:
    """The rows of "lines", "joints" and "conditions"; with currents where the scene has any."""
    lines = [_line(layout, i, electric) for i in range(len(layout.lines))]
    wires = {_key(joint): joint for joint in layout.wires} if electric else {}
    joints = [_joint(layout, joint, wires.pop(_key(joint), None)) for joint in layout.joints]
    joints += [_joint(layout, None, joint) for joint in wires.values()]
    conditions = [_condition(layout, c, False) for c in layout.conditions]
    conditions += [_condition(layout, c, True) for c in layout.electrodes] if electric else []
    return {"lines": lines, "joints": joints, "conditions": conditions}


def _key(joint: Joint) -> tuple[Any, ...]:
    return joint.one.line, joint.other.line, joint.one.lower, joint.one.upper


def _line(layout: Layout, i: int, electric: bool) -> Row:
    line = layout.lines[i]
    m, area, length = line.box.material, line.area, line.length
    across = " x ".join(map(_um, line.sides))
    row: Row = {"what": line.name, "how": f"along {AXES[line.axis]}, {_um(length)} long, {across}"}
    k = m.thermal_conductivity
    _put(row, "W/K", f"{k:g} W/(m K) x {_um2(area)} / {_um(length)}", k * area / length)
    if not layout.scene.steady:
        formula = f"{m.density:g} kg/m3 x {m.specific_heat:g} J/(kg K) x {_um2(area)} x {_um(length)}"
        _put(row, "J/K", formula, m.heat_capacity * area * length)
    if electric and m.resistivity is not None:
        r = layout.resistivity(i)
        _put(row, "ohm", f"{r:.6g} ohm m x {_um(length)} / {_um2(area)}", r * length / area)
    source = line.box.heat_source
    if source:
        _put(row, "W", f"{_value_text(source, 'W/m3')} x {_um2(area)} x {_um(length)}", _times(source, area * length))
    return row


def _joint(layout: Layout, heat: Joint | None, wire: Joint | None) -> Row:
    joint = heat or wire
    assert joint is not None
    one, other = joint.one, joint.other
    row: Row = {"what": f"{layout.lines[one.line].name} | {layout.lines[other.line].name}", "how": _how(layout, joint)}
    touches = [t for t in (one, other) if t.end is None]
    if heat and (touches or heat.contact):
        each = [(t.half, layout.lines[t.line].box.material.thermal_conductivity) for t in touches]
        parts = [f"{_um(half)}/{k:g} W/(m K)" for half, k in each]
        parts += [f"{heat.contact:g} m2 K/W"] if heat.contact else []
        resistance = sum(half / k for half, k in each) + heat.contact
        _put(row, "W/K", f"{_um2(one.area)} / ({' + '.join(parts)})", one.area / resistance)
    if wire and touches:
        wired = [(t.half, layout.resistivity(t.line)) for t in touches]
        halves = " + ".join(f"{_um(half)} x {r:.6g} ohm m" for half, r in wired)
        _put(row, "ohm", f"({halves}) / {_um2(one.area)}", sum(half * r for half, r in wired) / one.area)
    return row


def _how(layout: Layout, joint: Joint) -> str:
    if joint.kind == "ends":
        return "ends meet, a contact between" if joint.contact else "ends meet, nothing between"
    places = []
    for touch in (joint.one, joint.other):
        line = layout.lines[touch.line]
        if touch.end is None:
            places.append(f"{AXES[line.axis]} = {_um(touch.start)} to {_um(touch.stop)} of {line.name}")
        else:
            places.append(f"the end of {line.name}")
    return ("point by point, " if joint.kind == "along" else "means, ") + " and ".join(dict.fromkeys(places))


def _condition(layout: Layout, condition: Condition, electric: bool) -> Row:
    touch, b = condition.touch, layout.scene.boundaries[condition.boundary]
    line = layout.lines[touch.line]
    k = line.box.material.thermal_conductivity
    place = f"the end of {line.name}" if touch.end is not None else (
        f"a side of {line.name}, {AXES[line.axis]} = {_um(touch.start)} to {_um(touch.stop)}")  # fmt: skip
    row: Row = {"what": f"{b.name} | {line.name}", "how": place}
    if electric:
        if b.series_resistance == inf:
            row["how"] = f"{place}; {_value_text(b.value, 'A')} enters"
        elif b.series_resistance:
            row["how"] = f"{place}; behind {b.series_resistance:g} ohm"
        if touch.end is None:
            r = layout.resistivity(touch.line)
            _put(row, "ohm", f"{_um(touch.half)} x {r:.6g} ohm m / {_um2(touch.area)}", touch.half * r / touch.area)
    elif b.kind == "heat_flux":
        _put(row, "W", f"{_value_text(b.value, 'W/m2')} x {_um2(touch.area)}", _times(b.value, touch.area))
    elif b.kind == "convection" and b.value:
        film = float(b.value)  # type: ignore[arg-type]
        half = "" if touch.end is not None else f" + {_um(touch.half)}/{k:g} W/(m K)"
        value = touch.area / (1 / film + touch.half / k)
        _put(row, "W/K", f"{_um2(touch.area)} / (1/{film:g} W/(m2 K){half})", value)
    elif touch.end is None:
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
