"""Tests of the 1D models."""

from typing import Any

import numpy as np
import pytest

from reduced1d.ladder.beam import Anchor
from reduced1d.ladder.beam import fin as sparse_fin
from reduced1d.ladder.few_states import FewStates
from scenes.sink import Sink


def relative(expected: Any, tolerance: float) -> Any:
    """``pytest.approx`` without its own absolute tolerance of 1e-12, which would pass anything for small SI values."""
    return pytest.approx(expected, rel=tolerance, abs=0)


def fin(sink: Sink, anchor: Anchor) -> FewStates:
    """The fin in all its modes."""
    model = sparse_fin(sink, anchor)
    return model.on(np.eye(model.states)).in_modes()
