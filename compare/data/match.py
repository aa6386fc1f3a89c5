"""Match the columns of a file to quantities and keys of the scene, and pick the rows of the scene's run.

`--column NAME=COLUMN` reads a column as if its header were NAME. A sweep has its runs below one another with a column
for each parameter; the run has the scene's parameters.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np

from compare import quantities
from compare.data.columns import Column, find_times, plain_name, refusing, split_unit
from scenes.errors import SceneError, did_you_mean, quoted
from scenes.model import values as values_of
from scenes.parameters import SECTION
from scenes.units import VOLTAGE, Unit, called, parse_unit
from scenes.varied import every_number, varied

IGNORED = "ignore"
"""The role of a column that is left out."""
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

    def find_role(self, column: Column) -> str:
        """Return the quantity or the key that a column is called as; "" for none."""
        return self._find_quantity(column) or self._find_key(column.plain)

    def _find_key(self, name: str) -> str:
        """The key that ends with a name, of the scene's main section where there are several; "" for none."""
        wanted = "." + re.sub(r"\s+", "_", name.strip())
        found = [key for key in self.numbers if f".{key}".lower().endswith(wanted.lower())]
        found = [key for key in found if f".{key}".endswith(wanted)] or found
        found = [key for key in found if key.lower() in (wanted[1:].lower(), f"sink{wanted.lower()}")] or found
        if len(found) == 1:
            return found[0]
        return "drive.voltage" if self._is_sink and _VOLTAGE.fullmatch(name) else ""

    def _find_quantity(self, column: Column) -> str:
        """The quantity that a column is called as, also as v(NAME), "NAME rise" or in traces.csv; or ""."""
        if column.plain in self.quantities.names:
            return self.quantities.names[column.plain]
        texts = {plain_name(text) for text in (column.name, column.plain)}
        texts |= {re.sub("^fem3d_|_rise$", "", text) for text in texts}
        names = self.quantities.names.items()
        found = [name for word, name in names if {plain_name(word), plain_name(name)} & texts]
        return found[0] if len(found) == 1 else self._find_point(column)

    def _find_point(self, column: Column) -> str:
        """The probe at the point in the name of a column, in m, mm or um, as COMSOL's tables have it; or ""."""
        number = r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)"
        match = re.search(rf"\({number}, *{number}, *{number}\)", column.name, re.IGNORECASE)
        if not match or self._is_sink:
            return ""
        points = np.outer([1.0, 1e-3, 1e-6], [float(each) for each in match.groups()])
        found = []
        for probe in self.scene.probes:
            low, high = (getattr(probe, "at", None) or getattr(probe, side, None) for side in ("lower", "upper"))
            if low is not None and low == high and column.powers == self._unit(probe.name)[1].powers:
                near = np.abs(points - low).max(axis=1) <= 1e-3 * np.abs(points).max(axis=1)
                found += [probe.name] * bool(near.any())
        return found[0] if len(found) == 1 else ""

    def _unit(self, role: str) -> tuple[str, Unit]:
        """The SI unit of a role, and its symbol."""
        units = {"time": "s", **self.quantities.units}
        symbol = units[role] if role in units else self.numbers[role].kind.dimension.unit
        return symbol, parse_unit(symbol)

    def convert(self, column: Column) -> tuple[Column, str]:
        """Return a column in a unit of its role, and why it has none, or "".

        Numbers without a unit are in SI units; a circuit has volts for all that is no current.
        """
        symbol, unit = self._unit(column.role)
        if column.unit is None:
            column = replace(column, unit=unit, note=f"it has no unit and is taken in {symbol}")
        elif column.spice and column.powers == VOLTAGE.powers != unit.powers:
            column = replace(column, unit=unit, note=f"volts taken for {'kelvins' if symbol == 'K' else symbol}")
        return column, f"is {called(column.powers or ())}, not {called(unit.powers)}" * (column.powers != unit.powers)

    def sign(self, key: str) -> float:
        """Return the sign of a current: 1 at an electrode of the largest voltage, -1 of the smallest, otherwise 0."""
        if self._is_sink:
            return float(np.sign(self.scene.voltage if self.scene.current is None else self.scene.current))
        place = attrgetter("group") if self.scene.parts == "bodies" else attrgetter("lower", "upper")
        drives = {place(b): b for b in self.scene.boundaries if b.kind == "voltage"}
        here = drives.pop(place(next(probe for probe in self.scene.probes if probe.name == key)), None)
        if here is None:
            return 0.0
        value, *others = (max(values_of(b.value), key=abs) for b in (here, *drives.values()))
        if here.key == "current":
            return float(np.sign(value))
        signs = {float(np.sign(value - other)) for other in others}
        return signs.pop() if len(signs) == 1 and all(b.key == "voltage" for b in drives.values()) else 0.0


