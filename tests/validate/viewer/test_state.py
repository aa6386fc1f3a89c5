"""What the keys make of a view, and what is written on screen."""

from __future__ import annotations

from dataclasses import replace

import pytest

from validate.viewer.state import KEYS, View, keys_text, title

VIEW = View(("rise", "temperature", "potential"), 4, 20.0, can_compare=True)


def pressed(view: View, *keys: str) -> View:
    for key in keys:
        view = KEYS[key][2](view)
    return view


def test_time_goes_round() -> None:
    assert pressed(VIEW, "Right", "Right").step == 2
    assert pressed(VIEW, "Left").step == 3
    assert pressed(VIEW, "Left", "Right").step == 0


@pytest.mark.parametrize("key", ["space", "c", "l", "m", "a", "k"])
def test_a_switch_pressed_twice_is_as_before(key: str) -> None:
    once = pressed(VIEW, key)
    assert once != VIEW
    assert pressed(once, key) == VIEW


def test_quantities_and_clipping_go_round() -> None:
    assert [pressed(VIEW, *["t"] * n).quantity for n in range(4)] == ["rise", "temperature", "potential", "rise"]
    assert [pressed(VIEW, *["x"] * n).cut for n in range(5)] == ["", "x", "y", "z", ""]
    assert pressed(VIEW, "bracketright") == VIEW
    assert pressed(VIEW, "x", "bracketright", "bracketright").place == pytest.approx(0.6)
    assert pressed(VIEW, "x", *["bracketleft"] * 30).place > 0


def test_thickness() -> None:
    assert pressed(VIEW, "period").factor == 50
    assert pressed(VIEW, "comma", "comma").factor == 5
    assert pressed(VIEW, *["comma"] * 20).factor == 1
    assert "thickness drawn x50" in title(pressed(VIEW, "period"), "run", 1e-3)
    assert "true proportions" in title(replace(VIEW, factor=1.0), "run", None)
    assert "1 ms" in title(VIEW, "run", 1e-3)
    assert "steady" in title(VIEW, "run", None)


def test_comparing_shows_the_rise_and_needs_a_1d_model() -> None:
    assert pressed(VIEW, "t", "c").quantity == "rise"
    alone = replace(VIEW, can_compare=False)
    assert pressed(alone, "c") == alone
    assert "difference" in keys_text(VIEW, 4)
    assert "difference" not in keys_text(alone, 4)


def test_every_key_that_does_something_is_listed() -> None:
    for columns in (1, 4, 40):
        text = keys_text(VIEW, columns)
        assert all(what in text for _, what, _ in KEYS.values())
        assert text.count("\n") + 1 == -(-(len(KEYS) + 2) // columns)
    assert "play" not in keys_text(replace(VIEW, steps=1), 4)
