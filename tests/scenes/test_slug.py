"""The text that distinguishes the results of one sink from those of another."""

import re
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenes.loading import distinguishes, load
from scenes.sink import Sink
from tests.scenes.test_load import CHANGED, EXPECTED

SAFE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]{0,79}")


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ([], "1V"),
        (["voltage=2", "width=20um"], "2V-width20um"),
        (["voltage=-0.5"], "minus500mV"),
        (["electrodes=pad-edge"], "1V-pad-edge"),
        (["oxide_offset=10um", "end_time=5 ms"], "1V-oxide_offset10um-end_time5ms"),
        (["silicon.resistivity=1e-4 ohm m"], "1V-silicon_resistivity0.0001"),
        (["accuracy=1e-4"], "1V-accuracy0.0001"),
        (["room_temperature=300"], "1V-room_temperature300K"),
        (["name=other", "tolerances.eq12=1"], "1V"),
    ],
)
def test_it_says_what_differs(settings, text):
    assert distinguishes(load("sink", settings)) == text


def test_every_key_but_name_and_checks_counts():
    for path in CHANGED:
        if not path.startswith(("scene.", "checks.", "inputs.", "materials.oxide.resistivity")):
            one = load("sink", [f"{path}={CHANGED[path]}"])
            assert distinguishes(one) not in ("1V", ""), path


def test_a_long_text_is_cut_and_still_distinguishes():
    one, other = distinguishes(EXPECTED), distinguishes(replace(EXPECTED, accuracy=3e-3))
    assert SAFE.fullmatch(one)
    assert len(one) == len(other) == 80
    assert one != other


@given(st.floats(1e-9, 1.0), st.floats(1e-9, 1.0))
def test_different_sizes_have_different_safe_texts(a, b):
    one, other = distinguishes(Sink(width=a)), distinguishes(Sink(width=b))
    assert SAFE.fullmatch(one)
    assert (one == other) == (a == b)
