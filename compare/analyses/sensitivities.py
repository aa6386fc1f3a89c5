"""Sensitivities d ln quantity / d ln key of both models, and uncertainties of quantities by uncertain keys.

A check says whether 1D follows a key as 3D does. The uncertainty is u_input of ASME V&V 20: to first order u_input^2 =
s^T C s, with the logarithmic derivatives s of a quantity and the covariance C of the keys' relative deviations (GUM
5.2.2). Both models have the same keys, which move them together: the u_input of a difference is computed with the
derivatives of the difference.
"""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from textwrap import wrap
from typing import Any

import numpy as np

from compare.analyses.base import Analysis
from compare.kinds import kind_of
from compare.outcome import Outcome, Progress
from compare.report import Row, Section, Style, Table
from compare.slopes import Slopes, combined
from compare.verdict import Check, judge, part
from scenes.errors import SceneError
from scenes.formats import percent, quantity
from scenes.parameters import SECTION
from scenes.result import Estimate
from scenes.uncertain import Uncertain
from scenes.varied import made_of_parameters, zeros

PREFIX = "slope_"
MODELS = ("fem3d", "reduced1d")
NONE = 1e-6
"""Smaller slopes count as zero."""

AllSlopes = Mapping[str, Slopes]
ByKey = dict[str, dict[str, dict[str, Estimate]]]


class Sensitivity(Analysis[AllSlopes]):
    name = "sensitivities"
    about = "how quantities follow each key, in 3D by differences on the moved mesh"

    def run(self, outcome: Outcome[Any], progress: Progress) -> AllSlopes:
        outcome.checks = (*outcome.checks, *checks(outcome.scene, outcome.slopes, words(outcome)))
        return outcome.slopes

    def section(self, found: AllSlopes, outcome: Outcome[Any], style: Style) -> Section:
        """A line for each key that a quantity follows, the largest slope first: 3D, then 1D."""
        names, both, few = words(outcome), set(MODELS) <= found.keys(), kind_of(outcome.scene).shown
        shown = {name: names[name] for name in (few or list(names)[:3]) if name in names and not style.page} or names
        table, verdicts, rows = by_key(found), {check.id: check.verdict for check in outcome.checks}, []
        for key in followed_keys(outcome.scene, table, shown):
            cells = (_cell(table[key].get(name, {}), style, both) for name in shown)
            rows.append(Row([key, *cells], verdicts.get(f"{PREFIX}{key}", "")))
        heads = [f"{word}\n{'3D':>6}{'1D':>8}" if both else "\n".join(wrap(word, 15)) for word in shown.values()]
        whole = "the steady state" if (steady := next(iter(found.values())).steady) else "the largest values over time"
        said = [f"Logarithmic derivatives of {whole}, d ln(quantity) / d ln(key)."] * (style.page or not steady)
        if outcome.scene.kind == "free" and (without := zeros(outcome.scene)):
            said.append(f"0, of which there is no percent: {', '.join(without)}.")
        return Section("Sensitivities", [Table(("% for each percent of", *heads), rows), *said], headed=False)

    def enter(self, summary: dict[str, Any], found: AllSlopes, outcome: Outcome[Any]) -> None:
        """{key: {quantity: {"fem3d": {"value", "error"}, "reduced1d": {"value"}}}}."""
        summary["sensitivities"] = {
            key: {
                name: {m: asdict(s) if m == "fem3d" else {"value": s.value} for m, s in slopes.items()}
                for name, slopes in by_name.items()
            }
            for key, by_name in by_key(found).items()
        }


def by_key(slopes: AllSlopes) -> ByKey:
    """Return the slopes of both models by key, quantity and model."""
    table: ByKey = {}
    for model in filter(slopes.__contains__, MODELS):
        for key, by_name in slopes[model].relative.items():
            for name, slope in by_name.items():
                table.setdefault(key, {}).setdefault(name, {})[model] = slope
    return table


def words(outcome: Outcome[Any]) -> dict[str, str]:
    """Return the quantities that have slopes, with their words."""
    known = set().union(*(slopes.sizes for slopes in outcome.slopes.values()))
    quantities = kind_of(outcome.scene).quantities(outcome.scene)
    return {name: word for name, (word, _) in quantities.items() if name in known}


