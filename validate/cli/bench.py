"""Run time against error on the default sink and device: this toolkit's whole runs and its solver on a
given mesh, the 1D reductions, scikit-fem and, where installed, NGSolve; growth with the
unknowns; what each skip of the plan saves; start-up. Takes half an hour; --quick a minute.

examples:
  validate bench --quick
  validate bench --part transient --part steady --rounds 5
  validate bench --markdown docs/benchmark.md --json benchmark.json

exit status: 0 measured (an entry that fails is a row that says so), 2 bad input, 3 no reference could be made
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from scenes.errors import SceneError
from validate.cli import common
from validate.cli.terminal import FINE, progress, show

ROUNDS, QUICK_ROUNDS = 3, 1  # Defaults of --rounds, without and with --quick.
FOLDER = Path("results/bench")  # Where plots go if no page is written.


OPTIONS = {
    "--part {transient,steady,device,growth,skips,start-up} ...": "this part only, as often as needed",
    "--start-up": "the same as --part start-up: cold starts against a bare import",
    "--quick": "fewer and coarser entries, one round: to see that it works",
    "--rounds N": f"how often each entry is started (default {ROUNDS}, with --quick {QUICK_ROUNDS})",
    "--from FILE ...": "take the parts that an earlier --json holds from there, as often as needed",
    "--markdown FILE": "write the page, and its plots to figures/ beside it (default: plots only, to "
    "results/bench/)",
    "--json FILE": "write every number",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    rounds = common.whole("--rounds", arguments.rounds or str(QUICK_ROUNDS if arguments.quick else ROUNDS), 1, 100)
    page_file, numbers = (None if name is None else Path(name) for name in (arguments.markdown, arguments.json))
    files = [file for file in (page_file, numbers) if file is not None]
    for file in files:
        if not file.parent.is_dir():
            raise SceneError(f'"{file}" can\'t be written: there is no folder "{file.parent}"')
    from validate.bench import page
    from validate.bench.work import PARTS
    from validate.bench.work import run as measure
    from validate.report.summary import as_json, write_document

    wanted = [*arguments.part, *["start-up"] * arguments.start_up]
    wanted = wanted or [part for part in PARTS if part != "start-up" or not arguments.quick]
    earlier = _earlier(vars(arguments)["from"])
    with progress() as say:
        measurements = measure(wanted, rounds, arguments.quick, say, earlier)
    folder = FOLDER if page_file is None else page_file.parent / "figures"
    drawn = {part: folder / f"benchmark-{part}.png" for part in page.WORK if part in measurements}
    for part, path in drawn.items():
        folder.mkdir(parents=True, exist_ok=True)
        page.draw(part, measurements[part], path)
    if numbers is not None:
        write_document(numbers, as_json(measurements))
    if page_file is not None:
        linked = {part: f"figures/{path.name}" for part, path in drawn.items()}
        page_file.write_text(page.markdown(measurements, linked), encoding="utf-8")
    written = ", ".join(map(str, [*files, *drawn.values()]))
    show(page.text(measurements) + (f"\n\nWrote {written}" if written else ""))
    return FINE


def _earlier(names: list[str]) -> dict[str, Any]:
    """What earlier runs wrote; SceneError where a file is not one of theirs."""
    from validate.bench.work import SCHEMA

    measurements: dict[str, Any] = {}
    for name in names:
        try:
            read = json.loads(Path(name).read_text(encoding="utf-8"))
        except ValueError:
            read = None
        if not isinstance(read, dict) or not {"schema", "machine"} <= set(read):
            raise SceneError(f'--from "{name}" is no file of numbers that validate bench --json has written')
        if read["schema"] != SCHEMA:
            raise SceneError(f'--from "{name}" has numbers in another version\'s form: measure them anew')
        measurements |= read
    return measurements
