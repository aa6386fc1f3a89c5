"""Validation against measured traces, as ASME V&V 20-2009 has it (sections 1-5 and 1-6).

The comparison error is E = S - D, simulation less data, of 3D as of a 1D model. It is known to the validation
uncertainty u_val,
u_val^2 = u_num^2 + u_input^2 + u_D^2: of the numerics, of the inputs, of the data. The error of the model itself lies
within E -+ k u_val. Over time E is the mean over a window of the trace (`compare.windows`), for one of many noisy
samples is far off by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare import quantities, windows
from compare.against import Data, known_to, simulated
from compare.verdict import COVERS
from compare.windows import Window
from scenes.formats import span, with_error
from scenes.result import Result

U_input = Callable[[str, np.ndarray, np.ndarray], np.ndarray]
"""(times,): the u_input of a quantity, by its name, at times (s) and with its values there."""


@dataclass(frozen=True)
class Statement:
    """What follows for a ``model`` ("3D" or "1D") and a ``quantity`` of traces.csv, which a
    user has a word for (``called``) from a time to another (s), infinite in the steady state, ``where`` |E| is surely
    largest, or at the end of the data: the mean E over so many ``rows``, its standard uncertainties, and how many of
    them, ``k``, make an interval of 95 %; all in the quantity's ``unit``."""

    model: str
    quantity: str
    called: str
    unit: str
    where: str
    start: float
    end: float
    rows: int
    E: float
    u_num: float
    u_input: float
    u_data: float
    k: float

    @property
    def u_val(self) -> float:
        """The validation uncertainty."""
        return float(np.sqrt(self.u_num**2 + self.u_input**2 + self.u_data**2))

    @property
    def seen(self) -> bool:
        """Whether the model's error shows above what is not known."""
        return abs(self.E) > self.k * self.u_val

    @property
    def interval(self) -> tuple[float, float]:
        """Where the model's error lies (95 %)."""
        return self.E - self.k * self.u_val, self.E + self.k * self.u_val

    def said(self) -> str:
        """Where the model's error lies (95 %), in words: "-0.016 to +0.044 K"."""
        half = self.k * self.u_val
        if not np.isfinite(half):
            return "not known"
        _, _, unit, places, factor = with_error(self.E, half, self.unit)
        low, high = (f"{end * factor:+.{places}f}" for end in self.interval)
        return f"{low} to {high} {unit}"

    def when(self) -> str:
        """The time that it is of, in words."""
        return "steady state" if np.isinf(self.end) else span(self.start, self.end)

    def document(self) -> dict[str, Any]:
        """As the summary has it."""
        document = asdict(self) | {"u_val": self.u_val, "interval": list(self.interval)}
        document |= {"start_s": document.pop("start"), "end_s": document.pop("end")}
        return document | {"seen": self.seen, "said": self.said()}


@dataclass(frozen=True)
class Course:
    """A model's quantity, word and unit at the data's ``times`` (s): simulation, data, three uncertainties."""

    model: str
    quantity: str
    called: str
    unit: str
    times: np.ndarray
    simulated: np.ndarray
    measured: np.ndarray
    u_num: np.ndarray
    u_input: np.ndarray
    u_data: np.ndarray

    @property
    def error(self) -> np.ndarray:
        """E."""
        return self.simulated - self.measured

    @property
    def u_val(self) -> np.ndarray:
        """The validation uncertainty."""
        return np.sqrt(self.u_num**2 + self.u_input**2 + self.u_data**2)

    def statements(self) -> tuple[Statement, ...]:
        """What follows where the model is surely furthest off, and at the end."""
        means = windows.windows(self.times, self.error, self.u_data, windows.cut(self.simulated))
        others = [float(np.hypot(self.u_num, self.u_input)[window.rows].mean()) for window in means]
        i, k = windows.worst(means, others)
        last = len(means) - 1
        worst = (self._over(means[i], "worst", k),) if i != last else ()
        return (*worst, self._over(means[last], "end", COVERS))

    def _over(self, window: Window, where: str, k: float) -> Statement:
        rows, times = window.rows, self.times[window.rows]
        return Statement(
            self.model, self.quantity, self.called, self.unit, where, float(times[0]), float(times[-1]), len(times),
            window.distance, float(self.u_num[rows].mean()), float(self.u_input[rows].mean()), window.u_data, k,
        )  # fmt: skip


@dataclass(frozen=True)
class Validation:
    """The courses of both models and what follows; whether inputs and data were given uncertainties."""

    courses: tuple[Course, ...]
    inputs: bool
    data: bool

    @property
    def statements(self) -> tuple[Statement, ...]:
        """Those of every course."""
        return tuple(statement for course in self.courses for statement in course.statements())

    def document(self) -> dict[str, Any]:
        """As the summary has it."""
        within = [
            {"model": c.model, "quantity": c.quantity, "points": len(c.times),
             "within_2_u_val": int((np.abs(c.error) <= COVERS * c.u_val).sum())}
            for c in self.courses
        ]  # fmt: skip
        return {"statements": [s.document() for s in self.statements], "points": within}


def finding(validation: Validation) -> str:
    """What is seen of the errors of both models, in a line: where each is surely furthest off, of its own unit."""
    said = []
    for model in dict.fromkeys(course.model for course in validation.courses):
        seen = [s for s in validation.statements if s.model == model and s.seen]
        worst = max(seen, key=lambda s: abs(s.E) / s.u_val, default=None)
        at = (
            ""
            if worst is None
            else f"{worst.called} {worst.said()} {'in the' if np.isinf(worst.end) else 'over'} {worst.when()}"
        )
        said.append(f"no error of {model} is seen" if worst is None else f"{model} is off: {at}")
    text = "; ".join(said)
    return f"{text[0].upper()}{text[1:]}"


def validate(scene: Any, data: Data, models: Sequence[tuple[str, Result, U_input | None]]) -> Validation:
    """The validation of models, by what they are called, against data; with the u_input of their quantities, ``None``
    where the inputs are taken as exact. Estimated errors of the models count as u_num in full."""
    catalogue = quantities.of(scene, models[0][1])
    late = catalogue.sure(data.time)
    times, courses = data.time[late], []
    for word, key in catalogue.names.items():
        for called, result, u_of in models:
            answers = result.steady if data.at_rest else result.traces.values if result.traces else {}
            if key not in data.values or key not in answers:
                continue
            values = simulated(result, key, times)
            u_num = np.full(len(times), known_to(result, key, times))
            u_input = np.zeros(len(times)) if u_of is None else u_of(key, times, values)
            u_data = data.u[key][late] if key in data.u else np.zeros(len(times))
            measured = data.values[key][late]
            courses.append(
                Course(called, key, word, catalogue.units[key], times, values, measured, u_num, u_input, u_data)
            )
    return Validation(tuple(courses), any(u is not None for _, _, u in models), bool(data.u))
