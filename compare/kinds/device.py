"""The device: the whole sensor with its controllers, in 1D and in 3D, and the paper's claims about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from compare.kinds.base import Kind
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.verdict import Definition
from scenes.device import Device
from scenes.errors import SceneError
from scenes.result import Estimate, Result, Step, step
from scenes.varied import varied

if TYPE_CHECKING:
    from compare.slopes import Slopes

DEVICE_FIGURES = {
    "figure9": "power of sink and sensor against time",
    "figure10": "heat flow into the polymer against time",
    "figure11": "the same as figure 9, sampled every 5 ms with gains of 0.5 and 0.05 V",
    "figure12": "the sensor's power after outer steps from -80 to +20 K",
    "figure13": "the steady power of the sensor against the outer temperature",
}
LATE = ("figure11", "figure12", "figure13")
"""The figures that need runs of their own, which the paper's scheme does not make."""


class DeviceKind(Kind[Device]):
    name, call, builtin = "device", "compare.device", "device"
    shown = ("sink_power_W", "sensor_power_W", "sensor_V")
    traces = "a row per controller sample"
    step = 0.1  # A run is nonlinear: a key is moved by its own uncertainty (GUM 5.1.3, note 2), at most by this.

    def quantities(self, scene: Device) -> dict[str, tuple[str, str]]:
        """Return all but the temperatures, which the controllers fix."""
        from compare.quantities import OF_A_DEVICE

        return {name: words for name, words in OF_A_DEVICE.items() if words[1] != "K"}

    def declared(self, scene: Device, options: Options) -> Device:
        return scene if options.meter is None else replace(scene, expected_to_differ=None)

    def refuse(self, scene: Device, options: Options) -> None:
        late = [name for name in options.about if options.scheme == "paper" and name in LATE]
        if late:
            raise SceneError(f"--figure {late[0].removeprefix('figure')} needs the accurate scheme")

    def _runs(self, scene: Device, options: Options, progress: Progress) -> dict[str, Result]:
        """The 1D runs."""
        with progress.stage("imports"):
            from reduced1d.device import design as designs
        with progress.stage("device"):
            slow, steps = self.others(scene, options)
            made = designs.make(scene, options.scheme, options.meter, slow, steps, progress)
        exact = {name: Estimate(getattr(made.base.after, name), 0.0) for name in self.quantities(scene)}
        return {"reduced1d": Result("reduced1d", exact, None, {"runs": made})}

    def solve(self, scene: Device, options: Options, progress: Progress) -> dict[str, Result]:
        results = self._runs(scene, options, progress)
        from reduced1d.device import design

        if options.in_3d:
            from fem3d.runs.device import make

            with progress.stage("device in 3D"):
                meter, start = options.meter, scene.external.initial_temperature
                rounded = design.in_the_loop(scene, design.METERS[meter], start) if meter else (0.0, 0.0)
                slow, steps = (options.figures and run for run in self.others(scene, options))
                solved = make(scene, rounded, slow, steps, progress)
            errors, after = solved.model.steady_errors(scene), solved.runs.base.after
            known = {name: Estimate(getattr(after, name), errors[name]) for name in results["reduced1d"].steady}
            results["fem3d"] = Result("fem3d", known, None, {"solved": solved})
        if "designer" not in self.absent(scene, options):
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
        return "figure11" not in absent, not {"figure12", "figure13"} <= absent.keys()

    def absent(self, scene: Device, options: Options) -> dict[str, str]:
        said = super().absent(scene, options) | ({} if options.in_3d else {"3D": "not asked for (--3d)"})
        if options.about:
            only = f"only {', '.join(options.about)} asked for"
            others = [name for name in DEVICE_FIGURES if name not in options.about]
            said |= dict.fromkeys((*others, "all figures", "designer"), only)
        if options.scheme == "paper":
            said |= dict.fromkeys(LATE, "they need nine more runs, and the accurate scheme for them")
            said.setdefault("designer", "the accurate scheme answers them")
        if not scene.steps_outside:
            said["outer step"] = "the run ends before the outer step, or there is none"
        return said

    def alarms(self, outcome: Outcome[Device]) -> tuple[str, ...]:
        from compare import hottest

        return hottest.warnings(hottest.of_device(outcome.scene, outcome.runs.base.result))

    def slopes(self, outcome: Outcome[Device], keys: Sequence[str] | None) -> dict[str, Slopes]:
        from compare.slopes import Slopes, device_1d

        made = {"reduced1d": device_1d(outcome.scene, outcome.reduced)}
        if outcome.fem3d is None:
            return made
        from fem3d.runs.device import of_device

        by_key, left_out = of_device(outcome.scene, outcome.device_3d.model, keys)
        sizes = {name: each.value for name, each in outcome.solved.steady.items()}
        return {"fem3d": Slopes(sizes, by_key, left_out=left_out)} | made

    def nearby(self, outcome: Outcome[Device], slopes: Mapping[str, Slopes], key: str, step: float) -> Outcome[Device]:
        """The 1D runs of the device with a key larger by a relative step."""
        device = varied(outcome.scene, key, 1 + step)
        options = outcome.options.but(in_3d=False)
        return replace(outcome, scene=device, options=options, results=self._runs(device, options, Progress()))

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

    def figures(self, scene: Device, options: Options) -> dict[str, tuple[str, ...]]:
        return {name: (shows, name) for name, shows in DEVICE_FIGURES.items()}

    def compact(self, outcome: Outcome[Device], progress: Progress) -> dict[str, Any]:
        """Return the compact model with its controllers, of 3D where it was solved, else of 1D."""
        from reduced1d.device import design as designs
        from statespace.device_model import compact

        export = outcome.options.export
        whole = designs.exported(outcome.runs.base) if outcome.fem3d is None else outcome.device_3d.exported
        return compact(whole, export.states, export.accuracy, progress)
