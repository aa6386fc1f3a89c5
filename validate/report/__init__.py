"""What a run leaves: texts, tables, figures, the page, summary, traces, fields, the folder.

How a run of each kind is told and kept is one module for each, found by the kind of its scene. It has ``title``,
``headline`` and ``sections`` for the terminal and the page, ``entries`` of summary.json, ``columns`` of traces.csv
(none: no file), ``FIGURES``, by their names in the plan what draws each in ``figures``, and the ``FIELD_FIGURE`` (none:
empty); where there is one, which ``field`` it shows, and what ``stored`` field files have: their times (s), what rises
are above (K), and a 1D model beside 3D.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from validate.report.table import Section, Style
    from validate.run.outcome import Outcome

_ANALYSES = ("propagated", "fit", "validation", "left_out", "sensitivities", "why")


def of(scene: Any) -> Any:
    """The module that tells of a scene's kind of run."""
    return import_module(f"validate.report.{scene.kind}")


def analysed(outcome: Outcome[Any], style: Style) -> list[Section]:
    """The sections on what was found because it was asked for, whatever the kind of run."""
    analyses = {name: getattr(outcome, name) for name in _ANALYSES if getattr(outcome, name) is not None}
    module = import_module("validate.report.analyses") if analyses else None
    return [getattr(module, name)(part, outcome, style) for name, part in analyses.items()]
