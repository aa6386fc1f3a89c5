"""The paper's claims on the device as a person reads them: what is claimed, what comes out, how far off that is."""

from __future__ import annotations

import math
import re

from compare.verdict import Check
from scenes.checks import DEVICE_TOLERANCES
from scenes.formats import difference_text, percent, quantity

NAMES = {
    "sink_K": ("sink temperature", "K"),
    "sensor_K": ("sensor temperature", "K"),
    "sink_V": ("sink voltage", "V"),
    "sensor_V": ("sensor voltage", "V"),
    "sink_power_W": ("sink power", "W"),
    "sensor_power_W": ("sensor power", "W"),
    "polymer_flux_W": ("heat into polymer", "W"),
}
"""What a reader calls the quantities of the device, and their units."""
_SIDES = {"equal": "", "at least": ">=", "at most": "<="}


def sides(check: Check) -> tuple[str, str]:
    """Whose the predicted and the measured value are."""
    if check.id.startswith("dev3d_claim"):
        return "paper", "3D"
    return ("paper", "1D") if check.id in DEVICE_TOLERANCES else ("1D", "3D")


def claimed(check: Check) -> str:
    """What the paper says a check's value is: "100.0 ms", or ">=50.70 ms" where it claims one side only."""
    side = _SIDES[check.sense] if math.isfinite(check.predicted) else ""
    return side + amount(check.predicted, check.unit)


def amount(value: float, unit: str) -> str:
    """A check's value: "50.70 ms", "never" for a time that does not come, and "none" for anything else."""
    if math.isfinite(value):
        return quantity(value, unit)
    return "never" if unit == "s" else "none"


def off_by(check: Check) -> str:
    """How far the model is from the claim, briefly: "+97 %", "<1e-08 %" where that is all that is known."""
    if not check.u_num < 1:
        return "open"
    if check.sense != "equal" and not check.difference:
        return "holds"
    if not math.isfinite(check.difference):
        return "fails"
    if abs(check.difference) <= check.u_num:
        return f"<{percent(check.u_num, 1)}"
    return percent(check.difference, sign=True)


def in_full(check: Check, plus_minus: str) -> str:
    """The difference with its error, and what is tolerated: "paper/1D - 1 = +97.255 ± 0.006 %, tolerance 25 %"."""
    tolerance = f"tolerance {percent(check.tolerance, 2)}"
    if off_by(check).isalpha():
        return tolerance
    off = difference_text(check.difference, check.u_num, plus_minus) if check.u_num else percent(check.difference, 4)
    return f"{'/'.join(sides(check))} - 1 = {off}, {tolerance}"


def with_mu(text: str) -> str:
    """With the letter mu for the prefix that a terminal has as a "u"."""
    return re.sub(r"(?<=[\d(] )u(?=[A-Zmos])|(?<=\()u(?=[A-Zmos])", "\N{MICRO SIGN}", text)


def judged(check: Check) -> str:
    """A check's id with its verdict, as a figure's title has it."""
    mark = {"agrees": "\N{CHECK MARK}", "differs": "\N{MULTIPLICATION X}", "unresolved": "?"}[check.verdict]
    return f"{mark} {check.id} {check.verdict.upper() if check.verdict == 'differs' else check.verdict}"


def drawn(check: Check) -> str:
    """A check as a line under a figure's title; its sentence is in the report and in the terminal."""
    found = amount(check.measured, check.unit)
    off = off_by(check) if off_by(check).isalpha() else f"off by {off_by(check)}"
    one, other = sides(check)
    return with_mu(f"{judged(check)}: {check.title}, {one} {claimed(check)}, {other} {found} ({off})")
