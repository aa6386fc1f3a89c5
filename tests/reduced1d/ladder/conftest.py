"""The plate of the built-in sink, solved once."""

from __future__ import annotations

import pytest

from reduced1d.ladder.levels import Levels
from scenes.sink import Sink


@pytest.fixture(scope="session")
def levels() -> Levels:
    return Levels(Sink())
