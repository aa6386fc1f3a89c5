"""How the models follow each key of the scene, d ln quantity / d ln key, and whether 1D follows it as 3D does."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from compare.analyses.base import Analysis
from compare.analyses.uncertainty import slopes_of
from compare.kinds import kind_of
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report.table import MARKS, Row, Section, Style, Table, short_key, stacked
from scenes.formats import percent
from scenes.result import Step, step
from scenes.varied import made_of_parameters

if TYPE_CHECKING:
    from compare.slopes import Slopes
    from compare.verdict import Check
    from scenes.result import Estimate

PREFIX = "slope_"
MODELS = ("fem3d", "reduced1d")
MOST = 3
"""Probes of a free scene whose sensitivities a terminal shows."""
LEAST = 5e-5
"""Smaller slopes are shown as zero."""
NONE = 1e-6
"""Smaller slopes count as zero."""

AllSlopes = dict[str, "Slopes"]


class Sensitivity(Analysis[AllSlopes]):
    name, figure_name = "sensitivities", "sensitivity"

    def plan(self, scene: Any, options: Options) -> Step:
        return step("sensitivity", "how quantities follow each key, in 3D by differences on the moved mesh")

    def run(self, outcome: Outcome[Any], progress: Progress) -> AllSlopes:
        slopes = slopes_of(outcome, progress)
        outcome.checks = (*outcome.checks, *checks(outcome.scene, slopes, words(outcome)))
        return slopes

    def sentence(self, found: AllSlopes, outcome: Outcome[Any]) -> str:
        return sentence(outcome.checks)

    def section(self, found: AllSlopes, outcome: Outcome[Any], style: Style) -> Section:
        """A line for each key that a quantity follows, the largest slope first: 3D, then 1D."""
        from compare.slopes import keys_without_logarithm

        shown, names, both = shown_words(outcome, style.page), words(outcome), set(MODELS) <= found.keys()
        judged = {check.id.removeprefix(PREFIX): check for check in outcome.checks if check.id.startswith(PREFIX)}
        rows = []
        for key in followed_keys(outcome.scene, found, shown):
            cells = [short_key(key), *(_cell(found, key, name, style, both) for name in shown)]
            rows.append(Row(cells, judged[key].verdict if key in judged else ""))
        heads = [f"{word}\n{'3D':>6}{'1D':>8}" if both else stacked(word) for word in shown.values()]
        said, still = [], [short_key(key) for key in _keys(found) if _size(found, key, names) < LEAST]
        if style.page:
            steady = next(iter(found.values())).steady
            whole = "the steady state" if steady else "the largest value of each quantity"
            said.append(f"Logarithmic derivatives of {whole}, d ln(quantity) / d ln(key).")
        if zeros := keys_without_logarithm(outcome.scene):
            said.append(f"0, of which there is no percent: {', '.join(zeros)}.")
        if len(names) > len(shown) and outcome.scene.kind == "free":
            said.append(f"The slopes of {len(names) - len(shown)} more probes are in summary.json and on the page.")
        if judged:
            verdicts, mark = Counter(check.verdict for check in judged.values()), MARKS["unresolved"][style.ascii_only]
            within = percent(next(iter(judged.values())).tolerance, 1)
            count = f"{verdicts['agrees']} of {len(judged)} keys"
            said.append(f"1D follows {count} as 3D does, within {within} of the largest.")
            if open_ := verdicts["unresolved"]:
                said[-1] += f" {mark}: {open_} are open within the slopes' errors; a smaller --accuracy decides."
        if style.page and still:
            said.append(f"No quantity follows {', '.join(still)}.")
        return Section("Sensitivities", [Table(("% for each percent of", *heads), rows), *said], headed=False)

    def document(self, found: AllSlopes, outcome: Outcome[Any]) -> dict[str, Any]:
        """{key: {quantity: {"fem3d": {"value", "error"}, "reduced1d": {"value"}}}}."""
        entries = dict[str, dict[str, dict[str, Any]]]()
        for key in _keys(found):
            entries[key] = {}
            for model in MODELS:
                for name, slope in found[model].relative.get(key, {}).items() if model in found else ():
                    error = {"error": slope.error} if model == "fem3d" else {}
                    entries[key].setdefault(name, {})[model] = {"value": slope.value} | error
        return entries


def words(outcome: Outcome[Any]) -> dict[str, str]:
    """Return the quantities that have slopes, with their words."""
    known = set().union(*(slopes.sizes for slopes in outcome.slopes.values()))
    quantities = kind_of(outcome.scene).quantities(outcome.scene)
    return {name: word for name, (word, _) in quantities.items() if name in known}


def shown_words(outcome: Outcome[Any], full: bool = False) -> dict[str, str]:
    """Return the quantities for a terminal or a figure, or with ``full`` all."""
    names = words(outcome)
    chosen = kind_of(outcome.scene).shown or list(names)[:MOST]
    return names if full else {name: names[name] for name in chosen if name in names}


def followed_keys(scene: Any, slopes: Mapping[str, Slopes], names: Iterable[str]) -> list[str]:
    """Return the keys that a quantity follows, the largest slope first, without keys made of parameters."""
    made = made_of_parameters(scene)
    sizes = {key: _size(slopes, key, names) for key in _keys(slopes) if key not in made}
    return sorted((key for key, size in sizes.items() if size > NONE), key=lambda key: -sizes[key])


def checks(scene: Any, slopes: Mapping[str, Slopes], names: Mapping[str, str]) -> tuple[Check, ...]:
    """Check for each key the largest difference of both models' slopes, relative to the quantity's largest slope."""
    from compare.verdict import Check, judge

    if not set(MODELS) <= slopes.keys():
        return ()
    three, one, made = slopes["fem3d"], slopes["reduced1d"], []
    largest, tolerance = {name: three.largest(name) for name in names}, scene.tolerance("slope")
    for key in followed_keys(scene, slopes, names):
        in_3d, in_1d = three.relative.get(key, {}), one.relative.get(key, {})
        common = [name for name in names if name in in_3d and name in in_1d and largest[name] > NONE]
        off = {name: (in_1d[name].value - in_3d[name].value) / largest[name] for name in common}
        if not off:
            continue
        name = max(off, key=lambda n: abs(off[n]))
        u_num, values = in_3d[name].error / largest[name], (in_1d[name].value, in_3d[name].value)
        verdict = judge(off[name], tolerance, u_num)
        reason = f"{names[name]} follows {key} by {values[0]:+.3f}, in 3D by {values[1]:+.3f} % for each percent"
        made.append(
            Check(
                f"{PREFIX}{key}", f"{names[name]}, d ln / d ln key", *values, "1", off[name], tolerance, u_num, verdict,
                because="" if verdict == "agrees" else reason, relative_to="the largest slope of the quantity",
            )
        )  # fmt: skip
    return tuple(made)


def worst(made: Iterable[Check]) -> Check | None:
    """Return the check of a slope that differs most."""
    differ = [check for check in made if check.id.startswith(PREFIX) and check.verdict == "differs"]
    return max(differ, key=lambda check: abs(check.difference), default=None)


def sentence(made: Iterable[Check]) -> str:
    """Return the worst of the checks of slopes in a sentence; empty where there are none."""
    slopes = [check for check in made if check.id.startswith(PREFIX)]
    if not slopes:
        return ""
    if (check := worst(slopes)) is not None:
        return f"In the 1D model the {check.because}."
    open_ = sum(check.verdict == "unresolved" for check in slopes)
    said = "The 1D model follows every key as 3D does"
    return f"{said}, as far as the errors tell: {open_} of {len(slopes)} are open." if open_ else f"{said}."


def _cell(slopes: Mapping[str, Slopes], key: str, name: str, style: Style, both: bool) -> str:
    """The slopes of 3D and of 1D, to three places; zero has no sign."""
    three, one = (_slope(slopes, model, key, name) for model in MODELS)
    left, right = (
        "" if slope is None else f"{slope.value:+.3f}" if abs(slope.value) >= 5e-4 else "0.000"
        for slope in (three, one)
    )
    left += f" {style.plus_minus} {three.error:.4f}" if three is not None and style.page else ""
    return f"{left:>6} {right:>6}" if both and (left or right) else left or right


def _slope(slopes: Mapping[str, Slopes], model: str, key: str, name: str) -> Estimate | None:
    return slopes[model].relative.get(key, {}).get(name) if model in slopes else None


def _keys(slopes: Mapping[str, Slopes]) -> list[str]:
    return list(dict.fromkeys(key for model in MODELS if model in slopes for key in slopes[model].relative))


def _size(slopes: Mapping[str, Slopes], key: str, names: Iterable[str]) -> float:
    """The largest slope by a key, in size."""
    each = (_slope(slopes, model, key, name) for model in MODELS for name in names)
    return max((abs(slope.value) for slope in each if slope is not None), default=0.0)
