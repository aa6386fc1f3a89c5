"""From a request to an outcome, for every kind of scene: plan, models, checks, answer. Nothing is written.

Nothing here imports numpy before it solves: the renderer's process, which takes the longest to get ready, is started
first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scenes.plan import Export, Request, Step
from validate.run import kinds
from validate.run.outcome import Clock, Exported, Outcome, Run

if TYPE_CHECKING:
    from compare.against import Data
    from scenes.model import AnyScene


def plan(scene: Any, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `answer` will do, before it does it, and what is written then. Raises SceneError for what isn't made of a
    row of spans."""
    steps: tuple[Step, ...] = kinds.of(scene).plan(scene, request, data)
    return steps


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
        from fem3d.compact.find import check

        check(kind.exported(scene, request))
    outcome: Outcome[Any] = kind.answer(run, data)
    if request.export is not None:
        with run.clock.stage("export"):
            of_network = request.model == "network"
            exported = _exported(kind.exported(outcome.scene, request), request.export, run.say, of_network)
        outcome = replace(outcome, exported=exported)
    return replace(outcome, timing=run.clock.all())


def _exported(scene: AnyScene, export: Export, say: Callable[[str], None], of_network: bool) -> Exported:
    """The compact model of 3D, or of the network, and its own words."""
    if of_network:
        from reduced1d.network.compact import compact
    else:
        from fem3d.compact.find import compact
    from scenes.compact import fmu
    from scenes.compact.facts import validity

    document = compact(scene, export.states, export.accuracy, say)
    without = "" if fmu.available() else f"; {fmu.MISSING}"
    return Exported(f"a compact model ({validity(document)}{without})", document, export.folder)
