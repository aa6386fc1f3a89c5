"""The other sections of the page, each from what a run's summary holds; empty where it holds nothing of the kind."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from compare.plan import DEVICE_FIGURES as FIGURES
from validate.report.html.field import PICTURES
from validate.report.html.parts import anything, section, table, values
from validate.report.html.values import Document
from validate.report.html.words import named, text

_TREATED = (
    "schema", "command", "scene", "plan", "provenance", "fem3d", "reduced1d", "checks", "warnings", "files", "timing_s",
    "why", "sensitivities", "findings", "design", "answer",
)  # fmt: skip
_CAPTIONS = {
    "figure5": "The steady rise along the beam in both models.",
    "figure6": "Rises against time in both models.",
    "figure_traces": "Every probe against time.",
    "why": "What each assumption of the 1D model adds to its difference from 3D.",
    "sensitivity": "How rises and current follow the keys of the scene, in percent for each percent.",
    "figure7": "The current against time in both models.",
    **FIGURES,
}


def figures(folder: Path, document: Document, captions: Mapping[str, str] = _CAPTIONS) -> str:
    """The figures of the folder but the field's picture, which has a section of its own."""
    names = sorted(
        {Path(f).stem for f in document.get("files", ()) if f.startswith(("figure", "why.", "sensitivity."))}
        - set(PICTURES),
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
