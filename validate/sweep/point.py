"""The request of a sweep, and its points: each is solved to a row of numbers, or to the reason why it has none."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Collection, Iterable
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from compare.options import Options
from compare.processes import TimeIsUpError, within
from scenes import physics
from scenes.errors import RunawayError, SceneError, did_you_mean, quoted
from scenes.loading import refuse_unused
from scenes.model import OVER_TIME
from scenes.sink import Sink
from validate.sweep.design import Base, Design, Value, settings

if TYPE_CHECKING:
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.model import AnyScene
    from scenes.result import Result

S = TypeVar("S", bound=Any)
FINEST = 1e-4
"""The accuracy down to which points with an open verdict are solved again; finer ones take seconds to minutes."""

BLAMED = {"fig4": ("steady", "peak"), "fig6_peak": ("transient", "peak"), "fig6_end": ("transient", "end"),
          "fig7_current": ("transient", "current")}  # fmt: skip
"""The difference in `compare.blame` of each check of a reduction."""


@dataclass(frozen=True)
class Scope:
    """The results that every point should have.

    Attributes
    ----------
    reductions : names of the 1D models
    steady : whether the steady state alone is solved
    check : the check whose difference is split by assumption
    blame : whether it is split
    all_checks : whether every open verdict is solved again more accurately, or that of ``check`` alone
    model : path of the user's own model, whose name is then the only one of the ``reductions``
    """

    reductions: tuple[str, ...] = ("paper",)
    steady: bool = False
    check: str = "fig4"
    blame: bool = True
    all_checks: bool = True
    model: str = ""


@dataclass(frozen=True)
class Row:
    """The result of a point: the ``status`` is "ok" or a word, then ``because`` is a sentence. ``values`` are by the
    columns' names; ``parts`` are the contributions of the assumptions to the check's relative difference."""

    point: int
    status: str
    because: str
    seconds: float
    values: dict[str, Any]
    parts: dict[str, float] | None = None


@dataclass(frozen=True)
class Work:
    """A point to solve: its ``number`` and the values of the ``keys``."""

    base: Base
    scope: Scope
    keys: tuple[str, ...]
    number: int
    point: tuple[Value, ...]


@dataclass(frozen=True)
class Job:
    """A request: a ``design`` of a ``base``, and the ``scope`` of each point. The design of a map is the cells, of
    which about ``solves`` are solved."""

    base: Base
    design: Design
    scope: Scope
    solves: int | None = None

    def document(self) -> dict[str, Any]:
        """Return the request as JSON types, to compare with that of a folder's earlier run."""
        from validate.report.summary import version

        base, design = self.base, self.design
        document = {
            "program": version(),
            "kind": "sweep" if self.solves is None else "map",
            "scene": {"name": base.name, "kind": base.kind, "document": base.document},
            "settings": base.settings,
            "vary": {axis.key: {"values": axis.values, "log": axis.log, "range": axis.range} for axis in design.axes},
            **({} if design.sample is None else {"sample": design.sample, "seed": design.seed}),
            **asdict(self.scope),
            **({} if self.solves is None else {"solves": self.solves}),
        }
        return json.loads(json.dumps(document, default=str))

    def work(self, number: int, blamed: bool = True) -> Work:
        """Return the task of a point."""
        scope = replace(self.scope, blame=self.scope.blame and blamed)
        return Work(self.base, scope, self.design.keys, number, self.design.point(number))


def checked(
    base: Base, given: str | None, steady: bool, varied: Collection[str] = (), reduction: str = "paper", model: str = ""
) -> str:
    """Return the check of a sweep over the ``varied`` keys.

    Raises SceneError for a check that the scene, the ``reduction`` or every design lacks.
    """
    from compare.kinds import kind_of
    from compare.verdict import PAPERS
    from scenes.checks import DEFAULT_TOLERANCES, ISLAND_TOLERANCES, OF_THE_PAPER, OF_THE_REDUCTION

    scene: Any = base.at(())
    free = base.kind == "free"
    known = [probe.name for probe in scene.probes] if free else [*DEFAULT_TOLERANCES, *ISLAND_TOLERANCES]
    if model and free:
        from compare.kinds.free import varies

        at_rest, over_time = known, [f"{name}{OVER_TIME}" for name in known]
        known = at_rest if scene.steady else over_time if varies(scene) else [*at_rest, *over_time]
        # A probe's name will do where it is judged over time alone.
        given = f"{given}{OVER_TIME}" if given in at_rest and given not in known else given
    if given is not None and given not in known:
        what = "probe of the scene" if free else "check"
        raise SceneError(f"{quoted(given)} is no {what}: give {', '.join(known)}{did_you_mean(given, known)}")
    if free:
        return given or next(iter(known), "")
    keys = {key for joined in varied for key in joined.split("+")}
    refuse_unused(base.set | keys, replace(scene, current=1.0) if "drive.current" in keys else scene)
    check = given or "fig4"
    kind = kind_of(scene)
    here = kind.needs(scene, Options(steady=steady))
    if check not in here and "sink.spans" not in varied:
        allowed = "several spans, as sink.spans=3" if scene.spans == 1 else "a single span"
        raise SceneError(
            f"there is no check {quoted(check)} here: it is one of {allowed}, and sink.spans = {scene.spans}"
        )
    if check in OF_THE_PAPER and reduction not in PAPERS:
        allowed = ", ".join(name for name in here if name in OF_THE_REDUCTION)
        raise SceneError(
            f"{quoted(check)} is an equation of the paper's, which {reduction} makes no use of: give {allowed}, or "
            "--reduction paper"
        )
    skipped = kind.skipped(scene, Options(steady=steady))
    if check in skipped:
        raise SceneError(f"there is no check {quoted(check)} here: {skipped[check]}")
    return check


