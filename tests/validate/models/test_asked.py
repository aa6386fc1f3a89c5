"""What a model is asked for over time, and how often."""

from dataclasses import dataclass, field

import numpy as np

from scenes.result import Result, Traces
from validate.models import Answer, Asked
from validate.models.asked import solve

END = 1e-3
QUESTION = Asked("scene", {}, {}, {"tip": "K"}, {}, {})


@dataclass
class Recording:
    """A model that notes the times that it is asked about; of a ``smooth`` one each answer stands."""

    smooth: bool
    name: str = "recording"
    asked: list[np.ndarray] = field(default_factory=list)

    def rows(self, question: Asked) -> np.ndarray:
        return np.empty(0)

    def steady(self, question: Asked) -> Answer:
        return {}, {}

    def over_time(self, question: Asked, times: np.ndarray) -> Answer:
        self.asked.append(times)
        return {"tip": 300.0 + 10 * (1 - np.exp(-times / 1e-4))}, {"tip": 1e-4 * len(self.asked)}


def traces(model: Recording) -> Traces:
    time = np.linspace(0.0, END, 5)
    fem3d = Result("fem3d", {}, Traces(time, {"tip": 300.0 + 10 * time / END}, {"tip": 0.0}))
    answer = solve(model, QUESTION, fem3d, 1e-3, False, lambda _: None).traces
    assert answer is not None
    return answer


def test_a_model_without_noise_is_asked_about_no_time_twice_but_the_last() -> None:
    often, once = Recording(False), Recording(True)
    expected, found = traces(often), traces(once)
    assert len(once.asked) > 2
    assert np.array_equal(found.time, expected.time)
    assert np.array_equal(found.values["tip"], expected.values["tip"])
    assert found.errors["tip"] == 1e-4 * len(once.asked)  # the largest of all answers

    def repeated(model: Recording) -> int:
        times = np.concatenate([asked[:-1] for asked in model.asked])
        return len(times) - len(np.unique(times))

    assert repeated(once) == 0
    assert repeated(often) > 0
