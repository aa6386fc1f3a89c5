"""What a run of the device says in the terminal: the verdict first, then the numbers, reasons, findings and answers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from compare.device.runs import BAND
from compare.device.summary import peaks
from compare.table import Style, checks_text, reasons_text, verdict_text, where_text, wrapped
from compare.verdict import Check
from compare.words import percent, quantity
from reduced1d.device.settling import settling
from reduced1d.device.steady import steady

if TYPE_CHECKING:
    from compare.device.design import Design
    from compare.device.outcome import DeviceOutcome
    from scenes.plan import Step

QUANTITIES = {
    "sink_K": ("sink temperature", "K"),
    "sensor_K": ("sensor temperature", "K"),
    "sink_V": ("sink voltage", "V"),
    "sensor_V": ("sensor voltage", "V"),
    "sink_power_W": ("sink power", "W"),
    "sensor_power_W": ("sensor power", "W"),
    "polymer_flux_W": ("heat into the polymer", "W"),
}


def headline(outcome: DeviceOutcome, contrary: Sequence[Check], style: Style) -> str:
    """The verdict of the run, in one line where it fits."""
    external = outcome.device.external
    name = f"{outcome.device.name}, {external.initial_temperature:g} to {external.final_temperature:g} K outside"
    if outcome.request.scheme == "paper":
        name += ", paper's scheme"
    if not outcome.checks:
        return style.paint(wrapped(f"{name}: nothing was checked."), "heading")
    return verdict_text(name, outcome.checks, contrary, outcome.device.expected_to_differ is not None, style)


def outcome_text(
    outcome: DeviceOutcome, contrary: Sequence[Check], style: Style, planned: tuple[Step, ...] | None = None
) -> str:
    """Everything about a run; ``contrary`` are the checks that contradict the scene. A plan never turns out otherwise
    here, so that one that has been printed (``planned``) needs no more."""
    parts = [headline(outcome, contrary, style), _quantities(outcome, style)]
    if outcome.checks:
        parts += [checks_text(outcome.checks, style), reasons_text(outcome.checks, contrary, style)]
    findings = outcome.runs.base.result.findings
    if findings:
        lines = [wrapped(f"{text.rstrip('.')}.", "  ", "    ") for text in findings]
        parts.append("\n".join([style.paint("Findings", "heading"), *lines]))
    if outcome.design is not None:
        parts.append(_design(outcome.design, outcome, style))
    parts += [wrapped(f"Warning: {text.rstrip('.')}.") for text in outcome.warnings]
    parts.append(where_text(outcome))
    return "\n\n".join(parts)


def _quantities(outcome: DeviceOutcome, style: Style) -> str:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    device, result = outcome.device, outcome.runs.base.result
    before, after = steady(device, device.external.initial_temperature), steady(device)
    highest = peaks(outcome.runs.base)
    heads = f"  {'':<22}{'steady before':>14}{'after':>11}{'peak':>11}{'at':>8}{'settled':>12}"
    lines = [style.paint(heads, "heading")]
    for key, (name, unit) in QUANTITIES.items():
        top = highest[key]
        times = [s.time for s in settling(device, result, key, BAND)] if key[-2:] != "_V" else []
        shown = " / ".join(f"{time * 1e3:.1f}" if time < float("inf") else "never" for time in times)
        lines.append(
            f"  {name:<22}{quantity(getattr(before, key), unit, 5):>14}{quantity(getattr(after, key), unit, 5):>11}"
            f"{quantity(top['value'], unit, 4):>11}{top['time_s'] * 1e3:>5.4g} ms{shown:>12}".rstrip()
        )
    error = max(result.errors["sink_K"], result.errors["sensor_K"])
    said = (
        f"Settled: ms after the cold start / after the outer step, from when on within {percent(BAND, 1)} of the "
        f"change; 0.0 where it never left the band. Estimated error of the temperatures at most {error:.1e} K."
    )
    return "\n".join([*lines, wrapped(said, "  ", "  ")])


def _design(design: Design, outcome: DeviceOutcome, style: Style) -> str:
    control = outcome.device.control
    lines = [style.paint("For the designer", "heading"),
             f"  {'largest stable gain':<28}{'sink':>10}{'sensor':>10}{'slowest mode':>22}"]  # fmt: skip
    for limit in design.limits:
        sink, sensor = (_gain(g) for g in (limit.sink_gain_V, limit.sensor_gain_V))
        name = f"  sampled every {limit.sample_time_s * 1e3:g} ms"
        mode = f"{'decays' if limit.decay_per_s >= 0 else 'grows'} at {abs(limit.decay_per_s):.3g} 1/s"
        lines.append(f"  {name:<28}{sink:>10}{sensor:>10}{mode:>22}")
    smooth = [_gain(g) for g in design.smooth_start_gains_V]
    lines.append(f"  {'largest for a smooth start':<28}{smooth[0]:>10}{smooth[1]:>10}")
    lines.append(
        wrapped(
            f"The scene has {control.sink_gain:g} V and {control.sensor_gain:g} V at {control.sample_time * 1e3:g} ms; "
            "each limit with the other gain as it is. Smooth: from cold without the limit V >= 0 acting.", "  ", "  ",
        )
    )  # fmt: skip
    lines.append(_range(design, outcome))
    for name, step in design.resolutions.items():
        said = (
            step if isinstance(step, str) else
            f"resolves {quantity(step.total, 'K', 2)} outside: {quantity(step.power, 'K', 2)} by the sensor's power, "
            f"{quantity(step.sensor, 'K', 2)} by holding the sensor's temperature, {quantity(step.sink, 'K', 2)} the "
            "sink's"
        )  # fmt: skip
        lines.append(wrapped(f"{name}: {said}.", "  ", "    "))
    return "\n".join(lines)


def _gain(gain: float) -> str:
    return quantity(gain, "V", 3) if gain < float("inf") else "any"


def _range(design: Design, outcome: DeviceOutcome) -> str:
    highest = f"{outcome.device.control.set_temperature:g} K"
    if design.range is None:
        return wrapped(f"Range: up to {highest}; give --max-voltage or --max-power for its lower end.", "  ", "    ")
    found = design.range
    return wrapped(
        f"Range: {found.lowest_K:.5g} K to {highest}, where the sensor takes at most "
        f"{quantity(found.sensor_power_W, 'W')} at {quantity(found.sensor_V, 'V')}.", "  ", "    ",
    )  # fmt: skip
