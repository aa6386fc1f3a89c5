"""The checks of a sink against 3D, by id: the paper's equations and figures, and the equivalence of several spans.

Span 1 is an outer span, the highest number an innermost one. Over time the largest difference from 10 us on counts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from compare import sink_checks
from compare.against import Largest, from_first, over_time
from compare.made import made_checks
from compare.options import Options
from compare.sink_checks import SETTLED, at_rest, crossing_time, gap, resistances, rises_at
from compare.verdict import PAPERS, Check, Comparison, Models, judged, relative, spread, unit_of
from reduced1d.ladder.lumps import half_island
from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES, OF_THE_PAPER, OF_THE_REDUCTION, OF_THE_SPANS
from scenes.formats import percent, quantity, signed
from scenes.result import Estimate, Result
from scenes.sink import Sink, different

WHAT = {"peak_inner": "inner peak", "peak_outer": "outer peak", "mean": "mean", "current": "current"}


def evaluate(
    sink: Sink, options: Options, fem3d: Result, reduced1d: Result | None, single: Result | None = None
) -> tuple[Check, ...]:
    """Make the checks that the run allows (`compare.made`), in their order.

    ``reduced1d`` has its traces at the times of ``fem3d``. ``single`` is 3D of one span alone, for a row of spans;
    without it the check of the spans' equivalence is left out.
    """
    models = Models(sink, fem3d, reduced1d, single)
    another = reduced1d is not None and reduced1d.model not in PAPERS
    # What a row's checks find is told whether they agree or not: two faults may offset each other.
    checks = (
        judged(name, DEFINITIONS[name](models), sink, name in ISLAND_TOLERANCES)
        for name in made_checks(sink, options)
        if (single is not None or name not in OF_THE_SPANS) and _answers(models, name)
    )
    return tuple(replace(check, own=not (another and check.id in OF_THE_PAPER)) for check in checks)


def _answers(models: Models, check: str) -> bool:
    if check not in OF_THE_REDUCTION:
        return True
    what, reduced1d = check.removeprefix("islands_").removesuffix("_over_time"), models.reduction()
    key = _OF_FIGURES.get(check) or key_of(models.sink, what)
    over_time = check.endswith("_over_time") or (check in _OF_FIGURES and check != "fig4")
    return key.replace("_rise_K", "_K") in reduced1d.over_time.values if over_time else key in reduced1d.steady


_OF_FIGURES = {
    "fig4": "peak_rise_K", "fig6_peak": "peak_rise_K", "fig6_end": "end_rise_K", "fig7_current": "current_A",
}  # fmt: skip
"""The steady quantity that each check of the paper's figures compares."""


def key_of(sink: Sink, what: str) -> str:
    inner = f"span{different(sink.spans)}_peak_rise_K"
    return {"peak_inner": inner, "peak_outer": "span1_peak_rise_K", "mean": "mean_rise_K", "current": "current_A"}[what]


def _steady(what: str, models: Models) -> Comparison:
    key = key_of(models.sink, what)

    def because(predicted: float) -> str:
        unit = unit_of(key)
        off = f"{quantity(predicted, unit)} against {quantity(models.steady(key), unit)} in 3D"
        return f"{off}; {_causes(what, models)}"

    return at_rest(models, key, f"{WHAT[what]}, of 3D's", because)


def _over_time(what: str, models: Models) -> Comparison:
    """The largest distance of a trace over the final 3D rise, or of the current over itself."""
    key = key_of(models.sink, what)
    title = f"{WHAT[what]} trace, of {'itself' if what == 'current' else 'final rise'}"
    because = partial(_on_the_way, what)
    final = models.fem3d.steady[key]
    return over_time(models, key.replace("_rise_K", "_K"), final, title, "the final 3D value", because)


def _pairs(models: Models) -> Iterator[tuple[str, str, tuple[Result, str], tuple[Result, str]]]:
    assert models.single is not None
    for what in ("peak", "mean"):
        sources = {"one sink alone": (models.single, what)}
        sources |= {f"span {n}": (models.fem3d, f"span{n}_{what}") for n in range(1, different(models.sink.spans) + 1)}
        for (a, one), (b, other) in combinations(sources.items(), 2):
            yield f"the {what} of {a}", b, one, other


