"""Checks of a sink of several spans, of which the paper says that they "are all equivalent, and the theory below
applies to them all". Each is against 3D, with the sentence that says why the two differ.

The innermost span is that of the highest number, an outer one is span 1. Over time the largest difference from 10 us on
is taken, as for the paper's figures (`compare.figure_checks`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import combinations

import numpy as np

from compare import figure_checks
from compare.figure_checks import SETTLED, Largest
from compare.verdict import FIRST_TIME, PAPERS, Comparison, Models, of_formula, relative, spread
from reduced1d.ladder.lumps import half_island
from reduced1d.sink import anchor_series_resistance
from scenes.formats import percent, quantity, signed
from scenes.plan import Request
from scenes.result import Estimate, Result
from scenes.sink import Sink, different

WHAT = {"inner": "inner peak", "outer": "outer peak", "mean": "mean", "current": "current"}


def key_of(sink: Sink, what: str, steady: bool = True) -> str:
    """The quantity that a check is of, steady or as a trace."""
    rise = "_rise_K" if steady else "_K"
    return {
        "inner": f"span{different(sink.spans)}_peak{rise}", "outer": f"span1_peak{rise}", "mean": f"mean{rise}",
        "current": "current_A",
    }[what]  # fmt: skip


def steady(what: str, models: Models) -> Comparison:
    """A steady quantity of the 1D model less that of 3D, over the latter."""
    key = key_of(models.sink, what)
    inputs = {"value": models.reduction().steady[key]}

    def because(predicted: float) -> str:
        unit = "A" if what == "current" else "K"
        off = f"{quantity(predicted, unit)} against {quantity(models.steady(key), unit)} in 3D"
        return f"{off}: {_causes(what, models)}"

    unit = "A" if what == "current" else "K"
    return of_formula(f"{WHAT[what]}, of 3D's", unit, lambda value: value, inputs, models.fem3d.steady[key], because)


def over_time(what: str, models: Models) -> Comparison:
    """The largest distance of a trace over the final 3D rise, or of the current over itself."""
    key, final = key_of(models.sink, what, steady=False), models.fem3d.steady[key_of(models.sink, what)]
    title = f"{WHAT[what]} trace, of {'itself' if what == 'current' else 'final rise'}"
    because = partial(_on_the_way, what)
    return figure_checks.over_time(models, key, final, title, "the final 3D value", because)


def equivalent(models: Models) -> Comparison:
    """How far apart two of the spans, or a span and one sink alone, are in 3D: the largest relative difference of
    their peaks and of their means."""
    single = models.single
    assert single is not None
    worst: tuple[float, str, str, Estimate, Estimate, float] | None = None
    for what in ("peak", "mean"):
        rises = {"one sink alone": single.steady[f"{what}_rise_K"]}
        for number in range(1, different(models.sink.spans) + 1):
            rises[f"span {number}"] = models.fem3d.steady[f"span{number}_{what}_rise_K"]
        for (a, one), (b, other) in combinations(rises.items(), 2):
            difference = relative(one.value, other.value)
            if worst is None or abs(difference) > abs(worst[0]):
                u_num = spread(relative, {"predicted": one, "measured": other})
                worst = difference, f"the {what} of {a}", b, one, other, u_num
    assert worst is not None
    difference, first, second, one, other, u_num = worst
    return Comparison(
        "spans apart, or from one", one.value, other.value, "K", difference, u_num,
        lambda: (
            f"{first} is {quantity(one.value, 'K')}, that of {second} {quantity(other.value, 'K')}: {_apart(models)}"
        ),
        relative_to=f"that of {second}",
    )  # fmt: skip


def equivalent_over_time(models: Models) -> Comparison:
    """The same of their traces: the largest distance of two of them, over the final rise of the second."""
    single = models.single
    assert single is not None
    assert single.traces is not None
    three, room = models.fem3d.traces, models.sink.room_temperature
    assert three is not None
    late = np.concatenate([[FIRST_TIME], three.time[three.time > FIRST_TIME]])
    worst: tuple[float, str, str, float, float, float, float] | None = None
    for what in ("peak", "mean"):
        curves = {"one sink alone": (single, f"{what}_K")}
        for number in range(1, different(models.sink.spans) + 1):
            curves[f"span {number}"] = models.fem3d, f"span{number}_{what}_K"
        found = {name: _course(result, key, late) for name, (result, key) in curves.items()}
        for (a, (x, x_error, _)), (b, (y, y_error, final)) in combinations(found.items(), 2):
            i = int(np.abs(x - y).argmax())
            inputs = {"distance": Estimate(float(x[i] - y[i]), x_error + y_error), "final": final}
            difference = inputs["distance"].value / final.value
            if worst is None or abs(difference) > abs(worst[0]):
                u_num = spread(lambda distance, final: distance / final, inputs)
                worst = difference, f"the {what} of {a}", b, float(x[i]), float(y[i]), u_num, float(late[i])
    assert worst is not None
    difference, first, second, one, other, u_num, time = worst
    return Comparison(
        "spans apart, or from one, trace", one - room, other - room, "K", difference, u_num,
        lambda: (
            f"{first} is {quantity(one - room, 'K')} at {quantity(time, 's', 3)}, that of {second} "
            f"{quantity(other - room, 'K')}; when steady {_apart(models)}"
        ),
        time, relative_to=f"the final value of {second}",
    )  # fmt: skip


def _course(result: Result, key: str, late: np.ndarray) -> tuple[np.ndarray, float, Estimate]:
    """A 3D trace at some times (s), its error, with that of straight lines between its rows, and the final rise."""
    traces, final = result.traces, result.steady[key.replace("_K", "_rise_K")]
    assert traces is not None
    error = traces.errors[key] + result.details["sink"].accuracy * abs(final.value)
    return np.interp(late, traces.time, traces.values[key]), error, final


def _apart(models: Models) -> str:
    """Why spans differ from each other, and from one sink alone."""
    found, end = models.fem3d.details["profile"], quantity(models.steady("end_rise_K"), "K")
    anchor = quantity(models.steady("anchor_resistance_K_per_W"), "K/W")
    island = quantity(float(np.interp(models.sink.length, found["y_m"], found["rise_K"])), "K", 3)
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
    """Why the steady values differ, of the paper's model with what each part alone makes of them."""
    if models.reduction().model not in PAPERS:
        return f"see --why; {_circuit(models)}"
    sink, one = models.sink, models.reduction().steady
    ratio = models.steady("current_A") / one["current_A"].value
    if what == "current":
        return f"1D has no resistance there, but {_circuit(models)}"
    heat = 1 / ratio**2 - 1
    value = one[key_of(sink, what)].value
    left = relative(value * ratio**2, models.steady(key_of(sink, what)))
    said = (
        f"1D leaves the islands out of the circuit, {_circuit(models)}, and so heats each span by "
        f"{percent(heat, sign=True)}; with 3D's current it would be {percent(left, sign=True)} off"
    )
    wide = sink.island_width < sink.width * (1 - 1e-9)
    narrow = ", leaves out that heat gathers from the whole beam's width" if wide else ", is taken at one temperature"
    island = f"half a block alone, {quantity(half_island(sink), 'K/W')}{narrow}"
    if what == "inner":
        return f"{said}, for {island}"
    printed, found = anchor_series_resistance(sink), models.steady("anchor_resistance_K_per_W")
    anchor = f"eq 14's anchor has {quantity(printed, 'K/W')}, 3D's {quantity(found, 'K/W')}"
    return f"{said}, for {anchor}, and {island}"


