"""A user's own pytest file: a lumped model of the hot plate, held to its range of validity."""

from lumped import hotplate

import scenes
from compare.testing import assert_model_agrees


def test_the_lumped_model_knows_the_current_and_the_heater() -> None:
    assert_model_agrees(scenes.load("hotplate"), hotplate, heater=0.15, current=0.02)
