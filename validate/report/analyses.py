"""What a run found because it was asked for, as sections: how well the inputs are known and what that makes of the run,
and the budget of a difference."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.verdict import COVERS
from scenes.formats import cut, difference_text, percent, quantity, signed
from scenes.parameters import SECTION
from scenes.varied import kind_of
from validate.inputs.sensitivities import PREFIX
from validate.report.table import MARKS, Row, Section, Style, Table, sentences, stacked
from validate.run import kinds

if TYPE_CHECKING:
    from compare.blame import Budget, Part, Split
    from validate.inputs.calibration import Fit
    from validate.inputs.left_out import Found, LeftOut
    from validate.inputs.propagation import Propagated, Sampled
    from validate.inputs.sensitivities import Sensitivities, Slope
    from validate.inputs.validation import Validation
    from validate.run.outcome import Outcome

MOST = 3
"""Probes of a free scene whose sensitivities a terminal shows."""
_PER_BLOCK = 3
"""Columns of a budget that a terminal has room for."""
_LEAST = 5e-5
"""Smaller slopes are shown as zero."""
_NOTHING = 1e-6
"""Uncertainties below this part of u_val are shown as 0."""
_V20 = (
    "As ASME V&V 20 has it: the comparison error E = S - D, simulation less data, is known to u_val, of the numerics, "
    "the inputs and the data. Each line is of the mean over a window of the trace, the worst of up to 16 and the last: "
    "the error of the model itself lies within E - k u_val and E + k u_val (95 %), with k = 2, of the worst up to 3."
)


def short(key: str) -> str:
    """A key without its section, where it is as clear: "silicon.density"."""
    for section in ("materials.", "environment.", "material.", "boundary.", "box."):
        key = key.removeprefix(section)
    return key


def followed(outcome: Outcome[Any], full: bool = False) -> dict[str, str]:
    """The quantities whose sensitivities are shown, with what they are called."""
    kind, slopes = kinds.of(outcome.scene), outcome.sensitivities
    names = {name: called for name, (called, _) in kind.quantities(outcome).items()}
    if slopes is not None and slopes.values:
        names = {name: called for name, called in names.items() if name in slopes.values}
    return names if full else {name: names[name] for name in kind.SHOWN or list(names)[:MOST]}


def sensitivities(slopes: Sensitivities, outcome: Outcome[Any], style: Style) -> Section:
    """A line for each key that any of the quantities follows, that first which one follows most: 3D, then 1D."""
    names = followed(outcome, style.page)
    judged = {check.id.removeprefix(PREFIX): check for check in outcome.checks if check.id.startswith(PREFIX)}
    rows, both = [], any(s.reduced1d is not None for by_name in slopes.steady.values() for s in by_name.values())
    for key in slopes.sorted(names):
        cells = [short(key), *(_pair(slopes.steady[key].get(name), style, both) for name in names)]
        rows.append(Row(cells, judged[key].verdict if key in judged else ""))
    heads = [f"{called}\n{'3D':>6}{'1D':>8}" if both else stacked(called) for called in names.values()]
    said = []
    if style.page:
        what = "what each quantity is at most" if slopes.course and slopes.values else "the steady state"
        said.append(f"Logarithmic derivatives of {what}, d ln(quantity) / d ln(key).")
    if slopes.zeros:
        said.append(f"0, of which there is no percent: {', '.join(slopes.zeros)}.")
    if len(slopes.values) > len(names):
        said.append(f"Those of {len(slopes.values) - len(names)} more probes are in summary.json and on the page.")
    if judged:
        verdicts = Counter(check.verdict for check in judged.values())
        tolerance = percent(next(iter(judged.values())).tolerance, 1)
        as_3d = f"1D follows {verdicts['agrees']} of {len(judged)} keys as 3D does, within {tolerance} of the largest"
        mark = MARKS["unresolved"][style.ascii_only]
        open_ = f"{mark}: of {verdicts['unresolved']} the slopes' own errors leave it open; a smaller --accuracy tells"
        said.append(f"{as_3d}. {open_}." if verdicts["unresolved"] else f"{as_3d}.")
    still = [
        short(key)
        for key, by_name in slopes.steady.items()
        if max((s.size for s in by_name.values()), default=0.0) < _LEAST
    ]
    if style.page and still:
        said.append(f"Nothing of it follows {', '.join(still)}.")
    return Section("Sensitivities", [Table(("% for each percent of", *heads), rows), *said], headed=False)


def _pair(slope: Slope | None, style: Style, both: bool) -> str:
    """Of a slope 3D's and 1D's, to three places; nothing has no sign."""
    if slope is None:
        return ""
    three = None if slope.fem3d is None else slope.fem3d.value
    in_3d, right = (
        "" if value is None else f"{value:+.3f}" if abs(value) >= 5e-4 else "0.000"
        for value in (three, slope.reduced1d)
    )  # fmt: skip
    if slope.fem3d is not None and style.page:
        in_3d += f" {style.plus_minus} {slope.fem3d.error:.4f}"
    return f"{in_3d:>6} {right:>6}" if both else in_3d


def propagated(inputs: Propagated, outcome: Outcome[Any], style: Style) -> Section:
    """The standard uncertainties that were given, and a line for each quantity: u_input of both models and of their
    difference, and the key that adds most; then those of the checks, and what samples say."""
    inputs_text = ", ".join(f"{short(key)} {percent(u)}" for key, u in inputs.uncertain.relative.items())
    correlated = "".join(f"; {short(a)} and {short(b)} {r:+g}" for (a, b), r in inputs.uncertain.correlations.items())
    quantities = kinds.of(outcome.scene).quantities(outcome)
    heads, rows = ["u_input of", "3D", "1D", "1D/3D - 1", "most by"], []
    for name, (called, unit) in quantities.items():
        both = [
            quantity(deviations[name], unit, 2) if name in deviations else ""
            for deviations in (inputs.fem3d, inputs.reduced1d)
        ]
        off = percent(inputs.difference[name]) if name in inputs.difference else ""
        rows.append([cut(called, 30), *both, off, short(inputs.most.get(name, ""))])
    if not inputs.reduced1d:
        heads, *rows = [[*row[:2], row[4]] for row in (heads, *rows)]
    checks = [f"{check.id} {percent(check.u_input)}" for check in outcome.checks if check.u_input is not None]
    parts: list[str | Table] = [
        f"Inputs known to (standard uncertainty): {inputs_text}{correlated}.",
        Table(heads, rows),
        f"of the differences: {', '.join(checks)}" if checks else "",
    ]
    parts += [] if outcome.sampled is None else [_samples(outcome.sampled, quantities)]
    return Section("Uncertain inputs", parts, headed=False)


def _samples(sampled: Sampled, quantities: Mapping[str, tuple[str, str]]) -> Table:
    """What the samples spread by, beside what linear propagation makes of it."""
    rows = []
    for name, (called, unit) in quantities.items():
        row = [called]
        for spreads in (sampled.fem3d, sampled.reduced1d):
            spread = spreads.get(name)
            both = ("", "") if spread is None else (spread.deviation, spread.linear)
            row += [value if isinstance(value, str) else quantity(value, unit, 3) for value in both]
        rows.append(row)
    return Table((f"of {sampled.count - sampled.failed} samples", "3D", "linear", "1D", "linear"), rows)


def entered(entries: dict[str, Any], inputs: Propagated, sampled: Sampled | None) -> None:
    """Puts u_input beside the error of every steady quantity of a summary, and the inputs themselves."""
    for model, deviations in (("fem3d", inputs.fem3d), ("reduced1d", inputs.reduced1d)):
        for name, u in deviations.items():
            # Of a transient it is that of the largest size.
            entries[model]["steady"].setdefault(name, {})["u_input"] = u
    entries["uncertain"] = {
        "relative": inputs.uncertain.relative,
        "correlations": [{"keys": list(keys), "value": r} for keys, r in inputs.uncertain.correlations.items()],
        "difference": {name: {"u_input": u} for name, u in inputs.difference.items()},
    }
    if sampled is not None:
        entries["monte_carlo"] = asdict(sampled)


def fit(fitted: Fit, outcome: Outcome[Any], style: Style) -> Section:
    """A line for each fitted key: from, to, and its uncertainty; then the resulting scene."""
    rows, scene = [], dict[str, list[str]]()
    for key, value in fitted.fitted.items():
        ends = (f"{v:.4g}" for v in fitted.interval(key))
        rows.append([short(key), f"{fitted.start[key]:.4g}", f"{value:.4g}", percent(fitted.u[key]), *ends])
        section, _, name = key.rpartition(".")
        unit = kind_of(fitted.scene, key).dimension.unit if section == SECTION else ""
        # To six digits: no data tell a key to more.
        shown = float(f"{value:.6g}")
        line = f'{name} = "{shown!r} {unit}"' if unit else f"{name} = {shown!r}"
        scene.setdefault(section, [f"[{section}]"]).append(line)
    return Section(
        "Calibration",
        [
            Table(("fitted", "from", "to", "u", "95 % between", "and"), rows),
            f"Misfit {fitted.misfit:.3g} of {fitted.points} points; values in SI units. The scene that results:",
            [line for lines in scene.values() for line in lines],
            "A model that is fitted to data is not validated by them: what follows says how well it fits, other data "
            "whether it is right.",
        ],
        headed=False,
    )


def validation(result: Validation, outcome: Outcome[Any], style: Style) -> Section:
    """A line for each model and quantity where it is worst and at the end: E, its parts, and the model's error."""
    heads = ("S - D", "mean over", *["E"] * style.page, "u_num", "u_input", "u_D", "u_val", "model's error")
    rows = []
    for s in result.statements:
        unit, parts = s.unit, []
        for u in (s.u_num, s.u_input, s.u_data, s.u_val):
            parts.append("?" if not np.isfinite(u) else quantity(u, unit, 2) if u > _NOTHING * s.u_val else "0")
        middle = [signed(s.E, unit, 2)] * style.page
        rows.append([f"{cut(s.called, 20)} {s.model}", s.when(), *middle, *parts, s.said()])
    points = [
        f"{c.called} {c.model} {int((np.abs(c.error) <= COVERS * c.u_val).sum())} of {len(c.times)}"
        for c in result.courses
    ]
    at_rest = outcome.against is not None and outcome.against.at_rest
    exact = " and ".join(["the inputs"] * (not result.inputs) + ["the data"] * (not result.data))
    return Section(
        "Validation",
        [
            _V20 if style.page else "",
            Table(heads, rows),
            "" if at_rest else "The worst window and the last.",
            "Where 0 is within (95 %), no error of the model is seen.",
            f"Points of the data within 2 u_val: {', '.join(points)}.",
            f"Taken as exact: {exact}." if exact else "",
        ],
        headed=False,
    )