def _equivalent(models: Models) -> Comparison:
    """The largest relative difference in 3D, of peaks and of means, between two spans or a span and one sink alone."""
    pairs = [
        (first, second, a.steady[f"{one}_rise_K"], b.steady[f"{other}_rise_K"])
        for first, second, (a, one), (b, other) in _pairs(models)
    ]
    first, second, one, other = max(pairs, key=lambda pair: abs(relative(pair[2].value, pair[3].value)))
    return Comparison(
        "spans apart, or from one", one.value, other.value, "K", relative(one.value, other.value),
        spread(relative, {"predicted": one, "measured": other}),
        lambda: (
            f"{first} is {quantity(one.value, 'K')}, that of {second} {quantity(other.value, 'K')}: {_apart(models)}"
        ),
        relative_to=f"that of {second}",
    )  # fmt: skip


def _equivalent_over_time(models: Models) -> Comparison:
    fem3d, room = models.fem3d.over_time, models.sink.room_temperature
    late, distances = from_first(fem3d.time), []
    for first, second, *both in _pairs(models):
        (x, x_error, _), (y, y_error, final) = (_course(result, name, late) for result, name in both)
        i = int(np.abs(x - y).argmax())
        inputs = {"distance": Estimate(float(x[i] - y[i]), x_error + y_error), "final": final}
        u_num = spread(lambda distance, final: distance / final, inputs)
        off = inputs["distance"].value / final.value
        distances.append((off, u_num, first, second, float(x[i]) - room, float(y[i]) - room, float(late[i])))
    difference, u_num, first, second, one, other, time = max(distances, key=lambda entry: abs(entry[0]))
    return Comparison(
        "spans apart, or from one, trace", one, other, "K", difference, u_num,
        lambda: (
            f"{first} is {quantity(one, 'K')} at {quantity(time, 's', 3)}, that of {second} {quantity(other, 'K')}; "
            f"when steady {_apart(models)}"
        ),
        time, relative_to=f"the final value of {second}",
    )  # fmt: skip


def _course(result: Result, name: str, late: np.ndarray) -> tuple[np.ndarray, float, Estimate]:
    traces, final, key = result.over_time, result.steady[f"{name}_rise_K"], f"{name}_K"
    error = traces.errors[key] + result.details["sink"].accuracy * abs(final.value)
    return np.interp(late, traces.time, traces.values[key]), error, final


def _apart(models: Models) -> str:
    """Why spans differ from each other, and from one sink alone."""
    profile, end = models.fem3d.details["profile"], quantity(models.steady("end_rise_K"), "K")
    anchor = quantity(models.steady("anchor_resistance_K_per_W"), "K/W")
    island = quantity(float(np.interp(models.sink.length, profile["y_m"], profile["rise_K"])), "K", 3)
    return (
        f"a span ends {end} above room at a pad, through {anchor}, and {island} at an island, which the next one's "
        f"heat enters too; and {_circuit(models)}"
    )


def _circuit(models: Models) -> str:
    sink = models.sink
    return (
        f"the beam goes on over {sink.spans - 1} island{'s' * (sink.spans > 2)} of {sink.island * 1e6:.4g} um, "
        f"{percent(1 - sink.spans * sink.length / sink.row_length)} of the row's resistance"
    )


def _causes(what: str, models: Models) -> str:
    if not models.papers():
        return f"see --why; {_circuit(models)}"
    if what == "current":
        return f"1D has no resistance there, but {_circuit(models)}"
    sink, reduced1d, key = models.sink, models.reduction().steady, key_of(models.sink, what)
    ratio = models.steady("current_A") / reduced1d["current_A"].value
    residual = relative(reduced1d[key].value * ratio**2, models.steady(key))
    said = (
        f"1D leaves the islands out of the circuit, {_circuit(models)}, and so heats each span by "
        f"{percent(1 / ratio**2 - 1, sign=True)}; with 3D's current it is {percent(residual, sign=True)} off"
    )
    wide = sink.island_width < sink.width * (1 - 1e-9)
    narrow = ", leaves out that heat gathers from the whole beam's width" if wide else ", is taken at one temperature"
    island = f"half a block alone, {quantity(half_island(sink), 'K/W')}{narrow}"
    return f"{said}; {island if what == 'peak_inner' else f'{resistances(models)}; {island}'}"