def _on_the_way(what: str, models: Models, trace: str, at: Largest, final: float) -> str:
    """The time of the largest difference, and whether the steady one is its cause."""
    sink, key, unit = models.sink, key_of(models.sink, what), "A" if what == "current" else "K"
    rest = models.reduction().steady[key].value - models.steady(key)
    where = f"largest at {quantity(at.time, 's', 3)}, {signed(at.distance, unit)}; {signed(rest, unit)} when steady"
    if what == "current":
        return f"{where}: {_causes(what, models)}"
    if rest * at.distance > 0 and abs(rest) > SETTLED * abs(at.distance):
        return f"{where}: the steady state's gap"
    number = 1 if what == "outer" else different(sink.spans)
    ratio = []
    for traces in models.traces():
        peak, mean = (
            float(np.interp(at.time, traces.time, traces.values[f"span{number}_{of}_K"])) - sink.room_temperature
            for of in ("peak", "mean")
        )
        ratio.append(peak / mean)
    crossing = sink.length**2 * sink.silicon.heat_capacity / (np.pi**2 * sink.silicon.thermal_conductivity)
    heat = (models.reduction().steady["current_A"].value / models.steady("current_A")) ** 2 - 1
    return (
        f"{where}: 1D heats each span by {percent(heat, sign=True)}, and until heat has crossed it, L^2/(pi^2 D) = "
        f"{quantity(crossing, 's', 3)}, a profile is flatter in the middle and steeper at its ends than the fixed "
        f"parabola of eq 9: in span {number} the peak is {ratio[0]:.2f} of the mean in 1D then, {ratio[1]:.2f} in 3D"
    )


