"""The page itself: head, verdict, sections, style and script, all in one file; and the sections that list what a run's
summary holds."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.plan import DEVICE_FIGURES, ROW_FIGURES
from compare.verdict import contrary
from scenes.formats import percent, quantity, with_error
from validate.report import of
from validate.report.html import field as field_section
from validate.report.html.field import PICTURES
from validate.report.html.parts import named, of_section, section, text, values
from validate.report.table import Section, Style, Table

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from validate.report.figures.render import Field

_HERE = Path(__file__).parent
_STYLE = Style(page=True)
Document = Mapping[str, Any]


def write_report(path: Path, outcome: Outcome[Any], document: Document, field: Field | None = None) -> None:
    """Writes the page about a run into its folder, where its figures are already; ``document`` is the summary,
    ``field`` what the scene that can be turned shows."""
    kind, against = of(outcome.scene), contrary(outcome.checks, outcome.scene)
    said = kind.headline(outcome, against, _STYLE)
    sections = kind.sections(outcome, against, _STYLE)
    found = page(path.parent, kind.title(outcome), " ".join(said.split()), sections, document, field)
    path.write_text(found, encoding="utf-8")


def page(
    folder: Path, title: str, headline: str, sections: Iterable[Section], document: Document, field: Field | None
) -> str:  # fmt: skip
    """The page as text; figures are read from ``folder``."""
    shown, data = field_section.show(folder, field)
    told = [of_section(part) for part in (*sections, errors(document), energy(document), plan(document))]
    parts = [shown, figures(folder, document), *told, mesh(document), scene(document), provenance(document)]
    parts = [part for part in parts if part]
    answer = str(document.get("answer") or headline)
    counted = headline.removeprefix(answer).strip()
    counted = f"<p>{text(counted)}</p>" if counted else ""
    script = f"{data}\n<script>\n{_read('scene.js')}</script>" if data else ""
    warnings = "\n".join(f'<p class="warning">{text(w)}.</p>' for w in document.get("warnings") or ())
    head = f'<p class="verdict">{text(answer)}</p>\n{counted}\n{_tally(document)}\n{warnings}\n{headings(parts)}'
    return whole(title, head, parts, script)


def whole(title: str, head: str, parts: Sequence[str], script: str, style: str = "") -> str:
    """A page of a title, what stands under it, parts and a script, with nothing outside of it; ``style`` is added."""
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # An empty icon, so that no browser asks for one.
        '<link rel="icon" href="data:,">\n'
        f"<title>{text(title)}</title>\n<style>\n{_read('style.css')}{style}</style>\n</head>\n<body>\n<header>\n"
        f"<h1>{text(title)}</h1>\n{head}\n</header>\n<main>\n" + "\n".join(parts)
        + f"\n</main>\n{script}\n</body>\n</html>\n"
    )  # fmt: skip


def _tally(document: Mapping[str, Any]) -> str:
    """How many checks have each verdict, with their names."""
    found = []
    for verdict in ("differs", "unresolved", "agrees"):
        checked = [c for c in document.get("checks", ()) if c.get("own", True)]
        names: Sequence[str] = [c["id"] for c in checked if c["verdict"] == verdict]
        if names:
            word = "differ" if verdict == "differs" else "agree" if verdict == "agrees" else verdict
            found.append(f'<li><span class="{verdict} word">{len(names)} {word}</span>: {text(", ".join(names))}</li>')
    return f'<ul class="tally">{"".join(found)}</ul>' if found else ""


def _read(name: str) -> str:
    return (_HERE / name).read_text(encoding="utf-8")


_FIGURES = ("figure", "why.", "sensitivity.", "validation.", "islands", "air.")
"""How the files of figures begin."""
_CAPTIONS = {
    "figure5": "The steady rise along the beam in both models.",
    "figure6": "Rises against time in both models.",
    "figure_traces": "Every probe against time.",
    "why": "What each assumption of the 1D model adds to its difference from 3D.",
    "validation": "The data with both models, and the comparison error E = S - D within 2 u_val.",
    "sensitivity": "How quantities follow the keys of the scene, in percent for each percent.",
    "figure7": "The current against time in both models.",
    **ROW_FIGURES,
    "air": "How far 3D without the air, and a lumped term for it, are off 3D with it, against the coefficient.",
    **DEVICE_FIGURES,
}


def figures(folder: Path, document: Document, captions: Mapping[str, str] = _CAPTIONS) -> str:
    """The figures of the folder but the field's picture, which has a section of its own."""
    names = sorted(
        {Path(f).stem for f in document.get("files", ()) if f.startswith(_FIGURES)} - set(PICTURES),
        key=_order,
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


def plan(document: Document) -> Section:
    """What was done and what was skipped, each with its reason."""
    rows = [[step["step"], step["state"], step["reason"]] for step in document.get("plan", ())]
    return Section("Plan", [Table(("step", "state", "why"), rows, "<<<")] if rows else [])


def errors(document: Document) -> Section:
    """Where the numerical error stands against each tolerance, and what bounds it."""
    fem3d, judged = document.get("fem3d") or {}, [c for c in document.get("checks", ()) if c["u_num"]]
    over_time = fem3d.get("transient") or {}
    tables = []
    if fem3d:
        rows = []
        for key, item in fem3d["steady"].items():
            (name, unit), error = _probe_or_quantity(document, key), item.get("error")
            part = percent(error / abs(item["value"])) if error and item["value"] else ""
            rows.append([name, _error(error, unit), part])
        tables.append(Table(("steady", "estimated error", "of the value"), rows))
    for head, found in (
        (f"over time, {_since(over_time)}", over_time.get("errors")),
        ("1D model, over time", (document.get("reduced1d") or {}).get("errors")),
    ):
        named_ones = [(*_probe_or_quantity(document, key), error) for key, error in (found or {}).items()]
        tables.append(Table((head, "estimated error"), [[name, _error(e, unit)] for name, unit, e in named_ones]))
    rows = [
        [c["id"], *(percent(c[k], 1) for k in ("u_num", "tolerance")), percent(c["u_num"] / c["tolerance"], 1)]
        for c in judged
    ]
    tables.append(Table(("check", "error of the difference", "tolerance", "error / tolerance"), rows))
    said = "Errors are estimated bounds of the numerical error alone; the model's own assumptions are not in them."
    tables = [table for table in tables if table.rows]
    return Section("Error budget", [said, *tables] if tables else [])


def _probe_or_quantity(document: Document, key: str) -> tuple[str, str]:
    """Name and unit of a key of a model's values: a probe has its own, a quantity's are in the key."""
    units = (document.get("fem3d") or {}).get("units") or {}
    return (key, units[key]) if key in units else named(key)


def _error(error: float | None, unit: str) -> str:
    return "infinite" if error is None else quantity(error, unit, 2)


def _since(over_time: Mapping[str, Any]) -> str:
    """From when on errors over time hold; a sink's summary doesn't say, for it is always the same."""
    start = over_time.get("accurate_from_s", 1e-5)
    again = ", and that long after each jump of a given temperature" if over_time.get("jumps") else ""
    return f"from {quantity(start, 's', 2)} on{again}" if start else "at every time"


def energy(document: Document) -> Section:
    """How well what enters is balanced by what leaves and is stored."""
    fem3d, rows = document.get("fem3d") or {}, []
    for key in ("power_W", "heat_out_W"):
        if item := (fem3d.get("steady") or {}).get(key):
            value, error, unit, _, _ = with_error(item["value"], item["error"], named(key)[1])
            rows.append([named(key)[0], f"{value} {_STYLE.plus_minus} {error} {unit}"])
    over_time = (fem3d.get("transient") or {}).get("imbalance")
    for name, imbalance in (
        ("imbalance of the steady state, of the power", fem3d.get("energy_imbalance")),
        ("largest imbalance over time, of the heat supplied until then", over_time),
    ):
        rows += [] if imbalance is None else [[name, f"{imbalance:.1e}"]]
    return Section("Energy balance", [Table(("heat", ""), rows)] if rows else [])


def mesh(document: Document) -> str:
    """Statistics of the mesh that the 3D answer is from."""
    fem3d = document.get("fem3d") or {}
    found = {"part solved": fem3d.get("symmetry"), "unknowns": fem3d.get("dofs"), "time steps": fem3d.get("steps")}
    if fem3d.get("field_error"):
        found["error of the steady field at its worst place, of its largest rise"] = f"{fem3d['field_error']:.2g}"
    found = {key: value for key, value in found.items() if value is not None} | (fem3d.get("mesh") or {})
    return section("Mesh", values(found) if found else "")


def scene(document: Document) -> str:
    """Every key of the scene, with units where its type is known."""
    found = document.get("scene") or {}
    return section("Scene", f'<div class="columns">{values(_with_units(found))}</div>' if found else "")


def _with_units(found: Mapping[str, Any]) -> Mapping[str, Any]:
    """The scene in the words of its type's schema; as it is, in SI units, where that is none of the known ones."""
    from scenes.errors import SceneError
    from scenes.keys import TYPES
    from scenes.schema import nest

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
    command = document.get("command")
    made = f"<p>Made by <code>{text(command)}</code></p>" if command else ""
    return section("Versions and files", made, f'<div class="columns">{values(parts)}</div>', listed)


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