def followed_keys(scene: Any, table: ByKey, names: Iterable[str]) -> list[str]:
    """Return the keys that a quantity follows, the largest slope first, without keys made of parameters."""
    made, sizes = made_of_parameters(scene), dict[str, float]()
    for key in (key for key in table if key not in made):
        sizes[key] = max((abs(s.value) for name in names for s in table[key].get(name, {}).values()), default=0.0)
    return sorted((key for key, size in sizes.items() if size > NONE), key=lambda key: -sizes[key])


def checks(scene: Any, slopes: AllSlopes, names: Mapping[str, str]) -> tuple[Check, ...]:
    """Check for each key the largest difference of both models' slopes, relative to the quantity's largest slope.

    The largest slope is by a size or a property: a percent of kelvins means little, and slopes by parameters are sums.
    """
    table, tolerance, made = by_key(slopes), scene.tolerance("slope"), list[Check]()
    scales = [table[key] for key in table if not (key.endswith("_temperature") or key.startswith(f"{SECTION}."))]
    in_3d = {name: [abs(by[name]["fem3d"].value) for by in scales if "fem3d" in by.get(name, {})] for name in names}
    largest = {name: max(sizes) for name, sizes in in_3d.items() if max(sizes, default=0.0) > NONE}
    for key in followed_keys(scene, table, names):
        both = {n: (each["reduced1d"], each["fem3d"]) for n, each in table[key].items() if len(each) == 2}
        off = {n: (one.value - three.value) / largest[n] for n, (one, three) in both.items() if n in largest}
        if not off:
            continue
        name = max(off, key=lambda n: abs(off[n]))
        one, three = both[name]
        u_num = three.error / largest[name]
        verdict = judge(off[name], tolerance, u_num)
        follows = f"{one.value:+.3f}, in 3D by {three.value:+.3f} % for each percent"
        made.append(
            Check(
                f"{names[name]}, d ln / d ln key", one.value, three.value, "1", off[name], u_num,
                "" if verdict == "agrees" else f"{names[name]} follows {key} by {follows}", id=f"{PREFIX}{key}",
                tolerance=tolerance, verdict=verdict, relative_to="the largest slope of the quantity",
            )
        )  # fmt: skip
    return tuple(made)


def _cell(slopes: Mapping[str, Estimate], style: Style, both: bool) -> str:
    """The slopes of 3D and of 1D, to three places; zero has no sign."""
    values = {model: f"{s.value:+.3f}" if abs(s.value) >= 5e-4 else "0.000" for model, s in slopes.items()}
    left, right = (values.get(model, "") for model in MODELS)
    left += f" {style.plus_minus} {slopes['fem3d'].error:.4f}" if left and style.page else ""
    return f"{left:>6} {right:>6}" if both and (left or right) else left or right


OF_3D = {
    "dev3d_sink_power": "sink_power_W", "dev3d_sensor_power": "sensor_power_W",
    "dev3d_sink_voltage": "sink_V", "dev3d_sensor_voltage": "sensor_V",
}  # fmt: skip
"""Checks of the device that compare a steady quantity of both models."""


@dataclass(frozen=True)
class Propagated:
    """u_input by quantity: of ``fem3d`` and ``reduced1d`` in the quantity's unit, ``difference`` of 1D/3D - 1; ``most``
    names the key that adds most to its square."""

    uncertain: Uncertain
    fem3d: dict[str, float]
    reduced1d: dict[str, float]
    difference: dict[str, float]
    most: dict[str, str]


