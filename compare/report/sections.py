"""The sections of the page, each from what a run's summary holds; empty where it holds nothing of the kind."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.report.field import PICTURES
from compare.report.parts import anything, row, section, table, values
from compare.report.words import named, shown, text
from compare.words import difference_text, percent, quantity, with_error

Document = Mapping[str, Any]
_MARKS = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}
_PLUS_MINUS = "\N{PLUS-MINUS SIGN}"
_TREATED = (
    "schema", "scene", "plan", "provenance", "fem3d", "reduced1d", "checks", "warnings", "files", "timing_s",
    "findings",
)  # fmt: skip
_CAPTIONS = {
    "figure5": "The steady rise along the beam in both models.",
    "figure6": "Rises against time in both models.",
    "figure_traces": "Every probe against time.",
    "figure7": "The current against time in both models.",
}


def checks(document: Document) -> str:
    """Every check, with the reason where one is given."""
    heads = ("check", "of", "predicted", "measured", "difference", "tolerance", "verdict")
    numbers, rows = (2, 3, 4, 5), []
    for check in document.get("checks", ()):
        verdict, unit = check["verdict"], "" if check["unit"] == "1" else check["unit"]
        word = f'<span class="word {verdict}">{_MARKS[verdict]} {verdict}</span>'
        cells = [
            f"<code>{text(check['id'])}</code>",
            text(check["title"]),
            *(shown(check[key], unit) for key in ("predicted", "measured")),
            text(difference_text(_number(check["difference"]), _number(check["u_num"]), _PLUS_MINUS)),
            text(percent(_number(check["tolerance"]), 1)),
            word,
        ]
        because = check.get("because") or ""
        expected = check.get("expected")
        if expected and expected != verdict:
            because = f"the scene declares that it {expected}" + (f"; {because}" if because else "")
        rows.append(row(heads, cells, numbers, "judged" if because else ""))
        if because:
            rows.append(f'<tr class="because"><td colspan="{len(heads)}">{text(because)}.</td></tr>')
    if not rows:
        return ""
    top = "".join(f"<th{' class=n' if i in numbers else ''}>{head}</th>" for i, head in enumerate(heads))
    note = (
        "<p>A check <em>differs</em> or <em>agrees</em> only where that holds for every value that the difference may "
        "have given its numerical error; else it is <em>unresolved</em>.</p>"
    )
    body = "\n".join(rows)
    listed = f'<table class="cards"><thead><tr>{top}</tr></thead><tbody>\n{body}\n</tbody></table>'
    return section("Checks", note, f'<div class="wide">{listed}</div>')


def quantities(document: Document) -> str:
    """The steady state of each model, 3D with its error."""
    fem3d, reduced1d = (_steady(document, model) for model in ("fem3d", "reduced1d"))
    if not fem3d and not reduced1d:
        return ""
    name = (document.get("reduced1d") or {}).get("name")
    heads = ["quantity", *(["3D"] if fem3d else []), *([f"1D ({name})" if name else "1D"] if reduced1d else [])]
    if fem3d and reduced1d:
        heads.append("1D/3D - 1")
    rows = []
    for key in [*fem3d, *(k for k in reduced1d if k not in fem3d)]:
        label, unit = _probe_or_quantity(document, key)
        cells = [text(label)]
        if fem3d:
            cells.append(_with_error(fem3d.get(key), unit))
        if reduced1d:
            cells.append(shown(_value(reduced1d.get(key)), unit) if key in reduced1d else "")
        if fem3d and reduced1d:
            a, b = _value(reduced1d.get(key)), _value(fem3d.get(key))
            cells.append(text(percent(a / b - 1, sign=True)) if a is not None and b else "")
        rows.append(cells)
    return section("Steady state", table(heads, rows, range(1, len(heads))))


def at_times(document: Document) -> str:
    """The values of a transient at the times that were asked for."""
    over_time = (document.get("fem3d") or {}).get("transient") or {}
    times, found = over_time.get("time_s"), over_time.get("values")
    if not times or not found:
        return ""
    names = [_probe_or_quantity(document, key) for key in found]
    rows = [
        [shown(t, "s"), *(shown(v[i], unit) for v, (_, unit) in zip(found.values(), names, strict=True))]
        for i, t in enumerate(times)
    ]
    heads = ["time", *(label for label, _ in names)]
    return section("Over time", f'<div class="wide">{table(heads, rows, range(len(heads)))}</div>')


def _probe_or_quantity(document: Document, key: str) -> tuple[str, str]:
    """Name and unit of a key of a model's values: a probe has its own, a quantity's are in the key."""
    units = (document.get("fem3d") or {}).get("units") or {}
    return (key, units[key]) if key in units else named(key)


def figures(folder: Path, document: Document, captions: Mapping[str, str] = _CAPTIONS) -> str:
    """The figures of the folder but the field's picture, which has a section of its own."""
    names = sorted(
        {Path(f).stem for f in document.get("files", ()) if f.startswith("figure")} - set(PICTURES), key=_order
    )
    found = []
    for name in names:
        path = folder / f"{name}.svg"
        if not path.exists():
            continue
        source = f"data:image/svg+xml;base64,{base64.b64encode(path.read_bytes()).decode('ascii')}"
        caption = captions.get(name, f"Figure {name.removeprefix('figure')}.")
        found.append(
            f'<figure><div class="wide"><img src="{source}" alt="{text(caption)}"></div>'
            f"<figcaption>{text(caption)}</figcaption></figure>"
        )
    return section("Figures", *found)


