"""The compact model of a scene of boxes or on a mesh, by what a run asks of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from scenes.model import AnyScene
from scenes.plan import Request


def check(scene: AnyScene) -> None:
    """SceneError for a scene that has none."""
    from fem3d.compact.find import check

    check(scene)


def document(scene: AnyScene, request: Request, say: Callable[[str], None]) -> dict[str, Any]:
    """That of 3D, or of the network. Raises SceneError, and NumericsError where its accuracy isn't reached."""
    if request.model == "network":
        from reduced1d.network.compact import compact
    else:
        from fem3d.compact.find import compact
    assert request.export is not None
    return compact(scene, request.export.states, request.export.accuracy, say)
