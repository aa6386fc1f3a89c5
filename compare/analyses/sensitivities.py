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
from scenes.plan import Step, step
from scenes.varied import made_of_parameters

if TYPE_CHECKING:
    from compare.slopes import Slopes
    from compare.verdict import Check

PREFIX = "slope_"
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
        shown, names = shown_words(outcome, style.page), words(outcome)
        judged = {check.id.removeprefix(PREFIX): check for check in outcome.checks if check.id.startswith(PREFIX)}
        both, order = {"fem3d", "reduced1d"} <= found.keys(), followed_keys(outcome.scene, found, shown)
        rows = []
        for key in order:
            cells = [short_key(key), *(_cell(found, key, name, style, both) for name in shown)]
            rows.append(Row(cells, judged[key].verdict if key in judged else ""))
        heads = [f"{word}\n{'3D':>6}{'1D':>8}" if both else stacked(word) for word in shown.values()]
        said = []
        if style.page:
            of = "the largest value of each quantity" if not _first(found).steady else "the steady state"
            said.append(f"Logarithmic derivatives of {of}, d ln(quantity) / d ln(key).")
        from compare.slopes import keys_without_logarithm

        if zeros := keys_without_logarithm(outcome.scene):
            said.append(f"0, of which there is no percent: {', '.join(zeros)}.")
        if len(names) > len(shown) and outcome.scene.kind == "free":
            said.append(f"Those of {len(names) - len(shown)} more probes are in summary.json and on the page.")
        if judged:
            verdicts = Counter(check.verdict for check in judged.values())
            tolerance = percent(next(iter(judged.values())).tolerance, 1)
            text = (
                f"1D follows {verdicts['agrees']} of {len(judged)} keys as 3D does, within {tolerance} of the largest"
            )
            mark = MARKS["unresolved"][style.ascii_only]
            left = (
                f" {mark}: {verdicts['unresolved']} are open within the slopes' errors; a smaller --accuracy decides."
            )
            said.append(f"{text}." + left * bool(verdicts["unresolved"]))
        still = [short_key(key) for key in _keys(found) if _size(found, key, names) < LEAST]
        if style.page and still:
            said.append(f"No quantity follows {', '.join(still)}.")
        return Section("Sensitivities", [Table(("% for each percent of", *heads), rows), *said], headed=False)

    def document(self, found: AllSlopes, outcome: Outcome[Any]) -> dict[str, Any]:
        """{key: {quantity: {"fem3d": {"value", "error"}, "reduced1d": {"value"}}}}."""
        entries = dict[str, dict[str, Any]]()
        for key in _keys(found):
            entries[key] = {}
            models = [found[model] for model in ("fem3d", "reduced1d") if model in found]
            for name in dict.fromkeys(name for model in models for name in model.relative.get(key, ())):
                three, one = (_slope(found, model, key, name) for model in ("fem3d", "reduced1d"))
                entry = {} if three is None else {"fem3d": {"value": three.value, "error": three.error}}
                entry |= {} if one is None else {"reduced1d": {"value": one.value}}
                entries[key] |= {name: entry} if entry else {}
        return entries


def words(outcome: Outcome[Any]) -> dict[str, str]:
    """The quantities that have slopes, with their words."""
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
    """For each key the largest difference of both models' slopes, relative to the quantity's largest slope."""
    from compare.verdict import Check, judge

    if not {"fem3d", "reduced1d"} <= slopes.keys():
        return ()
    three, one, made = slopes["fem3d"], slopes["reduced1d"], []
    largest, tolerance = {name: three.largest(name) for name in names}, scene.tolerance("slope")
    for key in followed_keys(scene, slopes, names):
        in_3d, in_1d = three.relative.get(key, {}), one.relative.get(key, {})
        off = {
            name: (in_1d[name].value - in_3d[name].value) / largest[name]
            for name in names if name in in_3d and name in in_1d and largest[name] > NONE
        }  # fmt: skip
        if not off:
            continue
        name = max(off, key=lambda n: abs(off[n]))
        u_num = in_3d[name].error / largest[name]
        verdict = judge(off[name], tolerance, u_num)
        because = "" if verdict == "agrees" else _because(names[name], key, in_3d[name].value, in_1d[name].value)
        made.append(
            Check(
                f"{PREFIX}{key}", f"{names[name]}, d ln / d ln key", in_1d[name].value, in_3d[name].value, "1",
                off[name], tolerance, u_num, verdict, because=because, relative_to="the largest slope of the quantity",
            )
        )  # fmt: skip
    return tuple(made)


def worst(made: Iterable[Check]) -> Check | None:
    """The check of a slope that differs most."""
    differ = [check for check in made if check.id.startswith(PREFIX) and check.verdict == "differs"]
    return max(differ, key=lambda check: abs(check.difference), default=None)


def sentence(made: Iterable[Check]) -> str:
    """The worst of the checks of slopes in a sentence; empty where there are none."""
    slopes = [check for check in made if check.id.startswith(PREFIX)]
    if not slopes:
        return ""
    if (check := worst(slopes)) is not None:
        return f"The 1D model {check.because}."
    open_ = sum(check.verdict == "unresolved" for check in slopes)
    said = "The 1D model follows every key as 3D does"
    return f"{said}, as far as the errors tell: {open_} of {len(slopes)} are open." if open_ else f"{said}."


def _because(word: str, key: str, in_3d: float, in_1d: float) -> str:
    how = f"how the {word} follows {key}"
    slopes = f"{in_1d:+.3f} in place of {in_3d:+.3f} % for each percent"
    if in_1d * in_3d <= 0:
        if abs(in_1d) <= NONE:
            return f"does not see {how}: {slopes}"
        return f"has {how} the wrong way round: {slopes}" if abs(in_3d) > NONE else f"invents {how}: {slopes}"
    ratio = abs(in_1d / in_3d) - 1
    return f"{'overrates' if ratio > 0 else 'underrates'} {how} by {percent(abs(ratio))}: {slopes}"


def _cell(slopes: Mapping[str, Slopes], key: str, name: str, style: Style, both: bool) -> str:
    """The slopes of 3D and of 1D, to three places; zero has no sign."""
    three, one = (_slope(slopes, model, key, name) for model in ("fem3d", "reduced1d"))
    if three is None and one is None:
        return ""
    left, right = (
        "" if slope is None else f"{slope.value:+.3f}" if abs(slope.value) >= 5e-4 else "0.000"
        for slope in (three, one)
    )
    if three is not None and style.page:
        left += f" {style.plus_minus} {three.error:.4f}"
    return f"{left:>6} {right:>6}" if both else left or right


def _first(slopes: Mapping[str, Slopes]) -> Slopes:
    return next(iter(slopes.values()))


def _slope(slopes: Mapping[str, Slopes], model: str, key: str, name: str) -> Any:
    return slopes[model].relative.get(key, {}).get(name) if model in slopes else None


def _keys(slopes: Mapping[str, Slopes]) -> list[str]:
    models = [slopes[model] for model in ("fem3d", "reduced1d") if model in slopes]
    return list(dict.fromkeys(key for model in models for key in model.relative))


def _size(slopes: Mapping[str, Slopes], key: str, names: Iterable[str]) -> float:
    """The largest slope by a key, in size."""
    each = (_slope(slopes, model, key, name) for model in ("fem3d", "reduced1d") for name in names)
    return max((abs(slope.value) for slope in each if slope is not None), default=0.0)
