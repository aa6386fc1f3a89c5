"""report.html: verdict, figures, sections and style in one file."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from compare.kinds.device import OF_A_DEVICE as DEVICE
from compare.kinds.sink import QUANTITIES as SINK
from compare.outcome import Outcome
from compare.report import Row, Section, Style, Table
from scenes.formats import percent, quantity
from scenes.free.tables import toml
from scenes.loading import type_of_file
from scenes.parameters import SECTION
from scenes.schema import nest
from validate.report import views
from validate.report.figures import FIGURES
from validate.report.text import MARKS, headline

_HERE = Path(__file__).parent
_STYLE = Style(page=True)
_PICTURES = tuple(name for name, each in FIGURES.items() if not each.function)
"""Figures that are a picture of the field."""
_CAPTIONS = {name: each.shows for name, each in FIGURES.items()} | {
    "figure_map": "the difference over two keys", "figure_lines": "every check or probe over the varied keys",
}  # fmt: skip
_NAMED = SINK | DEVICE
_UNITS = {
    "_K_per_W": "K/W", "_W_per_m2": "W/m2", "_A_per_m2": "A/m2", "_K": "K", "_A": "A", "_W": "W", "_V": "V", "_s": "s",
    "_m3": "m3", "_m": "m", "_J": "J", "_Hz": "Hz", "_ohm": "ohm",
}  # fmt: skip
Document = Mapping[str, Any]


def write_report(path: Path, outcome: Outcome[Any], document: Document) -> None:
    """Write the page about a run into its folder, which has its figures; ``document`` is the summary."""
    said = " ".join(" ".join(views.headline(outcome, _STYLE)).split())
    whole = page(path.parent, outcome.scene.name, said, views.sections(outcome, _STYLE), document)
    path.write_text(whole, encoding="utf-8")


def excerpt(outcome: Outcome[Any]) -> str:
    """Return the answer and the first sections of a run, as a notebook shows them."""
    said = " ".join(headline(outcome, Style()).split())
    shown = (section_html(part) for part in views.sections(outcome, _STYLE)[:3])
    return "\n".join([f"<p><strong>{escape(said)}</strong></p>", *shown])


def page(folder: Path, title: str, said: str, sections: Iterable[Section], document: Document) -> str:
    """Return the page as text; figures are read from ``folder``."""
    steps = [[step["step"], step["state"], step["reason"]] for step in document.get("plan", ())]
    plan = Section("Plan", [Table(("step", "state", "why"), steps, "<<<")] if steps else [])
    tables = [section_html(part) for part in (*sections, _errors(document), *_solution(document), plan)]
    parts = [*_figures(folder, document), *tables, _scene(document), _provenance(document)]
    found = re.findall('<section id="(.*?)"><h2>(.*?)</h2>', "".join(parts))
    links = " ".join(f'<a href="#{at}">{head}</a>' for at, head in found)
    answer = str(document.get("answer") or said)
    head = [f'<p class="verdict">{text(answer)}</p>', f"<p>{text(said.removeprefix(answer).strip())}</p>"]
    head += [f'<p class="warning">{text(w)}.</p>' for w in document.get("warnings") or ()]
    template = Template((_HERE / "page.html").read_text(encoding="utf-8"))
    style = (_HERE / "style.css").read_text(encoding="utf-8")
    return template.substitute(
        title=text(title), style=style, head="\n".join([*head, f"<nav>{links}</nav>"]),
        main="\n".join(filter(None, parts)),
    )  # fmt: skip


def _figures(folder: Path, document: Document) -> list[str]:
    """Return the sections of the field's picture and of the other figures."""

    def order(name: str) -> tuple[int, str]:
        digits = name.removeprefix("figure")
        return (int(digits) if digits.isdigit() else 0, name)

    def drawn(file: str, caption: str) -> str:
        kind = "png" if file.endswith("png") else "svg+xml"
        source = base64.b64encode((folder / file).read_bytes()).decode("ascii")
        image = f'<img src="data:image/{kind};base64,{source}" alt="{text(caption)}">'
        return f'<figure><div class="wide">{image}</div><figcaption>{text(caption)}</figcaption></figure>'

    names = {Path(file).stem for file in document.get("files", ()) if file.endswith(".svg")}
    seen = "The 3D temperature field; `validate view` turns it where the run has --fields."
    pictures = [drawn(f"{name}.png", seen) for name in _PICTURES if name in names]
    figures = []
    for name in sorted(names - set(_PICTURES), key=order):
        caption = _CAPTIONS.get(name, f"figure {name.removeprefix('figure')}")
        figures.append(drawn(f"{name}.svg", f"{caption[0].upper()}{caption[1:].removesuffix('.')}."))
    return [section("Field", *pictures), section("Figures", *figures)]


