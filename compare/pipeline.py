"""A run, from a scene and options to an outcome, and functions of packages above this one, found by entry points.

A run plans, solves, checks, analyses and answers; nothing is written.
"""

from collections.abc import Callable
from typing import Any

from compare.analyses import chosen
from compare.kinds import kind_of
from compare.models import Model, chosen_model, open_model
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.slopes import remarks
from scenes.errors import NumericsError, SceneError
from scenes.result import Step

PLUGINS: dict[str, Callable[..., Any]] = {}
"""By name: "write" writes a results folder, "sweep" solves many designs, "report" and "excerpt" show a run."""


def plan(scene: Any, options: Options, outcome: Outcome[Any] | None = None) -> tuple[Step, ...]:
    """Return the steps of a run before it is solved, or of an ``outcome``, but for files. Raises SceneError."""
    kind = kind_of(scene)
    kind.refuse(scene, options)
    return (*kind.steps(scene, options, outcome), *(analysis.plan(scene, options) for analysis in chosen(options)))


def solve(scene: Any, options: Options, progress: Progress | None = None, answer: bool = True) -> Outcome[Any]:
    """Solve a scene, compare its models, run the analyses that the options choose, and, unless it is not needed, state
    the answer.

    Raises SceneError where a model refuses, and ArithmeticError (RunawayError, NumericsError) where its numerics fail.
    Where the user's own model fails, `Outcome.failure` has the error, and the 3D result is kept.
    """
    progress, kind, analyses = progress or Progress(), kind_of(scene), chosen(options)
    kind.refuse(scene, options)
    outcome = Outcome(kind.declared(scene, options), options)
    own = chosen_model(scene, options.model)
    model = None if own is None else open_model(*own)
    for analysis in analyses:
        with progress.stage(analysis.name):
            analysis.prepare(outcome, progress)
    outcome.results = kind.solve(outcome.scene, options, progress, outcome.fem3d)
    if outcome.fem3d is not None:
        outcome.scene = outcome.fem3d.details.get("scene", outcome.scene)
        if model is not None:
            _ask_own_model(outcome, model, progress)
    outcome.plan = plan(outcome.scene, outcome.options, outcome)
    with progress.stage("checks"):
        outcome.checks = kind.checks(outcome)
        outcome.alarms = (*outcome.alarms, *kind.alarms(outcome))
        outcome.warn(*kind.warnings(outcome))
    if options.follows_keys:
        progress("sensitivities")
        with progress.stage("sensitivities"):
            keys = None if options.sensitivities else list(options.uncertain.relative)
            outcome.slopes = kind.slopes(outcome, keys)
            outcome.warn(*remarks(outcome.slopes))
    for analysis in analyses:
        with progress.stage(analysis.name):
            found = analysis.run(outcome, progress)
        if found is not None:
            outcome.analyses[analysis.name] = found
    if answer:
        with progress.stage("answer"):
            outcome.answer = kind.answer(outcome)
    outcome.timing = progress.timing()
    return outcome


def _ask_own_model(outcome: Outcome[Any], model: Model, progress: Progress) -> None:
    """Add the answer of the user's own model; where it fails or is interrupted, 3D is kept without it."""
    try:
        with progress.stage("reduced1d"):
            outcome.results["reduced1d"] = model.solve(outcome.scene, outcome.solved, progress)
    except (KeyboardInterrupt, NumericsError, SceneError) as error:
        why = f"{model.name} was interrupted" if isinstance(error, KeyboardInterrupt) else str(error)
        outcome.failure = error
        if isinstance(error, NumericsError):
            why = f"{model.name} has no answer: {error}"
            outcome.failure = NumericsError(why)
        outcome.alarms = (f"{why}; what 3D found is kept, and nothing is compared with it",)
        outcome.options = outcome.options.but(only="3d", model="", why=False)


def plugin(name: str) -> Callable[..., Any]:
    """Return a function by its name. Raises SceneError where no installed package has it."""
    if name not in PLUGINS:
        from importlib.metadata import entry_points

        found = next(iter(entry_points(group="compare", name=name)), None)
        if found is None:
            raise SceneError(f'no installed package has the function "{name}": pip install this project')
        PLUGINS[name] = found.load()
    return PLUGINS[name]