def left_out(study: LeftOut, outcome: Outcome[Any], style: Style) -> Section:
    """By effect the changes of the steady state, the largest first; what decides is the first line of the run."""
    shown = [q for q in study.called if style.page or q in kinds.of(outcome.scene).SHOWN]

    def row(called: str, each: Found) -> Row:
        if not each.changes:
            return Row([called, *["runs away"] * len(shown)], below=each.assumed)
        cells = (difference_text(c.value, c.error, style.plus_minus) for c in (each.changes[q] for q in shown))
        said = f"{each.assumed}; {each.source}" if each.source and style.page else each.assumed
        return Row([called, *cells], below=said)

    rows = [row(name.replace("_", " "), each) for name, each in study.effects.items()]
    if study.together is not None:
        rows.append(row("together", study.together))
        rows.append(Row(["their sum", *(percent(study.sum[q], sign=True) for q in shown)]))
    skipped = [f"{name.replace('_', ' ')} is not here: {why}" for name, why in study.skipped.items()]
    parts: list[Table | str | Sequence[str]] = []
    if rows:
        parts.append(Table(("left out", *(study.called[q] for q in shown)), rows))
        parts.append("Changes of the 3D steady state with each effect, over that without.")
    return Section("What both models leave out", [*parts, sentences(skipped)], headed=True)


