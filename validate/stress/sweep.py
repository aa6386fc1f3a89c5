"""All tests of robustness, in order; the last are random scenes, each solved and held to the invariants under a time
limit, side by side in processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Literal

import numpy as np

from compare.processes import TimeIsUpError, limited
from compare.worker import DIED, map_tasks
from validate.stress import compact_models, extremes, steps
from validate.stress.report import Row, failed

QUICK_SCENES = 24
Kind = Literal["boxes", "laws", "plates"]
GROUPS: dict[Kind, str] = {
    "boxes": "random scenes", "laws": "random scenes with laws, contacts, radiation and given currents",
    "plates": "random plates with 10 to 60 boxes",
}  # fmt: skip
SHARES: dict[Kind, int] = {"boxes": 1, "laws": 6, "plates": 24}
"""Of how many random scenes one is drawn of each kind."""
FINER: dict[Kind, float] = {"boxes": 10.0, "laws": 3.0, "plates": 4.0}
"""How many times finer each scene is solved again: tetrahedra don't reach a tenth of 1e-2 within the unknowns that they
may have, and with laws that takes too long. The finer solve's own error is added to what is allowed."""
PADDED: dict[Kind, float] = {"boxes": 5.0, "laws": 10.0, "plates": 5.0}
"""How many times the true error the stated one may be, in the median; with laws quadratures and rounds add theirs."""
SOON = 1.0  # s after which a scene that is out of reach should be refused
LATE_REFUSALS = 1.5e-3  # of all scenes, that may be refused later
LIMIT, PATIENCE = 60, 20  # s of computing a scene with its invariants may take, and times that by the clock


@dataclass(frozen=True)
class Outcome:
    """A scene's seed, its violations by invariant, how it ended ("" where it was solved), seconds and unknowns, and the
    stated over the true error (None without a finer solve)."""

    seed: int
    violations: dict[str, float] = field(default_factory=dict)
    ended: str = ""
    said: str = ""
    seconds: float = 0.0
    unknowns: int = 0
    padding: float | None = None


def examine(seed: int, limit: int = LIMIT, kind: Kind = "boxes") -> Outcome:
    """Solves the scene of a seed and holds it to the invariants of its kind under a ``limit`` (s), and its errors to a
    finer solve under another."""
    import time

    from scenes.errors import ConvergenceError, NumericsError
    from validate.stress import invariants, random_effects, random_plates, random_scenes

    started, padding = time.process_time(), None
    violations: dict[str, float] = {}
    unknowns, ended, said = 0, "", ""
    try:
        with limited(limit, PATIENCE * limit):
            # A scene to be heated until laws matter is solved with numbers first, which may be out of reach as well.
            draw, tests_of = {
                "boxes": (random_scenes.draw, invariants.tests), "laws": (random_effects.draw, invariants.of_laws),
                "plates": (random_plates.draw, invariants.of_plates),
            }[kind]  # fmt: skip
            drawn = draw(seed)
            tests = tests_of(drawn)
            result = invariants.solve(drawn.scene)
            unknowns = int(result.details["unknowns"])
            for each, test in tests.items():
                violations[each] = test(drawn, result)
    except TimeIsUpError:
        ended = "out of time"
    except Exception as error:
        ended, said = "error", f"{type(error).__name__}: {error}"
        # Thermal runaway, or an accuracy out of reach: a sentence that says why.
        if isinstance(error, NumericsError) and not isinstance(error, ConvergenceError):
            ended, said = "refused by name", str(error)
    seconds = time.process_time() - started
    if not ended:
        try:
            with limited(limit, PATIENCE * limit):
                violation, padding = invariants.compared(drawn, result, FINER[kind])
                violations[f"{'errors' if drawn.scene.steady else 'traces'} honoured by a finer solve"] = violation
        except (TimeIsUpError, NumericsError):
            # An accuracy that is out of reach, or takes too long, is not the one that was asked for.
            pass
    return Outcome(seed, violations, ended, said, seconds, unknowns, padding)


def sweep(first: int, count: int, jobs: int, progress: Callable[[str], None], kind: Kind = "boxes") -> list[Outcome]:
    """The outcomes of ``count`` seeds from ``first`` on, by some processes."""
    outcomes = []
    seeds = range(first, first + count)
    for _, outcome in map_tasks(
        partial(examine, kind=kind), seeds, jobs, lambda seed: Outcome(seed, {}, "error", DIED)
    ):
        outcomes.append(outcome)
        progress(f"{len(outcomes)} of {count} {GROUPS[kind]}")
    return sorted(outcomes, key=lambda outcome: outcome.seed)


