"""The report of a run of any kind of scene: its first paragraphs, its sections, and its entries of summary.json."""

from collections.abc import Callable
from typing import Any, NamedTuple

from compare.analyses import ANALYSES
from compare.outcome import Outcome
from compare.report import Section, Style
from validate.report import device, free, sink


class View(NamedTuple):
    """How runs of one kind of scene are reported.

    Attributes
    ----------
    headline : the first paragraphs: the answer, and how many checks differ
    sections : sections on models and checks
    document : entries of summary.json
    """

    headline: Callable[[Outcome[Any], Style], list[str]]
    sections: Callable[[Outcome[Any], Style], list[Section]]
    document: Callable[[Outcome[Any]], dict[str, Any]]


VIEWS = {
    "sink": View(sink.headline, sink.sections, sink.document),
    "device": View(device.headline, device.sections, device.document),
    "free": View(free.headline, free.sections, free.document),
}


def headline(outcome: Outcome[Any], style: Style) -> list[str]:
    """Return the first paragraphs of a report: the answer, and how many checks differ."""
    return VIEWS[outcome.scene.kind].headline(outcome, style)


def sections(outcome: Outcome[Any], style: Style) -> list[Section]:
    """Return the sections of a report: of the models and checks, then of the analyses."""
    return VIEWS[outcome.scene.kind].sections(outcome, style) + [
        each.section(outcome.analyses[each.name], outcome, style) for each in ANALYSES if each.name in outcome.analyses
    ]


def document(outcome: Outcome[Any]) -> dict[str, Any]:
    """Return the entries of summary.json that the kind of scene and the analyses make."""
    summary = VIEWS[outcome.scene.kind].document(outcome)
    for each in ANALYSES:
        if each.name in outcome.analyses:
            each.enter(summary, outcome.analyses[each.name], outcome)
    return summary
