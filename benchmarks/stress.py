"""All tests of robustness, in order; the last are random scenes, each solved in a process under a time limit, held to
the invariants of its kind and solved again more finely."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import bars, extremes, invariants, mesh_files, random_scenes
from benchmarks.rows import Row, at_most, failed
from compare.processes import TimeIsUpError, limited
from compare.worker import DIED, map_tasks
from scenes.errors import NumericsError
from scenes.model import Scene
from scenes.result import Result

QUICK_SCENES = 24
HOLD_OUT = 1_000_000  # the first seed of scenes on which no constant is ever tuned
LIMIT, PATIENCE = 60, 20  # s of computing that a scene may take, and times that by the clock


@dataclass(frozen=True)
class Kind:
    """A kind of random scene.

    Attributes
    ----------
    name : heading of the table
    share : the number of random boxes over the number of scenes of this kind
    finer : how many times finer each is solved again. Tetrahedra don't reach a tenth of 1e-2 within their unknowns, and
        scenes with laws take too long for that. The finer solution's own error bound is added to the allowed distance.
    padding : largest median of error bound over true error; with laws the quadrature adds its own error bound
    draw : the scene of a seed
    always : the invariants of a steady scene
    in_turn : whether one of `invariants.IN_TURN`, which needs a further solution, is tested too
    on_files : whether the scene is solved on a mesh file; the finer solution is of the boxes themselves
    """

    name: str
    share: int
    finer: float
    padding: float
    draw: Callable[[int], Scene]
    always: dict[str, invariants.Test]
    in_turn: bool = False
    on_files: bool = False

    def solve(self, scene: Scene, seed: int) -> Result:
        """Solve a scene, on files of tetrahedra and of hexahedra by turns."""
        if not self.on_files:
            return invariants.solve(scene)
        with TemporaryDirectory() as folder:
            return invariants.solve(mesh_files.on_mesh(scene, Path(folder) / "boxes.msh", seed % 2 == 0))

    def tests(self, scene: Scene, seed: int) -> dict[str, invariants.Test]:
        """Return the invariants of the scene of a seed."""
        always, in_turn = invariants.OVER_TIME_ALWAYS, invariants.OVER_TIME_IN_TURN
        if scene.steady:
            always, in_turn = self.always, invariants.IN_TURN
        turn = list(in_turn)[seed % len(in_turn)]
        return always | ({turn: in_turn[turn]} if self.in_turn else {})


KINDS = {
    "boxes": Kind("random scenes", 1, 10.0, 5.0, random_scenes.boxes, invariants.ALWAYS, in_turn=True),
    "laws": Kind("random scenes with laws, contacts, radiation and given currents", 6, 3.0, 10.0, random_scenes.laws,
                 invariants.ALWAYS),
    "plates": Kind("random plates with 10 to 60 boxes", 24, 4.0, 5.0, random_scenes.plates, invariants.NEVER_COLDER),
    "meshes": Kind("random scenes on mesh files", 6, 10.0, 10.0, random_scenes.boxes_or_laws, invariants.ALWAYS,
                   on_files=True),
}  # fmt: skip


@dataclass
class Outcome:
    """The outcome of one scene: its violations by invariant, how it ended ("" where it was solved) and why, the seconds
    and unknowns, and the error bound over the true error (None without a finer solution)."""

    seed: int
    violations: dict[str, float] = field(default_factory=dict)
    ended: str = ""
    why: str = ""
    seconds: float = 0.0
    unknowns: int = 0
    padding: float | None = None


def examine(seed: int, kind: str, limit: int = LIMIT) -> Outcome:
    """Solve the scene of a seed, hold it to its invariants, and its error bounds to a finer solution."""
    started, outcome = time.process_time(), Outcome(seed)
    try:
        with limited(limit, PATIENCE * limit):
            # Drawing a scene with laws solves it with numbers first.
            scene = KINDS[kind].draw(seed)
            result = KINDS[kind].solve(scene, seed)
            outcome.unknowns = int(result.details["unknowns"])
            for name, test in KINDS[kind].tests(scene, seed).items():
                outcome.violations[name] = test(scene, result)
    except TimeIsUpError:
        outcome.ended = "out of time"
    except Exception as error:
        refused = isinstance(error, NumericsError)
        outcome.ended = "refused by name" if refused else "error"
        outcome.why = str(error) if refused else f"{type(error).__name__}: {error}"
    outcome.seconds = time.process_time() - started
    if not outcome.ended:
        # The finer accuracy may be out of reach or take too long.
        with suppress(TimeIsUpError, NumericsError), limited(limit, PATIENCE * limit):
            violation, outcome.padding = invariants.compared(scene, result, KINDS[kind].finer)
            outcome.violations[f"{'errors' if scene.steady else 'traces'} honoured by a finer solve"] = violation
    return outcome


def sweep(first: int, count: int, jobs: int, progress: Callable[[str], None], kind: str) -> list[Outcome]:
    """Return the outcomes of ``count`` seeds from ``first`` on, by some processes."""
    outcomes: list[Outcome] = []
    died = partial(Outcome, ended="error", why=DIED)
    for _, outcome in map_tasks(partial(examine, kind=kind), range(first, first + count), jobs, died):
        outcomes.append(outcome)
        progress(f"{len(outcomes)} of {count} {KINDS[kind].name}")
    return sorted(outcomes, key=lambda outcome: outcome.seed)


def rows(outcomes: list[Outcome], group: str, padding: float) -> Iterator[Row]:
    """Yield a row for each invariant, with its worst scene, and rows for how scenes ended."""
    count, first = len(outcomes), min(o.seed for o in outcomes)
    scenes = f"{count} scenes, seeds {first} to {first + count - 1}"
    for name in dict.fromkeys(name for o in outcomes for name in o.violations):
        values = {o.seed: o.violations[name] for o in outcomes if name in o.violations}
        worst = max(values, key=values.__getitem__)
        note = f"seed {worst}"
        if broken := [seed for seed, value in values.items() if not value <= 1.0]:
            worst, note = broken[0], f"violated by {len(broken)} of {len(values)}: seeds {str(broken[:8])[1:-1]}"
        case = f"{name}, {len(values)} of {scenes}"
        yield at_most(group, case, "largest violation over the error bounds", values[worst], 1.0, note)
    for ended in ("error", "out of time", "refused by name"):
        seeds = [o for o in outcomes if o.ended == ended]
        note = f"seed {seeds[0].seed}: {seeds[0].why}" if seeds else ""
        # A scene may run away, and an accuracy may be out of reach: both end in a sentence.
        yield at_most(group, f"{ended}, {scenes}", "scenes", len(seeds), count * (ended == "refused by name"), note)
    slowest = max(outcomes, key=lambda o: o.seconds)
    yield at_most(group, f"slowest with its invariants, {scenes}", "seconds", slowest.seconds, LIMIT + 5,
                  f"seed {slowest.seed}, {slowest.unknowns} unknowns")  # fmt: skip
    paddings = [o.padding for o in outcomes if o.padding is not None and np.isfinite(o.padding)]
    if paddings:
        lower, median, upper = np.quantile(paddings, (0.25, 0.5, 0.75))
        # Of n values the middle one is certain (95 %) to sqrt(n) places; of fewer than four nothing is.
        place = int(np.floor(len(paddings) / 2 - np.sqrt(len(paddings))))
        surely = sorted(paddings)[place] if place >= 0 else 0.0
        case = f"error bound over true error of the worst reading, {len(paddings)} of {scenes}"
        note = f"median {median:.3g}, quartiles {lower:.3g} and {upper:.3g}"
        yield at_most(group, case, "lower confidence limit of the median", surely, padding, note)


def run(quick: bool, scenes: int, seed: int, jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """Return all rows; of ``scenes`` random boxes and a share of the other kinds one half has ordinary seeds, the other
    hold-out seeds. ``quick`` takes fewer of everything else."""
    parts = {
        "aspect ratios and contrasts": extremes.families(quick), "voltages": extremes.runaway(quick),
        "bars of random laws": bars.rows(quick, seed),
    }  # fmt: skip
    table: list[Row] = []
    for name, part in parts.items():
        progress(name)
        try:
            table.extend(part)
        except Exception as error:
            table.append(failed(name, name, error))
    for name, kind in KINDS.items():
        count = -(-scenes // (2 * kind.share))
        for start, group in ((seed, kind.name), (HOLD_OUT + seed, f"{kind.name}, hold-out")):
            table += rows(sweep(start, count, jobs, progress, name), group, kind.padding)
    return table
