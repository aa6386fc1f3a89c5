"""What each skip of the plan saves: the same run with it and without it, in turns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from validate.bench import measure
from validate.bench.entries import Entry

ACCURACY = 1e-3
SOLVER = {
    "symmetry": "symmetry: a quarter is solved in place of the whole",
    "transient": "transient (`--steady`)",
    "second voltage": "mesh, factorization and fields of a second voltage (those of the first serve)",
}
QUICK = ("symmetry", "transient")
COMMANDS = {
    "figures (`--no-figures`), whole command from cold": (["sink", "--no-figures"], ["sink"]),
    "3D model (`--only 1d --no-figures`), whole command from cold": (
        ["sink", "--only", "1d", "--no-figures"],
        ["sink", "--no-figures"],
    ),
    "fields: not written without `--fields`, whole command from cold": (
        ["sink", "--no-figures"],
        ["sink", "--no-figures", "--fields"],
    ),
}


def run(quick: bool, count: int, progress: Callable[[str], None]) -> list[dict[str, Any]]:
    """A row for each skip: median seconds with it and without."""
    accuracy = 1e-2 if quick else ACCURACY
    pairs = [
        (name, [Entry(name, state, "skip_runs", {"skip": skip, "off": state == "off", "accuracy": accuracy})
                for state in ("on", "off")])
        for skip, name in SOLVER.items()
        if not quick or skip in QUICK
    ] + [
        (name, [Entry(name, state, "skip_runs", {"arguments": arguments})
                for state, arguments in zip(("on", "off"), both, strict=True)])
        for name, both in list(COMMANDS.items())[: 1 if quick else None]
    ]  # fmt: skip
    measured = measure.in_turns([entry for _, both in pairs for entry in both], count, progress, not quick)
    return [
        {"skip": name, "failure": on.failure or off.failure, "on_s": on.median_s, "off_s": off.median_s}
        for (name, _), on, off in zip(pairs, measured[::2], measured[1::2], strict=True)
    ]
