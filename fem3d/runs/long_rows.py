"""How many spans of a long row are solved, and what the others add to the errors.

Span by span the difference d_k that a row's outer end makes falls like r^k, so that those further inside are alike. In
a row cut short both ends act on the innermost span m: what is there and wouldn't be in the long row is at most 2 d_m,
and the difference of the last two, |T_m - T_(m-1)|, is at least d_(m-1) (1 - r)^2. r is that of the chain of
resistances, along a span and down through an island, or what the last three spans show if that is larger.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from fem3d.adaptivity.mesh import Answer
from fem3d.runs.span_quantities import OF_SPAN
from scenes.result import Estimate, Traces
from scenes.sink import SLOWEST, Sink, decay, different

T = TypeVar("T")

SHARE = 0.1  # spans that are not solved may add this fraction of the accuracy


def modelled(sink: Sink) -> int:
    """How many spans are solved at first; five at least, to see how fast their differences fall."""
    inner = max(3, int(np.ceil(np.log(SHARE * sink.accuracy) / np.log(decay(sink)))))
    return allowed(sink, 2 * inner - 1)


def allowed(sink: Sink, count: int) -> int:
    """An odd number of spans, so that the middle of one ends the half that is solved; all where that is hardly more."""
    return sink.spans if count + 1 >= sink.spans else count


class Apart(NamedTuple):
    """By how much of its rises a span, and of its heat an island, that is not solved may differ from the innermost that
    is, steady or over time."""

    spans: float = 0.0
    islands: float = 0.0

    def within(self, accuracy: float) -> bool:
        """Whether that is little enough: rises are what an accuracy is of, heats are known far better than it."""
        return self.spans <= SHARE * accuracy and self.islands <= accuracy / 2


def apart(sink: Sink, count: int, answer: Answer) -> Apart:
    """How the spans and islands that are not solved differ, by those of the ``count`` that are."""
    if count == sink.spans:
        return Apart()
    # An island is nearer to the other end than a span by half a period, and half of the bound does.
    spans = [_far(sink, answer, [f"span{k}_{what}" for k in range(different(count), 0, -1)]) for what in OF_SPAN]
    slowest = max(r for r, _ in spans)
    islands = _far(sink, answer, [f"island{k}_heat" for k in range(count // 2, 0, -1)])[1]
    bounds = [2 * r / (1 - r) ** 2 * last for r, last in spans]
    return Apart(max(bounds), slowest / (1 - slowest) ** 2 * islands)


def _far(sink: Sink, answer: Answer, names: list[str]) -> tuple[float, float]:
    """r, and the last difference over the innermost value, of what is the same of each span or island, from the
    innermost on."""
    steady = answer.fine.quantities
    values = [np.atleast_1d(steady[f"{n}_W" if f"{n}_W" in steady else f"{n}_rise_K"]) for n in names[:3]]
    if answer.response is not None:
        traces = answer.response.traces
        room = sink.room_temperature
        over_time = [traces[f"{n}_W"] if f"{n}_W" in traces else traces[f"{n}_K"] - room for n in names[:3]]
        values = [np.append(a, b) for a, b in zip(values, over_time, strict=True)]
    differences = [float(np.abs(a - b).max()) for a, b in pairwise(values)]
    seen = differences[0] / max(differences[1], 1e-300) if len(differences) > 1 else 0.0
    return min(max(decay(sink), seen), SLOWEST), differences[0] / float(np.abs(values[0]).max())


def of_all(sink: Sink, count: int, answer: Answer, off: Apart) -> tuple[dict[str, Estimate], Traces | None]:
    """The steady quantities and the traces of all spans, with errors in which those that are not solved are ``off``."""
    rise = float(answer.fine.quantities["mean_rise_K"])
    warm = sink.silicon.temperature_coefficient * rise

    def share(name: str) -> float:
        if name in ("current_A", "power_W"):
            # The current follows a rise by what that changes the resistance.
            return off.spans * min(abs(warm / (1 + warm)), 1.0)
        return off.islands if name.startswith(("island", "heat_out")) else off.spans

    values, scales = answer.fine.quantities, {n: abs(float(v)) for n, v in answer.fine.quantities.items()}
    errors = {n: e + share(n) * scales[n] for n, e in answer.errors.items()}
    steady = repeated(sink, count, {n: Estimate(float(v), errors[n]) for n, v in values.items()})
    response = answer.response
    if response is None:
        return steady, None
    scales |= {n.replace("_rise_K", "_K"): v for n, v in scales.items()}
    of_traces = {n: e + share(n) * scales[n] for n, e in response.errors.items()}
    return steady, Traces(
        response.times, repeated(sink, count, response.traces), repeated(sink, count, of_traces)
    )  # fmt: skip


def repeated(sink: Sink, count: int, values: Mapping[str, T]) -> dict[str, T]:
    """What is known of each span and island, by names such as "span2_mean_K", of those too that are not solved."""
    repeated = dict(values)
    kinds = (("span", different(count), different(sink.spans)), ("island", count // 2, sink.spans // 2))
    for name, value in values.items():
        for kind, last, number in kinds:
            if name.startswith(f"{kind}{last}_"):
                repeated |= {name.replace(str(last), str(k), 1): value for k in range(last + 1, number + 1)}
    return repeated
