"""The page itself: head, verdict, sections, style and script, all in one file; and the sections that list what a run's
summary holds."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.plan import DEVICE_FIGURES, ROW_FIGURES
from compare.verdict import contrary
from validate.report import of
from validate.report.html import checks, numbers
from validate.report.html import device as device_section
from validate.report.html import field as field_section
from validate.report.html import sensitivities as sensitivities_section
from validate.report.html import validation as validation_section
from validate.report.html.field import PICTURES
from validate.report.html.parts import Document, anything, named, section, table, text, values
from validate.report.table import Style

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from validate.report.figures.render import Field

_HERE = Path(__file__).parent


def write_report(path: Path, outcome: Outcome[Any], document: Mapping[str, Any], field: Field | None = None) -> None:
    """Writes the page about a run into its folder, where its figures are already; ``document`` is the summary,
    ``field`` what the scene that can be turned shows."""
    kind, against = of(outcome.scene), contrary(outcome.checks, outcome.scene)
    said = getattr(kind, "on_page", kind.headline)(outcome, against, Style())
    found = page(path.parent, kind.title(outcome), " ".join(said.split()), document, field)
    path.write_text(found, encoding="utf-8")


def page(folder: Path, title: str, headline: str, document: Mapping[str, Any], field: Field | None) -> str:
    """The page as text; figures are read from ``folder``."""
    shown, data = field_section.show(folder, field)
    parts = [
        checks.checks(document),
        numbers.quantities(document),
        device_section.device(document),
        numbers.over_time(document),
        shown,
        figures(folder, document),
        numbers.why(document),
        validation_section.validation(document),
        sensitivities_section.sensitivities(document),
        others(document),
        numbers.errors(document),
        numbers.energy(document),
        numbers.mesh(document),
        plan(document),
        scene(document),
        provenance(document),
    ]
    parts = [part for part in parts if part]
    answer = str(document.get("answer") or headline)
    counted = headline.removeprefix(answer).strip()
    counted = f"<p>{text(counted)}</p>" if counted else ""
    script = f"{data}\n<script>\n{_read('scene.js')}</script>" if data else ""
    warnings = "\n".join(f'<p class="warning">{text(w)}.</p>' for w in document.get("warnings") or ())
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        # An empty icon, so that no browser asks for one.
        '<link rel="icon" href="data:,">\n'
        f"<title>{text(title)}</title>\n<style>\n{_read('style.css')}</style>\n</head>\n<body>\n<header>\n"
        f'<h1>{text(title)}</h1>\n<p class="verdict">{text(answer)}</p>\n'
        f"{counted}\n{_tally(document)}\n{warnings}\n"
        f"{headings(parts)}\n</header>\n<main>\n" + "\n".join(parts) + f"\n</main>\n{script}\n</body>\n</html>\n"
    )


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
_TREATED = (
    "schema", "command", "scene", "plan", "provenance", "fem3d", "reduced1d", "checks", "warnings", "files", "timing_s",
    "why", "sensitivities", "validation", "findings", "design", "answer",
)  # fmt: skip
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


def plan(document: Document) -> str:
    """What was done and what was skipped, each with its reason."""
    rows = [
        [text(step["step"]), f'<span class="word">{text(step["state"])}</span>', text(step["reason"])]
        for step in document.get("plan", ())
    ]
    return section("Plan", table(("step", "state", "why"), rows)) if rows else ""


def others(document: Document) -> str:
    """What else a run's summary holds: findings, answers, attributions."""
    found = [section("Findings", anything(document["findings"]))] if document.get("findings") else []
    for key, item in document.items():
        if key not in _TREATED and item:
            found.append(section(named(key)[0].capitalize(), anything(item)))
    return "\n".join(found)


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
