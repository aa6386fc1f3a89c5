"""report.html: head, verdict, figures, sections and style in one file, and any JSON value as markup."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from string import Template
from typing import Any

from compare.kinds import kind_of
from compare.kinds.device import DEVICE_FIGURES
from compare.kinds.sink import FIGURES
from compare.kinds.sink import QUANTITIES as SINK
from compare.outcome import Outcome
from compare.pipeline import sections
from compare.quantities import OF_A_DEVICE as DEVICE
from compare.report.table import Row, Section, Style, Table, html_table
from compare.report.table import html_section as section
from compare.report.table import html_text as text
from compare.verdict import contrary
from scenes.formats import percent, quantity

_HERE = Path(__file__).parent
_STYLE = Style(page=True)
_PICTURES = ("figure4", "figure_field")
"""Figures that are a picture of the field."""
_CAPTIONS = {name: shows for name, (shows, *_) in FIGURES.items()} | DEVICE_FIGURES | {
    "figure_traces": "every probe against time", "why": "what each assumption adds to the difference from 3D",
}  # fmt: skip
_NAMED = SINK | DEVICE
_UNITS = {
    "_K_per_W": "K/W", "_W_per_m2": "W/m2", "_A_per_m2": "A/m2", "_K": "K", "_A": "A", "_W": "W", "_V": "V", "_s": "s",
    "_m3": "m3", "_m": "m", "_J": "J", "_Hz": "Hz", "_ohm": "ohm",
}  # fmt: skip
Document = Mapping[str, Any]


def write_report(path: Path, outcome: Outcome[Any], document: Document) -> None:
    """Write the page about a run into its folder, which has its figures; ``document`` is the summary."""
    kind, against, title = kind_of(outcome.scene), contrary(outcome.checks, outcome.scene), outcome.scene.name
    said, parts = " ".join(kind.report.headline(outcome, against, _STYLE).split()), sections(outcome, against, _STYLE)
    path.write_text(page(path.parent, title, said, parts, document), encoding="utf-8")


def page(folder: Path, title: str, said: str, sections: Iterable[Section], document: Document) -> str:
    """Return the page as text; figures are read from ``folder``."""
    steps = [[step["step"], step["state"], step["reason"]] for step in document.get("plan", ())]
    plan = Section("Plan", [Table(("step", "state", "why"), steps, "<<<")] if steps else [])
    made = [part.html() for part in (*sections, _errors(document))]
    parts = [_field(folder), figures(folder, document), *made, *_solution(document), plan.html(), _scene(document)]
    parts = [part for part in (*parts, _provenance(document)) if part]
    answer = str(document.get("answer") or said)
    found = re.findall('<section id="(.*?)"><h2>(.*?)</h2>', "".join(parts))
    links = " ".join(f'<a href="#{at}">{head}</a>' for at, head in found)
    head = [f'<p class="verdict">{text(answer)}</p>']
    head += [f"<p>{text(said.removeprefix(answer).strip())}</p>", _tally(document)]
    head += [f'<p class="warning">{text(w)}.</p>' for w in document.get("warnings") or ()]
    return whole(title, "\n".join([*head, f"<nav>{links}</nav>"]), parts)


def whole(title: str, head: str, parts: Sequence[str]) -> str:
    """Return a page of a title, the head below the title, and parts, in one file."""
    template = Template((_HERE / "page.html").read_text(encoding="utf-8"))
    style = (_HERE / "style.css").read_text(encoding="utf-8")
    return template.substitute(title=text(title), style=style, head=head, main="\n".join(parts))


def _tally(document: Document) -> str:
    """The checks by their verdicts, as the headline counts them, and how many slopes differ."""
    items, judged = "", [c for c in document.get("checks", ()) if c.get("own", True)]
    slopes = [c["verdict"] for c in judged if c["id"].startswith("slope_")]
    for verdict, word in (("differs", "differ"), ("unresolved", "unresolved"), ("agrees", "agree")):
        names = [c["id"] for c in judged if c["verdict"] == verdict and not c["id"].startswith("slope_")]
        if names:
            items += f'<li><span class="{verdict} word">{len(names)} {word}</span>: {text(", ".join(names))}</li>'
    if slopes:
        items += f"<li>slopes by the scene's keys: {slopes.count('differs')} of {len(slopes)} differ</li>"
    return f'<ul class="tally">{items}</ul>' if items else ""


def _embedded(path: Path, alt: str) -> str:
    """An image of a page that needs no other file."""
    kind = {".png": "png", ".svg": "svg+xml"}[path.suffix]
    source = base64.b64encode(path.read_bytes()).decode("ascii")
    return f'<img src="data:image/{kind};base64,{source}" alt="{alt}">'


def _field(folder: Path) -> str:
    """Return the section with the picture of the field, if there is one."""
    pictures = [path for name in _PICTURES if (path := folder / f"{name}.png").exists()]
    shown = "".join(_embedded(path, "The 3D temperature field") for path in pictures[:1])
    caption = "The 3D temperature field; `validate view` turns it where the run has --fields."
    figure = f'<figure><div class="wide picture">{shown}</div><figcaption>{text(caption)}</figcaption></figure>'
    return section("Field", figure if shown else "")


def figures(folder: Path, document: Document, captions: Mapping[str, str] = _CAPTIONS) -> str:
    """The figures of the folder but the field's picture, which has a section of its own."""

    def order(name: str) -> tuple[int, str]:
        digits = name.removeprefix("figure")
        return (int(digits) if digits.isdigit() else 0, name)

    images, names = [], {Path(file).stem for file in document.get("files", ()) if file.endswith(".svg")}
    for name in sorted(names - set(_PICTURES), key=order):
        caption = captions.get(name, f"figure {name.removeprefix('figure')}")
        caption = text(f"{caption[0].upper()}{caption[1:]}{'.' * (not caption.endswith('.'))}")
        image = _embedded(folder / f"{name}.svg", caption)
        images.append(f'<figure><div class="wide">{image}</div><figcaption>{caption}</figcaption></figure>')
    return section("Figures", *images)