def _on_the_way(what: str, models: Models, trace: str, at: Largest, final: float) -> str:
    """The time of the largest difference, and whether the steady one is its cause."""
    sink, unit, rest = models.sink, unit_of(trace), gap(models, key_of(models.sink, what))
    where = f"largest at {quantity(at.time, 's', 3)}, {signed(at.distance, unit)}; {signed(rest, unit)} when steady"
    if what == "current":
        return f"{where}; {_causes(what, models)}"
    if rest * at.distance > 0 and abs(rest) > SETTLED * abs(at.distance):
        return f"{where}: the steady state's gap"
    number = 1 if what == "peak_outer" else different(sink.spans)
    peaks, means = (rises_at(models, at.time, f"span{number}_{kind}_K") for kind in ("peak", "mean"))
    heat = (models.reduction().steady["current_A"].value / models.steady("current_A")) ** 2 - 1
    return (
        f"{where}; 1D heats each span by {percent(heat, sign=True)}, and until heat has crossed it, L^2/(pi^2 D) = "
        f"{crossing_time(sink)}, a profile is flatter in the middle and steeper at its ends than the fixed "
        f"parabola of eq 9; in span {number} the peak is {peaks[0] / means[0]:.2f} of the mean in 1D then, "
        f"{peaks[1] / means[1]:.2f} in 3D"
    )


DEFINITIONS: dict[str, Callable[[Models], Comparison]] = {
    **{name: getattr(sink_checks, name) for name in DEFAULT_TOLERANCES},
    **{f"islands_{what}": partial(_steady, what) for what in WHAT},
    "islands_equivalent": _equivalent,
    **{f"islands_{what}_over_time": partial(_over_time, what) for what in WHAT},
    "islands_equivalent_over_time": _equivalent_over_time,
}
"""What makes each check; those of the paper's equations and figures are the functions of the same name."""

FOLLOWED = {**{f"islands_{what}": called for what, called in WHAT.items()}, "islands_equivalent": "spans alike"}
"""The checks whose dependence on the row is drawn, with the curve's name."""
SPANS = (2, 3, 5, 10, 30, 100)  # Numbers of spans for which the row is solved, to draw how its differences follow them.
LENGTHS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Island lengths that are solved, in units of the sink's own; those longer than a span are left out."""


@dataclass(frozen=True)
class Varied:
    """The difference of each check, by id, at some ``values`` of a ``key``; ``original`` is the sink's own value."""

    key: str
    original: float
    values: tuple[float, ...]
    differences: tuple[dict[str, float], ...]


def varied(sink: Sink, reduction: str, single: Result, say: Callable[[str], None]) -> tuple[Varied, Varied]:
    """Solve rows of other numbers of spans, and of other islands, by both models.

    Raises RunawayError where a row has no steady state.
    """
    from fem3d.runs.sink import solve as solve_3d
    from reduced1d import ladder

    def differences(changed: Sink) -> dict[str, float]:
        say(f"{changed.spans} spans with islands of {changed.island * 1e6:.4g} um")
        reduced1d = ladder.solve(changed, reduction, steady_only=True)
        models = Models(changed, solve_3d(changed, transient=False), reduced1d, single)
        kept = [c for c in FOLLOWED if changed.spans > 2 or c != "islands_peak_inner"]
        return {check: DEFINITIONS[check](models).difference for check in kept}

    lengths = tuple(factor * sink.island for factor in LENGTHS if factor * sink.island <= sink.length)
    rows, islands = [replace(sink, spans=n) for n in SPANS], [replace(sink, island_length=a) for a in lengths]
    return (
        Varied("sink.spans", sink.spans, SPANS, tuple(map(differences, rows))),
        Varied("sink.island_length", sink.island, lengths, tuple(map(differences, islands))),
    )
