"""From a request to an outcome, for every kind of scene: plan, models, checks, answer. Nothing is written.

Nothing here imports numpy before it solves: the renderer's process, which takes the longest to get ready, is started
first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scenes.plan import Export, Request, Step
from validate.run import kinds
from validate.run.outcome import Clock, Exported, Outcome, Run

if TYPE_CHECKING:
    from compare.against import Data


def plan(scene: Any, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `answer` will do, and what will be written. SceneError for what isn't made of a row of spans."""
    return kinds.of(scene).plan(scene, request, data)


def answer(
    scene: Any, request: Request, progress: Callable[[str], None] | None = None, data: Data | None = None,
    clock: Clock | None = None,
) -> Outcome[Any]:  # fmt: skip
    """Solve a scene as asked, compare, and answer. ``data`` are a user's own, checked against the 3D model's.

    Raises SceneError for what a model refuses, and ArithmeticError (RunawayError, NumericsError) where its numerics
    fail.
    """
    run, kind = Run(scene, request, progress or (lambda _: None), clock or Clock()), kinds.of(scene)
    if request.export is not None:
        kind.exportable(scene, request)
    outcome: Outcome[Any] = kind.answer(run, data)
    if request.export is not None:
        with run.clock.stage("export"):
            outcome = replace(outcome, exported=_exported(kind.exported(outcome, run.say), request.export))
    return replace(outcome, timing=run.clock.all())


def _exported(document: Mapping[str, Any], export: Export) -> Exported:
    """A compact model and its own words."""
    from statespace import fmu
    from statespace.document import validity

    without = "" if fmu.available() else f"; {fmu.MISSING}"
    what = "a compact model and its controllers" if "controllers" in document else "a compact model"
    return Exported(f"{what} ({validity(document)}{without})", document, export.folder)
