"""Solve the points of a sweep, by processes on this machine or by the workers of a Dask cluster.

A row has the columns of points.csv by name; without an answer its status is a word, and because a sentence.
"""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import Any

from compare import hottest, pipeline
from compare.blame import budget
from compare.kinds import kind_of
from compare.kinds.free import probed
from compare.options import Options
from compare.outcome import Outcome
from compare.verdict import Check
from compare.worker import EndedError, OverdueError, Worker, pool, share
from fem3d.runs import scene as scene_run
from reduced1d.ladder import solve as solve_1d
from reduced1d.ladder.levels import Levels
from scenes.checks import OF_THE_REDUCTION
from scenes.errors import NumericsError, RunawayError, SceneError, printable, quoted
from scenes.loading import overridden
from scenes.result import Result
from validate.report.summary import version
from validate.sweep.design import Row, Scope, Task

FINEST = 1e-4  # The accuracy down to which points with an open verdict are solved again; finer takes minutes.
OVER_TIME = {"fig6_peak": "peak", "fig6_end": "end", "fig7_current": "current"}
"""The difference in `compare.blame` of checks over time; the steady peak stands for the others."""
ANSWERS_WITHIN = 10.0  # Seconds that a scheduler has to answer.
ATTEMPTS = 3  # How often a point is tried whose process dies, before the point is taken to be at fault.

Outcomes = Iterator[tuple[Task, Future[Row]]]
Solver = Callable[[Iterable[Task]], Iterator[Row]]


@contextmanager
def solver(workers: int, scheduler: str | None, seconds: float | None) -> Iterator[Solver]:
    """Provide a function that yields the rows of points as they come, solved by ``workers`` processes here or by the
    workers of a ``scheduler``, with some ``seconds`` for each point.

    A point whose process dies is tried again; if it dies each time, its row says so. The function raises
    NumericsError where the workers are gone.
    """
    with ExitStack() as stack:
        if scheduler is None:
            processes = stack.enter_context(pool(workers))
            limit = seconds or math.inf
            yield partial(_rows, lambda tasks: share(processes, solve, tasks, limit, ATTEMPTS), seconds)
        else:
            yield partial(_rows, partial(_share_on, _connect(stack, scheduler), seconds), seconds)


def _rows(
    hand_out: Callable[[Iterable[Task]], Outcomes], seconds: float | None, tasks: Iterable[Task]
) -> Iterator[Row]:
    try:
        for (_, number, _), outcome in hand_out(tasks):
            failed = {"point": number, "status": "crashed", "because": "its processes died", "seconds": seconds or 0.0}
            try:
                yield outcome.result()
            except OverdueError:
                yield failed | {"status": "timeout", "because": f"it took more than {seconds:g} s (--point-timeout)"}
            except Exception as error:
                if not isinstance(error, EndedError) and type(error).__name__ != "KilledWorker":  # Dask's
                    raise
                yield failed
    except Exception as error:
        raise NumericsError(
            f"the workers are gone ({_shorten(error)}): what is solved is stored, and the same command goes on"
        ) from None


def _connect(stack: ExitStack, scheduler: str) -> Any:
    """Return a client of a cluster, closed with the stack. Raises SceneError where the cluster cannot be used."""
    logging.disable()  # the sentence here reports the failure
    stack.callback(logging.disable, logging.NOTSET)
    try:
        from distributed import Client

        client = stack.enter_context(Client(scheduler, timeout=ANSWERS_WITHIN))
        if others := set(client.run(version).values()) - {version()}:
            raise ValueError(f"its workers have version {', '.join(others)} of this program and not {version()}")
    except Exception as error:
        raise SceneError(
            f"--scheduler {quoted(scheduler)} cannot be used ({_shorten(error)}): give the address that dask scheduler "
            "prints, and install this program with Dask here and there: '.[cluster]'"
        ) from None
    return client


def _solve_in_time(seconds: float | None, *task: Any) -> Row:
    """Return the row of a point on a cluster, in a process that can be ended where there is a limit of time."""
    if seconds is None:
        return solve(*task)
    return Worker().run(seconds, solve, *task)


def _share_on(client: Any, seconds: float | None, tasks: Iterable[Task]) -> Outcomes:
    """Yield each task with its outcome; workers come and go."""
    from distributed import as_completed

    running = {client.submit(_solve_in_time, seconds, *task, pure=False): task for task in tasks}
    for future in as_completed(list(running)):
        yield running.pop(future), future


def _shorten(error: Exception) -> str:
    """The first line of an error's message."""
    return printable(str(error).strip().split("\n")[0] or type(error).__name__, 120)


def solve(scope: Scope, number: int, settings: list[str]) -> Row:
    """Return the row of a point; never raise for what a scene can cause."""
    started, because, row = time.perf_counter(), "", dict[str, Any]()
    try:
        row = columns(overridden(scope.scene, settings), scope)
        status = "ok"
    except Exception as error:
        words = {SceneError: "refused", RunawayError: "runaway", Exception: "failed"}
        status = next(word for kind, word in words.items() if isinstance(error, kind))
        because = str(error) if isinstance(error, (SceneError, ArithmeticError)) else f"{type(error).__name__}: {error}"
    took = round(time.perf_counter() - started, 4)
    return {"point": number, "status": status, "because": " ".join(because.split()), "seconds": took} | row