def import_solvers() -> None:
    """Import the modules that a point needs, so that no point's time includes the import."""
    import fem3d.runs.scene
    import fem3d.runs.sink  # noqa: F401


def solve(work: Work, seconds: float | None = None) -> Row:
    """Return the row of a point, which has some ``seconds``; never raise for what a scene can cause."""
    import_solvers()
    started, status, because = time.perf_counter(), "ok", ""
    values: dict[str, Any] = {}
    parts = None
    try:
        with within(seconds):
            scene: Any = work.base.at(settings(work.base, work.keys, work.point))
            values, parts = _sink(scene, work.scope) if work.base.kind == "sink" else (_free(scene, work.scope), None)
    except SceneError as error:
        status, because = "refused", str(error)
    except RunawayError as error:
        status, because = "runaway", str(error)
    except ArithmeticError as error:
        status, because = "failed", str(error)
    except MemoryError:
        status, because = "failed", "out of memory: ask for a larger accuracy"
    except TimeIsUpError:
        status, because = "timeout", late(seconds)
    except Exception as error:
        status, because = "failed", f"a fault of this program, {type(error).__name__}: {error}"
    took = round(time.perf_counter() - started, 4)
    return Row(work.number, status, " ".join(because.split()), took, values, parts)


def late(seconds: float | None) -> str:
    """Return the reason of a point that was stopped."""
    return f"it took more than {seconds:g} s (--point-timeout)"


def _sink(sink: Sink, scope: Scope) -> tuple[dict[str, Any], dict[str, float] | None]:
    """A sink's columns and the parts of its difference; solved again more finely while a verdict is open."""
    from compare import hottest
    from compare.kinds import kind_of
    from reduced1d.ladder.levels import Levels

    options = Options(steady=scope.steady, reduction=scope.reductions[0], model=scope.model)
    # The coarser models of the ladder tell the largest part; a reduction that stands on it needs both.
    rough = scope.reductions == ("paper",)
    finer: Sink | None = sink
    while finer is not None:
        sink = finer
        outcome = kind_of(sink).compare(sink, options)
        fem3d, levels = cast("Result", outcome.fem3d), Levels(sink, rough)
        by_reduction = {scope.reductions[0]: (outcome.checks, outcome.reduced1d)}
        for name in scope.reductions[1:]:
            by_reduction[name] = _of_another(sink, options.but(reduction=name), fem3d, levels)
        finer = _finer(sink, [check for checks, _ in by_reduction.values() for check in checks], scope)
    values: dict[str, Any] = {}
    for name, given in fem3d.steady.items():
        values |= {f"fem3d_{name}": given.value, f"fem3d_{name}_error": given.error}
    for reduction, (checks, reduced) in by_reduction.items():
        prefix, model = ("", "reduced1d_") if reduction == scope.reductions[0] else (f"{reduction}_", f"{reduction}_")
        values |= {f"{model}{name}": given.value for name, given in (reduced.steady if reduced else {}).items()}
        values |= _check_columns(checks, prefix)
    top = sink.room_temperature + fem3d.steady["peak_rise_K"].value
    # Nothing is hotter than the peak, and a step's response nowhere hotter than the steady state.
    hot = hottest.excess(sink.materials, top, lambda: fem3d.details["fields"], np.empty(0))
    parts = _parts(sink, scope, fem3d, levels) if scope.blame and not scope.model else None
    return values | too_hot(*hot) | blame(parts) | {"accuracy": sink.accuracy}, parts