def why(causes: Budget, outcome: Outcome[Any], style: Style) -> Section:
    """Its parts in percent of the final rise or of the current or its change, then the sentence."""
    from compare.blame import of_current

    over_time = causes.transient
    scale = "what else 3D finds" if causes.start == "network" else f"the {of_current(outcome.scene)}"
    most = len(causes.steady) if style.page else _PER_BLOCK
    blocks = [causes.steady[n : n + most] for n in range(0, len(causes.steady), most)]
    parts: list[Table | str] = [
        f"in % of the final rise, or of {scale}",
        *(_parts("steady state", block, style) for block in blocks),
    ]
    if over_time:
        heads = [split.quantity for split in over_time]
        same = all(
            abs(p.value - q.value) <= p.error + q.error
            for s, t in zip(causes.steady, over_time, strict=True)
            for p, q in zip(s.parts, t.parts, strict=True)
        )
        when = ", ".join(dict.fromkeys(quantity(split.time or 0.0, "s", 3) for split in over_time))
        said = f"over time the whole is largest at {when}: as in the steady state"
        parts.append(said if same else _parts("when it is largest", over_time, style))
        rows = _rows(over_time, lambda part: part.largest or 0.0, _at_its_time, style)
        parts += ["each at its largest from 10 us on (they do not add up)", Table(("", *heads), rows)]
    said = f"{causes.sentence[0].upper()}{causes.sentence[1:]}."
    return Section(f"Why {named(causes.start)} differs from 3D", [*parts, said])


