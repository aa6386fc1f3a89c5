"""What a run leaves: texts, tables, figures, the page, summary, traces, fields, the folder.

How a run of each kind is told and kept is one module for each, found by the kind of its scene. It has ``title``,
``headline`` and ``tables`` (paragraphs) for the terminal and the page, ``entries`` of summary.json, ``columns`` of
traces.csv, ``FIGURES`` by their names in the plan, and ``draws_field``; where a field is drawn ``field`` and
``field_figure``, where field files are written ``stored``, and ``more_columns`` where there are other files of columns.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from compare.pipeline import kind


def of(scene: Any) -> Any:
    """The module that tells of a scene's kind of run."""
    return import_module(f"validate.report.{kind(scene)}")
