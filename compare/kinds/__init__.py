"""The kinds of scenes: the sink, the device, and free scenes of boxes or on a mesh."""

from typing import Any

from compare.kinds.base import Kind
from compare.kinds.device import DeviceKind
from compare.kinds.free import FreeKind
from compare.kinds.sink import SinkKind
from compare.options import DEVICE, FREE, SINK

KINDS: dict[str, Kind[Any]] = {SINK: SinkKind(), DEVICE: DeviceKind(), FREE: FreeKind()}


def kind_of(scene: Any) -> Kind[Any]:
    """Return the kind of a scene."""
    return KINDS[scene.kind]
