"""What commands have in common: options, overrides, the plan, the report; whole numbers and pages of tables."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scenes.errors import SceneError, printable, quoted, reason
from validate.cli.terminal import DIFFERS, FINE, Progress, show, style

if TYPE_CHECKING:
    from compare.against import Data
    from scenes.plan import Export, Request, Step
    from scenes.uncertain import Uncertain

PLAN = ("--explain", "--dry-run")
MOST_STATES = 400  # that can be asked for; a model has no more than its structure needs
STATUS = "exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed"


_SHARED: dict[str, dict[str, Any]] = {
    "--set": {"action": "append", "default": [], "metavar": "KEY=VALUE", "dest": "settings"},
    "--accuracy": {"metavar": "A"},
    "--out": {"metavar": "DIR", "help": "the results folder; a run that is there is replaced"},
    "--steady": {"action": "store_true", "help": "the steady state only, no transient"},
    "--no-figures": {"action": "store_false", "dest": "figures", "help": "no figures"},
    "--explain": {"help": "print first what will be solved and what is skipped, and why; then run"},
    "--dry-run": {"help": "print that plan alone: nothing is solved or written"},
    "--strict": {"help": "exit with 1 for any check not as declared (undeclared: expected to agree), or unresolved"},
    "--jobs": {"metavar": "N", "help": "processes at once (default: one a processor)"},
    "--markdown": {"metavar": "FILE", "help": "write the table as a page of the documentation too"},
    "--quiet": {"help": "print one line only"},
    "--json": {"help": "print summary.json in place of the tables"},
}
"""The options that several commands have, each declared once."""
OF_A_TABLE = {
    "--jobs": "", "--markdown": "", "--quiet": "print the outcome only, one line", "--json": "print the table as JSON",
}  # fmt: skip


def shared(parser: argparse.ArgumentParser, options: Mapping[str, str]) -> None:
    """Adds some of these by name, each with a help of the command's own where that is not empty."""
    for name, said in options.items():
        given = _SHARED[name] | ({"help": said} if said else {})
        parser.add_argument(name, **given if "metavar" in given else {"action": "store_true"} | given)


def options(parser: argparse.ArgumentParser, scene: str, example: str, accuracy: str) -> None:
    """Adds those of a run: the default ``scene``, an ``example`` of an override, what ``--accuracy`` means."""
    parser.add_argument("scene", nargs="?", default=scene, metavar="SCENE.toml",
                        help=f'a scene file (default: the built-in "{scene}")')  # fmt: skip
    given = {"--set": f"override a key of the scene, as often as needed: {example}", "--accuracy": accuracy}
    quiet = {"--quiet": "print the answer and the verdict only, in one line"}
    shared(parser, given | dict.fromkeys(("--out", "--no-figures", *PLAN, "--strict"), "") | quiet | {"--json": ""})


def uncertain_options(add: Callable[..., Any], example: str, pair: str) -> None:
    """Adds those that say how well keys are known, with an ``example`` of that, and a ``pair`` that goes together."""
    add("--uncertain", action="append", default=[], metavar="KEY=U",
        help=f"the standard uncertainty of a key, as often as needed: {example}")  # fmt: skip
    add("--correlated", action="append", default=[], metavar="KEY,KEY=R",
        help=f"the correlation of two uncertain keys, from -1 to 1: {pair}")  # fmt: skip


def uncertain(arguments: argparse.Namespace, scene: object) -> Uncertain | None:
    """How well the keys are known; None where nothing is said of it."""
    if not arguments.uncertain and not arguments.correlated:
        return None
    from scenes.uncertain import read

    return read(scene, arguments.uncertain, arguments.correlated)


def settings(arguments: argparse.Namespace, *more: tuple[str, str | None], accuracy: str = "run.accuracy") -> list[str]:
    """The overrides, with the options that stand for some, ``accuracy`` being the key of that one; SceneError where two
    set one key."""
    given = [(key, value) for key, value in (*more, (accuracy, arguments.accuracy)) if value is not None]
    for key, value in given:
        for setting in arguments.settings:
            if _sets(setting, key):
                option = f"--{key.rpartition('.')[2].removesuffix('_3d')} {value}"
                raise SceneError(f"{option} and --set {printable(setting)} both set {key}: give one of them")
    return [*arguments.settings, *(f"{key}={value}" for key, value in given)]


def _sets(setting: str, path: str) -> bool:
    """Whether an override is of a key: by its path, the end of that, or as an item of its section."""
    key, _, value = (part.strip() for part in setting.partition("="))
    item = path.removeprefix(f"{key}.")
    return key == path or path.endswith(f".{key}") or (item != path and item in value)


