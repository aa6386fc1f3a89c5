"""Free scenes, of boxes or on a mesh: their probes in 3D, and a 1D model of the user's own where one is given."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from compare.kinds.base import STEADY, Kind
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.verdict import Check
from scenes import physics
from scenes.errors import RunawayInTimeError, SceneError, quoted
from scenes.model import OVER_TIME, UNITS, AnyScene, Schedule
from scenes.result import Result, Step, step

if TYPE_CHECKING:
    from compare.models import Model
    from compare.slopes import Slopes


class FreeKind(Kind[AnyScene]):
    name, call = "free", "compare.solve"
    traces, field = "a column for each probe", "heat"

    def quantities(self, scene: AnyScene) -> dict[str, tuple[str, str]]:
        return {probe.name: (probe.name, UNITS[probe.quantity]) for probe in scene.probes}

    def refuse(self, scene: AnyScene, options: Options) -> None:
        if not scene.probes and not physics.heat(scene):
            raise SceneError("the scene has no [[probe]] to report: add one")
        if options.why and options.model != "network":
            raise SceneError("--why asks which joint of the network is to blame: give --model network with it")
        if (own_model(scene, options) or ("",))[0] == "network":
            from reduced1d.network.lines import layout

            layout(scene)
        if (options.follows_keys or options.calibrate) and not scene.steady:
            if why := physics.nonlinear(scene, True):
                raise SceneError(f"{why}, and a sensitivity is then one of the steady state alone: add --steady")
            physics.refuse_terminals(scene, "a sensitivity over time")

    def declared(self, scene: AnyScene, options: Options) -> AnyScene:
        return probed(scene)

    def solve(self, scene: AnyScene, options: Options, progress: Progress) -> dict[str, Result]:
        with progress.stage("imports"):
            from fem3d.runs import scene as scene_run
        own = own_model(scene, options)
        progress("solving in 3D")
        with progress.stage("fem3d"):
            try:
                result = scene_run.solve(scene, progress, whole=options.follows_keys)
            except RunawayInTimeError as error:
                if options.export is not None or own is not None:
                    raise
                ended, result, runs_away = scene_run.until(scene, error, progress, whole=options.follows_keys)
                result = replace(result, details=result.details | {"scene": ended, "runs_away": runs_away})
            if own is not None and not scene.steady and not varies(scene):
                still = replace(scene, steady=True, output_times=())
                result = replace(result, steady=scene_run.solve(still, progress).steady)
        return {"fem3d": result}

    def open_model(self, scene: AnyScene, options: Options) -> Model | None:
        if (given := own_model(scene, options)) is None:
            return None
        from compare.models import open_model
        from compare.models.sampling import make_question

        model = open_model(*given)
        # A fault in the model's parameters, which are read from the scene, is one before 3D is solved.
        make_question(scene)
        return model

    def comparisons(self, outcome: Outcome[AnyScene]) -> dict[str, Check]:
        from compare.quantities import compare_probes

        if outcome.reduced1d is None:
            return {}
        return compare_probes(outcome.scene, outcome.solved, outcome.reduced1d)

    def alarms(self, outcome: Outcome[AnyScene]) -> tuple[str, ...]:
        from compare import hottest

        return hottest.warnings(hottest.in_3d(outcome.scene, outcome.solved))

    def warnings(self, outcome: Outcome[AnyScene]) -> tuple[str, ...]:
        scene, said = outcome.scene, [outcome.runs_away, *super().warnings(outcome)]
        if outcome.reduced1d is None and scene.model is not None and scene.model.file and not outcome.failure:
            said.append(f"the scene's model, {scene.model.file}, is a program, and runs only with --model scene")
        return tuple(said)

    def answer(self, outcome: Outcome[AnyScene], progress: Progress) -> str:
        if outcome.reduced1d is None:
            return ""
        from compare.blame import answer
        from compare.quantities import called

        name, probes = outcome.reduced1d.model, {probe.name for probe in outcome.scene.probes}
        checks = [check for check in outcome.checks if check.id.removesuffix(OVER_TIME) in probes]
        if not checks:
            return f"{name} and 3D have no quantity in common."
        far = [check for check in checks if check.time is not None and check.verdict == "differs"]
        worst = max(far, key=lambda check: abs(check.difference), default=None)
        claims = [
            replace(c, title=called(c.id.removesuffix(OVER_TIME)), because=c.because.partition("; ")[2] * (c is worst))
            for c in checks
        ]
        return answer(name, claims)

    def slopes(self, outcome: Outcome[AnyScene], keys: Sequence[str] | None) -> dict[str, Slopes]:
        from compare import slopes

        scene, reduced1d = outcome.scene, outcome.reduced1d
        made = {"fem3d": slopes.in_3d(scene, outcome.solved, keys)}
        if reduced1d is not None:
            model, followed = reduced1d.details["own_model"], made["fem3d"].relative
            made["reduced1d"] = slopes.own_model(model, scene, reduced1d, followed, outcome.solved)
        return made

    def plan_3d(self, scene: AnyScene, options: Options) -> Sequence[Step]:
        from fem3d.runs.scene import plan

        return plan(scene, whole=options.follows_keys)

    def describe_1d(self, scene: AnyScene, options: Options) -> str:
        own = own_model(scene, options)
        return "" if own is None else f"{getattr(own[0], '__name__', own[0])}, where 3D has an answer"

    def check_steps(self, scene: AnyScene, options: Options) -> list[Step]:
        return [step("checks", "of every probe that it answers")] * (own_model(scene, options) is not None)

    def absent(self, scene: AnyScene, options: Options) -> dict[str, str]:
        said = super().absent(scene, options)
        if scene.steady:
            said["traces"] = f"{STEADY} (run.steady)"
        if not physics.heat(scene):
            said["heat"] = "no temperature is solved for"
        if scene.model is not None and scene.model.file and own_model(scene, options) is None:
            said["1D"] = f"{scene.model.file} is a program, which runs with --model scene"
        return said

    def figures(self, scene: AnyScene, options: Options) -> dict[str, tuple[str, ...]]:
        when = "steady" if scene.steady else "hottest moment's"
        return {
            "figure_field": (f"the {when} temperature field, rendered off screen", "heat"),
            "figure_traces": ("every probe against time", "traces"),
        }

    def exported(self, scene: AnyScene, options: Options) -> AnyScene:
        return scene


def own_model(scene: AnyScene, options: Options) -> tuple[str | Callable[..., Any], str] | None:
    """Return the user's own model and the folder of its file: the given one, or the scene's where it runs no program.

    Raises SceneError for `--model scene` where the scene has no model.
    """
    from compare.models import OF_THE_SCENE, runs_code

    given, model = options.model, scene.model
    if given and given != OF_THE_SCENE:
        return given, ""
    if model is None or not model.file:
        if given:
            raise SceneError(f"--model scene: {quoted(scene.name)} has no [model] with a file: name one there, or here")
        return None
    return None if not given and runs_code(model.file) else (model.file, model.folder)


def varies(scene: AnyScene) -> bool:
    """Whether anything that drives a scene varies in time, so that it has no single steady state."""
    return any(isinstance(value, Schedule) for value in physics.driving(scene))


def probed(scene: AnyScene) -> AnyScene:
    """The scene, or where it has no probes with the mean temperature of every part as one."""
    means: Any = scene.means()
    return scene if scene.probes else replace(scene, probes=means)