def rows(outcomes: list[Outcome], kind: Kind = "boxes") -> Iterator[Row]:
    """One row per invariant with the worst scene, and rows for how scenes ended."""
    group, count, first = GROUPS[kind], len(outcomes), min(o.seed for o in outcomes)
    extremes = f"{count} scenes, seeds {first} to {first + count - 1}"
    names = dict.fromkeys(name for o in outcomes for name in o.violations)
    for name in names:
        held = [(o.violations[name], o.seed) for o in outcomes if name in o.violations]
        # NaN compares false with everything: put it first by hand.
        worst, seed = max(held, key=lambda pair: (pair[0] != pair[0], pair[0]))
        broken = [s for value, s in held if not value <= 1.0]
        said = f"worst: seed {seed}"
        if broken:
            said = f"violated by {len(broken)} of {len(held)}: seeds {', '.join(map(str, broken[:8]))}"
        yield Row(group, name, f"{len(held)} of {extremes}", "violation over what errors allow",
                  float("inf") if worst != worst else worst, 1.0, said=said)  # fmt: skip
    seeds = {ended: [o for o in outcomes if o.ended == ended] for ended in ("error", "out of time", "refused by name")}
    first_of = {ended: f"seed {scenes[0].seed}: {scenes[0].said}" if scenes else "" for ended, scenes in seeds.items()}
    late = ", ".join(str(o.seed) for o in seeds["out of time"][:8])
    for what, ended, said in (
        ("ended with an error", "error", first_of["error"]),
        (f"computed for more than {LIMIT} s", "out of time", f"seeds {late}" if late else ""),
    ):
        yield Row(group, what, extremes, "scenes", len(seeds[ended]), 0, said=said)
    slowest = max(outcomes, key=lambda o: o.seconds)
    yield Row(group, "the slowest scene with its invariants", extremes, "seconds", slowest.seconds, LIMIT + 5,
              said=f"seed {slowest.seed}, {slowest.unknowns} unknowns")  # fmt: skip
    paddings = [o.padding for o in outcomes if o.padding is not None]
    if known := [padding for padding in paddings if padding < float("inf")]:
        lower, median, upper = np.quantile(known, (0.25, 0.5, 0.75))
        # Of n the middle one is known to some sqrt(n) places (95 %): of fewer than four nothing is.
        lowest = int(np.floor(len(known) / 2 - np.sqrt(len(known))))
        surely = sorted(known)[lowest] if lowest >= 0 else 0.0
        yield Row(
            group,
            "stated over true error of the reading that is off most",
            f"{len(known)} of {extremes}",
            "median, 95 % sure to be more than",
            surely,
            PADDED[kind],
            said=f"median {median:.3g}, quartiles {lower:.3g} and {upper:.3g}; {len(paddings) - len(known)} more are "
            "off by rounding",
        )
    if refused := seeds["refused by name"]:
        # That a scene with laws runs away is told by solving it.
        late_ones = [o for o in refused if o.seconds > SOON and kind != "laws"]
        yield Row(group, f"refused after more than {SOON:g} s", extremes, "scenes", len(late_ones),
                  max(1, round(LATE_REFUSALS * count)), said=f"seeds {', '.join(str(o.seed) for o in late_ones[:8])}"
                  if late_ones else "")  # fmt: skip
        yield Row(group, "refused by name: runaway, or out of reach", extremes, "scenes", len(refused), count,
                  said=first_of["refused by name"])  # fmt: skip


def run(quick: bool, scenes: int, seed: int, jobs: int, progress: Callable[[str], None]) -> list[Row]:
    """The rows; ``quick`` takes fewer of each kind, ``scenes`` random ones from ``seed`` on."""
    parts: dict[str, Callable[[], Iterator[Row]]] = {
        "time steps": steps.rows,
        "explicit coupling": lambda: steps.coupling(quick),
        "aspect ratios and contrasts": lambda: extremes.families(quick),
        "voltages": lambda: extremes.runaway(quick),
        "drives": lambda: extremes.drives(quick),
        "accuracies": lambda: extremes.accuracies(quick),
        "compact models": lambda: compact_models.rows(quick, seed),
    }
    table: list[Row] = []
    for name, part in parts.items():
        progress(name)
        try:
            for row in part():
                table.append(row)
        except Exception as error:
            table.append(failed(name, name, error))
    kinds: tuple[Kind, ...] = ("boxes", "laws", "plates")
    for kind in kinds:
        table += rows(sweep(seed, -(-scenes // SHARES[kind]), jobs, progress, kind), kind)
    return table