def named(reduction: str) -> str:
    return "the paper's model" if reduction == "paper" else reduction


def budget(causes: Budget) -> dict[str, Any]:

    def part(given: Part) -> dict[str, Any]:
        when = {} if given.when is None else {"largest": given.largest, "largest_time_s": given.when}
        return {"assumption": given.blame, "value": given.value, "error": given.error} | when

    def split(given: Split) -> dict[str, Any]:
        whole = {"unit": given.unit, "scale": given.scale, "difference": {"value": given.total, "error": given.error}}
        when = {} if given.time is None else {"time_s": given.time}
        return whole | {"parts": [part(p) for p in given.parts]} | when

    return {
        "reduction": causes.start,
        "sentence": causes.sentence,
        "steady": {given.quantity: split(given) for given in causes.steady},
        "transient": {given.quantity: split(given) for given in causes.transient},
    }


def _parts(title: str, splits: Sequence[Split], style: Style) -> Table:
    """What each part adds, and the whole."""
    heads = [s.quantity if s.time is None else f"{s.quantity} at {quantity(s.time, 's', 3)}" for s in splits]
    rows = _rows(splits, lambda p: p.value, lambda p, split: _cell(p.value, p.error, split.scale, style), style)
    return Table((title, *heads), [*rows, ["in all", *(_cell(s.total, s.error, s.scale, style) for s in splits)]])


def _rows(
    splits: Sequence[Split], value: Callable[[Part], float], cell: Callable[[Part, Split], str], style: Style
) -> list[Row]:
    """A row for each part; those that are nothing but their numerical error in one, with their names below."""
    names = [part.blame for part in splits[0].parts]
    nothing = [n for n in range(len(names)) if all(abs(value(s.parts[n])) <= s.parts[n].error for s in splits)]
    if len(nothing) < 2:
        nothing = []
    shown = [n for n in range(len(names)) if n not in nothing]
    rows = [Row([names[n], *(cell(split.parts[n], split) for split in splits)]) for n in shown]
    if nothing:
        zeros = (_cell(0.0, max(s.parts[n].error for n in nothing), abs(s.scale), style) for s in splits)
        cells = [f"{len(nothing)} others, each", *(zero.replace("+", "", 1) for zero in zeros)]
        rows.append(Row(cells, below=", ".join(names[n] for n in nothing)))
    return rows


def _at_its_time(part: Part, split: Split) -> str:
    off = percent((part.largest or 0.0) / split.scale, 2, sign=True).removesuffix(" %") if split.scale else "-"
    return f"{off} at {quantity(part.when or 0.0, 's', 3)}"


def _cell(value: float, error: float, scale: float, style: Style) -> str:
    if not scale:
        return "-"
    return difference_text(value / scale, error / abs(scale), style.plus_minus).removesuffix(" %")
