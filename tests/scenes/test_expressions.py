"""Expressions of quantities: their values and units, and refusals before any cost."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.expressions import Measure, measured
from scenes.units import PLAIN, UnitError, is_unit

LENGTH, KELVIN = (1, 0, 0, 0, 0), (0, 0, 0, 0, 1)
NAMES = {
    "w": Measure.from_float(10e-6, LENGTH), "h": Measure.from_float(2e-6, LENGTH),
    "T": Measure.from_float(293.0, KELVIN),
    "n": Measure.from_float(3, PLAIN), "w2": Measure.from_float(3e-6, LENGTH),
}  # fmt: skip


@pytest.mark.parametrize(("text", "value", "powers"), [
    ("w/2", 5e-6, LENGTH), ("-w", -10e-6, LENGTH), ("2 um + h", 4e-6, LENGTH), ("w - n*h", 4e-6, LENGTH),
    ("2 um + 0.5 um", 2.5e-6, LENGTH), ("0.1 um*3", 0.3e-6, LENGTH), ("2*3 um", 6e-6, LENGTH),
    ("w*h", 20e-12, (2, 0, 0, 0, 0)), ("w**2", 1e-10, (2, 0, 0, 0, 0)), ("w^2", 1e-10, (2, 0, 0, 0, 0)),
    ("-w**2", -1e-10, (2, 0, 0, 0, 0)), ("2**-1", 0.5, PLAIN), ("2**2**3", 256.0, PLAIN), ("w/h*n", 15.0, PLAIN),
    ("sqrt(w*w + h*h)", math.hypot(10e-6, 2e-6), LENGTH), ("(w**3)**(1/3)", 10e-6, LENGTH),
    ("min(w, h, 3 um)", 2e-6, LENGTH), ("max(w, h)", 10e-6, LENGTH), ("2*pi*n", 6 * math.pi, PLAIN),
    ("T + 10 K", 303.0, KELVIN), ("130 W/(m K) * n", 390.0, (1, 1, -3, 0, -1)), ("8e-4 1/K*T", 0.2344, PLAIN),
    ("w2 + 2 um/n", 3e-6 + 2e-6 / 3, LENGTH), ("3 W/m² * n", 9.0, (0, 1, -3, 0, 0)), ("2 µm + h", 4e-6, LENGTH),
    ("2 um/s * 1 s", 2e-6, LENGTH), ("2 um**2 / w", 2e-7, LENGTH), ("5 % * w", 5e-7, LENGTH),
    ("( ( w ) )", 1e-5, LENGTH),
])  # fmt: skip
def test_an_expression_has_its_value_and_its_unit(text, value, powers):
    found, of = measured(text, NAMES)
    assert found == pytest.approx(value, rel=1e-15, abs=0)  # a few roundings, of roots alone
    assert of == powers


def test_sums_of_decimals_are_the_doubles_of_the_decimals():
    """In doubles 0.1 um + 0.2 um is not 0.3 um, and two faces meant as one plane would be two."""
    assert 0.1 + 0.2 != 0.3
    assert measured("0.1 m + 0.2 m", {})[0] == 0.3
    assert measured("w*3 - 20 um", NAMES)[0] == 10e-6


@settings(deadline=None)
@given(st.fractions(-1000, 1000, max_denominator=1000), st.fractions(1, 1000, max_denominator=1000))
def test_sums_and_quotients_are_exact(a, b):
    names = {"a": Measure(a, PLAIN), "b": Measure(b, PLAIN)}
    assert measured("(a + b)*(a - b)/b", names)[0] == float((a + b) * (a - b) / b)


@pytest.mark.parametrize("text", ["20 um", "2e-6", "130 W/(m*K)", "1 m**2", "5e-4/K", "20 degC", "2330 kg/m^3"])
def test_what_is_no_expression_is_as_before(text):
    from scenes.units import parse_quantity

    value, unit = parse_quantity(text)
    assert measured(text, NAMES) == (value, unit and unit.powers)


@pytest.mark.parametrize(("text", "said"), [
    ("w + 2 K", "adds a temperature to a length"), ("w - 1", "subtracts a plain number from a length"),
    ("w + w*w", "adds a quantity in m2 to a length"), ("max(w, T)", "compares a length with a temperature"),
    ("w/0", "divides by zero"), ("w/(n - 3)", "divides by zero"), ("(n - 3)**-1", "divides by zero"),
    ("9**9**9", "exponent beyond 100"), ("n**101", "exponent beyond 100"), ("2**w", "exponent that is a length"),
    ("2**2 um", "exponent that is a length"), ("10**100*10**100*10**100*10**100", "not a finite number"),
    ("(0 - n)**0.5", "root of a negative"), ("sqrt(h - w)", "root of a negative"), ("w**0.123", "fraction such as 1/2"),
    ("width/2", 'no parameter "width"'), ("2 w", "write 2*w"), ("20 degC + n*1 K", "give it in K"),
    ("2 um**n", "put brackets"), ("f(w)", 'no function "f"'), ("sqrt(w, h)", "more than one number"),
    ("w +", "no expression"), ("(w", "no expression"), ("w)", "no expression"), ("w h", "no expression"),
    ("w.real", "no expression"), ("w; h", "no expression"), ("min()", "no expression"),
    ("1e400*n", "not a finite number"),
    ("w" + "+w" * 300, "longer than 500"), ("2**2**2**2" + "**2" * 40, "exponent beyond"),
    # An unknown name is read as a quantity, whose sentence has more detail.
    ("5 mm/sec", 'unknown unit "sec", did you mean "s"'), ("abc", "names no parameter"), ("10² um", "no expression"),
])  # fmt: skip
def test_a_bad_expression_is_refused(text, said):
    with pytest.raises(UnitError) as found:
        measured(text, NAMES)
    assert said in str(found.value)


def test_a_power_of_powers_stays_small():
    """An exact fraction of 1.23456789**1000000 would have 30 million digits."""
    assert measured("((1.00001**100)**100)**100", {})[0] == pytest.approx(1.00001**1e6, rel=1e-10)


def test_a_long_chain_of_signs_is_no_traceback():
    assert measured("-" * 480 + "w", NAMES)[0] == 10e-6


def test_a_word_without_parameters_is_no_name():
    with pytest.raises(UnitError, match="is not a number with a unit"):
        measured("abc", {})


@pytest.mark.parametrize(("name", "unit"), [("V", True), ("m2", False), ("mm", True), ("w", False), ("gap", False)])
def test_names_of_units_are_known(name, unit):
    assert is_unit(name) is unit
