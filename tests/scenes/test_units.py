"""Quantities, every unit against an independent number and the way there and back; expressions of them, and refusals
before any cost."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import units as d
from scenes.expressions import Measure, measured
from scenes.formats import quantity, with_error
from scenes.kinds import Quantity
from scenes.units import PLAIN, UnitError, parse_quantity, parse_unit

SI = {
    d.LENGTH: {"1000 um": 1e-3, "20um": 20e-6, "20 \N{MICRO SIGN}m": 20e-6, "20 \N{GREEK SMALL LETTER MU}m": 20e-6,
        "50 nm": 50e-9, "1.5mm": 1.5e-3, "2e1 um": 20e-6, "1 m": 1.0},
    d.TIME: {"0.2 ms": 2e-4, "6 us": 6e-6, "3 ns": 3e-9, "2 s": 2.0, "2 min": 120.0, "0.1min": 6.0},
    d.VOLTAGE: {"250 mV": 0.25, "-1.5 kV": -1500.0, "\N{MINUS SIGN}1 V": -1.0, ".5 V": 0.5},
    d.TEMPERATURE: {"37.5 degC": 310.65, "0.2 degC": 273.35, "-10 \N{DEGREE SIGN}C": 263.15, "293 K": 293.0},
    d.THERMAL_CONDUCTIVITY: {"130 W/(m K)": 130.0, "130 W/m/K": 130.0, "130 W/(m*K)": 130.0,
        "130 W m^-1 K^-1": 130.0, "130 W\N{MIDDLE DOT}m\N{SUPERSCRIPT MINUS}\N{SUPERSCRIPT ONE}/K": 130.0,
        "1.3 W / (cm K)": 130.0},
    d.DENSITY: {"2330 kg/m3": 2330.0, "2330 kg/m^3": 2330.0, "2330 kg/m**3": 2330.0,
        "2330 kg/m\N{SUPERSCRIPT THREE}": 2330.0, "2.33 g/cm3": 2330.0},
    d.SPECIFIC_HEAT: {"712 J/(kg K)": 712.0, "0.712 J/g/K": 712.0, "0.712 kJ/(kg K)": 712.0},
    d.RESISTIVITY: {"6e-5 ohm m": 6e-5, "6e-5 ohm*m": 6e-5, "6e-5 \N{GREEK CAPITAL LETTER OMEGA} m": 6e-5,
        "6e-3 ohm cm": 6e-5, "60 uohm m": 6e-5},
    d.TEMPERATURE_COEFFICIENT: {"5e-4 1/K": 5e-4, "5e-4/K": 5e-4, "500 ppm/K": 5e-4, "500 ppm/degC": 5e-4},
    d.CONVECTION_COEFFICIENT: {"10 W/(m2 K)": 10.0, "10 W/m^2/K": 10.0},
    d.HEAT_FLUX: {"1 W/cm2": 1e4},
    d.HEAT_SOURCE: {"1 W/mm3": 1e9},
    d.ELECTRICAL_CONDUCTIVITY: {"17 kS/m": 17e3, "17e3 1/(ohm m)": 17e3},
    d.POWER: {"3 mW": 3e-3},
    d.NUMBER: {"0.1 %": 1e-3},
}  # fmt: skip


@pytest.mark.parametrize(("dimension", "text"), [(dimension, text) for dimension, of in SI.items() for text in of])
def test_a_quantity_has_its_si_value_to_the_last_digit(dimension, text):
    assert Quantity(dimension, -1e12, 1e12).read("key", text) == SI[dimension][text]
    unit = parse_quantity(text)[1]
    assert unit.powers == dimension.powers


@pytest.mark.parametrize(
    "text",
    ["", "um", "abc", "nan um", "inf", "1,5 mm", "1 000 um", "11/K/", "2 //m", "2 W/(m K", "2 W/m)", "1 1 um", "5 11/K",
     "1 MM", "2 furlong", "20 C", "1 m-", "1 m^2.5", "1 " + "m " * 80, "1e" + "9" * 5000, "\ud800 m"],
)  # fmt: skip
def test_what_is_no_quantity_is_refused(text):
    with pytest.raises(UnitError):
        parse_quantity(text)


def test_a_slash_divides_by_one_factor_only():
    assert parse_unit("W/m K").powers != d.THERMAL_CONDUCTIVITY.powers
    assert parse_unit("W K/m").powers == parse_unit("W/m K").powers


def test_dimensions_differ_from_one_another():
    assert len({dimension.powers for dimension in d.DIMENSIONS}) == len(d.DIMENSIONS)


@pytest.mark.parametrize("dimension", d.DIMENSIONS, ids=lambda x: x.name)
def test_an_example_is_of_its_dimension(dimension):
    assert Quantity(dimension, 1e-12, 1e12).read("key", dimension.example) > 0


@settings(deadline=None)
@given(
    value=st.floats(1e-300, 1e300).flatmap(lambda x: st.sampled_from([x, -x])), dimension=st.sampled_from(d.DIMENSIONS)
)
def test_what_is_shown_reads_back_exactly(value, dimension):
    assert Quantity(dimension, -1e300, 1e300).read("key", dimension.show(value)) == value


def test_values_are_shown_in_the_unit_one_would_choose():
    assert [d.LENGTH.show(x) for x in (1e-9, 20e-6, 1e-3, 1.0, 0.0)] == ["1 nm", "20 um", "1 mm", "1 m", "0 m"]
    assert d.TIME.show(0.0002) == "200 us"
    assert d.THERMAL_CONDUCTIVITY.show(1.38) == "1.38 W/(m K)"


@pytest.mark.parametrize(
    ("text", "meant"), [("20C", "degC"), ("20 Celsius", "degC"), ("2 sec", "s"), ("5 micron", "um")]
)
def test_a_word_that_is_meant_for_a_unit(text, meant):
    """Spelled most like "C" is "cm"."""
    with pytest.raises(UnitError, match=f'did you mean "{meant}"'):
        parse_quantity(text)


def test_nothing_has_no_sign_and_small_kelvins_have_a_prefix_where_asked_for():
    assert quantity(-0.0, "W") == "0 W"
    assert quantity(2.647e-3, "K", 3) == "0.00265 K"
    assert quantity(2.647e-3, "K", 3, prefixed=True) == "2.65 mK"
    assert with_error(2.647e-3, 8.6e-6, "K", prefixed=True)[:3] == ("2.6470", "0.0086", "mK")
    assert with_error(2e-7, 2.2e-4, "W")[:3] == ("0", "220", "uW")
    assert with_error(-2e-9, 3.5e-6, "W")[:3] == ("0.0", "3.5", "uW")  # a zero has no sign


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
    value, unit = parse_quantity(text)
    assert measured(text, NAMES) == (value, unit and unit.powers)


@pytest.mark.parametrize(("text", "said"), [
    ("w + 2 K", "adds or compares a length and a temperature"), ("w - 1", "a length and a plain number"),
    ("w + w*w", "a length and a quantity in m2"), ("max(w, T)", "compares a length and a temperature"),
    ("w/0", "divides by zero"), ("w/(n - 3)", "divides by zero"), ("(n - 3)**-1", "divides by zero"),
    ("9**9**9", "exponent beyond 100"), ("n**101", "exponent beyond 100"), ("2**w", "exponent that is a length"),
    ("2**2 um", "exponent that is a length"), ("10**100*10**100*10**100*10**100", "not a finite number"),
    ("(0 - n)**0.5", "root of a negative"), ("sqrt(h - w)", "root of a negative"), ("w**0.123", "fraction such as 1/2"),
    ("width/2", 'no parameter "width"'), ("2 w", "write 2*w"), ("20 degC + n*1 K", "give it in K"),
    ("2 um**n", "put brackets"), ("f(w)", 'no function "f"'), ("sqrt(w, h)", 'no function "sqrt" of these'),
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
