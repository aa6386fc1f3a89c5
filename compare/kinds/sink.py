"""The sink: 3D, the paper's model or another 1D model, and the paper's equations and figures."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from compare.blame import Budget, answer, budget, causes, repeats
from compare.kinds.base import STEADY, Kind
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.sink_checks import CHECKS, at_rest
from compare.slopes import Slopes, in_3d, own_model, sink_1d
from compare.verdict import PAPER, Check, Definition, judged
from reduced1d import ladder
from scenes.checks import DEFAULT_TOLERANCES, FIRST_TIME, ISLAND_TOLERANCES
from scenes.errors import RunawayError, SceneError
from scenes.formats import quantity
from scenes.model import AnyScene, Probe
from scenes.physics import nonlinear, refuse_terminals
from scenes.result import Result, Step
from scenes.sink import OF_A_SINK, Sink
from scenes.varied import numbers

QUANTITIES = {entry.steady: (entry.called, entry.unit) for entry in OF_A_SINK.values()}


class SinkKind(Kind[Sink]):
    shown = ("peak_rise_K", "end_rise_K", "current_A")

    def quantities(self, scene: Sink) -> dict[str, tuple[str, str]]:
        return QUANTITIES

    def declared(self, scene: Sink, options: Options) -> Sink:
        return scene if options.reduction == "paper" else replace(scene, expected_to_differ=None)

    def refuse(self, scene: Sink, options: Options) -> None:
        if options.model:
            # A model of the user's own is compared with 3D, and no ladder of assumptions leads to it.
            chosen = {"--why": options.why, "--only 1d": options.only == "1d", "--monte-carlo": options.monte_carlo}
            for option in (option for option, given in chosen.items() if given):
                raise SceneError(f"--reduction {options.reduction} is judged against 3D as it is: leave out {option}")
        elif options.only != "3d":
            ladder.refuse(scene, options.reduction)
        if options.against and (options.steady or options.only == "1d"):
            raise SceneError("--against compares with the 3D model over time: leave out --steady and --only 1d")
        if options.model == "network":
            from reduced1d.network.solution import lines_of

            lines_of(scene)
        if (options.follows_keys or options.calibrate) and not options.steady:
            refuse_terminals(scene.scene(), "a sensitivity over time")
        if options.calibrate and (why := nonlinear(scene.scene(), True)):
            raise SceneError(f"{why}, and --calibrate then has no slopes of a sink's traces to fit by: leave it out")

    def solve(
        self, scene: Sink, options: Options, progress: Progress, fem3d: Result | None = None
    ) -> dict[str, Result]:
        results = {"fem3d": fem3d} if fem3d else dict[str, Result]()
        if options.only != "1d":
            from fem3d.runs.sink import solve

            rows = {"fem3d": scene} | ({"single": replace(scene, spans=1)} if scene.spans > 1 else {})
            for name in [name for name in rows if name not in results]:
                progress("solving in 3D")
                with progress.stage("fem3d"):
                    results[name] = solve(rows[name], not options.steady, progress)
        if options.only != "3d" and not options.model:
            traces = results["fem3d"].traces if "fem3d" in results else None
            with progress.stage("reduced1d"):
                times = None if traces is None else traces.time
                try:
                    one = ladder.solve(scene, options.reduction, steady_only=options.steady, times=times)
                except RunawayError as error:
                    raise RunawayError(f"in 1D {error}", error.limit) from None
                results["reduced1d"] = one
        return results

    def definitions(self, scene: Sink, options: Options) -> Mapping[str, Definition[Outcome[Sink]]]:
        ids = DEFAULT_TOLERANCES if scene.spans == 1 else (*ISLAND_TOLERANCES, "fig4", "energy")
        return {name: CHECKS[name] for name in ids}

    def absent(self, scene: Sink, options: Options) -> dict[str, str]:
        several = any(isinstance(v, tuple) for material in (scene.silicon, scene.oxide) for _, v in material.given())
        early = not options.steady and scene.end_time <= FIRST_TIME
        return {
            "3D": "only the 1D model was asked for" * (options.only == "1d"),
            "one conductivity": "the paper's equations take one conductivity" * several,
            "traces": STEADY * bool(options.steady),
            "10 us": "they compare from 10 us on, and the run ends before" * early,
            "1D": "only the 3D model was asked for" * (options.only == "3d"),
            "current follows": "the current is given" * (scene.current is not None),
        }

    def answer(self, outcome: Outcome[Sink]) -> str:
        fem3d, reduced1d = outcome.fem3d, outcome.reduced1d
        model = reduced1d or outcome.solved
        who = "The paper's 1D model" if model.model == PAPER else f"The 1D model {model.model}"
        if fem3d is None or reduced1d is None:
            peak, end = (quantity(model.steady[key].value, "K") for key in ("peak_rise_K", "end_rise_K"))
            who = "The 3D model" if reduced1d is None else who
            return f"{who} alone was run: in the steady state its peak is {peak} and its ends are {end} above room."
        if not (claims := _claims(outcome)):
            return f"{who} says nothing of the peak and the ends."
        parts = outcome.analyses.get("why") or _ladder(outcome, claims)
        return answer(who, claims, lambda some: causes(some, parts))

    def slopes(self, outcome: Outcome[Sink], keys: Sequence[str] | None) -> dict[str, Slopes]:
        sink, fem3d, reduced1d, made = outcome.scene, outcome.fem3d, outcome.reduced1d, dict[str, Slopes]()
        uncertain = bool(outcome.options.uncertain)
        times = None if reduced1d is None or reduced1d.traces is None else reduced1d.traces.time[1:]
        if fem3d is not None:
            made["fem3d"] = in_3d(sink, fem3d, keys, profile=uncertain and sink.spans == 1)
            times = made["fem3d"].times
            if "single" in outcome.results and uncertain:
                made["single"] = in_3d(replace(sink, spans=1), outcome.results["single"], keys)
        if (model := outcome.own_model) is not None:
            made["reduced1d"] = own_model(model, sink, outcome.reduced, keys or numbers(sink), outcome.solved)
        elif reduced1d is not None:
            made["reduced1d"] = sink_1d(sink, reduced1d, times, keys)
        return made

    def plan_3d(self, scene: Sink, options: Options) -> Sequence[Step]:
        from fem3d.runs.sink import plan

        return plan(scene, not options.steady)

    def describe_1d(self, scene: Sink, options: Options) -> str:
        return options.reduction if options.model else f"{options.reduction}, {ladder.describe(options.reduction)}"

    def exported(self, scene: Sink, options: Options) -> AnyScene:
        if scene.emissivity:
            raise SceneError("a compact model has no radiation: give environment.emissivity = 0, or leave it out")
        boxes = scene.scene()
        inlet = next(b for b in boxes.boundaries if b.kind == "voltage")
        current = Probe("current", inlet.lower, inlet.upper, "current")
        return replace(boxes, probes=(*boxes.probes, current), steady=options.steady)


def _claims(outcome: Outcome[Sink]) -> list[Check]:
    """The differences of peak and ends, and of the current where nothing else differs."""
    checks, peak, end = {check.id: check for check in outcome.checks}, "the peak", "the ends"
    steady = {"fig4": at_rest("peak_rise_K", peak, outcome), "fig6_end": at_rest("end_rise_K", end, outcome)}
    claims = [judged(name, each, outcome.scene) for name, each in steady.items() if each is not None]
    over_time = {"fig6_peak": peak, "fig6_end": end}
    claims += [replace(checks[name], title=title) for name, title in over_time.items() if name in checks]
    if "fig7_current" in checks and all(claim.verdict == "agrees" for claim in claims):
        claims.append(replace(checks["fig7_current"], title="the current"))
    return [replace(claim, because="") for claim in claims]


def _ladder(outcome: Outcome[Sink], claims: Sequence[Check]) -> Budget | None:
    """The parts of the differences, by coarse models of the ladder; None where nothing differs or no ladder leads."""
    from reduced1d.ladder.levels import Levels

    steady, name, fem3d = [c for c in claims if c.time is None], outcome.reduced.model, outcome.solved
    wrong = [c for c in claims if c.verdict == "differs" and (c.time is None or not repeats(c, steady))]
    if not wrong or outcome.own_model is not None or not ladder.is_one(name):
        return None
    if all(claim.time is None for claim in wrong):
        fem3d = replace(fem3d, traces=None)
    try:
        return budget(name, fem3d, Levels(outcome.scene, rough=True))
    except ArithmeticError as error:
        outcome.warn(f"nothing is blamed: {error}")
        return None