def _errors(document: Document) -> Section:
    """The estimated error of every number, beside its part of the rise or value, of a trace of the largest one."""
    fem3d, reduced1d = document.get("fem3d") or {}, document.get("reduced1d") or {}
    over_time, units, scene = fem3d.get("transient") or {}, fem3d.get("units") or {}, document.get("scene") or {}
    steady, places = fem3d.get("steady") or {}, (scene.get("scene", {}), scene.get("environment", {}))
    start_K = next((at[key] for at in places for key in ("initial_temperature", "room_temperature") if key in at), 0.0)
    # A sink's summary has no start of the errors over time: it is always the same.
    start = f"over time, from {quantity(over_time.get('accurate_from_s', 1e-5), 's', 2)} on"
    start += ", but not for a while after each jump of a drive" * bool(over_time.get("jumps"))
    ranges = {key: (item["least"], item["largest"]) for key, item in over_time.get("range", {}).items()}
    groups: dict[str, tuple[Mapping[str, Any], Mapping[str, Any]]] = {
        "steady": ({key: item.get("error") for key, item in steady.items()}, steady),
        start: (over_time.get("errors") or {}, ranges),
        "1D model, over time": (reduced1d.get("errors") or {}, {}),
    }
    rows: list[Row] = []
    for head, (errors, values) in groups.items():
        rows += [Row([head])] * bool(errors)
        for key, error in errors.items():
            # A probe has a name and a unit of its own, a quantity's are in the key.
            name, unit = (key, units[key]) if key in units else named(key)
            base = start_K * (unit == "K" and not key.endswith("rise_K"))
            known = (values[key]["value"],) if values is steady else values.get(key, ())
            size = max((abs(value - base) for value in known), default=0.0)
            shown_error = "infinite" if error is None else quantity(error, unit, 2)
            rows.append(Row([name, shown_error, percent(error / size) if error and size else ""]))
    said = "Errors are estimated bounds of the numerical error alone; the model's own assumptions are not in them."
    table = Table(("quantity", "estimated error", "of the rise or value"), rows)
    return Section("Error budget", [said, table] if rows else [])


def _solution(document: Document) -> list[Section]:
    """The balance of heat, and the mesh."""
    fem3d = document.get("fem3d") or {}
    transient, steady = fem3d.get("transient") or {}, fem3d.get("steady") or {}
    heat = {key: steady[key]["value"] for key in ("power_W", "heat_out_W") if key in steady} | {
        "imbalance of the steady state, of the power": fem3d.get("energy_imbalance") if steady else None,
        "largest imbalance over time, of the heat supplied until then": transient.get("imbalance"),
    }
    mesh = {
        "part solved": fem3d.get("symmetry"), "unknowns": fem3d.get("dofs"), "time steps": fem3d.get("steps"),
        "error of the steady field at its worst place, of its largest rise": fem3d.get("field_error") or None,
        **(fem3d.get("mesh") or {}),
    }  # fmt: skip
    return [Section("Energy balance", _table(heat)), Section("Mesh", _table(mesh))]


def _table(items: Mapping[str, Any]) -> list[Table]:
    """Return a table of names and values; none without values."""
    rows = []
    for key, value in items.items():
        name, unit = named(key)
        # A volume takes no prefix: a "pm3" is a cubic picometre.
        number = isinstance(value, float) and unit not in ("", "m3")
        shown = quantity(value, unit, 5) if number else f"{value:.6g} {unit}" if isinstance(value, float) else value
        rows += [[name, str(shown).strip("[]")]] * (value is not None)
    return [Table(("", ""), rows, "<<")] if rows else []


