"""Tests of a user's own traces."""

from pathlib import Path

from compare.against import Data
from compare.data.read import read
from scenes.model import AnyScene
from scenes.sink import Sink

SINK = Sink()


def found(folder: Path, content: str | bytes, *columns: str, scene: AnyScene = SINK) -> Data:
    """Read a file with some content as data of a scene."""
    path = folder / "a.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read(path, scene, columns)
