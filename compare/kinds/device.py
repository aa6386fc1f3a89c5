"""The device: the whole sensor with its controllers, in 1D and in 3D, and the paper's claims about it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from compare import hottest
from compare.kinds.base import Kind
from compare.options import FIGURES, Options
from compare.outcome import Outcome, Progress
from compare.slopes import Slopes, device_1d
from compare.verdict import Definition
from scenes.device import Device
from scenes.errors import SceneError
from scenes.result import Estimate, Result, Step, Traces, step
from scenes.varied import varied
from statespace.result import Run

OF_A_DEVICE = {
    "sink_K": ("sink temperature", "K"), "sensor_K": ("sensor temperature", "K"), "sink_power_W": ("sink power", "W"),
    "sensor_power_W": ("sensor power", "W"), "sink_V": ("sink voltage", "V"), "sensor_V": ("sensor voltage", "V"),
    "polymer_flux_W": ("heat into polymer", "W"),
}  # fmt: skip
"""Words and units of the device's quantities."""
LATE = ("figure11", "figure12", "figure13")
"""The figures that need runs of their own, which the paper's scheme does not make."""


class DeviceKind(Kind[Device]):
    shown = ("sink_power_W", "sensor_power_W", "sensor_V")
    step = 0.1  # A run is nonlinear: a key is moved by its own uncertainty (GUM 5.1.3, note 2), at most by this.

    def quantities(self, scene: Device) -> dict[str, tuple[str, str]]:
        """Return all but the temperatures, which the controllers fix."""
        return {name: words for name, words in OF_A_DEVICE.items() if words[1] != "K"}

    def declared(self, scene: Device, options: Options) -> Device:
        return scene if options.meter is None else replace(scene, expected_to_differ=None)

    def refuse(self, scene: Device, options: Options) -> None:
        late = [name for name in options.about if options.scheme == "paper" and name in LATE]
        if late:
            raise SceneError(f"--figure {late[0].removeprefix('figure')} needs the accurate scheme")

    def _in_1d(self, scene: Device, options: Options, progress: Progress) -> Result:
        from reduced1d.device import design

        with progress.stage("device"):
            slow, steps = self.others(scene, options)
            made = design.make(scene, options.scheme, options.meter, slow, steps, progress)
        return self._result("reduced1d", made.base, {}, {"runs": made})

    def _result(self, model: str, run: Run, errors: Mapping[str, float], details: dict[str, Any]) -> Result:
        """The scene's own run; ``errors`` are of the steady state, none where they are left out."""
        names, result = self.quantities(run.device), run.result
        steady = {name: Estimate(getattr(run.after, name), errors.get(name, 0.0)) for name in names}
        traces = {name: result.trace(name) for name in result.quantities}
        return Result(model, steady, Traces(result.time_s, traces, result.errors), details)

    def solve(
        self, scene: Device, options: Options, progress: Progress, fem3d: Result | None = None
    ) -> dict[str, Result]:
        from reduced1d.device import design

        results = {"reduced1d": self._in_1d(scene, options, progress)}
        if options.in_3d:
            from fem3d.runs.device import solve

            with progress.stage("device in 3D"):
                meter, start = options.meter, scene.external.initial_temperature
                rounded = design.in_the_loop(scene, design.METERS[meter], start) if meter else (0.0, 0.0)
                slow, steps = (options.figures and run for run in self.others(scene, options))
                solved = solve(scene, rounded, slow, steps, progress)
            errors = solved.model.steady_errors(scene)
            results["fem3d"] = self._result("fem3d", solved.runs.base, errors, {"solved": solved})
        if not self.absent(scene, options).get("designer"):
            progress("answering a designer's questions")
            with progress.stage("design"):
                answers = design.answer(scene, options.largest_voltage, options.largest_power)
            results["reduced1d"].details["design"] = answers
        return results

    def definitions(self, scene: Device, options: Options) -> Mapping[str, Definition[Outcome[Device]]]:
        from compare.device_checks import CHECKS

        return {name: check for name, check in CHECKS.items() if options.in_3d or "3D" not in check[1]}

    def others(self, scene: Device, options: Options) -> tuple[bool, bool]:
        """Whether the run of slow sampling and the runs of other outer steps are wanted, for figures or checks."""
        absent = self.absent(scene, options)
        return not absent.get("figure11"), not (absent.get("figure12") and absent.get("figure13"))

    def absent(self, scene: Device, options: Options) -> dict[str, str]:
        only = f"only {', '.join(options.about)} asked for" * bool(options.about)
        late = "they need nine more runs, and the accurate scheme for them" * (options.scheme == "paper")
        figures = {name: late * (name in LATE) or only * (name not in options.about) for name in FIGURES}
        return figures | {
            "3D": "not asked for (--3d)" * (not options.in_3d),
            "all figures": only,
            "designer": only or "the accurate scheme answers them" * (options.scheme == "paper"),
            "outer step": "the run ends before the outer step, or there is none" * (not scene.steps_outside),
        }  # fmt: skip

    def alarms(self, outcome: Outcome[Device]) -> tuple[str, ...]:
        return hottest.warnings(hottest.of_device(outcome.scene, outcome.runs.base.result))

    def slopes(self, outcome: Outcome[Device], keys: Sequence[str] | None) -> dict[str, Slopes]:
        made = {"reduced1d": device_1d(outcome.scene, outcome.reduced)}
        if outcome.fem3d is None:
            return made
        from fem3d.runs.device import of_device

        by_key, left_out = of_device(outcome.scene, outcome.device_3d.model, keys)
        sizes = {name: each.value for name, each in outcome.solved.steady.items()}
        return {"fem3d": Slopes(sizes, by_key, left_out=left_out)} | made

    def nearby(self, outcome: Outcome[Device], key: str, step: float) -> Outcome[Device]:
        """The 1D runs of the device with a key larger by a relative step."""
        device, options = varied(outcome.scene, key, 1 + step), outcome.options.but(in_3d=False)
        results = {"reduced1d": self._in_1d(device, options, Progress())}
        return replace(outcome, scene=device, options=options, results=results)

    def plan_3d(self, scene: Device, options: Options) -> Sequence[Step]:
        return [step("3D model", f"a few states of the whole device, known to {scene.accuracy_3d:g}")]

    def describe_1d(self, scene: Device, options: Options) -> str:
        scheme = "the paper's own scheme, and the accurate one beside it"
        if options.scheme != "paper":
            scheme = "all layers at once, exact between samples but for V2/R, its error estimated"
        return f"{scheme}; from cold to {scene.end_time:g} s"

    def check_steps(self, scene: Device, options: Options) -> list[Step]:
        idle = self.absent(scene, options).get("designer", "")
        designer = step("designer's questions", "largest gains, range and resolution", idle)
        return [*super().check_steps(scene, options), designer]

    def compact(self, outcome: Outcome[Device], progress: Progress) -> dict[str, Any]:
        """Return the compact model with its controllers, of 3D where it was solved, else of 1D."""
        from reduced1d.device import design as designs
        from statespace.device_model import compact

        export = outcome.options.export
        whole = designs.exported(outcome.runs.base) if outcome.fem3d is None else outcome.device_3d.exported
        return compact(whole, export.states, export.accuracy, progress)
