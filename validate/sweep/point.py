"""The request of a sweep, and its points: each is solved to a row of numbers, or to the reason why it has none."""

from __future__ import annotations

import json
import math
from collections.abc import Collection
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from compare.options import Options
from scenes import physics
from scenes.errors import RunawayError, SceneError, did_you_mean, quoted
from scenes.loading import refuse_unused
from scenes.model import OVER_TIME
from scenes.sink import Sink
from validate.sweep.design import Base, Design, Value

if TYPE_CHECKING:
    from compare.outcome import Outcome
    from compare.verdict import Check
    from reduced1d.ladder.levels import Levels
    from scenes.result import Result

FINEST = 1e-4
"""The accuracy down to which points with an open verdict are solved again; finer ones take seconds to minutes."""

BLAMED = {"fig4": ("steady", "peak"), "fig6_peak": ("transient", "peak"), "fig6_end": ("transient", "end"),
          "fig7_current": ("transient", "current")}  # fmt: skip
"""The difference in `compare.blame` of each check of a reduction."""
OF_A_CHECK = ("difference", "u_num", "verdict")


@dataclass(frozen=True)
class Scope:
    """The results that every point should have.

    Attributes
    ----------
    reductions : names of the 1D models
    steady : whether the steady state alone is solved
    check : the check whose difference is split by assumption
    blame : whether it is split
    all_checks : whether every open verdict is solved again more accurately, or the verdict of ``check`` alone
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
        """Return the request as JSON types, to compare with a folder's earlier run."""
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


def prepare(
    base: Base, design: Design, models: tuple[tuple[str, ...], str], check: str | None = None, steady: bool = False,
    blame: bool = True, solves: int | None = None,
) -> Job:  # fmt: skip
    """Return the request of a sweep, or of a map for a number of ``solves``.

    ``models`` are the names of the 1D models, and the path of the user's own one. Raises SceneError for a check that
    the scene, the first model or every design lacks, and for a key that is varied and set.
    """
    base.at(())
    for key in design.keys:
        if base.set & set(key.split("+")):
            raise SceneError(f"{key} is varied and set: give it one of the two")
    names, model = models
    check = checked(base, check, steady, design.keys, names[0], model)
    return Job(base, design, Scope(names, steady, check, blame, solves is None, model), solves)


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


def columns(scene: Any, scope: Scope) -> tuple[dict[str, Any], dict[str, float] | None]:
    """Return the columns of a scene, solved again more finely while a verdict is open, and the parts of its difference.

    A scene with probes has each of them, at the end where it is over time.
    """
    from compare.kinds import kind_of
    from compare.kinds.free import probed
    from fem3d.runs import scene as scene_run
    from reduced1d.ladder.levels import Levels

    sink, judged = scene.kind == "sink", scene.kind == "sink" or bool(scope.model)
    values: dict[str, Any] = {}
    if not sink:
        scene = probed(scene)
    if not judged:
        fem3d = scene_run.solve(scene)
    while judged:
        # The coarser models of the ladder tell the largest part; a reduction that stands on it needs both.
        levels = Levels(scene, scope.reductions == ("paper",)) if sink else cast("Levels", None)
        options = Options(steady=scope.steady, reduction=scope.reductions[0], model=scope.model)
        outcome = kind_of(scene).compare(scene, options)
        fem3d, results = outcome.solved, {scope.reductions[0]: (outcome.checks, outcome.reduced1d)}
        for name in scope.reductions[1:]:
            results[name] = _of_another(outcome, name, levels)
        checks = [check for each, _ in results.values() for check in each]
        finer = max(scene.accuracy / 10, FINEST)
        open_ = any(c.verdict == "unresolved" and (scope.all_checks or c.id == scope.check) for c in checks)
        if not open_ or finer >= scene.accuracy:
            break
        scene = replace(scene, accuracy=finer)
    if sink or scene.steady or fem3d.traces is None:
        read = {name: (each.value, each.error) for name, each in fem3d.steady.items()}
    else:
        traces = fem3d.traces
        read = {name: (float(traces.values[name][-1]), float(traces.errors[name])) for name in traces.values}
    for name in read if sink else [probe.name for probe in scene.probes]:
        values |= {f"fem3d_{name}": read[name][0], f"fem3d_{name}_error": read[name][1]}
    for n, (name, (made, reduced)) in enumerate(results.items() if judged else ()):
        prefix, model = (f"{name}_", f"{name}_") if n else ("", "reduced1d_")
        values |= {f"{model}{quantity}": each.value for quantity, each in (reduced.steady if reduced else {}).items()}
        values |= {f"{prefix}{c.id}_{part}": getattr(c, part) for c in made for part in OF_A_CHECK}
    parts = _parts(scene, scope, fem3d, levels) if sink and scope.blame and not scope.model else None
    values |= blame(parts) if judged else {}
    return values | _too_hot(scene, fem3d) | {"accuracy": scene.accuracy}, parts


def _too_hot(scene: Any, fem3d: Result) -> dict[str, Any]:
    """The material that gets hotter than its valid_to, "" for none, and the excess (K)."""
    from compare import hottest

    if scene.kind == "sink":
        # Nothing is hotter than the peak, and a step's response nowhere hotter than the steady state.
        top = scene.room_temperature + fem3d.steady["peak_rise_K"].value
        excess, name = hottest.excess(scene.materials, top, lambda: fem3d.details["fields"], np.empty(0))
    elif not physics.heat(scene):
        return {}
    else:
        fields, times = fem3d.details["fields"], hottest.moments(fem3d.traces)
        excess, name = hottest.excess(physics.materials(scene), fields.ceiling(times), lambda: fields, times)
    return {"too_hot": name, "past_valid_to_K": excess} if math.isfinite(excess) else {}


def _of_another(outcome: Outcome[Any], name: str, levels: Levels) -> tuple[tuple[Check, ...], Result | None]:
    """The checks of another reduction against the same 3D result; none where it has no answer."""
    from compare.kinds import kind_of
    from reduced1d.ladder import solve as solve_1d
    from scenes.checks import OF_THE_REDUCTION

    sink, options, fem3d = outcome.scene, outcome.options.but(reduction=name), outcome.solved
    times = fem3d.traces.time if fem3d.traces is not None else None
    try:
        result = solve_1d(sink, name, steady_only=options.steady, times=times, levels=levels)
    except RunawayError:
        return (), None
    checks = kind_of(sink).checks(replace(outcome, options=options, results={"fem3d": fem3d, "reduced1d": result}))
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
    split = next((s for s in getattr(causes, kind) if s.quantity == quantity and s.scale), None)
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
