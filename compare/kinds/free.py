"""Free scenes, of boxes or on a mesh: their probes in 3D, and a 1D model of the user's own where one is given.

A model is compared with 3D probe by probe: steady, and at the largest difference over time. The difference is
(model - 3D)/scale. The scale of a temperature is its 3D rise above the initial temperature, over time the largest rise;
of other quantities the 3D value, over time the largest. No difference is relative to kelvins.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compare.blame import answer
from compare.course import ascending, compare_courses
from compare.kinds.base import STEADY, Kind
from compare.models import chosen_model
from compare.models.model import make_question
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.quantities import of
from compare.slopes import Slopes, in_3d, own_model
from compare.verdict import Check, compared
from scenes import physics
from scenes.errors import RunawayInTimeError, SceneError, quoted
from scenes.model import OVER_TIME, UNITS, AnyScene, Schedule
from scenes.result import Estimate, Result, Step, step


class FreeKind(Kind[AnyScene]):
    def quantities(self, scene: AnyScene) -> dict[str, tuple[str, str]]:
        return {probe.name: (probe.name, UNITS[probe.quantity]) for probe in scene.probes}

    def refuse(self, scene: AnyScene, options: Options) -> None:
        if not scene.probes and not physics.heat(scene):
            raise SceneError("the scene has no [[probe]] to report: add one")
        if options.why and options.model != "network":
            raise SceneError("--why asks which joint of the network is to blame: give --model network with it")
        if (own := chosen_model(scene, options.model)) is not None:
            make_question(scene)  # A fault in the model's parameters is one before 3D is solved.
            if own[0] == "network":
                from reduced1d.network.lines import layout

                layout(scene)
        if (options.follows_keys or options.calibrate) and not scene.steady:
            if why := physics.nonlinear(scene, True):
                raise SceneError(f"{why}, and a sensitivity is then one of the steady state alone: add --steady")
            physics.refuse_terminals(scene, "a sensitivity over time")

    def declared(self, scene: AnyScene, options: Options) -> AnyScene:
        return probed(scene)

    def solve(
        self, scene: AnyScene, options: Options, progress: Progress, fem3d: Result | None = None
    ) -> dict[str, Result]:
        from fem3d.runs import scene as scene_run

        own = chosen_model(scene, options.model)
        if options.export is not None:
            from fem3d.runs.compact import RUN_SHARE

            # The compact model is compared with this result.
            scene = replace(scene, accuracy=min(scene.accuracy, max(RUN_SHARE * options.export.accuracy, 1e-6)))
        progress("solving in 3D")
        with progress.stage("fem3d"):
            try:
                result = fem3d or scene_run.solve(scene, progress)
            except RunawayInTimeError as error:
                if options.export is not None or own is not None:
                    raise
                ended, result, runs_away = scene_run.until(scene, error, progress)
                result = replace(result, details=result.details | {"scene": ended, "runs_away": runs_away})
            if own is not None and not scene.steady and not varies(scene):
                still = replace(scene, steady=True, output_times=())
                result = replace(result, steady=scene_run.solve(still, progress).steady)
        return {"fem3d": result}

    def of_models(self, outcome: Outcome[AnyScene]) -> dict[str, Check]:
        """Compare every quantity that 3D and a model have, by the ids of checks, in the order of the quantities."""
        fem3d, model, made = outcome.solved, outcome.reduced1d, dict[str, Check]()
        if model is None:
            return made
        catalogue = of(outcome.scene, fem3d)
        for name, unit in catalogue.units.items():
            base, whole = catalogue.base(name), catalogue.whole(name)
            if name in model.steady and name in fem3d.steady:
                one, three = (replace(r.steady[name], value=r.steady[name].value - base) for r in (model, fem3d))
                made[name] = compared(name, unit, one, three, relative_to=f"the 3D {whole}")
            if model.traces is not None and fem3d.traces is not None and name in model.traces.values:
                scale, whole = Estimate(catalogue.largest(name), fem3d.traces.errors[name]), f"the largest 3D {whole}"
                one_course, in_3d_course, time = (model.traces, name), (fem3d.traces, name), model.traces.time
                made[f"{name}{OVER_TIME}"] = compare_courses(
                    f"{name}, trace", unit, one_course, in_3d_course, time, scale, whole, base, catalogue.sure(time),
                    own=True,
                )  # fmt: skip
        return made

    def warnings(self, outcome: Outcome[AnyScene]) -> tuple[str, ...]:
        scene, said = outcome.scene, [outcome.runs_away, *super().warnings(outcome)]
        if outcome.reduced1d is None and scene.model is not None and scene.model.file and not outcome.failure:
            said.append(f"the scene's model, {scene.model.file}, is a program, and runs only with --model scene")
        return tuple(said)

    def answer(self, outcome: Outcome[AnyScene]) -> str:
        if outcome.reduced1d is None:
            return ""
        name, probes = outcome.reduced1d.model, {probe.name for probe in outcome.scene.probes}
        checks = [check for check in outcome.checks if check.id.removesuffix(OVER_TIME) in probes]
        far = [check for check in checks if check.time is not None and check.verdict == "differs"]
        worst = max(far, key=lambda check: abs(check.difference), default=None)
        claims = []
        for c in checks:
            probe, detail = c.id.removesuffix(OVER_TIME), c.because.partition("; ")[2] * (c is worst)
            claims.append(replace(c, title=quoted(probe) if " " in probe else probe, because=detail))
        return answer(name, claims)

    def slopes(self, outcome: Outcome[AnyScene], keys: Sequence[str] | None) -> dict[str, Slopes]:
        scene, reduced1d = outcome.scene, outcome.reduced1d
        made = {"fem3d": in_3d(scene, outcome.solved, keys)}
        if reduced1d is not None and (model := outcome.own_model) is not None:
            made["reduced1d"] = own_model(model, scene, reduced1d, made["fem3d"].relative, outcome.solved)
        return made

    def plan_3d(self, scene: AnyScene, options: Options) -> Sequence[Step]:
        from fem3d.runs.scene import plan

        return plan(scene)

    def describe_1d(self, scene: AnyScene, options: Options) -> str:
        own = chosen_model(scene, options.model)
        return "" if own is None else f"{getattr(own[0], '__name__', own[0])}, where 3D has an answer"

    def check_steps(self, scene: AnyScene, options: Options) -> list[Step]:
        return [step("checks", "of every probe that it answers")] * (chosen_model(scene, options.model) is not None)

    def absent(self, scene: AnyScene, options: Options) -> dict[str, str]:
        file = "" if scene.model is None or chosen_model(scene, options.model) else scene.model.file
        return {
            "traces": f"{STEADY} (run.steady)" * scene.steady,
            "heat": "no temperature is solved for" * (not physics.heat(scene)),
            "1D": f"{file} is a program, which runs with --model scene" * bool(file),
        }

    def exported(self, scene: AnyScene, options: Options) -> AnyScene:
        return scene

    def columns(self, outcome: Outcome[AnyScene]) -> dict[str, np.ndarray]:
        """Return time_s and a column for each probe (K, V, W or A); a model's beside them."""
        traces, own = outcome.solved.traces, None if outcome.reduced1d is None else outcome.reduced1d.traces
        if traces is None or own is None:
            return {} if traces is None else {"time_s": traces.time, **traces.values}
        columns = {"time_s": own.time}
        for name, values in traces.values.items():
            columns[name] = np.interp(own.time, ascending(traces.time), values)
            if name in own.values:
                columns[f"reduced1d {name}"] = own.values[name]
        return columns


def varies(scene: AnyScene) -> bool:
    """Whether anything that drives a scene varies in time, so that it has no single steady state."""
    return any(isinstance(value, Schedule) for value in physics.driving(scene))


def probed(scene: AnyScene) -> AnyScene:
    """The scene, or where it has no probes with the mean temperature of every part as one."""
    means: Any = scene.means()
    return scene if scene.probes else replace(scene, probes=means)