DEFINITIONS: dict[str, Callable[[Models], Comparison]] = {
    "islands_peak_inner": partial(steady, "inner"),
    "islands_peak_outer": partial(steady, "outer"),
    "islands_mean": partial(steady, "mean"),
    "islands_current": partial(steady, "current"),
    "islands_equivalent": equivalent,
    "islands_peak_inner_over_time": partial(over_time, "inner"),
    "islands_peak_outer_over_time": partial(over_time, "outer"),
    "islands_mean_over_time": partial(over_time, "mean"),
    "islands_current_over_time": partial(over_time, "current"),
    "islands_equivalent_over_time": equivalent_over_time,
}

FOLLOWED = {
    "islands_peak_inner": "inner peak", "islands_peak_outer": "outer peak", "islands_mean": "mean",
    "islands_current": "current", "islands_equivalent": "spans alike",
}  # fmt: skip
"""The checks that are followed, and what a curve of one is called."""
SPANS = (2, 3, 5, 10, 30, 100)
LENGTHS = (0.25, 0.5, 1.0, 2.0, 4.0)
"""Times the sink's own island; those longer than a span are left out."""


@dataclass(frozen=True)
class Varied:
    """The difference of each check (by id) for some ``values`` of a ``key``, of which ``own`` is the sink's."""

    key: str
    own: float
    values: tuple[float, ...]
    differences: tuple[dict[str, float], ...]


def varied(sink: Sink, reduction: str, single: Result, say: Callable[[str], None]) -> tuple[Varied, Varied]:
    """How the steady differences run with the number of spans, and with the length of an island: other rows, solved by
    both models. Raises RunawayError where a row has no steady state."""
    from fem3d.run import solve as solve_3d
    from reduced1d import ladder

    request = Request(transient=False)

    def differences(other: Sink) -> dict[str, float]:
        say(f"{other.spans} spans with islands of {other.island * 1e6:.4g} um")
        models = Models(
            other, solve_3d(other, request), ladder.solve(other, reduction, steady_only=True), single
        )  # fmt: skip
        kept = [c for c in FOLLOWED if other.spans > 2 or c != "islands_peak_inner"]
        return {check: DEFINITIONS[check](models).difference for check in kept}

    lengths = tuple(factor * sink.island for factor in LENGTHS if factor * sink.island <= sink.length)
    return (
        Varied("sink.spans", sink.spans, SPANS, tuple(differences(replace(sink, spans=n)) for n in SPANS)),
        Varied(
            "sink.island_length", sink.island, lengths,
            tuple(differences(replace(sink, island_length=length)) for length in lengths),
        ),
    )  # fmt: skip
