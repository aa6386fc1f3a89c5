"""The lines of the plan are true of the run."""

from dataclasses import replace

from fem3d import run
from meshes import symmetry
from scenes.plan import Request
from scenes.sink import Sink
from tests.fem3d import silicon


def lines(sink, request=None):
    result = run.solve(replace(sink, accuracy=1e-2), request or Request(transient=False))
    return {s.step: s for s in result.details["plan"]}, result


def test_pads_carry_no_unknowns_between_electrodes_at_the_beam_s_ends():
    found, result = lines(Sink())
    assert found["electric unknowns in oxide-0, pad-0"].state == "skipped"
    conductor = result.details["answer"].fine.state.conductor
    mesh = conductor.heat.mesh
    assert {mesh.boxes[b.box].name for b in conductor.blocks} == {"beam"}
    assert conductor.free == result.details["electric_unknowns"]
    inside = conductor.number.reshape(mesh.shape)[:, mesh.coordinates()[1].reshape(mesh.shape)[0, :, 0] < -1e-9]
    assert (inside == -1).all()


def test_pads_are_part_of_the_circuit_between_electrodes_at_their_edges():
    found, result = lines(Sink(electrodes="pad-edge"))
    assert found["electric unknowns in oxide-0"].state == "skipped"
    assert "pad-0" in found["electric problem"].reason
    conductor = result.details["answer"].fine.state.conductor
    assert {conductor.heat.mesh.boxes[b.box].name for b in conductor.blocks} == {"beam", "pad-0"}


def test_without_a_temperature_coefficient_one_step_is_enough():
    found, result = lines(Sink(silicon=silicon(0.0)))
    assert "electric iteration" not in found
    assert result.details["answer"].fine.state.steps == 1
    iterated, result = lines(Sink())
    steps = result.details["answer"].fine.state.steps
    assert iterated["electric iteration"].state == "done"
    assert iterated["electric iteration"].reason.startswith(f"{steps} coupled")
    assert steps > 1


def test_what_is_skipped_is_absent():
    found, result = lines(Sink())
    assert found["transient"].state == "skipped"
    assert result.traces is None
    found, result = lines(Sink(), Request())
    assert found["transient"].state == "done"
    states = result.details["answer"].response.transient.reduced.states
    assert found["transient"].reason.endswith(f"projected on {states} fields")
    assert len(result.traces.time) > 10


def test_the_pattern_of_the_current_is_followed_where_the_plan_says_so():
    for sink in (Sink(), Sink(voltage=10.0, electrodes="pad-edge")):
        found, result = lines(sink)
        state = result.details["answer"].fine.state
        assert (found["current pattern when hot"].state == "done") == state.follows_pattern
        assert len(state.patterns) == (2 if state.follows_pattern else 1)


def test_the_symmetric_part_is_named_and_the_plan_before_agrees_with_the_plan_after():
    sink = Sink()
    found, result = lines(sink)
    assert symmetry.reduce(sink.scene()).part == "the quarter"
    assert "the quarter is solved" in found["symmetry"].reason
    before = {s.step: s.state for s in run.plan(sink, Request(transient=False))}
    after = {s.step: s.state for s in result.details["plan"]}
    assert set(before) == set(after)
    assert all(before[name] == after[name] for name in before if name != "current pattern when hot")


def test_only_1d_plans_no_3d():
    (only,) = run.plan(Sink(), Request(models=("reduced1d",)))
    assert only.state == "skipped"
