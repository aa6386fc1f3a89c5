"""Read a user's own data from a file of another program: columns, the run of the scene, quantities, uncertainties."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from compare.against import Data
from compare.data import raw, text
from compare.data.columns import refusing
from compare.data.match import Target, assign, match, pick
from compare.quantities import AT_REST, EDGE, Quantities
from compare.verdict import COVERS
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.formats import quantity
from scenes.units import ICE_POINT, UnitError, parse_quantity, parse_unit


def read(path: Path, scene: Any, columns: Sequence[str] = (), uncertainty: Sequence[str] = ()) -> Data:
    """Read data of a sink, or of a scene with probes, from a table of text or a raw file.

    ``columns`` and ``uncertainty`` are as `--column` and `--data-uncertainty` have them. Raises SceneError where no
    column is a quantity of the scene, or no run is the scene's.
    """
    target, named, content = Target(scene), f"--against {quoted(path)}", text.read_bytes(path)
    with refusing(named):
        data = _read(path.name, content, target, columns)
    if data.curve and uncertainty:
        raise SceneError("--data-uncertainty is of traces or of one steady state: leave it out with a curve")
    data = replace(data, u=read_uncertainty(target.quantities, data, uncertainty))
    with refusing(named):
        return data if data.at_rest else replace(data, warnings=_compare_run(data, target))


def _read(name: str, content: bytes, target: Target, given: Sequence[str]) -> Data:
    """The data of a file, without uncertainties."""
    catalogue = target.quantities
    if not catalogue.units:
        raise SceneError("the scene has no [[probe]] that data could be of: add one")
    kind, columns = (raw if raw.is_raw(content) else text).read(content)
    if kind == text.LIST and not catalogue.steady:
        raise SceneError("a list of steady values, and the scene is solved over time: give traces, or --steady")
    columns = assign(columns, target, given)
    run = pick(columns, target)
    values: dict[str, np.ndarray] = {}
    headers: dict[str, str] = {"time_s": run.clock} if run.clock else {}
    how = {"time_s": "; ".join(run.notes)}
    for column in run.columns:
        key, found, note = match(column, target, run.curve)
        if not key or (not column.role and any(c.role == key for c in columns)):
            run.left_out[column.name] = "is not the one that --column names" if key else note
        elif key in values:
            word = catalogue.word(key)
            raise SceneError(
                f"both {quoted(headers[key])} and {quoted(column.name)} may be the scene's {word}: say which, by name "
                f'or number, --column {word}="{printable(column.name)}"'
            )
        else:
            values[key], headers[key], how[key] = found, column.name, note
    if not values:
        reasons = "".join(f"; {quoted(n)} {why}" for n, why in [*run.left_out.items()][:8])
        known = ", ".join(f"{word} ({catalogue.units[name]})" for word, name in [*catalogue.names.items()][:8])
        raise SceneError(
            f"none of its columns is a quantity of the scene, {known}{reasons}: call them so, or say which they are, "
            f'--column "{known.partition(", ")[0]}=NAME"'
        )
    names = ", ".join(quoted(headers[key]) for key, each in values.items() if np.isnan(each).any())
    full = np.all([np.isfinite(each) for each in values.values()], axis=0)
    if not full.any():
        raise SceneError(f"every row is empty in one of {names}: leave one of them out, --column ignore=COLUMN")
    notes = (f"{(~full).sum()} of {len(full)} rows are left out, for {names} has no number there",) if names else ()
    values = {key: each[full] for key, each in values.items()}
    time = np.repeat(AT_REST, full.sum()) if catalogue.steady else run.time[full]
    # Other columns may be uncertainties: of temperatures they are differences.
    others = {c.name: c.at(full) for c in run.columns if c.name not in headers.values()}
    return Data(
        name, kind, time, values, headers, {key: note for key, note in how.items() if note}, notes, run.left_out,
        run.words, others=others, words=catalogue.words, curve=list(compress(run.curve, full)),
    )  # fmt: skip


def _compare_run(data: Data, target: Target) -> tuple[str, ...]:
    """Warnings of traces whose times, or whose temperatures at the start, are not the run's. Raises SceneError."""
    catalogue, warnings, last = target.quantities, [], float(data.time[-1])
    end = quantity(catalogue.end, "s", 3)
    inside = int((data.time <= catalogue.end * (1 + 1e-9)).sum())
    if inside < 3:
        covered = f"{quantity(float(data.time[0]), 's', 3)} to {quantity(last, 's', 3)}"
        raise SceneError(
            f"{inside} of its times, {covered}, are within the run up to {end}, and three are the least: give a longer "
            'run, --set end_time=T, or the unit of the times, --column "time (ms)=NAME"'
        )
    if not 0.5 * catalogue.end <= last <= 10 * catalogue.end:
        warnings.append(f"it ends at {quantity(last, 's', 3)}, the run at {end}: only what both cover is compared")
    if data.time[0] > max(catalogue.first / 10, EDGE * catalogue.end):
        return tuple(warnings)
    for key, values in data.values.items():
        off, change = float(values[0]) - catalogue.initial, float(np.abs(values - values[0]).max())
        surely = abs(off) - (COVERS * float(data.u[key][0]) if key in data.u else 0.0)
        if catalogue.units[key] != "K" or surely <= 0.005 * change:
            continue
        header = data.headers[key]
        said = f"{quoted(header)} starts {abs(off):.4g} K {'above' if off > 0 else 'below'} {target.initial}, "
        said += f"{catalogue.initial:g} K: give --set {target.initial}={catalogue.initial + off:.6g}"
        if surely > 0.05 * change:  # the tolerance of the checks
            raise SceneError(
                f'{said}, or of a rise --column "{catalogue.word(key)} rise={printable(header)}", or of noise '
                "--data-uncertainty U"
            )
        warnings.append(f"{said}, or the difference has it")
    return tuple(warnings)


