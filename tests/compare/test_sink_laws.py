"""A sink whose silicon conducts less when it is hot: solved in 3D, refused or taken at room temperature in 1D."""

from dataclasses import replace

import numpy as np
import pytest

from compare.kinds import KINDS
from compare.options import Options
from compare.pipeline import solve as answer
from reduced1d import ladder
from scenes.errors import SceneError
from scenes.laws import PowerLaw
from scenes.sink import Sink

LAW = PowerLaw(130.0, 293.0, -1.3)
SINK = replace(Sink(voltage=2.0, accuracy=1e-2), silicon=replace(Sink().silicon, thermal_conductivity=LAW))


def test_law_is_charged_to_step_from_plate_to_3d():
    outcome = answer(SINK, Options(steady=True, why=True))
    (peak,) = [split for split in outcome.analyses["why"].steady if split.quantity == "peak"]
    parts = {part.blame: part.value for part in peak.parts}
    plain = ladder.solve(SINK.plain, "plate", steady_only=True).steady["peak_rise_K"].value
    in_3d = outcome.fem3d.steady["peak_rise_K"].value
    assert in_3d - plain > 15.0
    assert parts["properties at room temperature"] == pytest.approx(plain - in_3d, rel=1e-3)
    assert sum(parts.values()) == pytest.approx(peak.total, rel=1e-9)
    assert "properties at room temperature" in outcome.answer
    # The paper's equations stay, and all their checks are made.
    assert outcome.reduced1d.steady == ladder.solve(SINK.plain, "paper", steady_only=True).steady
    made = KINDS["sink"].made(SINK, Options(steady=True))
    assert [check.id for check in outcome.checks] == list(made)
    assert {"fig4", "eq16"} <= set(made)
    (eq16,) = [check for check in outcome.checks if check.id == "eq16"]
    assert "of its value at room temperature" in eq16.because


@pytest.mark.parametrize("name", ["fin-massless", "fin", "plate", "moments:3"])
@pytest.mark.parametrize(("sink", "said"), [(SINK, "follows the temperature"), (Sink(emissivity=0.7), "radiates")])
def test_models_from_fin_on_refuse_laws_and_radiation(sink, said, name):
    with pytest.raises(SceneError, match=said):
        ladder.solve(sink, name, steady_only=True)


def test_paper_and_anchored_take_numbers_at_room_temperature():
    times = np.array([0.0, 1e-4, 1e-2])
    silicon = replace(SINK.silicon, specific_heat=PowerLaw(712.0, 293.0, 0.3))
    sink = replace(SINK, silicon=silicon, emissivity=0.7)
    for name in ("paper", "anchored"):
        found, plain = (ladder.solve(each, name, times=times) for each in (sink, Sink(voltage=2.0)))
        assert found.steady == plain.steady
        assert all(np.array_equal(found.traces.values[n], v) for n, v in plain.traces.values.items())