def assign(columns: Sequence[Column], target: Target, given: Sequence[str]) -> list[Column]:
    """Return the columns with their roles; `--column NAME=COLUMN` gives them other names. Raises SceneError."""
    assigned = list(columns)
    for text in given:
        with refusing(f"--column {quoted(text)}"):
            name, _, wanted = (part.strip() for part in text.partition("="))
            if not name or not wanted:
                raise SceneError('give NAME=COLUMN, such as peak="T (K), Point 1"')
            places = _find_columns(columns, wanted)
            plain, unit = (name, None) if name in target.quantities.names else split_unit(name)
            header = re.sub(" curve$", "", plain, flags=re.IGNORECASE)
            role = plain.lower() if plain.lower() in ("time", IGNORED) else ""
            role = target.find_role(replace(columns[places[0]], name=header, spice=False)) or role
            if not role:
                choices = ("time", *target.quantities.names, IGNORED)
                key = f", or a key of the scene such as {next(iter(target.numbers))}" if target.numbers else ""
                raise SceneError(f"it is no quantity: give {', '.join(choices)}{key}{did_you_mean(plain, choices)}")
            if any(c.called and (n in places or c.role == role != IGNORED) for n, c in enumerate(assigned)):
                raise SceneError("this column, or another one for it, is named already: name each once")
            for n in places:
                assigned[n] = replace(columns[n], called=name, role=role, unit=unit or columns[n].unit)
    clocks = {c.name for c in find_times([c for c in assigned if not c.called])}
    return [c if c.called else replace(c, role="time" if c.name in clocks else target.find_role(c)) for c in assigned]


def _find_columns(columns: Sequence[Column], wanted: str) -> list[int]:
    """The places of a column: by number, or by its header, without its unit where that is enough. Vectors of ngspice
    may share one header, the time, which stands before each."""
    plain, names = " ".join(wanted.split()), [c.name for c in columns]
    loose = [n for n, c in enumerate(columns) if plain.lower() in (c.name.lower(), c.plain.lower())]
    places = [n for n, name in enumerate(names) if name == plain] or loose
    if len({names[n] for n in places}) == 1:
        return places
    if wanted.isdigit() and 0 < int(wanted) <= len(columns):
        return [int(wanted) - 1]
    shown = ", ".join(map(quoted, dict.fromkeys(names[:12])))
    raise SceneError(f"no column is called so: there are {shown}{did_you_mean(plain, names)}")


def pick(
    time: np.ndarray, traces: Sequence[Column], keys: Sequence[Column], target: Target
) -> tuple[np.ndarray, str, list[str], list[tuple[str, Any]]]:
    """Pick the rows of the scene's run, or of a curve, at times (s); NaN are times to leave out. Raises SceneError.

    Returns a mask of the rows, the run in words, notes, and of a curve the value in words and the scene of each row.
    """
    steady, rows = target.quantities.steady, np.isfinite(time)
    notes = [f"{(~rows).sum()} rows without one are left out"] * (not rows.all())
    curve = next((c for c in keys if c.is_curve), None)
    rows, words = _choose([c for c in keys if not c.is_curve], rows, target)
    if curve is not None:
        rows &= np.isfinite(curve.si) & (curve.si != 0)  # A scene without a drive has no 3D solution.
        words += "; " * bool(words) + f"the curve over {curve.plain} ({curve.role}), without its zeros"
        return rows, words, notes, _vary(curve, rows, target)
    if steady and traces:
        rows &= np.any([np.isfinite(c.values) for c in traces], axis=0)
    rows, note = _keep_one(time, rows, steady)
    return rows, words, [*notes, note], []


def count_runs(time: np.ndarray) -> int:
    """Return how often times start again, and once more; at an event a solver stores a time twice, before and after."""
    steps = np.diff(time)
    is_one = (steps >= 0).all() and 2 * (steps == 0).sum() <= (steps > 0).sum()
    return 1 if is_one else 1 + int((steps <= 0).sum())


def _choose(parameters: Sequence[Column], rows: np.ndarray, target: Target) -> tuple[np.ndarray, str]:
    """At which of some rows all parameters are the scene's to the digits of a table, and the run in words."""
    said = []
    for p in parameters:
        value = target.numbers[p.role].value
        rows = rows & np.isclose(p.si, value, rtol=1e-4, atol=1e-15)
        said.append(f"{p.plain} = {target.show(p.role, value)} ({p.role})")
    if not rows.any():
        first = parameters[0]
        other = target.show(first.role, float(first.si[0])).replace(" ", "")
        raise SceneError(
            f"it has no run of this scene, {', '.join(said)}: export that run, or set the scene: "
            f'--set {first.role}={other} (--column "ignore={first.plain}" where it is no such parameter)'
        )
    return rows, f"the run at {', '.join(said)}" * bool(said)


def _keep_one(time: np.ndarray, rows: np.ndarray, steady: bool) -> tuple[np.ndarray, str]:
    """The rows of one run at ascending times, or the last one for the steady state, and a note."""
    kept = np.flatnonzero(rows)
    last, note = kept == kept[-1:], f"the last of {len(kept)} rows with numbers is taken for the steady state"
    if not steady:
        last = np.append(np.diff(time[kept]) > 0, True)
        note = f"{(~last).sum()} of them twice, the second row is taken"
    if count_runs(time[kept]) > 1:
        problem = f'it has {len(kept)} rows where the scene has one steady state, and they are not "probe, value, unit"'
        if not steady:
            problem = 'its times repeat or step back, as those of several runs, of too few digits or with "1,000" do'
        raise SceneError(f"{problem}: export one run, or name the column of a key of the scene, --column KEY=COLUMN")
    return np.isin(np.arange(len(time)), kept[last]), note * (not last.all())


def _vary(curve: Column, rows: np.ndarray, target: Target) -> list[tuple[str, Any]]:
    """The value in words and the scene of each row of a curve. Raises SceneError."""
    if not target.quantities.steady:
        raise SceneError(f"a curve over {curve.plain} is one of steady states: give --steady")
    if not (now := target.numbers[curve.role].value):
        raise SceneError(f"{curve.role} is 0 in the scene: give it another value for a curve")
    return [
        (f"{curve.role} = {target.show(curve.role, value)}", varied(target.scene, curve.role, value / now))
        for value in curve.si[rows].tolist()
    ]
