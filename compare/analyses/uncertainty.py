"""Uncertain inputs: u_input of ASME V&V 20, of quantities and of differences.

To first order u_input^2 = s^T C s, with the logarithmic derivatives s of a quantity and the covariance C of the keys'
relative deviations (GUM 5.2.2). Both models have the same keys, which move them together: the u_input of a difference
is computed with the derivatives of the difference.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report.table import Section, Style, Table, short_key
from scenes.errors import SceneError
from scenes.formats import cut, percent, quantity
from scenes.result import Step, step

if TYPE_CHECKING:
    from compare.slopes import Slopes
    from compare.verdict import Check
    from scenes.uncertain import Uncertain

OF_3D = {
    "dev3d_sink_power": "sink_power_W", "dev3d_sensor_power": "sensor_power_W",
    "dev3d_sink_voltage": "sink_V", "dev3d_sensor_voltage": "sensor_V",
}  # fmt: skip
"""Checks of the device that compare a steady quantity of both models."""


@dataclass(frozen=True)
class Propagated:
    """u_input by quantity: of ``fem3d`` and ``reduced1d`` in the quantity's unit, ``difference`` of 1D/3D - 1.

    ``most`` names the key that adds most to its square.
    """

    uncertain: Uncertain
    fem3d: dict[str, float]
    reduced1d: dict[str, float]
    difference: dict[str, float]
    most: dict[str, str]


class UncertainInputs(Analysis[Propagated]):
    name = "uncertain"

    def plan(self, scene: Any, options: Options) -> Step:
        given = ", ".join(options.uncertain.given)
        return step("uncertain inputs", f"{given}: u_input by the sensitivities, to first order")

    def run(self, outcome: Outcome[Any], progress: Progress) -> Propagated:
        uncertain, slopes = outcome.options.uncertain, slopes_of(outcome, progress)

        def differences(nearby: Outcome[Any]) -> dict[str, float]:
            return {name: each.difference for name, each in kind_of(nearby.scene).comparisons(nearby).items()}

        with progress.stage("sensitivities"):
            found = propagated(uncertain, slopes)
            checks = by_differences(outcome.checks, outcome, differences)
            known = {check: found.difference[name] for check, name in OF_3D.items() if name in found.difference}
            outcome.checks = tuple(replace(c, u_input=known[c.id]) if c.id in known else c for c in checks)
        return found

    def section(self, found: Propagated, outcome: Outcome[Any], style: Style) -> Section:
        """The given uncertainties, and for each quantity u_input and the key that adds most."""
        given = found.uncertain
        keys = ", ".join(f"{short_key(key)} {percent(u)}" for key, u in given.relative.items())
        pairs = "".join(f"; {short_key(a)} and {short_key(b)} {r:+g}" for (a, b), r in given.correlations.items())
        heads, rows = ["u_input of", "3D", "1D", "1D/3D - 1", "most by"], []
        for name, (word, unit) in kind_of(outcome.scene).quantities(outcome.scene).items():
            models = [quantity(u[name], unit, 2) if name in u else "" for u in (found.fem3d, found.reduced1d)]
            off = percent(found.difference[name]) if name in found.difference else ""
            rows.append([cut(word, 30), *models, off, short_key(found.most.get(name, ""))])
        if not found.reduced1d:
            heads, *rows = [[*row[:2], row[4]] for row in (heads, *rows)]
        checks = [f"{check.id} {percent(check.u_input)}" for check in outcome.checks if check.u_input is not None]
        of_checks = f"of the differences: {', '.join(checks)}" if checks else ""
        text = f"Inputs known to (standard uncertainty): {keys}{pairs}."
        return Section("Uncertain inputs", [text, Table(heads, rows), of_checks], headed=False)

    def document(self, found: Propagated, outcome: Outcome[Any]) -> dict[str, Any]:
        given = found.uncertain
        return {
            "relative": given.relative,
            "correlations": [{"keys": list(keys), "value": r} for keys, r in given.correlations.items()],
            "difference": {name: {"u_input": u} for name, u in found.difference.items()},
        }

    def enter(self, summary: dict[str, Any], found: Propagated, outcome: Outcome[Any]) -> None:
        """Put u_input beside the error of every steady quantity, too; of a transient for the largest value."""
        super().enter(summary, found, outcome)
        for model, deviations in (("fem3d", found.fem3d), ("reduced1d", found.reduced1d)):
            for name, u in deviations.items():
                summary[model]["steady"].setdefault(name, {})["u_input"] = u


def slopes_of(outcome: Outcome[Any], progress: Progress) -> dict[str, Slopes]:
    """Return the slopes of the results, computed once for all analyses; remarks on them are warnings."""
    if not outcome.slopes:
        from compare.slopes import remarks

        options = outcome.options
        progress("sensitivities")
        with progress.stage("sensitivities"):
            keys = None if options.sensitivities else list(options.uncertain.relative)
            outcome.slopes = kind_of(outcome.scene).slopes(outcome, keys)
            outcome.warn(*remarks(outcome.slopes))
    return outcome.slopes


def propagated(uncertain: Uncertain, slopes: Mapping[str, Slopes]) -> Propagated:
    """Combine the slopes of both models, and of their difference, with the covariance of the inputs."""
    from compare.slopes import combined

    keys, variances = list(uncertain.relative), uncertain.covariance().diagonal()
    u = {model: slopes[model].combine(uncertain) for model in ("reduced1d", "fem3d") if model in slopes}
    vectors = {model: slopes[model].vectors(keys) for model in u}
    most = dict[str, str]()
    for by_name in vectors.values():  # 3D last: its largest key stands
        for name, vector in by_name.items():
            parts = vector**2 * variances
            most[name] = keys[int(parts.argmax())] if parts.any() else ""
    three, one, difference = vectors.get("fem3d", {}), vectors.get("reduced1d", {}), {}
    for name in three.keys() & one.keys():
        size = slopes["fem3d"].sizes[name]
        off = slopes["reduced1d"].sizes[name] / size if size else float("nan")
        difference[name] = abs(off) * combined(one[name] - three[name], uncertain)
    return Propagated(uncertain, u.get("fem3d", {}), u.get("reduced1d", {}), difference, most)


def by_differences(
    checks: Sequence[Check], outcome: Outcome[Any], differences: Callable[[Outcome[Any]], Mapping[str, float]]
) -> tuple[Check, ...]:
    """Return the checks with the u_input of their ``differences``, from outcomes with each key larger and smaller."""
    import numpy as np

    from compare.slopes import combined

    kind, uncertain, slopes = kind_of(outcome.scene), outcome.options.uncertain, dict[str, list[float]]()
    for key, u in uncertain.relative.items():
        step = kind.step(u)
        try:
            more, less = (differences(kind.nearby(outcome, outcome.slopes, key, s)) for s in (step, -step))
        except SceneError:
            return tuple(checks)
        for name, value in more.items():
            slopes.setdefault(name, []).append(0.0 if value == less[name] else (value - less[name]) / (2 * step))
    known = {name: combined(s, uncertain) for name, s in slopes.items() if np.isfinite(s).all()}
    return tuple(replace(check, u_input=known.get(check.id)) for check in checks)
