"""Numbers as a person reads them: engineering prefixes, and as many digits as the error leaves."""

from __future__ import annotations

import math

from scenes.sink import Sink
from scenes.units import CURRENT, VOLTAGE

_PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}
# Units that carry no prefix: a rise of 2e-7 K reads better than 200 nK, and K/W is quoted in full in the paper.
_WITHOUT_PREFIX = ("K", "K/W", "1", "")


def scale(value: float, unit: str, prefixed: bool = False) -> tuple[float, str]:
    """Factor and unit that show a value: 0.0033 A gives (1000, "mA"); kelvins get a prefix if ``prefixed``."""
    if (unit in _WITHOUT_PREFIX and not prefixed) or value == 0 or not math.isfinite(value):
        return 1.0, unit
    power = min(max(3 * math.floor(math.log10(abs(value)) / 3 + 1e-12), -12), 9)
    return 10.0**-power, _PREFIXES[power] + unit


def with_error(value: float, error: float, unit: str, prefixed: bool = False) -> tuple[str, str, str, int, float]:
    """Value, error and unit as texts, then the decimals and the factor used, for others to stand in the same column.

    The prefix is of the larger one of value and error. Decimals go up to the error's second digit, 12 at most, and to
    eight digits of the value at most; an error below the last one is rounded up to it, and so stays a bound.
    """
    factor, shown = scale(max(abs(value), error) if math.isfinite(error) else value, unit, prefixed)
    most = 7 - math.floor(math.log10(abs(value * factor))) if value and math.isfinite(value) else 6
    scaled = error * factor
    meant = 1 - math.floor(math.log10(scaled)) if scaled > 0 and math.isfinite(scaled) else 6
    places = max(min(meant, most, 12), 0)
    bound = max(scaled, 10.0**-places) if error > 0 else 0.0
    return f"{round(value * factor, places) + 0.0:.{places}f}", f"{bound:.{places}f}", shown, places, factor


def quantity(value: float, unit: str, digits: int = 4, prefixed: bool = False) -> str:
    """A value with its unit, to some significant digits: "3.309 mA", "1862 K/W"."""
    factor, shown = scale(value, unit, prefixed)
    return f"{_significant(value * factor, digits)} {shown}".rstrip()


def signed(value: float, unit: str, digits: int = 3) -> str:
    """As ``quantity``, with the sign in any case."""
    return ("+" if value >= 0 else "") + quantity(value, unit, digits)


def span(start: float, end: float) -> str:
    """From a time to another (s), in one unit: "0.19 - 0.33 ms"; a single time where both are equal."""
    factor, _ = scale(end, "s")
    return quantity(end, "s", 2) if start == end else f"{_significant(start * factor, 2)} - {quantity(end, 's', 2)}"


def percent(ratio: float, digits: int = 2, sign: bool = False) -> str:
    """A ratio in percent: "30 %", "0.021 %", "+6.5 %"."""
    if not math.isfinite(ratio):
        return "infinite"
    plus = "+" if sign and ratio >= 0 else ""
    return f"{plus}{_significant(100 * ratio, digits)} %"


def difference_text(difference: float, u_num: float, plus_minus: str) -> str:
    """A relative difference with its error, in percent: "-30.07 ± 0.05 %", to the error's first digit."""
    if not (math.isfinite(difference) and math.isfinite(u_num)):
        return f"{percent(difference, sign=True)} {plus_minus} {percent(u_num)}"
    if u_num < 1e-6 * abs(difference) or u_num < 1e-8:
        return f"{percent(difference, sign=True).removesuffix(' %')} {plus_minus} {percent(u_num, 1)}"
    places = max(-math.floor(math.log10(100 * u_num)), 0)
    return f"{100 * difference:+.{places}f} {plus_minus} {100 * u_num:.{places}f} %"


def _significant(value: float, digits: int) -> str:
    """To some significant digits, without an exponent where that stays readable."""
    if value == 0 or not math.isfinite(value):
        return f"{value + 0.0:g}"
    places = digits - 1 - math.floor(math.log10(abs(value)) + 1e-12)
    if abs(value) < 1e-4 or abs(value) >= 1e7:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(places, 0)}f}"


def sink_text(sink: Sink) -> str:
    """A sink with its voltage or current, as its folder is called: "sink at 2 mV"."""
    shown = VOLTAGE.show(sink.voltage) if sink.current is None else CURRENT.show(sink.current)
    return f"{sink.name} at {shown}"


def milliseconds(time: float) -> str:
    """A time in s as "50.7 ms", or "never"."""
    return f"{time * 1e3:.3g} ms" if math.isfinite(time) else "never"


def kelvin(difference: float) -> str:
    return f"{difference:.3g} K"


def cut(text: str, longest: int, end: str = "..") -> str:
    """The text, at most so long."""
    return text if len(text) <= longest else f"{text[: longest - len(end)]}{end}"
