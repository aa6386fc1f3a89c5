"""The device: the whole sensor with its controllers, in 1D and in 3D, and the paper's claims about it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

from compare import hottest
from compare.kinds.base import Kind
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.report import Section, Style, Table, checked, checks_document, counted, sentences
from compare.slopes import Slopes, device_1d
from compare.verdict import Definition
from scenes.device import Device
from scenes.errors import SceneError
from scenes.formats import milliseconds, percent, quantity
from scenes.result import Estimate, Result, Step, Traces, step
from scenes.varied import varied
from statespace.result import BAND, QUANTITIES, Run, settling

if TYPE_CHECKING:
    from reduced1d.device.design import Design

OF_A_DEVICE = {
    "sink_K": ("sink temperature", "K"), "sensor_K": ("sensor temperature", "K"), "sink_power_W": ("sink power", "W"),
    "sensor_power_W": ("sensor power", "W"), "sink_V": ("sink voltage", "V"), "sensor_V": ("sensor voltage", "V"),
    "polymer_flux_W": ("heat into polymer", "W"),
}  # fmt: skip
"""Words and units of the device's quantities."""
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
    name = "device"
    shown = ("sink_power_W", "sensor_power_W", "sensor_V")
    traces = "a row per controller sample"
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

    def solve(self, scene: Device, options: Options, progress: Progress) -> dict[str, Result]:
        from reduced1d.device import design

        results = {"reduced1d": self._in_1d(scene, options, progress)}
        if options.in_3d:
            from fem3d.runs.device import make

            with progress.stage("device in 3D"):
                meter, start = options.meter, scene.external.initial_temperature
                rounded = design.in_the_loop(scene, design.METERS[meter], start) if meter else (0.0, 0.0)
                slow, steps = (options.figures and run for run in self.others(scene, options))
                solved = make(scene, rounded, slow, steps, progress)
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
        figures = {name: late * (name in LATE) or only * (name not in options.about) for name in DEVICE_FIGURES}
        return super().absent(scene, options) | figures | {
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

    def figures(self, scene: Device) -> dict[str, tuple[str, ...]]:
        return {name: (shows, name) for name, shows in DEVICE_FIGURES.items()}

    def compact(self, outcome: Outcome[Device], progress: Progress) -> dict[str, Any]:
        """Return the compact model with its controllers, of 3D where it was solved, else of 1D."""
        from reduced1d.device import design as designs
        from statespace.device_model import compact

        export = outcome.options.export
        whole = designs.exported(outcome.runs.base) if outcome.fem3d is None else outcome.device_3d.exported
        return compact(whole, export.states, export.accuracy, progress)

    def headline(self, outcome: Outcome[Device], style: Style) -> list[str]:
        """State what the sensor's power settles to and when, and the number of checks that differ."""
        scene, external, run = outcome.scene, outcome.scene.external, outcome.runs.base
        when = f"from cold, with {external.initial_temperature:g} K outside,"
        if scene.steps_outside:
            when = f"after the step from {external.initial_temperature:g} to {external.final_temperature:g} K outside"
        after = scene.end_time > external.step_time
        power = quantity((run.after if after else run.before).sensor_power_W, "W")
        ends = [each.time for each in settling(run.device, run.result, "sensor_power_W", BAND)]
        how = f"does not settle to {percent(BAND, 1)}: it is bound for {power} (see Findings)"
        if ends and math.isfinite(ends[-1]):
            how = f"settles to {percent(BAND, 1)} in {milliseconds(ends[-1])}, at {power}"
        by = ", by the paper's scheme," * (outcome.options.scheme == "paper")
        return [f"{scene.name}: {when}{by} the sensor's power {how}. {counted(outcome)}".rstrip()]

    def sections(self, outcome: Outcome[Device], style: Style) -> list[Section]:
        """Return the findings, the quantities, the claims with their reasons, and the designer's answers."""
        design = outcome.reduced.details.get("design")
        return [
            Section("Findings", sentences(outcome.runs.base.result.findings)),
            _quantities(outcome.runs.base, "in 1D"),
            *([] if outcome.fem3d is None else [_quantities(outcome.device_3d.runs.base, "in 3D")]),
            *checked(outcome, style),
            *([] if design is None else [_design(design, style)]),
        ]

    def document(self, outcome: Outcome[Device]) -> dict[str, Any]:
        from reduced1d.device.lumped import shielding as shielding_1d

        solved, shielding = None if outcome.fem3d is None else outcome.device_3d, None
        design = outcome.reduced.details.get("design")
        if solved is not None and "dev3d_shielding" in {check.id for check in outcome.checks}:
            slopes, errors = solved.model.shielding
            shielding = _values(slopes, errors) | {"reduced1d": _values(shielding_1d(outcome.scene), {})}
        return {
            "fem3d": None if solved is None else _run(solved.runs.base, solved.model),
            "reduced1d": _run(outcome.runs.base),
            "checks": checks_document(outcome),
            "findings": list(outcome.runs.base.result.findings),
            "shielding": shielding,
            "design": None if design is None else asdict(design),
        }


def _quantities(run: Run, model: str) -> Section:
    """Of every quantity the steady values before and after the step, the peak, and the settling times."""
    highest, rows = _peaks(run), []
    for key, (name, unit) in OF_A_DEVICE.items():
        times = [milliseconds(each.time) for each in settling(run.device, run.result, key, BAND)]
        states = (quantity(getattr(state, key), unit, 5) for state in (run.before, run.after))
        peak = quantity(highest[key]["value"], unit, 4), f"{highest[key]['time_s'] * 1e3:.4g} ms"
        rows.append([name, *states, *peak, *times, *[""] * (2 - len(times))])
    errors = run.result.errors
    error, flow = max(errors["sink_K"], errors["sensor_K"]), quantity(errors["polymer_flux_W"], "W", 2)
    said = (
        f"Steady states before and after the outer step; the times until within {percent(BAND, 1)} of a change for "
        f"good. Estimated errors: of the temperatures {error:.1e} K, of the heat into the polymer {flow}."
    )
    heads = (model, "before", "after", "peak", "at", "from cold", "from step")
    return Section(f"Over the run, {model}", [Table(heads, rows), said], headed=False)


def _design(design: Design, style: Style) -> Section:
    """The largest stable gains, the range and the resolution of meters."""
    rows = []
    for limit in design.limits:
        mode = f"{'decays' if limit.decay_per_s >= 0 else 'grows'} at {abs(limit.decay_per_s):.3g} 1/s"
        largest = limit.sink_gain_V, limit.sensor_gain_V
        gains = (quantity(gain, "V", 3) if gain < math.inf else "any" for gain in largest)
        name = f"  sampled every {limit.sample_time_s * 1e3:g} ms"
        rows.append([name, *gains, mode, f"{limit.largest_eigenvalue:.4g}"])
    said = "Each limit is with the other gain as the scene has it; an eigenvalue (per sample) below 1 is stable."
    reach = "Range: give --max-voltage or --max-power"
    if (limits := design.range) is not None:
        most = f"{quantity(limits.sensor_power_W, 'W')} at {quantity(limits.sensor_V, 'V')}"
        reach = f"Range: {limits.lowest_K:.5g} K to {limits.highest_K:.5g} K, where the sensor takes at most {most}"
    answers = [reach, *(f"{name}: {text}" for name, text in design.meters.items())]
    answers += [f"Source of {name}: {text}" for name, text in design.sources.items()] * style.page
    table = Table(("largest stable gain", "sink", "sensor", "slowest mode", "eigenvalue"), rows)
    return Section("For the designer", [table, said, *sentences(answers)])


def _values(state: Any, errors: Mapping[str, float], names: Sequence[str] = ()) -> dict[str, Any]:
    """The fields of a state, all or by ``names``, with the errors that are known."""
    values = {name: getattr(state, name) for name in names or asdict(state)}
    return {q: {"value": value} | ({"error": errors[q]} if q in errors else {}) for q, value in values.items()}


def _run(run: Run, model: Any = None) -> dict[str, Any]:
    device, result = run.device, run.result
    settled = [
        {"quantity": name, "after_s": s.start, "target": s.target, "band": s.band, "fraction": f, "time_s": s.time}
        for name in ("sink_K", "sensor_K", "sink_power_W", "sensor_power_W", "polymer_flux_W")
        for f in (0.05, 0.01, 1e-3, 1e-4)
        for s in settling(device, result, name, f)
    ]
    states = {"steady": (run.after, device.external.final_temperature),
              "steady_before": (run.before, device.external.initial_temperature)}  # fmt: skip
    steady = {name: _values(state, model.steady_errors(device, outer) if model else {}, QUANTITIES)
              for name, (state, outer) in states.items()}  # fmt: skip
    return {
        "scheme": result.scheme, **steady, "peaks": _peaks(run), "settling": settled, "errors": result.errors,
        "error_parts": result.error_parts, "details": result.details,
    }  # fmt: skip


def _peaks(run: Run) -> dict[str, dict[str, float]]:
    """The largest value of each quantity over the run, and when (s)."""
    places = {name: int(run.result.trace(name).argmax()) for name in run.result.quantities}
    return {name: {"value": float(run.result.trace(name)[at]), "time_s": float(run.result.time_s[at])}
            for name, at in places.items()}  # fmt: skip
