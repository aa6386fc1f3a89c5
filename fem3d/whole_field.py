"""The steady state of a free scene with a field that can be looked at: a few more levels where the probes need none."""

from __future__ import annotations

from collections.abc import Callable

from fem3d import adapt, field_error, level, reach
from fem3d.adapt import Answer
from fem3d.errors import NumericsError
from fem3d.study import Study
from meshes import grading

MOST_LEVELS = 6  # more than the probes need
MOST_GROWTH = 2.0  # times the nodes that the probes need
FREELY = 3_000  # nodes that any scene may have
MOST = 30_000  # nodes beyond which the probes decide alone


def solve(study: Study, progress: Callable[[str], None] = lambda _: None) -> Answer:
    """The steady state with every probe within the accuracy, and then with the field within the study's bound for it,
    if a few levels of no more than a few times the cost reach that; the answer says how far off it is.

    Raises what `fem3d.adapt.solve` does.
    """
    best = adapt.solve(study, False, progress)
    assert study.field is not None
    features = grading.features(study.part.scene)
    state = best.fine.state
    most = max(min(MOST_GROWTH * state.heat.mesh.solid.sum(), MOST), FREELY)
    for number in range(best.levels + 1, best.levels + 1 + MOST_LEVELS):
        if best.field <= study.field:
            break
        mesh = field_error.refined(state)
        if mesh.solid.sum() > most or reach.entries(mesh) > reach.MOST_ENTRIES:
            break
        try:
            fine = level.solution(study, mesh, reported=True)
            here = level.examined(study, mesh, fine, features)
        except NumericsError:
            break
        state = fine.state
        progress(f"level {number}, for the field: {state.heat.size} unknowns")
        if here.accepted(study.accuracy):
            assert here.lesser is not None
            off = field_error.of(state, *(lesser.state for lesser in here.lesser))
            if off < best.field:
                best = Answer(fine, here.errors, None, number, off)
    return best