def _scene(document: Document) -> str:
    """Every key of the scene, as in a file: of a sink and a device with units, else in SI units."""
    scene = document.get("scene")
    if scene and (kind := type_of_file(scene)) is not None:
        read = kind.schema.read(kind.schema.flatten(scene))
        keys = {path: key for path, key in kind.schema.paths.items() if path in read}
        parameters = {SECTION: scene[SECTION]} if SECTION in scene else {}
        scene = nest({path: key.kind.show(read[path]) or "none" for path, key in keys.items()}) | parameters
    return section("Scene", f"<pre>{escape(toml(scene))}</pre>" if scene else "")


def _provenance(document: Document) -> str:
    timing = {f"{key} (s)": float(value) for key, value in (document.get("timing_s") or {}).items()}
    files = [text(name) for name in document.get("files", ()) if name != "report.html"]
    links = ", ".join(f'<a href="{name}">{name}</a>' for name in files)
    command = document.get("command")
    return section(
        "Versions and files",
        f"<p>Made by <code>{text(command)}</code></p>" if command else "",
        *(table_html(table) for table in _table({**document.get("provenance", {}), **timing})),
        f"<p>Beside this page: {links}.</p>" if links else "",
    )


def named(key: str) -> tuple[str, str]:
    """A key as a name and its unit: "peak_rise_K" is ("peak rise", "K")."""
    if key in _NAMED:
        return _NAMED[key]
    ending, unit = next((item for item in _UNITS.items() if key.endswith(item[0])), ("", ""))
    return key.removesuffix(ending).replace("_", " "), unit


def section_html(part: Section) -> str:
    """Format a section under a heading; empty without content."""
    wide = '<div class="wide">{}</div>'
    content = (wide.format(table_html(e)) if isinstance(e, Table) else f"<p>{text(e)}</p>" for e in part.filled)
    return section(part.title, *content)


def section(title: str, *content: str) -> str:
    """Put content in HTML under a heading; empty without content."""
    filled = "\n".join(filter(None, content))
    anchor = title.lower().replace(" ", "-")
    return f'<section id="{anchor}"><h2>{text(title)}</h2>\n{filled}\n</section>' if filled else ""


def table_html(table: Table) -> str:
    """Format a table, a verdict with its sign and in its colour."""
    numbers, rows = [i for i, side in enumerate(table.aligned) if side == ">"], []
    heads, across = [text(" ".join(head.split())) for head in table.heads], f'colspan="{len(table.heads)}"'
    for row in table.marked:
        cells = [text(cell) for cell in row.cells]
        if row.verdict:
            at = -1 if cells[-1] == row.verdict else 0
            cells[at] = f'<span class="word {row.verdict}">{MARKS[row.verdict][0]} {cells[at]}</span>'
        single = f'<tr class="kind"><th {across}>{cells[0]}</th></tr>'
        rows.append(single if len(cells) == 1 else _row(cells, numbers))
        rows += [f'<tr class="because"><td {across}>{text(row.below)}</td></tr>'] * bool(row.below)
    body = "\n".join(rows)
    return f"<table><thead>{_row(heads, numbers, 'th')}</thead>\n<tbody>\n{body}\n</tbody></table>"


def _row(cells: Sequence[str], numbers: Sequence[int], cell: str = "td") -> str:
    """A row of cells that are HTML; columns in ``numbers`` stand to the right."""
    looks = [' class="n"' * (i in numbers) for i in range(len(cells))]
    return f"<tr>{''.join(f'<{cell}{look}>{each}</{cell}>' for look, each in zip(looks, cells, strict=True))}</tr>"


def text(value: object) -> str:
    """Escape a text, with the numbers of an exponent or a unit kept on one line with it."""
    return re.sub(r"(?<=\d) (?=[A-Za-z%\N{PLUS-MINUS SIGN}])", "&nbsp;", escape(str(value)))
