"""`validate bench`: run time against error, beside other programs."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from scenes.errors import SceneError
from validate.cli.terminal import FINE, Progress, show

ROUNDS, QUICK_ROUNDS = 3, 1
FOLDER = Path("results/bench")
"""For the plots, where no page is written."""


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Run time against error on the default sink and device: this toolkit's whole runs and its solver on a\n"
        "given mesh, the 1D reductions, scikit-fem and, where installed, NGSolve and FreeFEM; growth with the\n"
        "unknowns; what each skip of the plan saves; start-up. Takes half an hour; --quick a minute."
    )
    parser.epilog = (
        "examples:\n"
        "  validate bench --quick\n"
        "  validate bench --part transient --part steady --rounds 5\n"
        "  validate bench --markdown docs/benchmark.md --json benchmark.json\n\n"
        "exit status: 0 measured (an entry that fails is a row that says so), 2 bad input, 3 no reference could be made"
    )
    add = parser.add_argument
    parts = ("transient", "steady", "device", "growth", "skips", "start-up")
    add("--part", action="append", default=[], choices=parts, dest="parts", help="this part only, as often as needed")
    add("--start-up", action="store_true", help="the same as --part start-up: cold starts against a bare import")
    add("--quick", action="store_true", help="fewer and coarser entries, one round: to see that it works")
    add(
        "--rounds", metavar="N", help=f"how often each entry is started (default {ROUNDS}, with --quick {QUICK_ROUNDS})"
    )
    add("--from", action="append", default=[], metavar="FILE", dest="earlier",
        help="take the parts that an earlier --json holds from there, as often as needed")  # fmt: skip
    add(
        "--markdown",
        metavar="FILE",
        help="write the page, and its plots to figures/ beside it (default: plots only, to results/bench/)",
    )
    add("--json", metavar="FILE", help="write every number")


def run(arguments: argparse.Namespace) -> int:
    """Measures, writes and prints."""
    rounds = _rounds(arguments)
    files = [Path(name) for name in (arguments.markdown, arguments.json) if name is not None]
    for file in files:
        if not file.parent.is_dir():
            raise SceneError(f'"{file}" can\'t be written: there is no folder "{file.parent}"')
    from validate.bench import page
    from validate.bench.parts import PARTS
    from validate.bench.parts import run as measure
    from validate.report.summary import as_json, write_document

    earlier = _earlier(arguments.earlier)
    wanted = [*arguments.parts, *(["start-up"] if arguments.start_up else [])] or PARTS
    if arguments.quick and wanted is PARTS:
        wanted = [part for part in PARTS if part != "start-up"]
    with Progress() as progress:
        found = measure(wanted, rounds, arguments.quick, progress, earlier)
    if arguments.json:
        write_document(Path(arguments.json), as_json(found))
    if arguments.markdown:
        file = Path(arguments.markdown)
        drawn = _draw(found, file.parent / "figures")
        file.write_text(page.markdown(found, {part: f"figures/{path.name}" for part, path in drawn.items()}),
                        encoding="utf-8")  # fmt: skip
    else:
        drawn = _draw(found, FOLDER)
    written = [*files, *drawn.values()]
    show(page.text(found) + (f"\n\nWrote {', '.join(map(str, written))}" if written else ""))
    return FINE


def _rounds(arguments: argparse.Namespace) -> int:
    given = arguments.rounds
    if given is None:
        return QUICK_ROUNDS if arguments.quick else ROUNDS
    if not given.isascii() or not given.isdigit() or not 1 <= int(given) <= 100:
        raise SceneError(f'--rounds "{given}" is not allowed: give a whole number from 1 to 100')
    return int(given)


def _earlier(names: list[str]) -> dict[str, Any]:
    """What earlier runs wrote; SceneError where a file is not one of theirs."""
    import json

    from validate.bench.parts import SCHEMA

    found: dict[str, Any] = {}
    for name in names:
        try:
            read = json.loads(Path(name).read_text(encoding="utf-8"))
        except ValueError:
            read = None
        if not isinstance(read, dict) or not {"schema", "machine"} <= set(read):
            raise SceneError(f'--from "{name}" is no file of numbers that validate bench --json has written')
        if read["schema"] != SCHEMA:
            raise SceneError(f'--from "{name}" has numbers in another version\'s form: measure them anew')
        found |= read
    return found


def _draw(found: dict[str, Any], folder: Path) -> dict[str, Path]:
    from validate.bench import plots

    drawn = {part: folder / f"benchmark-{part}.png" for part in plots.TITLES if part in found}
    for part, path in drawn.items():
        folder.mkdir(parents=True, exist_ok=True)
        plots.draw(part, found[part], path)
    return drawn
