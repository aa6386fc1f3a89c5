"""Validation against measured traces, as ASME V&V 20-2009 has it (sections 1-5 and 1-6).

At a time t the comparison error is E = S - D, simulation less data. It is known to the validation uncertainty u_val,
u_val^2 = u_num^2 + u_input^2 + u_D^2: of the numerics, of the inputs, of the data. The error of the model itself lies
within E -+ k u_val; where |E| < u_val all that can be said is that it is no larger than about u_val.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from compare.against import QUANTITIES, Data
from scenes.checks import FIRST_TIME
from scenes.errors import SceneError, did_you_mean, printable, quoted
from scenes.formats import quantity, signed
from scenes.result import Result
from scenes.sink import Sink
from scenes.units import UnitError, parse_quantity
from validate.inputs.propagation import Propagated, of_values, over_time

COVERS = 2.0
"""k: of a normal distribution 95 % lie within so many standard deviations (GUM 6.3.3)."""
_FORM = 'give 0.5K, 1%, peak=0.5K, or peak="a column of the file"'


@dataclass(frozen=True)
class Statement:
    """What follows for a ``model`` ("3D" or "1D") and a ``quantity`` of traces.csv at a ``time`` (s), ``where`` |E| is
    largest against u_val, or at the end of the data; all in the quantity's unit."""

    model: str
    quantity: str
    where: str
    time: float
    E: float
    u_num: float
    u_input: float
    u_data: float

    @property
    def u_val(self) -> float:
        """The validation uncertainty."""
        return float(np.sqrt(self.u_num**2 + self.u_input**2 + self.u_data**2))

    @property
    def seen(self) -> bool:
        """Whether the model's error shows above what is not known."""
        return abs(self.E) >= self.u_val

    @property
    def interval(self) -> tuple[float, float]:
        """Where the model's error lies (95 %)."""
        return self.E - COVERS * self.u_val, self.E + COVERS * self.u_val

    def said(self) -> str:
        """What follows, in words."""
        unit = self.quantity.rpartition("_")[2]
        if not self.seen:
            return f"|E| < u_val: no more than about {quantity(self.u_val, unit, 2)}"
        low, high = (signed(v, unit, 2) for v in self.interval)
        return f"{low} to {high}"

    def document(self) -> dict[str, Any]:
        """As the summary has it."""
        found = asdict(self) | {"time_s": self.time, "u_val": self.u_val, "interval": list(self.interval)}
        del found["time"]
        return found | {"seen": self.seen, "said": self.said()}


@dataclass(frozen=True)
class Course:
    """A quantity of a model at the ``times`` (s) of the data: simulation, data, the three uncertainties (times,)."""

    model: str
    quantity: str
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

    def at(self, i: int, where: str) -> Statement:
        """What follows at one of the times."""
        return Statement(
            self.model, self.quantity, where, float(self.times[i]), float(self.error[i]), float(self.u_num[i]),
            float(self.u_input[i]), float(self.u_data[i]),
        )  # fmt: skip


@dataclass(frozen=True)
class Validation:
    """The courses of both models, and what follows where they are worst and at the end; whether the inputs were said to
    be uncertain, and the data."""

    courses: tuple[Course, ...]
    inputs: bool
    data: bool

    @property
    def statements(self) -> tuple[Statement, ...]:
        """The worst and the last of each course."""
        found = []
        for course in self.courses:
            with np.errstate(divide="ignore", invalid="ignore"):
                against = np.nan_to_num(np.abs(course.error) / course.u_val)
            worst, last = int(against.argmax()), len(course.times) - 1
            found += [course.at(worst, "worst")] if worst != last else []
            found.append(course.at(last, "end"))
        return tuple(found)

    def document(self) -> dict[str, Any]:
        """As the summary has it."""
        within = [
            {"model": c.model, "quantity": c.quantity, "points": len(c.times),
             "within_2_u_val": int((np.abs(c.error) <= COVERS * c.u_val).sum())}
            for c in self.courses
        ]  # fmt: skip
        return {"statements": [s.document() for s in self.statements], "points": within}


