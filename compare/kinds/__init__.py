"""The kinds of scenes: the sink, the device, and free scenes of boxes or on a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from compare.kinds.base import Kind
from compare.kinds.device import DeviceKind
from compare.kinds.free import FreeKind
from compare.kinds.sink import SinkKind
from scenes import loading
from scenes.keys import TYPES

KINDS: dict[str, Kind[Any]] = {kind.name: kind for kind in (SinkKind(), DeviceKind(), FreeKind())}


def kind_of(scene: Any) -> Kind[Any]:
    """Return the kind of a scene."""
    return KINDS[scene.kind]


def load(kind: str, source: str, settings: Sequence[str]) -> Any:
    """Load a scene of a kind with overrides. Raises SceneError."""
    if kind in TYPES:
        return loading.load(source, settings, scene_type=TYPES[kind])
    return loading.load_free(source, settings)
