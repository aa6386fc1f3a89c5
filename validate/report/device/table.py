"""What a run of the device says in the terminal: the answer first, then findings, numbers, checks and reasons."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from compare.device.answer import answer
from compare.device.runs import BAND
from compare.device.words import QUANTITIES, amount, claimed, in_full, off_by
from compare.verdict import Check
from compare.words import percent, quantity
from scenes.loop.settling import settling
from validate.report.device.summary import peaks
from validate.report.table import WIDTH, Style, warnings_text, where_text, wrapped

if TYPE_CHECKING:
    from compare.device.design import Design
    from compare.device.outcome import DeviceOutcome
    from scenes.plan import Step


def headline(outcome: DeviceOutcome, contrary: Sequence[Check], style: Style) -> str:
    """The answer, with the count of the paper's claims that differ."""
    return style.paint(wrapped(answer(outcome, contrary)), "heading")


def outcome_text(
    outcome: DeviceOutcome, contrary: Sequence[Check], style: Style, planned: tuple[Step, ...] | None = None
) -> str:
    """Everything about a run; ``contrary`` are the checks that contradict the scene. A plan never turns out otherwise
    here, so that one that has been printed (``planned``) needs no more."""
    return f"{found_text(outcome, contrary, style)}\n\n{where_text(outcome)}"


def found_text(outcome: DeviceOutcome, contrary: Sequence[Check], style: Style) -> str:
    """The answer, the findings, the quantities, the claims with their reasons, the designer's answers, the warnings."""
    parts = [headline(outcome, contrary, style)]
    if outcome.runs.base.result.findings:
        parts.append(_listed("Findings", outcome.runs.base.result.findings, style))
    parts.append(_quantities(outcome, style))
    if outcome.checks:
        parts += [_checks(outcome.checks, style), _reasons(outcome.checks, contrary, style)]
    if outcome.design is not None:
        parts.append(_design(outcome.design, outcome, style))
    return "\n\n".join([*parts, *warnings_text(outcome)])


def columns(rows: Sequence[Sequence[str]], left: int, style: Style) -> list[str]:
    """Lines of a table, the first its heading: ``left`` columns stand to the left, the rest to the right. No two
    columns ever touch; they move together where the line would be too long."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    gaps = len(widths) - 1
    gap = " " * max(min((WIDTH - sum(widths)) // gaps, 3), 1)
    sides = ["<" if i < left else ">" for i in range(len(widths))]
    lines = [
        gap.join(f"{cell:{side}{width}}" for cell, side, width in zip(row, sides, widths, strict=True)).rstrip()
        for row in rows
    ]
    return [style.paint(lines[0], "heading"), *lines[1:]]


def _quantities(outcome: DeviceOutcome, style: Style) -> str:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    run = outcome.runs.base
    highest, events = peaks(run), 0
    rows = [["  ", "before", "after", "peak", "at", "from cold", "from step"]]
    never = True
    for key, (name, unit) in QUANTITIES.items():
        times = [s.time for s in settling(run.device, run.result, key, BAND)]
        events, top = len(times), highest[key]
        never = never and bool(times) and times[-1] == math.inf
        shown = [f"{time * 1e3:.1f} ms" if time < math.inf else "never" for time in times]
        rows.append(
            [
                f"  {name}", *(quantity(getattr(state, key), unit, 5) for state in (run.before, run.after)),
                quantity(top["value"], unit, 4), f"{top['time_s'] * 1e3:.4g} ms", *shown, *[""] * (2 - len(shown)),
            ]
        )  # fmt: skip
    errors = run.result.errors
    said = "Before, after: the steady states that the controllers are bound for, before and after the outer step. "
    if never:
        said += f"Nothing settles to {percent(BAND, 1)} of its change before the run ends. "
    elif events:
        said += (
            f"From cold, from step: how long until within {percent(BAND, 1)} of the change for good; 0 where it never "
            "left that band. "
        )
    said += f"Estimated error of the temperatures at most {max(errors['sink_K'], errors['sensor_K']):.1e} K."
    return "\n".join([*columns(rows, 1, style), wrapped(said, "  ", "  ")])


def _checks(checks: Sequence[Check], style: Style) -> str:
    """A line for every claim of the paper, with what the model finds."""
    rows, room = [["  check", "", "paper", "1D", "off by", ""]], max(len(check.verdict) for check in checks)
    for check in checks:
        values = claimed(check), amount(check.measured, check.unit), off_by(check)
        rows.append([f"{style.mark(check.verdict)} {check.id}", check.title, *values, f"{check.verdict:<{room}}"])
    head, *lines = columns(rows, 2, style)
    painted = [
        line.removesuffix(check.verdict) + style.paint(check.verdict, check.verdict)
        for line, check in zip(lines, checks, strict=True)
    ]
    return "\n".join([head, *painted])


def _reasons(checks: Sequence[Check], contrary: Sequence[Check], style: Style) -> str:
    """Of every check what the paper says and what comes out, the difference with its error, and the tolerance."""
    found = []
    for check in checks:
        declared = f"the scene declares that it {check.expected} (checks.expect_differs); "
        said = declared if check in contrary and check.expected not in (None, check.verdict) else ""
        found.append(f"{check.id}: {said}{check.because}; {in_full(check, style.plus_minus)}")
    return _listed("Why", found, style)


def _listed(head: str, sentences: Sequence[str], style: Style) -> str:
    lines = [wrapped(f"{text.rstrip('.')}.", "  ", "    ") for text in sentences]
    return "\n".join([style.paint(head, "heading"), *lines])


def _design(design: Design, outcome: DeviceOutcome, style: Style) -> str:
    control = outcome.device.control
    rows = [["  largest stable gain", "sink", "sensor", "slowest mode", "eigenvalue"]]
    for limit in design.limits:
        mode = f"{'decays' if limit.decay_per_s >= 0 else 'grows'} at {abs(limit.decay_per_s):.3g} 1/s"
        gains = _gain(limit.sink_gain_V), _gain(limit.sensor_gain_V)
        name, size = f"    sampled every {limit.sample_time_s * 1e3:g} ms", f"{limit.largest_eigenvalue:.4g}"
        rows.append([name, *gains, mode, size])
    rows.append(["  largest for a smooth start", *(_gain(g) for g in design.smooth_start_gains_V), "", ""])
    said = (
        f"The scene has {control.sink_gain:g} V and {control.sensor_gain:g} V at {control.sample_time * 1e3:g} ms; "
        "each limit with the other gain as it is. Eigenvalue: the largest in size per sample, stable below 1. Smooth: "
        "from cold without the limit V >= 0 acting."
    )
    found = [_range(design, outcome), *(f"{name}: {text}" for name, text in design.meters.items())]
    lines = [wrapped(f"{text}.", "  ", "    ") for text in found]
    head = style.paint("For the designer", "heading")
    return "\n".join([head, *columns(rows, 1, style), wrapped(said, "  ", "  "), *lines])


def _gain(gain: float) -> str:
    return "none" if gain == 0 else quantity(gain, "V", 3) if gain < math.inf else "any"


def _range(design: Design, outcome: DeviceOutcome) -> str:
    highest = f"{outcome.device.control.set_temperature:g} K"
    if design.range is None:
        return f"Range: up to {highest}; give --max-voltage or --max-power for its lower end"
    found = design.range
    return (
        f"Range: {found.lowest_K:.5g} K to {highest}, where the sensor takes at most "
        f"{quantity(found.sensor_power_W, 'W')} at {quantity(found.sensor_V, 'V')}"
    )
