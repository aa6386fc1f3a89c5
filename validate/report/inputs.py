"""What uncertain inputs make of a run of the sink: in the terminal, and in the summary."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from compare.inputs.sensitivities import QUANTITIES
from scenes.formats import percent, quantity
from validate.report.sensitivities import short
from validate.report.table import Style, columns_text, wrapped

if TYPE_CHECKING:
    from compare.inputs.propagation import Propagated
    from compare.inputs.sampling import Sampled
    from compare.outcome import Outcome
    from scenes.sink import Sink

_CALLED = {"heat_out_W": "heat out"}
_UNITS = {"K_per_W": "K/W", "K": "K", "A": "A", "W": "W"}


def inputs_text(outcome: Outcome[Sink], found: Propagated, style: Style) -> str:
    """The standard uncertainties that were given, and a line for each quantity: u_input of both models and of their
    difference, and the key that adds most; then those of the checks, and what samples say."""
    given = ", ".join(f"{short(key)} {percent(u)}" for key, u in found.uncertain.relative.items())
    correlated = "".join(f"; {short(a)} and {short(b)} {r:+g}" for (a, b), r in found.uncertain.correlations.items())
    rows = [["u_input of", "3D", "1D", "1D/3D - 1", "most by"]]
    for name, called in QUANTITIES.items():
        unit = next(u for end, u in _UNITS.items() if name.endswith(end))
        rows.append([
            _CALLED.get(name, called),
            quantity(found.fem3d[name], unit, 2) if name in found.fem3d else "",
            quantity(found.reduced1d[name], unit, 2) if name in found.reduced1d else "",
            percent(found.difference[name]) if name in found.difference else "",
            short(found.most.get(name, "")),
        ])  # fmt: skip
    said = f"Inputs known to (standard uncertainty): {given}{correlated}."
    lines = [wrapped(said), *columns_text(rows, 1, style)]
    known = [f"{check.id} {percent(check.u_input)}" for check in outcome.checks if check.u_input is not None]
    lines += [wrapped(f"of the differences: {', '.join(known)}")] if known else []
    if outcome.sampled is not None:
        lines += _samples_text(outcome.sampled, style)
    return "\n".join(lines)


def _samples_text(found: Sampled, style: Style) -> list[str]:
    """What the samples spread by, beside what linear propagation makes of it."""
    rows = [[f"of {found.count - found.failed} samples", "3D", "linear", "1D", "linear"]]
    for name, called in QUANTITIES.items():
        unit, row = next(u for end, u in _UNITS.items() if name.endswith(end)), [_CALLED.get(name, called)]
        for own in (found.fem3d, found.reduced1d):
            spread = own.get(name)
            row += [quantity(spread.deviation, unit, 3), quantity(spread.linear, unit, 3)] if spread else ["", ""]
        rows.append(row)
    return columns_text(rows, 1, style)


def entered(entries: dict[str, Any], found: Propagated, sampled: Sampled | None) -> None:
    """Puts u_input beside the error of every steady quantity of a summary, and the inputs themselves."""
    for model, own in (("fem3d", found.fem3d), ("reduced1d", found.reduced1d)):
        for name, u in own.items():
            entries[model]["steady"][name]["u_input"] = u
    entries["uncertain"] = {
        "relative": found.uncertain.relative,
        "correlations": [{"keys": list(keys), "value": r} for keys, r in found.uncertain.correlations.items()],
        "difference": {name: {"u_input": u} for name, u in found.difference.items()},
    }
    if sampled is not None:
        entries["monte_carlo"] = asdict(sampled)