def _errors(document: Document) -> Section:
    """The estimated error of every number, beside the number or the tolerance."""
    fem3d, reduced1d = document.get("fem3d") or {}, document.get("reduced1d") or {}
    over_time, units = fem3d.get("transient") or {}, fem3d.get("units") or {}
    steady = fem3d.get("steady") or {}
    # A sink's summary has no start of the errors over time: it is always the same.
    start = f"over time, from {quantity(over_time.get('accurate_from_s', 1e-5), 's', 2)} on"
    start += ", and that long after each jump of a given temperature" * bool(over_time.get("jumps"))
    groups = {
        "steady": {key: item.get("error") for key, item in steady.items()},
        start: over_time.get("errors") or {}, "1D model, over time": reduced1d.get("errors") or {},
    }  # fmt: skip
    rows: list[Row] = []
    for head, errors in groups.items():
        rows += [Row([head])] * bool(errors)
        for key, error in errors.items():
            # A probe has a name and a unit of its own, a quantity's are in the key.
            name, unit = (key, units[key]) if key in units else named(key)
            value = steady.get(key, {}).get("value") if errors is groups["steady"] else None
            shown_error = "infinite" if error is None else quantity(error, unit, 2)
            rows.append(Row([name, shown_error, percent(error / abs(value)) if error and value else ""]))
    checks = [c for c in document.get("checks", ()) if c["u_num"]]
    rows += [Row(["difference of a check, and its part of the tolerance"])] * bool(checks)
    rows += [Row([c["id"], percent(c["u_num"], 1), percent(c["u_num"] / c["tolerance"], 1)]) for c in checks]
    said = "Errors are estimated bounds of the numerical error alone; the model's own assumptions are not in them."
    table = Table(("quantity", "estimated error", "of the value"), rows)
    return Section("Error budget", [said, table] if rows else [])


def _solution(document: Document) -> list[str]:
    """The balance of heat, and the mesh."""
    fem3d = document.get("fem3d") or {}
    transient, steady = fem3d.get("transient") or {}, fem3d.get("steady") or {}
    heat = {key: steady[key]["value"] for key in ("power_W", "heat_out_W") if key in steady} | {
        "imbalance of the steady state, of the power": fem3d.get("energy_imbalance"),
        "largest imbalance over time, of the heat supplied until then": transient.get("imbalance"),
    }
    mesh = {
        "part solved": fem3d.get("symmetry"), "unknowns": fem3d.get("dofs"), "time steps": fem3d.get("steps"),
        "error of the steady field at its worst place, of its largest rise": fem3d.get("field_error") or None,
        **(fem3d.get("mesh") or {}),
    }  # fmt: skip
    parts = {"Energy balance": heat, "Mesh": mesh}
    return [section(name, values({k: v for k, v in part.items() if v is not None})) for name, part in parts.items()]