def errors(document: Document) -> str:
    """Where the numerical error stands against each tolerance, and what bounds it."""
    fem3d = document.get("fem3d") or {}
    rows = []
    over_time = (fem3d.get("transient") or {}).get("errors") or {}
    for key, item in _steady(document, "fem3d").items():
        label, unit = _probe_or_quantity(document, key)
        error, value = _number(item.get("error")), _number(item.get("value"))
        rows.append([text(label), _error(error, unit), text(percent(error / abs(value))) if value else ""])
    parts = [table(("steady", "estimated error", "of the value"), rows, (1, 2))] if rows else []
    if over_time:
        listed = [
            [text(name), _error(error, unit)]
            for (name, unit), error in ((_probe_or_quantity(document, k), e) for k, e in over_time.items())
        ]
        parts.append(table(("over time, from 10 \N{MICRO SIGN}s on", "estimated error"), listed, (1,)))
    judged = [c for c in document.get("checks", ()) if c["u_num"]]
    if judged:
        listed = [
            [f"<code>{text(c['id'])}</code>", *(text(percent(_number(c[k]), 1)) for k in ("u_num", "tolerance")),
             text(percent(_number(c["u_num"]) / _number(c["tolerance"]), 1))]
            for c in judged
        ]  # fmt: skip
        heads = ("check", "error of the difference", "tolerance", "error / tolerance")
        parts.append(table(heads, listed, (1, 2, 3)))
    found = (document.get("reduced1d") or {}).get("errors")
    if isinstance(found, Mapping) and found:
        parts.append(values({"of the 1D model": found}))
    if not parts:
        return ""
    said = (
        "<p>Errors are estimated bounds of the numerical error alone; the model's own assumptions are not in them.</p>"
    )
    return section("Error budget", said, *parts)


def energy(document: Document) -> str:
    """How well what enters is balanced by what leaves and is stored."""
    fem3d = document.get("fem3d") or {}
    steady = _steady(document, "fem3d")
    found: dict[str, str] = {}
    for key in ("power_W", "heat_out_W"):
        if key in steady:
            label, unit = named(key)
            found[label] = _with_error(steady[key], unit)
    if fem3d.get("energy_imbalance") is not None:
        found["imbalance of the steady state, of the power"] = text(f"{fem3d['energy_imbalance']:.1e}")
    over_time = (fem3d.get("transient") or {}).get("imbalance")
    if over_time is not None:
        found["largest imbalance over time, of the heat supplied until then"] = text(f"{over_time:.1e}")
    rows = "".join(f"<dt>{text(name)}</dt><dd>{value}</dd>" for name, value in found.items())
    return section("Energy balance", f"<dl>{rows}</dl>" if rows else "")


