"""What a run says of how sure its inputs are, in the same way of every kind of scene."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from scenes.plan import Request
from validate.run import kinds
from validate.run.outcome import Outcome, Run


def followed(request: Request) -> bool:
    """Whether numbers of the scene are followed: it is solved whole then, for one of one side changes that side
    alone."""
    return request.sensitivities or request.uncertain is not None


def told(run: Run, outcome: Outcome[Any]) -> Outcome[Any]:
    """The outcome with how its quantities follow the scene's keys, where asked for, and what uncertain keys make of
    them and of the checks."""
    request, uncertain = run.request, run.request.uncertain
    if not followed(request):
        return outcome
    run.say("sensitivities")
    with run.clock.stage("sensitivities"):
        from validate.inputs import propagation, sensitivities

        kind = kinds.of(outcome.scene)
        found = kind.sensitivities(outcome)
        outcome = replace(outcome, warnings=(*outcome.warnings, *found.remarks()))
        if uncertain is not None:
            propagated = propagation.propagated(uncertain, found, *kind.steady(outcome, found))
            outcome = replace(outcome, propagated=propagated)
            checks, warnings = kind.judged(outcome, propagated, run)
            outcome = replace(outcome, checks=checks, warnings=(*outcome.warnings, *warnings))
        if request.sensitivities:
            called = {name: called for name, (called, _) in kind.quantities(outcome).items()}
            made = sensitivities.checks(outcome.scene, found, called)
            # Where there is an answer, how the model follows the keys is a part of it.
            said = sensitivities.sentence(made) if outcome.answer else ""
            answer = f"{outcome.answer} {said}".rstrip()
            outcome = replace(outcome, sensitivities=found, answer=answer, checks=(*outcome.checks, *made))
    return outcome
