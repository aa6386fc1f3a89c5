"""Free scenes, of boxes or on a mesh: their probes in 3D, and a 1D model of the user's own where one is given."""

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from compare.blame import answer
from compare.course import ascending
from compare.kinds.base import STEADY, Kind
from compare.models import chosen_model
from compare.models.sampling import make_question
from compare.options import Options
from compare.outcome import Outcome, Progress
from compare.quantities import compare_probes
from compare.report import Row, Section, Style, Table, checked, checks_document, counted, steady_document
from compare.slopes import Slopes, in_3d, own_model
from compare.verdict import Check
from scenes import physics
from scenes.errors import RunawayInTimeError, SceneError, quoted
from scenes.formats import quantity, with_error
from scenes.model import OVER_TIME, UNITS, AnyScene, Schedule
from scenes.result import Estimate, Result, Step, step
from scenes.units import TIME


class FreeKind(Kind[AnyScene]):
    name, traces, field = "free", "a column for each probe", "heat"

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

    def solve(self, scene: AnyScene, options: Options, progress: Progress) -> dict[str, Result]:
        from fem3d.runs import scene as scene_run

        own = chosen_model(scene, options.model)
        progress("solving in 3D")
        with progress.stage("fem3d"):
            try:
                result = scene_run.solve(scene, progress)
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
        if outcome.reduced1d is None:
            return {}
        return compare_probes(outcome.scene, outcome.solved, outcome.reduced1d)

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
        return super().absent(scene, options) | {
            "traces": f"{STEADY} (run.steady)" * scene.steady,
            "heat": "no temperature is solved for" * (not physics.heat(scene)),
            "1D": f"{file} is a program, which runs with --model scene" * bool(file),
        }

    def figures(self, scene: AnyScene) -> dict[str, tuple[str, ...]]:
        when = "steady" if scene.steady else "hottest moment's"
        return {
            "figure_field": (f"the {when} temperature field, rendered off screen", "heat"),
            "figure_traces": ("every probe against time", "traces"),
        }

    def exported(self, scene: AnyScene, options: Options) -> AnyScene:
        return scene

    def headline(self, outcome: Outcome[AnyScene], style: Style) -> list[str]:
        """State the first probes, or the answer about a model, then unknowns and heat balance."""
        scene, details, end = outcome.scene, outcome.solved.details, TIME.show(outcome.scene.end_time)
        what, when, key = f"Transient to {end}", f"after {end}", "transient_imbalance"
        if scene.steady:
            what, when, key = "Steady state", "in the steady state", "energy_imbalance"
        shown = (
            f"{probe.name} {_value(_read(outcome.solved, probe.name)[0], UNITS[probe.quantity], style)}"
            for probe in scene.probes[:4]
        )
        answer = outcome.answer or f"{scene.name}: {', '.join(shown)} {when}."
        # No balance is stated where no heat passes.
        balance = details.get(key)
        closed = f", heat balanced to {balance:.0e}" if balance and math.isfinite(balance) else ""
        how = f"{what} in 3D, {details['unknowns']} unknowns{closed}."
        return [answer, counted(outcome, f"{scene.name}: "), how]

    def sections(self, outcome: Outcome[AnyScene], style: Style) -> list[Section]:
        """Return the probes, the checks of a model, and the lines of a network."""
        network = _network(outcome)
        return [_probes(outcome, style), *checked(outcome, style), *([_network_section(network)] if network else [])]

    def document(self, outcome: Outcome[AnyScene]) -> dict[str, Any]:
        """Return the entries of summary.json: probes with errors; of a transient values at times and ranges."""
        scene, traces, reduced1d = outcome.scene, outcome.solved.traces, outcome.reduced1d
        named = ("field_error", "energy_imbalance", "unknowns", "steps", "levels", "symmetry", "mesh")
        units = {probe.name: UNITS[probe.quantity] for probe in scene.probes}
        in_3d: dict[str, Any] = {"units": units, **steady_document(outcome.solved, *named)}
        if traces is not None:
            times, ranges = sorted({*scene.output_times, scene.end_time}), {}
            for name in traces.values:
                last, least, most = _read(outcome.solved, name)
                ranges[name] = {
                    "end": last.value, "least": least.value, "least_error": least.error,
                    "largest": most.value, "largest_error": most.error,
                }  # fmt: skip
            in_3d["transient"] = {
                "errors": traces.errors, "accurate_from_s": traces.since, "jumps": len(traces.jumps),
                "imbalance": outcome.solved.details.get("transient_imbalance"),
                "runs_away": outcome.runs_away or None, "time_s": times,
                "values": {name: np.interp(times, traces.time, v) for name, v in traces.values.items()},
                "range": ranges,
            }  # fmt: skip
        checks = checks_document(outcome)
        if reduced1d is None:
            return {"fem3d": in_3d, **({"checks": checks} if checks else {})}
        model: dict[str, Any] = {"model": reduced1d.model, **steady_document(reduced1d)}
        if reduced1d.traces is not None:
            model["errors"] = reduced1d.traces.errors
        if network := _network(outcome):
            model["network"] = network
        return {"answer": outcome.answer, "fem3d": in_3d, "reduced1d": model, "checks": checks}

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


