"""Quantities: every unit against an independent number, and the way there and back."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes import units as d
from scenes.formats import quantity, with_error
from scenes.kinds import Quantity
from scenes.units import UnitError, parse_quantity, parse_unit

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