def run(
    arguments: argparse.Namespace,
    scene: Any,
    request: Request,
    overrides: Sequence[str],
    given: Sequence[str] = (),
    data: Data | None = None,
    then: Callable[..., Any] | None = None,
) -> int:
    """Explains, solves, writes and reports a scene as asked, and returns the exit status. The folder's name has the
    ``overrides`` in it and, of a user's own ``data``, the file ``given`` and what is said of its columns;
    ``then`` adds to what was found."""
    from validate.report import names

    folder = out(arguments) or names.of(scene, request, overrides, given)
    planned = _explained(arguments, scene, request, data)
    if arguments.dry_run:
        return FINE
    from validate.report.output import run

    with Progress(arguments.quiet) as progress:
        more = None if then is None else partial(then, say=progress)
        outcome = run(scene, request, folder, progress, data, more)
    from compare.verdict import contrary
    from validate.report import text

    against = contrary(outcome.checks, scene, getattr(arguments, "strict", False))
    if arguments.json:
        show((outcome.folder / "summary.json").read_text(encoding="utf-8").rstrip("\n"))
    elif arguments.quiet:
        show(" ".join(text.headline(outcome, against, style()).split()))
    else:
        show(text.outcome_text(outcome, against, style(), planned))
    return DIFFERS if against else FINE


def out(arguments: argparse.Namespace) -> Path | None:
    """The folder that was asked for; SceneError where it has no name."""
    if arguments.out is not None and not arguments.out.strip():
        raise SceneError('--out "" names no folder: give one, such as results/mine')
    return Path(arguments.out) if arguments.out else None


def _explained(
    arguments: argparse.Namespace, scene: Any, request: Request, data: Data | None
) -> tuple[Step, ...] | None:  # fmt: skip
    """The plan, printed; ``None`` where that is not asked for. SceneError where several things to print are."""
    asked = [name for name in ("explain", "dry_run", "quiet", "json") if getattr(arguments, name)]
    if len(asked) > 1:
        told = " and ".join(f"--{name.replace('_', '-')}" for name in asked)
        raise SceneError(f"{told} print different things: give one of them")
    if not arguments.explain and not arguments.dry_run:
        return None
    from compare.pipeline import plan
    from validate.report import text

    planned = plan(scene, request, data)
    show(text.plan_text(planned, style()) + ("\n" if arguments.explain else ""))
    return planned


def jobs(given: str | None) -> int:
    """How many processes to use; SceneError for what is no positive number."""
    from validate.processes import processors

    return processors() if given is None else whole("--jobs", given, 1, 256)


def whole(option: str, given: str, least: int, most: int) -> int:
    """A whole number that was given; SceneError for what is none, or out of range."""
    if not given.isascii() or not given.isdigit() or not least <= int(given) <= most:
        raise SceneError(f"{option} is {quoted(given)}: give a whole number from {least} to {most}")
    return int(given)


def show_rows(
    arguments: argparse.Namespace, report: Any, rows: Sequence[Any], seconds: float, page: Callable[..., str]
) -> None:
    """Prints the rows of a table in the form that was asked for, of those that ``report`` has, and writes their
    ``page``; SceneError where that can't be done."""
    from validate.report.summary import provenance

    if arguments.markdown is not None:
        try:
            Path(arguments.markdown).write_text(page(rows, provenance()).rstrip("\n") + "\n", encoding="utf-8")
        except OSError as error:
            raise SceneError(f"--markdown {quoted(arguments.markdown)} can't be written: {reason(error)}") from None
    if arguments.json:
        show(json.dumps(report.document(rows, provenance(), seconds), indent=1, allow_nan=False))
    elif arguments.quiet:
        show(report.headline(rows))
    else:
        show(f"{report.text(rows, style())}\n\n{seconds:.0f} s")


def of_model(add: Callable[..., Any], states: str, accuracy: str) -> None:
    """Adds the options of a compact model, with what holds where they are left out."""
    add("--states", metavar="N", help=f"with --export, how many states a compact model has ({states})")
    add("--model-accuracy", metavar="A", help=f"with --export, the relative accuracy of a compact model ({accuracy})")


def export(arguments: argparse.Namespace, accuracy: float | None = None) -> Export | None:
    """The model that is asked for, with an ``accuracy`` where none is given; SceneError for one that can't be."""
    from scenes.keys import ACCURACY
    from scenes.plan import Export

    states, given = arguments.states, arguments.model_accuracy
    if arguments.export is None:
        if states is not None or given is not None:
            option = f"--states {states}" if states is not None else f"--model-accuracy {given}"
            raise SceneError(f"{printable(option)} is of the model that --export DIR writes: give that, too")
        return None
    if not arguments.export.strip():
        raise SceneError('--export "" names no folder: give one, such as my-model')
    if states is not None and given is not None:
        raise SceneError("--states says how many states, --model-accuracy takes as many as it needs: give one of them")
    if given is not None:
        accuracy = ACCURACY.read("--model-accuracy", given)
    count = None if states is None else whole("--states", states, 1, MOST_STATES)
    return Export(Path(arguments.export), count, accuracy)