def _network(outcome: Outcome[AnyScene]) -> dict[str, list[dict[str, Any]]]:
    """Return the lines, joints and conditions of a network; nothing of another model."""
    if outcome.reduced1d is None or outcome.reduced1d.model != "network":
        return {}
    from reduced1d.network.lines import layout
    from reduced1d.network.model import table

    return table(layout(outcome.scene))


def _network_section(network: Mapping[str, Sequence[Mapping[str, Any]]]) -> Section:
    """Return tables of lines, joints and conditions; rows that are alike in one."""

    def cell(row: Mapping[str, Any], unit: str) -> str:
        value = row[unit]["value"] if unit in row else None
        return "" if value is None else quantity(value, unit)

    tables = []
    for name, rows in network.items():
        units = [unit for unit in ("W/K", "J/K", "ohm", "W") if any(unit in row for row in rows)]
        alike: dict[tuple[str, ...], list[str]] = {}
        for row in rows:
            alike.setdefault((row["how"], *(cell(row, unit) for unit in units)), []).append(row["what"])
        lines = []
        for (how, *cells), (first, *more) in alike.items():
            others = [name + f" ({n} times)" * (n > 1) for name, n in Counter(more).items()]
            lines.append(Row([first, *cells], below="; alike: ".join(filter(None, (how, ", ".join(others))))))
        tables += [Table((name, *units), lines)] * bool(rows)
    return Section("The network", tables, headed=False)


def _value(estimate: Estimate, unit: str, style: Style) -> str:
    number, bound, shown, _, _ = with_error(estimate.value, estimate.error, unit)
    return f"{number} {style.plus_minus} {bound} {shown}"


def _read(result: Result, name: str) -> list[Estimate]:
    """The steady value of a probe; or over time its last value, and the extremes that have a known error bound."""
    if (traces := result.traces) is None:
        return [result.steady[name]]
    errors = traces.error_at(name, traces.time)
    values, known = traces.values[name][errors < math.inf], errors[errors < math.inf]
    extremes = (Estimate(float(values[i]), float(known[i])) for i in (values.argmin(), values.argmax()))
    return [Estimate(float(traces.values[name][-1]), traces.errors[name]), *extremes]


def _probes(outcome: Outcome[AnyScene], style: Style) -> Section:
    """Of every probe the steady value, or the last one with its extremes over time."""
    result, traces, rows, said = outcome.solved, outcome.solved.traces, [], []
    title, heads = "Steady state", ["probe", "steady state"]
    for probe in outcome.scene.probes:
        rows.append([probe.name, *(_value(e, UNITS[probe.quantity], style) for e in _read(result, probe.name))])
    if traces is not None:
        title, heads = "Over time", ["probe", "at the end", "least", "largest"]
        wait = max((wait for _, wait in traces.jumps), default=0.0)
        again = f", but not for {quantity(wait, 's', 3)} after each jump of a drive" * bool(wait)
        start = f"The errors hold from {quantity(traces.since, 's', 3)} on{again}; earlier extremes have their own."
        said += [start] * bool(traces.since)
        said.append("summary.json has the values at the output times, traces.csv all values.")
    if off := result.details.get("field_error"):
        said.append(f"The field is known to {off:.2g} of its largest rise, at its worst place.")
    return Section(title, [Table(heads, rows), *said], headed=False)
