"""Tests of the 1D models."""

from typing import Any

import pytest


def relative(expected: Any, tolerance: float) -> Any:
    """``pytest.approx`` without its own absolute tolerance of 1e-12, which would pass anything for small SI values."""
    return pytest.approx(expected, rel=tolerance, abs=0)