def _scene(document: Document) -> str:
    """Every key of the scene, in the units of its schema; SI units for keys outside the schema."""
    from scenes.errors import SceneError
    from scenes.keys import TYPES
    from scenes.parameters import SECTION
    from scenes.schema import nest

    scene = document.get("scene") or {}
    for kind in TYPES.values():
        try:
            read = kind.schema.read(kind.schema.flatten(scene))
        except SceneError:
            continue
        keys = {path: key for path, key in kind.schema.paths.items() if path in read}
        parameters = {SECTION: scene[SECTION]} if SECTION in scene else {}
        scene = nest({path: key.kind.show(read[path]) or "none" for path, key in keys.items()}) | parameters
        break
    return section("Scene", f'<div class="columns">{values(scene)}</div>' if scene else "")


def _provenance(document: Document) -> str:
    timing = {f"{key} (s)": round(float(value), 3) for key, value in (document.get("timing_s") or {}).items()}
    files = [text(name) for name in document.get("files", ()) if name != "report.html"]
    links = ", ".join(f'<a href="{name}">{name}</a>' for name in files)
    parts = {"versions": document.get("provenance") or {}, "time taken": timing}
    command = document.get("command")
    return section(
        "Versions and files",
        f"<p>Made by <code>{text(command)}</code></p>" if command else "",
        f'<div class="columns">{values(parts)}</div>',
        f"<p>Beside this page: {links}.</p>" if links else "",
    )


def named(key: str) -> tuple[str, str]:
    """A key as a name and its unit: "peak_rise_K" is ("peak rise", "K")."""
    if key in _NAMED:
        return _NAMED[key]
    ending, unit = next((item for item in _UNITS.items() if key.endswith(item[0])), ("", ""))
    return key.removesuffix(ending).replace("_", " "), unit


def shown(value: Any, unit: str = "") -> str:
    """Return a value of a summary, or a list of values, as escaped text."""
    if isinstance(value, (list, tuple)):
        return ", ".join(shown(part, unit) for part in value)
    if value is None or isinstance(value, bool):
        return {None: "none", True: "yes", False: "no"}[value]
    if isinstance(value, int):
        return f"{value:,}".replace(",", "&#8239;")
    if isinstance(value, float):
        if not math.isfinite(value):
            return "infinite"
        # A volume takes no prefix: a "pm3" is a cubic picometre.
        return text(quantity(value, unit, 5) if unit and unit != "m3" else f"{value:.6g} {unit}".rstrip())
    return text(value)


def values(items: Mapping[str, Any]) -> str:
    """Return keys with their values; tables and lists get headings of their own."""
    rows, parts = [], []
    for key, item in items.items():
        name, unit = named(str(key))
        if not isinstance(item, (Mapping, list, tuple)):
            rows.append(f"<dt>{text(name)}</dt><dd>{shown(item, unit)}</dd>")
        elif not isinstance(item, Mapping) and len(item) < 9 and all(isinstance(p, (int, float, str)) for p in item):
            rows.append(f"<dt>{text(name)}</dt><dd>{shown(item, unit) or 'none'}</dd>")
        elif item:
            parts.append(f'<section class="keep"><h3>{text(name)}</h3>{_anything(item)}</section>')
    return "\n".join([*[f"<dl>{''.join(rows)}</dl>"] * bool(rows), *parts])


def _anything(item: Any) -> str:
    """Any JSON value: a table for rows of the same keys, a list, keys with values, or text."""
    if isinstance(item, Mapping):
        return values(item)
    if not isinstance(item, (list, tuple)):
        return shown(item)
    if item and all(isinstance(part, Mapping) and part.keys() == item[0].keys() for part in item):
        heads = [named(str(key)) for key in item[0]]
        if not any(isinstance(value, Mapping) for part in item for value in part.values()):
            rows = [
                [shown(value, unit) for value, (_, unit) in zip(part.values(), heads, strict=True)] for part in item
            ]
            return f'<div class="wide">{html_table([name for name, _ in heads], rows)}</div>'
    return "<ul>" + "".join(f"<li>{_anything(part)}</li>" for part in item) + "</ul>"
