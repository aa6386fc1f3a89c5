"""A user's own pytest file: the 1D model stays within its tolerances, or a test reports by how much it does not."""

import pytest

import scenes
from compare.testing import assert_reduction_agrees


def test_the_mean_rise_at_two_volts():
    assert_reduction_agrees(scenes.load("sink"), voltage=2, mean=0.10, current=0.005)


def test_the_equation_for_the_mean():
    assert_reduction_agrees(scenes.load("sink", ["sink.width=20um"]), eq13=0.002)


def test_the_end_rise_is_not_to_be_trusted():
    with pytest.raises(AssertionError, match="steady end rise"):
        assert_reduction_agrees(scenes.load("sink"), end=0.05)
