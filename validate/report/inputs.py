"""What uncertain inputs make of a run: in the terminal, and in the summary."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from compare.inputs.sensitivities import QUANTITIES
from scenes.formats import cut, percent, quantity
from scenes.model import UNITS
from validate.report.sensitivities import short
from validate.report.table import Style, columns_text, wrapped

if TYPE_CHECKING:
    from compare.inputs.propagation import Propagated
    from compare.inputs.sampling import Sampled
    from compare.outcome import Outcome

_CALLED = {"heat_out_W": "heat out"}
_UNITS = {"K_per_W": "K/W", "K": "K", "A": "A", "W": "W"}


def inputs_text(outcome: Outcome[Any], found: Propagated, style: Style) -> str:
    """The standard uncertainties that were given, and a line for each quantity: u_input of both models and of their
    difference, and the key that adds most; then those of the checks, and what samples say."""
    given = ", ".join(f"{short(key)} {percent(u)}" for key, u in found.uncertain.relative.items())
    correlated = "".join(f"; {short(a)} and {short(b)} {r:+g}" for (a, b), r in found.uncertain.correlations.items())
    rows = [["u_input of", "3D", "1D", "1D/3D - 1", "most by"]]
    for name, called, unit in _quantities(outcome):
        rows.append([
            called,
            quantity(found.fem3d[name], unit, 2) if name in found.fem3d else "",
            quantity(found.reduced1d[name], unit, 2) if name in found.reduced1d else "",
            percent(found.difference[name]) if name in found.difference else "",
            short(found.most.get(name, "")),
        ])  # fmt: skip
    said = f"Inputs known to (standard uncertainty): {given}{correlated}."
    filled = [any(row[i] for row in rows[1:]) for i in range(len(rows[0]))]
    rows = [[cell for cell, full in zip(row, filled, strict=True) if full] for row in rows]
    lines = [wrapped(said), *columns_text(rows, 1, style)]
    known = [f"{check.id} {percent(check.u_input)}" for check in outcome.checks if check.u_input is not None]
    lines += [wrapped(f"of the differences: {', '.join(known)}")] if known else []
    if outcome.sampled is not None:
        lines += _samples_text(outcome.sampled, style)
    return "\n".join(lines)


def _quantities(outcome: Outcome[Any]) -> list[tuple[str, str, str]]:
    """The quantities of a run, with what they are called and their units."""
    from compare.pipeline import kind

    if kind(outcome.scene) == "sink":
        return _of_sink()
    return [(p.name, cut(p.name, 30), UNITS[p.quantity]) for p in outcome.scene.probes]


def _of_sink() -> list[tuple[str, str, str]]:
    return [
        (name, _CALLED.get(name, called), next(u for end, u in _UNITS.items() if name.endswith(end)))
        for name, called in QUANTITIES.items()
    ]


def _samples_text(found: Sampled, style: Style) -> list[str]:
    """What the samples spread by, beside what linear propagation makes of it."""
    rows = [[f"of {found.count - found.failed} samples", "3D", "linear", "1D", "linear"]]
    for name, called, unit in _of_sink():
        row = [called]
        for own in (found.fem3d, found.reduced1d):
            spread = own.get(name)
            row += [quantity(spread.deviation, unit, 3), quantity(spread.linear, unit, 3)] if spread else ["", ""]
        rows.append(row)
    return columns_text(rows, 1, style)


def entered(entries: dict[str, Any], found: Propagated, sampled: Sampled | None) -> None:
    """Puts u_input beside the error of every steady quantity of a summary, of a free transient with its errors, and
    the inputs themselves."""
    for model, own in (("fem3d", found.fem3d), ("reduced1d", found.reduced1d)):
        for name, u in own.items():
            if name in entries[model]["steady"]:
                entries[model]["steady"][name]["u_input"] = u
            else:
                entries[model]["transient"].setdefault("u_input", {})[name] = u
    entries["uncertain"] = {
        "relative": found.uncertain.relative,
        "correlations": [{"keys": list(keys), "value": r} for keys, r in found.uncertain.correlations.items()],
        "difference": {name: {"u_input": u} for name, u in found.difference.items()},
    }
    if sampled is not None:
        entries["monte_carlo"] = asdict(sampled)