def mesh(document: Document) -> str:
    """Statistics of the mesh that the 3D answer is from."""
    fem3d = document.get("fem3d") or {}
    found = {"part solved": fem3d.get("symmetry"), "unknowns": fem3d.get("dofs"), "time steps": fem3d.get("steps")}
    found = {key: value for key, value in found.items() if value is not None}
    return section("Mesh", values({**found, **(fem3d.get("mesh") or {})}) if found or fem3d.get("mesh") else "")


def plan(document: Document) -> str:
    """What was done and what was skipped, each with its reason."""
    rows = [
        [text(step["step"]), f'<span class="word">{text(step["state"])}</span>', text(step["reason"])]
        for step in document.get("plan", ())
    ]
    return section("Plan", table(("step", "state", "why"), rows)) if rows else ""


def others(document: Document) -> str:
    """What else a run's summary holds: findings, answers, attributions."""
    reduced = document.get("reduced1d") or {}
    found = [section("Findings", anything(document["findings"]))] if document.get("findings") else []
    for key in ("peaks", "settling"):
        if reduced.get(key):
            found.append(section(f"1D {key}", _peaks(reduced[key]) if key == "peaks" else anything(reduced[key])))
    for key, item in document.items():
        if key not in _TREATED and item:
            found.append(section(named(key)[0].capitalize(), anything(item)))
    return "\n".join(found)


def _peaks(found: Mapping[str, Any]) -> str:
    rows = [[text(named(k)[0]), shown(v["value"], named(k)[1]), shown(v["time_s"], "s")] for k, v in found.items()]
    return table(("quantity", "largest", "at"), rows, (1, 2))


def scene(document: Document) -> str:
    """Every key of the scene, with units where its type is known."""
    found = document.get("scene") or {}
    return section("Scene", f'<div class="columns">{values(_with_units(found))}</div>' if found else "")


def _with_units(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """The scene in the words of its type's schema; as it is, in SI units, where that is none of the known ones."""
    from scenes.errors import SceneError
    from scenes.schema import nest
    from scenes.types import TYPES

    for kind in TYPES.values():
        try:
            read = kind.schema.read(kind.schema.flatten(found))
        except SceneError:
            continue
        return nest({path: kind.schema.paths[path].kind.show(value) or "none" for path, value in read.items()})
    return found


def provenance(document: Document) -> str:
    """Versions, times and files."""
    timing = {f"{key} (s)": round(float(value), 3) for key, value in (document.get("timing_s") or {}).items()}
    links = ", ".join(
        f'<a href="{text(name)}">{text(name)}</a>' for name in document.get("files", ()) if name != "report.html"
    )
    parts = {"versions": document.get("provenance") or {}, "time taken": timing}
    listed = f"<p>Beside this page: {links}.</p>" if links else ""
    return section("Versions and files", f'<div class="columns">{values(parts)}</div>', listed)


def _steady(document: Document, model: str) -> Mapping[str, Any]:
    found = (document.get(model) or {}).get("steady") or {}
    return found if isinstance(found, Mapping) else {}


def _error(error: float, unit: str) -> str:
    return text(quantity(error, unit, 2))


def _value(item: Mapping[str, Any] | None) -> float | None:
    return None if item is None else item.get("value")


def _number(value: Any) -> float:
    """A summary has null where a number is not finite."""
    return float("inf") if value is None else float(value)


def _with_error(item: Mapping[str, Any] | None, unit: str) -> str:
    if item is None or item.get("value") is None:
        return ""
    if item.get("error") is None:
        return text(quantity(item["value"], unit, 6))
    value, error, shown_unit, _, _ = with_error(item["value"], item["error"], unit)
    return text(f"{value} {_PLUS_MINUS} {error} {shown_unit}")


def _order(name: str) -> tuple[int, str]:
    digits = name.removeprefix("figure")
    return (int(digits) if digits.isdigit() else 0, name)


def headings(sections: Sequence[str]) -> str:
    """Links to the sections."""
    found = []
    for part in sections:
        for piece in part.split('<section id="')[1:]:
            anchor = piece.split('"', 1)[0]
            title = piece.split("<h2>", 1)[1].split("</h2>", 1)[0]
            found.append(f'<a href="#{anchor}">{title}</a>')
    return f"<nav>{' '.join(found)}</nav>"
