"""The page itself: head, verdict, sections, style and script, all in one file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.verdict import contrary
from validate.report.html import checks, numbers, sections
from validate.report.html import device as device_section
from validate.report.html import field as field_section
from validate.report.html import sensitivities as sensitivities_section
from validate.report.html import why as why_section
from validate.report.html.words import text
from validate.report.kinds import of
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
        sections.figures(folder, document),
        why_section.why(document),
        sensitivities_section.sensitivities(document),
        sections.others(document),
        numbers.errors(document),
        numbers.energy(document),
        numbers.mesh(document),
        sections.plan(document),
        sections.scene(document),
        sections.provenance(document),
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
        f"{sections.headings(parts)}\n</header>\n<main>\n"
        + "\n".join(parts)
        + f"\n</main>\n{script}\n</body>\n</html>\n"
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