def read_uncertainty(catalogue: Quantities, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """Read `--data-uncertainty` as standard uncertainties (times,) by quantity, in SI units.

    A number with a unit is of all quantities in that unit, a percentage is of the rise or value, a name is a column of
    the file; "peak=0.5K" is of one quantity. Raises SceneError.
    """
    uncertainties: dict[str, np.ndarray] = {}
    names = catalogue.names
    example = next((word for word, name in names.items() if catalogue.units[name] == "K"), next(iter(names)))
    form = f'give 0.5K, 1%, {example}=1%, or {example}="a column of the file"'
    for entry in given:
        name, equals, value = (part.strip() for part in entry.partition("="))
        with refusing(f"--data-uncertainty {quoted(entry)}"):
            if equals and name not in names:
                raise SceneError(
                    f"{printable(name)} is no quantity: give {', '.join(names)}{did_you_mean(name, names)}"
                )
            keys = [names[name]] if equals else list(data.values)
            size = value if equals else entry.strip()
            each = {key: u for key in keys if (u := _read_size(catalogue, data, key, size)) is not None}
            if not each:
                raise SceneError(f"it is none, with its unit, of a quantity of {data.name}: {form}")
            if any((u <= 0).any() or not np.isfinite(u).all() for u in each.values()):
                raise SceneError(f"an uncertainty must be more than nothing: {form}")
        uncertainties |= each
    return uncertainties


def _read_size(catalogue: Quantities, data: Data, key: str, size: str) -> np.ndarray | None:
    """(times,): the uncertainty of one quantity; ``None`` for a size of another kind."""
    if key not in data.values:
        return None
    if size in data.others:
        column = data.others[size]
        return column.differences if column.powers == parse_unit(catalogue.units[key]).powers else None
    try:
        number, unit = parse_quantity(size)
    except UnitError:
        return None
    if size.endswith("%"):
        # A rise is zero at the start, where half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - catalogue.base(key)), np.sign(number) * 1e-12)
    if unit is None or unit.powers != parse_unit(catalogue.units[key]).powers:
        return None
    return np.full(len(data.time), number - float(ICE_POINT) * unit.celsius)
