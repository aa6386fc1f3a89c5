"""How many spans of a long row are solved, and what the others add to the errors.

Span by span the difference d_k that a row's outer end makes falls like r^k, so that those further inside are alike. In
a row cut short both ends act on the innermost span m: what is there and wouldn't be in the long row is at most 2 d_m,
and the difference of the last two, |T_m - T_(m-1)|, is at least d_(m-1) (1 - r)^2. r is that of the chain of
resistances, along a span and down through an island, or what the last three spans show if that is larger.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TypeVar

import numpy as np

from fem3d import span_quantities
from fem3d.adapt import Answer
from scenes.result import Estimate, Traces
from scenes.sink import Sink, different

T = TypeVar("T")

SHARE = 0.1  # of the accuracy: what spans that are not solved may add
SLOWEST = 0.9  # of r: what falls more slowly is solved whole


def modelled(sink: Sink) -> int:
    """How many spans are solved at first."""
    inner = max(2, int(np.ceil(np.log(SHARE * sink.accuracy) / np.log(decay(sink)))))
    return allowed(sink, 2 * inner - 1)


def allowed(sink: Sink, count: int) -> int:
    """An odd number of spans, so that the middle of one ends the half that is solved; all where that is hardly more."""
    return sink.spans if count + 1 >= sink.spans else count


def decay(sink: Sink) -> float:
    """r of the chain: r + 1/r = 2 + R_span / R_island."""
    along = sink.length / (sink.silicon.thermal_conductivity * sink.cross_section)
    down = sink.oxide_thickness / (sink.oxide.thermal_conductivity * sink.island * sink.island_width)
    half = 1 + along / down / 2
    return min(half - float(np.sqrt(half**2 - 1)), SLOWEST)


def apart(sink: Sink, count: int, answer: Answer) -> float:
    """By how much of its rise a span that is not solved may differ from the innermost of ``count`` that are, steady or
    over time; 0 where all are solved."""
    if count == sink.spans:
        return 0.0
    m, worst = different(count), 0.0
    for what in span_quantities.OF_SPAN:
        rises = [np.atleast_1d(answer.fine.quantities[f"span{k}_{what}_rise_K"]) for k in range(m, max(m - 3, 0), -1)]
        if answer.response is not None:
            over_time = [answer.response.traces[f"span{k}_{what}_K"] for k in range(m, max(m - 3, 0), -1)]
            rises = [np.append(a, b - sink.room_temperature) for a, b in zip(rises, over_time, strict=True)]
        differences = [float(np.abs(a - b).max()) for a, b in pairwise(rises)]
        seen = differences[0] / max(differences[1], 1e-300) if m > 2 else 0.0
        r = min(max(decay(sink), seen), SLOWEST)
        worst = max(worst, 2 * r / (1 - r) ** 2 * differences[0] / float(np.abs(rises[0]).max()))
    return worst


def of_all(sink: Sink, count: int, answer: Answer, off: float) -> tuple[dict[str, Estimate], Traces | None]:
    """The steady quantities and the traces of all spans, with errors in which those that are not solved are ``off``."""
    rise = float(answer.fine.quantities["mean_rise_K"])
    warm = sink.silicon.temperature_coefficient * rise
    # The current follows a rise by what that changes the resistance.
    share = {name: off * min(abs(warm / (1 + warm)), 1.0) for name in ("current_A", "power_W")}
    values, scales = answer.fine.quantities, {n: abs(float(v)) for n, v in answer.fine.quantities.items()}
    errors = {n: e + share.get(n, off) * scales[n] for n, e in answer.errors.items()}
    steady = _repeated(sink, count, {n: Estimate(float(v), errors[n]) for n, v in values.items()})
    response = answer.response
    if response is None:
        return steady, None
    scales |= {n.replace("_rise_K", "_K"): v for n, v in scales.items()}
    of_traces = {n: e + share.get(n, off) * scales[n] for n, e in response.errors.items()}
    return steady, Traces(
        response.times, _repeated(sink, count, response.traces), _repeated(sink, count, of_traces)
    )  # fmt: skip


def _repeated(sink: Sink, count: int, of: Mapping[str, T]) -> dict[str, T]:
    """What is known of each span and island, by names such as "span2_mean_K", of those too that are not solved."""
    found = dict(of)
    kinds = (("span", different(count), different(sink.spans)), ("island", count // 2, sink.spans // 2))
    for name, value in of.items():
        for kind, last, number in kinds:
            if name.startswith(f"{kind}{last}_"):
                found |= {name.replace(str(last), str(k), 1): value for k in range(last + 1, number + 1)}
    return found
