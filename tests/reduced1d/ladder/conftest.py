"""The plate of the built-in sink, solved once."""

import pytest

from reduced1d.ladder.levels import Levels
from scenes.sink import Sink


@pytest.fixture(scope="session")
def levels():
    return Levels(Sink())
