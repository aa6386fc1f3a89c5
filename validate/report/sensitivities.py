"""How the models follow each key, in the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from compare.inputs.sensitivities import PREFIX, QUANTITIES
from scenes.formats import cut, percent
from validate.report.table import Style, wrapped

if TYPE_CHECKING:
    from compare.inputs.sensitivities import Sensitivities, Slope
    from compare.outcome import Outcome
    from compare.verdict import Check

MOST = 3
"""Of so many quantities the terminal and the figure have room; the page and the summary have all."""
_KEY = 33


def followed(outcome: Outcome[Any]) -> dict[str, str]:
    """Those quantities, with what they are called."""
    from compare.pipeline import kind

    if kind(outcome.scene) == "sink":
        return {name: QUANTITIES[name] for name in ("peak_rise_K", "end_rise_K", "current_A")}
    if kind(outcome.scene) == "device":
        from reduced1d.device.slopes import QUANTITIES as FOLLOWED

        return {name: FOLLOWED[name] for name in ("sink_power_W", "sensor_power_W", "sensor_V")}
    found = outcome.sensitivities
    names = [] if found is None else [p.name for p in outcome.scene.probes if p.name in found.values]
    return {name: name for name in names[:MOST]}


def short(key: str) -> str:
    """A key without its section, where it is as clear: "silicon.density"."""
    for section in ("materials.", "environment.", "material.", "boundary.", "box."):
        key = key.removeprefix(section)
    return key


def sensitivities_text(found: Sensitivities, checks: Iterable[Check], style: Style, names: Mapping[str, str]) -> str:
    """A line for each key that any of the quantities follows, that first which one follows most: 3D and 1D side by
    side, where there are both; ``names`` are the quantities with what they are called."""
    judged = {check.id.removeprefix(PREFIX): check for check in checks if check.id.startswith(PREFIX)}
    both = any(s.reduced1d is not None for of in found.steady.values() for s in of.values())
    heads = "".join(f"{cut(called, 14):>15}" for called in names.values())
    lines = [style.paint(f"  {'% for each percent of':<{_KEY}}{heads}", "heading")]
    if both:
        lines.append(f"  {'':<{_KEY}}" + f"{'3D':>8}{'1D':>7}" * len(names))
    for key in found.sorted(names):
        mark = style.paint(style.mark(judged[key].verdict), judged[key].verdict) if key in judged else " "
        values = "".join(_values(found.steady[key].get(name), both) for name in names)
        lines.append(f"{mark} {cut(short(key), _KEY - 1):<{_KEY}}{values}".rstrip())
    if judged:
        differ = sum(check.verdict == "differs" for check in judged.values())
        tolerance = percent(next(iter(judged.values())).tolerance, 1)
        lines.append(
            f"  1D follows {len(judged) - differ} of {len(judged)} keys as 3D does, within {tolerance} of the largest"
        )
    more = len(found.values) - len(names)
    if more > 0:
        lines.append(wrapped(f"Those of {more} more probes are in summary.json and on the page.", "  ", "  "))
    if found.zeros:
        lines.append(wrapped(f"0, of which there is no percent: {', '.join(found.zeros)}.", "  ", "  "))
    return "\n".join(lines)


def _signed(value: float) -> str:
    """Three places; nothing has no sign."""
    return f"{value:+.3f}" if abs(value) >= 5e-4 else "0.000"


def _values(slope: Slope | None, both: bool) -> str:
    """Of a quantity both models, or the one that there is."""
    three = "" if slope is None or slope.fem3d is None else _signed(slope.fem3d.value)
    one = "" if slope is None or slope.reduced1d is None else _signed(slope.reduced1d)
    return f"{three:>8}{one:>7}" if both else f"{three:>15}"