def validate(
    sink: Sink,
    data: Data,
    u_data: Mapping[str, np.ndarray],
    models: Sequence[tuple[str, Result]],
    propagated: Propagated | None,
) -> Validation:
    """The validation of models ("3D" or "1D", with traces) against data whose standard uncertainties (times of the
    data,) are given by quantity. Estimated errors of the models count as u_num in full."""
    late = (data.time >= FIRST_TIME) & (data.time <= sink.end_time * (1 + 1e-9))
    times, courses = data.time[late], []
    for key in QUANTITIES.values():
        if key not in data.values:
            continue
        for name, result in models:
            traces = result.traces
            if traces is None:
                continue
            simulated = np.interp(times, traces.time, traces.values[key])
            u_num = np.full(len(times), traces.errors[key])
            u_input = np.zeros(len(times))
            if propagated is not None:
                u_input = trace_u_input(
                    sink, propagated, key, times, simulated, "fem3d" if name == "3D" else "reduced1d"
                )
            known = u_data[key][late] if key in u_data else np.zeros(len(times))
            courses.append(Course(name, key, times, simulated, data.values[key][late], u_num, u_input, known))
    return Validation(tuple(courses), propagated is not None, bool(u_data))


def trace_u_input(
    sink: Sink, propagated: Propagated, key: str, times: np.ndarray, values: np.ndarray, model: str
) -> np.ndarray:
    """(times,): the u_input of a trace, in its unit; not a number where its derivatives aren't known."""
    keys, covariance = list(propagated.uncertain.relative), propagated.uncertain.covariance()
    by = {k: {key: over_time(propagated.sensitivities, k, key, times, model)} for k in keys}
    own = np.array([of[key] for of in of_values(sink, {key: values}, by).values()])
    return np.sqrt(np.maximum(np.einsum("it,ij,jt->t", own, covariance, own), 0.0))


def data_uncertainty(sink: Sink, data: Data, given: Sequence[str]) -> dict[str, np.ndarray]:
    """The standard uncertainties (times of the data,) by quantity, from what ``--data-uncertainty`` says: a number with
    a unit for all quantities that have it, a part in percent (of the rise, for temperatures), or a column of the file;
    a quantity in front means that one alone. Raises SceneError."""
    found: dict[str, np.ndarray] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if equals and name.strip() not in QUANTITIES:
            known = ", ".join(QUANTITIES)
            raise SceneError(
                f"--data-uncertainty {quoted(text)}: {printable(name)} is no quantity: give {known}"
                f"{did_you_mean(name.strip(), QUANTITIES)}"
            )
        said = (value if equals else text).strip()
        keys = [QUANTITIES[name.strip()]] if equals else [k for k in QUANTITIES.values() if k in data.values]
        own = {key: u for key in keys if (u := _known_to(sink, data, key, said)) is not None}
        if not own:
            raise SceneError(f"--data-uncertainty {quoted(text)} is one of no quantity of {data.name}: {_FORM}")
        if any((u <= 0).any() or not np.isfinite(u).all() for u in own.values()):
            raise SceneError(f"--data-uncertainty {quoted(text)}: an uncertainty must be more than nothing: {_FORM}")
        found |= own
    return found


def _known_to(sink: Sink, data: Data, key: str, said: str) -> np.ndarray | None:
    """(times of the data,): the uncertainty of a quantity, None where what is said is of another kind."""
    if key not in data.values:
        return None
    if said in data.others:
        return data.others[said]
    try:
        number, unit = parse_quantity(said)
    except UnitError:
        return None
    if said.endswith("%"):
        start = sink.room_temperature if key.endswith("_K") else 0.0
        # At the start a rise is nothing: half of the last digit of a double would do as well.
        return np.maximum(number * np.abs(data.values[key] - start), np.sign(number) * 1e-12)
    kind = {"K": (0, 0, 0, 0, 1), "A": (0, 0, 0, 1, 0), "W": (2, 1, -3, 0, 0)}[key.rpartition("_")[2]]
    if unit is None or unit.powers != kind:
        return None
    return np.full(len(data.time), number - 273.15 if unit.celsius else number)
