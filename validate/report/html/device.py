"""The device's sections: what its quantities do over the run, how long they take to settle, a designer's answers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenes.formats import percent
from validate.report.html.parts import Document, named, section, shown, table, text


def device(document: Document) -> str:
    """Empty for a scene of another type."""
    reduced = document.get("reduced1d") or {}
    if "steady_before" not in reduced:
        return ""
    parts = [
        section("Over the run", _quantities(reduced)),
        section("Settling", _settling(reduced.get("settling") or ())),
    ]
    design = document.get("design")
    if isinstance(design, Mapping):
        parts.append(section("For the designer", _limits(design), _range(design.get("range")), _meters(design)))
    return "\n".join(part for part in parts if part)


def _quantities(reduced: Mapping[str, Any]) -> str:
    heads = ("quantity", "steady before", "steady after", "peak", "at")
    rows = []
    for key, peak in reduced["peaks"].items():
        name, unit = named(key)
        states = (shown(reduced[state][key]["value"], unit) for state in ("steady_before", "steady"))
        rows.append([text(name), *states, shown(peak["value"], unit), shown(peak["time_s"], "s")])
    return table(heads, rows, range(1, 5))


def _settling(found: Sequence[Mapping[str, Any]]) -> str:
    """A row for each quantity and event, a column for each band."""
    fractions = list(dict.fromkeys(item["fraction"] for item in found))
    first = min((item["after_s"] for item in found), default=0.0)
    times: dict[tuple[str, float], dict[float, Any]] = {}
    for item in found:
        times.setdefault((item["quantity"], item["after_s"]), {})[item["fraction"]] = item["time_s"]
    rows = []
    for (key, after), by_band in times.items():
        cells = ["never" if by_band[f] is None else shown(by_band[f], "s") for f in fractions]
        rows.append([text(named(key)[0]), "the cold start" if after == first == 0 else "the outer step", *cells])
    said = (
        "<p>How long after the event until the quantity stays within a part of its change, to the next or the end.</p>"
    )
    heads = ["quantity", "after", *(f"within {percent(f, 1)}" for f in fractions)]
    return said + table(heads, rows, range(2, len(heads))) if rows else ""


def _limits(design: Mapping[str, Any]) -> str:
    heads = ("sampled every", "sink", "sensor", "slowest mode", "largest eigenvalue per sample")
    rows = [
        [
            shown(limit["sample_time_s"], "s"), _gain(limit["sink_gain_V"]), _gain(limit["sensor_gain_V"]),
            f"{'decays' if limit['decay_per_s'] >= 0 else 'grows'} at {abs(limit['decay_per_s']):.3g} 1/s",
            f"{limit['largest_eigenvalue']:.4g}",
        ]
        for limit in design["limits"]
    ]  # fmt: skip
    smooth = [_gain(gain) for gain in design["smooth_start_gains_V"]]
    said = (
        "<p>Largest gains that start from cold without the limit V &gt;= 0 acting: "
        f"sink {smooth[0]}, sensor {smooth[1]}.</p>"
    )
    return f"<h3>Largest stable gains, each with the other as it is</h3>{table(heads, rows, range(5))}{said}"


def _gain(gain: float | None) -> str:
    return "any" if gain is None else "none" if gain == 0 else shown(gain, "V")


def _range(found: Mapping[str, Any] | None) -> str:
    if not found:
        return ""
    rows = [[text(name), shown(value, unit)] for key, value in found.items() for name, unit in [named(key)]]
    return f"<h3>Range of the outer temperature</h3>{table(('quantity', 'value'), rows, (1,))}"


def _meters(design: Mapping[str, Any]) -> str:
    heads = ("meter", "resolves outside", "by the power", "by the sensor's resistance", "by the sink's")
    rows, notes = [], []
    for name, step in design["resolutions"].items():
        if isinstance(step, Mapping):
            rows.append([text(name), *(shown(step[key], "K") for key in ("total", "power", "sensor", "sink"))])
        notes.append(f"<li>{text(name)}: {text(design['meters'][name])}. Source: {text(design['sources'][name])}.</li>")
    listed = table(heads, rows, range(1, 5)) if rows else ""
    return f"<h3>Smallest step of the outer temperature that a meter tells</h3>{listed}<ul>{''.join(notes)}</ul>"