def columns(scene: Any, scope: Scope) -> Row:
    """Return the columns of a scene, solved again more finely while a verdict is open.

    A scene with probes has each of them, at the end where it is over time. The ``parts`` are the contributions of the
    assumptions to the relative difference of the check.
    """
    first, *others = scope.reductions
    sink, options = scene.kind == "sink", Options(steady=scope.steady, reduction=first, model=scope.model)
    scene = scene if sink else probed(scene)
    while True:
        if sink or scope.model:
            outcome = pipeline.solve(scene, options, answer=False)
            if outcome.failure is not None:
                raise outcome.failure
        else:
            outcome = Outcome(scene, options, {"fem3d": scene_run.solve(scene)})
        # The coarser models of the ladder tell the largest part; a reduction that stands on it needs both.
        levels: Any = Levels(scene, scope.reductions == ("paper",)) if sink else None
        answers = {first: (outcome.checks, outcome.reduced1d)}
        answers |= {name: _of_another(outcome, name, levels) for name in others}
        judged = [c for checks, _ in answers.values() for c in checks if scope.all_checks or c.id == scope.check]
        finer = max(scene.accuracy / 10, FINEST)
        if finer >= scene.accuracy or all(check.verdict != "unresolved" for check in judged):
            break
        scene = replace(scene, accuracy=finer)
    fem3d = outcome.solved
    values = _of_3d(scene, fem3d)
    for name, (checks, reduced1d) in answers.items():
        prefix, model = ("", "reduced1d_") if name == first else (f"{name}_", f"{name}_")
        values |= {f"{model}{quantity}": e.value for quantity, e in (reduced1d.steady if reduced1d else {}).items()}
        values |= {
            f"{prefix}{c.id}_{part}": getattr(c, part) for c in checks for part in ("difference", "u_num", "verdict")
        }
    parts = _parts(scope, fem3d, levels) if sink and scope.blame and not scope.model else {}
    return values | _too_hot(scene, fem3d) | _blame(parts) | {"accuracy": scene.accuracy, "parts": parts}


def _of_3d(scene: Any, fem3d: Result) -> dict[str, Any]:
    """The steady 3D quantities with their errors; of a free scene the probes, at the end where it is over time."""
    if scene.kind == "sink" or scene.steady or fem3d.traces is None:
        read = {name: (each.value, each.error) for name, each in fem3d.steady.items()}
    else:
        read = {name: (float(v[-1]), float(fem3d.traces.errors[name])) for name, v in fem3d.traces.values.items()}
    names = read if scene.kind == "sink" else [probe.name for probe in scene.probes]
    return {f"fem3d_{name}{end}": read[name][n] for name in names for n, end in enumerate(("", "_error"))}


def _too_hot(scene: Any, fem3d: Result) -> dict[str, Any]:
    """The material that gets hotter than its valid_to, "" for none, and the excess (K)."""
    if not (reached := hottest.reached(scene, fem3d)):
        return {}
    worst = max(reached, key=lambda each: each.excess)
    return {"too_hot": worst.material.name * (worst.excess > 0), "past_valid_to_K": worst.excess}


def _of_another(outcome: Outcome[Any], name: str, levels: Levels) -> tuple[tuple[Check, ...], Result | None]:
    """The checks of another reduction against the same 3D result; none where it has no answer."""
    sink, options, fem3d = outcome.scene, outcome.options.but(reduction=name), outcome.solved
    times = fem3d.traces.time if fem3d.traces is not None else None
    try:
        result = solve_1d(sink, name, steady_only=options.steady, times=times, levels=levels)
    except RunawayError:
        return (), None
    checks = kind_of(sink).checks(replace(outcome, options=options, results={"fem3d": fem3d, "reduced1d": result}))
    return tuple(check for check in checks if check.id in OF_THE_REDUCTION), result


def _parts(scope: Scope, fem3d: Result, levels: Levels) -> dict[str, float]:
    """The difference that the check is of, split by assumption; empty where it cannot be split."""
    quantity = OVER_TIME.get(scope.check, "")
    try:
        causes = budget(scope.reductions[0], fem3d if quantity else replace(fem3d, traces=None), levels)
    except RunawayError:
        return {}
    splits = causes.transient if quantity else causes.steady
    split = next((split for split in splits if split.quantity == (quantity or "peak") and split.scale), None)
    if split is None:
        return {}
    # A part within its own error is no ground to blame anything on.
    return {part.assumption: part.value / split.scale if abs(part.value) > part.error else 0.0 for part in split.parts}


def _blame(parts: dict[str, float]) -> Row:
    """The assumption with the largest part, and its share of the sum of all, taken without their signs."""
    name = max(parts, key=lambda name: abs(parts[name]), default="")
    total = sum(map(abs, parts.values()))
    return {"blame": name, "blame_share": abs(parts[name]) / total} if total else {"blame": "", "blame_share": None}
