"""From a request to an outcome, for every kind of scene: plan, models, checks, answer. Nothing is written.

A kind of run is a module with ``plan(scene, request, data)`` and ``solve(scene, request, say, clock, data)``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

from compare.outcome import Clock, Outcome
from scenes.device import Device
from scenes.plan import Request, Step
from scenes.sink import Sink

if TYPE_CHECKING:
    from compare.against import Data


def kind(scene: Any) -> str:
    """What kind of run a scene is for: "sink", "device" or "free"."""
    return "sink" if isinstance(scene, Sink) else "device" if isinstance(scene, Device) else "free"


def plan(scene: Any, request: Request, data: Data | None = None) -> tuple[Step, ...]:
    """What `answer` will do, before it does it, and what is written then."""
    return _run(scene).plan(scene, request, data)


def answer(
    scene: Any,
    request: Request,
    progress: Callable[[str], None] | None = None,
    data: Data | None = None,
    clock: Clock | None = None,
) -> Outcome[Any]:
    """Solve a scene as asked, compare, and answer. ``data`` are a user's own traces of a sink, checked against the 3D
    model's; they need its transient.

    Raises SceneError for what a model refuses, and ArithmeticError (RunawayError, NumericsError) where its numerics
    fail.
    """
    clock = clock or Clock()
    outcome: Outcome[Any] = _run(scene).solve(scene, request, progress or (lambda _: None), clock, data)
    return replace(outcome, timing=clock.all())


def _run(scene: Any) -> Any:
    return import_module(f"compare.{kind(scene)}_run")