def _finer(scene: S, checks: Iterable[Check], scope: Scope) -> S | None:
    """The scene at a tenth of its accuracy, down to `FINEST`, while one of its checks is open; else ``None``."""
    finer = max(scene.accuracy / 10, FINEST)
    open_ = any(c.verdict == "unresolved" and (scope.all_checks or c.id == scope.check) for c in checks)
    return replace(scene, accuracy=finer) if open_ and finer < scene.accuracy else None


def _check_columns(checks: Iterable[Check], prefix: str = "") -> dict[str, Any]:
    return {f"{prefix}{c.id}_{name}": getattr(c, name) for c in checks for name in ("difference", "u_num", "verdict")}


def too_hot(excess: float, material: str) -> dict[str, Any]:
    """Return the columns of the material that gets hotter than its valid_to, "" for none, and of the excess (K)."""
    return {"too_hot": material, "past_valid_to_K": excess} if math.isfinite(excess) else {}


def _of_another(sink: Sink, options: Options, fem3d: Result, levels: Levels) -> tuple[tuple[Check, ...], Result | None]:
    """The checks of another reduction against the same 3D result; none where it has no answer."""
    from compare.kinds import kind_of
    from compare.outcome import Outcome
    from reduced1d.ladder import solve as solve_1d
    from scenes.checks import OF_THE_REDUCTION

    times = fem3d.traces.time if fem3d.traces is not None else None
    try:
        result = solve_1d(sink, options.reduction, steady_only=options.steady, times=times, levels=levels)
    except RunawayError:
        return (), None
    checks = kind_of(sink).checks(Outcome(sink, options, {"fem3d": fem3d, "reduced1d": result}))
    return tuple(check for check in checks if check.id in OF_THE_REDUCTION), result


def _parts(sink: Sink, scope: Scope, fem3d: Result, levels: Levels) -> dict[str, float] | None:
    """The difference that the check is of, split by assumption."""
    from compare.blame import budget

    kind, quantity = BLAMED.get(scope.check, ("steady", "peak"))
    if kind == "steady":
        fem3d = replace(fem3d, traces=None)
    try:
        causes = budget(sink, scope.reductions[0], fem3d, levels)
    except RunawayError:
        return None
    splits = causes.steady if kind == "steady" else causes.transient
    split = next((s for s in splits if s.quantity == quantity and s.scale), None)
    if split is None:
        return None
    # A part within its own error is no ground to blame anything on.
    return {part.blame: part.value / split.scale if abs(part.value) > part.error else 0.0 for part in split.parts}


def blame(parts: dict[str, float] | None) -> dict[str, Any]:
    """The assumption with the largest part, and that part's share of the sum of all, taken without their signs."""
    total = sum(abs(part) for part in parts.values()) if parts else 0.0
    if not parts or not total:
        return {"blame": "", "blame_share": None}
    name = max(parts, key=lambda n: abs(parts[n]))
    return {"blame": name, "blame_share": abs(parts[name]) / total}


def _free(scene: AnyScene, scope: Scope) -> dict[str, Any]:
    """The columns of a free scene: every probe, at the end where it is over time."""
    from compare import hottest
    from compare.kinds.free import probed
    from fem3d.runs import scene as scene_run

    scene = probed(scene)
    if scope.model:
        result, values = _judged(scene, scope)
    else:
        result, values = scene_run.solve(scene), dict[str, Any]()
    for probe in scene.probes:
        if scene.steady or result.traces is None:
            estimate = result.steady[probe.name]
            value, error = estimate.value, estimate.error
        else:
            value, error = float(result.traces.values[probe.name][-1]), float(result.traces.errors[probe.name])
        values |= {f"fem3d_{probe.name}": value, f"fem3d_{probe.name}_error": error}
    if physics.heat(scene):
        fields, times = result.details["fields"], hottest.moments(result.traces)
        hot = hottest.excess(physics.materials(scene), fields.ceiling(times), lambda: fields, times)
        values |= too_hot(*hot)
    return {"accuracy": scene.accuracy} | values


def _judged(scene: AnyScene, scope: Scope) -> tuple[Result, dict[str, Any]]:
    """A free scene's 3D result, and the columns of a user's model; solved again more finely while a verdict is open."""
    from compare.kinds import kind_of

    finer: AnyScene | None = scene
    while finer is not None:
        scene = finer
        outcome = kind_of(scene).compare(scene, Options(model=scope.model))
        finer = _finer(scene, outcome.checks, scope)
    steady = outcome.reduced1d.steady if outcome.reduced1d is not None else {}
    values: dict[str, Any] = {f"reduced1d_{name}": estimate.value for name, estimate in steady.items()}
    return outcome.solved, values | _check_columns(outcome.checks) | blame(None) | {"accuracy": scene.accuracy}