class UncertainInputs(Analysis[Propagated]):
    name, about = "uncertain", "u_input by the sensitivities, to first order"

    def run(self, outcome: Outcome[Any], progress: Progress) -> Propagated:
        found, known = propagated(outcome.options.uncertain, outcome.slopes), by_differences(outcome)
        known |= {check: found.difference[name] for check, name in OF_3D.items() if name in found.difference}
        outcome.checks = tuple(replace(check, u_input=known.get(check.id)) for check in outcome.checks)
        return found

    def section(self, found: Propagated, outcome: Outcome[Any], style: Style) -> Section:
        """The given uncertainties, and u_input of each quantity."""
        given = found.uncertain
        keys = ", ".join(f"{key} {percent(u)}" for key, u in given.relative.items())
        pairs = "".join(f"; {a} and {b} {r:+g}" for (a, b), r in given.correlations.items())
        steady = next(iter(outcome.slopes.values())).steady
        rows = [["u_input of" + " the largest" * (not steady), "3D", "1D", "1D/3D - 1", "most by"]]
        for name, (word, unit) in kind_of(outcome.scene).quantities(outcome.scene).items():
            models = [quantity(u[name], unit, 2) if name in u else "" for u in (found.fem3d, found.reduced1d)]
            off = percent(found.difference[name]) if name in found.difference else ""
            rows.append([word, *models, off, found.most.get(name, "")])
        if not found.reduced1d:
            rows = [[*row[:2], row[4]] for row in rows]
        checks = [f"{check.id} {percent(check.u_input)}" for check in outcome.checks if check.u_input is not None]
        of_checks = f"of the differences: {', '.join(checks)}" if checks else ""
        text = f"Inputs known to (standard uncertainty): {keys}{pairs}."
        return Section("Uncertain inputs", [text, Table(rows[0], rows[1:]), of_checks], headed=False)

    def enter(self, summary: dict[str, Any], found: Propagated, outcome: Outcome[Any]) -> None:
        """Put u_input beside the error of every steady quantity, too; that of the largest value over time by itself."""
        given = found.uncertain
        summary["uncertain"] = {
            "relative": given.relative,
            "correlations": [{"keys": list(keys), "value": r} for keys, r in given.correlations.items()],
            "difference": {name: {"u_input": u} for name, u in found.difference.items()},
        }
        for model, deviations in (("fem3d", found.fem3d), ("reduced1d", found.reduced1d)):
            for name, u in deviations.items():
                of = "steady" if outcome.slopes[model].steady else "largest"
                summary[model].setdefault(of, {}).setdefault(name, {})["u_input"] = u


def propagated(uncertain: Uncertain, slopes: AllSlopes) -> Propagated:
    """Combine the slopes of both models, and of their difference, with the covariance of the inputs.

    Quantities without a slope by each of the keys are left out.
    """
    vectors: dict[str, dict[str, np.ndarray]] = {model: {} for model in MODELS}
    u: dict[str, dict[str, float]] = {model: {} for model in MODELS}
    for model in filter(slopes.__contains__, MODELS):
        by_key = [slopes[model].relative.get(key, {}) for key in uncertain.relative]
        for name, size in slopes[model].sizes.items():
            if all(name in by_name for by_name in by_key):
                vector = vectors[model][name] = np.array([by_name[name].value for by_name in by_key])
                u[model][name] = abs(size) * float(combined(vector, uncertain))
    three, one = vectors.values()
    difference = {}
    for name in filter(one.__contains__, three):
        off = part(slopes["reduced1d"].sizes[name], slopes["fem3d"].sizes[name])
        difference[name] = abs(off) * float(combined(one[name] - three[name], uncertain))
    parts = {name: vector**2 * uncertain.covariance().diagonal() for name, vector in (one | three).items()}
    most = {name: list(uncertain.relative)[int(each.argmax())] for name, each in parts.items() if each.any()}
    return Propagated(uncertain, **u, difference=difference, most=most)


def by_differences(outcome: Outcome[Any]) -> dict[str, float]:
    """Return u_input of the differences of checks, compared with each key larger and smaller; no points of a curve."""
    kind, options, slopes = kind_of(outcome.scene), outcome.options, dict[str, list[float]]()
    if options.against is not None and options.against.curve:
        outcome = replace(outcome, options=options.but(against=None))
    for key, u in options.uncertain.relative.items():
        step = min(u, kind.step)
        try:
            more, less = (kind.comparisons(kind.nearby(outcome, key, s), outcome.fem3d) for s in (step, -step))
        except SceneError:
            return {}
        for name, check in more.items():
            a, b = check.difference, less[name].difference
            slopes.setdefault(name, []).append(0.0 if a == b else (a - b) / (2 * step))  # both may be infinite
    return {name: float(combined(s, options.uncertain)) for name, s in slopes.items() if np.isfinite(s).all()}
