"""What commands have in common: options, overrides, the plan, the report; whole numbers and pages of tables."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from scenes.errors import SceneError, printable, quoted, reason
from validate.cli.terminal import BAD_INPUT, DIFFERS, FINE, INTERRUPTED, NUMERICS, complain, progress, show, style

if TYPE_CHECKING:
    from compare.against import Data
    from compare.verdict import Check
    from scenes.plan import Export, Request
    from scenes.uncertain import Uncertain
    from validate.report.verdicts import Report
    from validate.run.outcome import Outcome

R = TypeVar("R")
MOST_STATES = 400  # The most states that --states takes; a model has no more than its structure needs.
_SHARED = {
    "--out DIR": "the results folder; a run that is there is replaced",
    "--steady": "the steady state only, no transient",
    "--no-figures": "no figures",
    "--explain": "print first what will be solved and what is skipped, and why; then run",
    "--dry-run": "print that plan alone: nothing is solved, or written but a picture of the scene in --out DIR",
    "--strict": "exit with 1 for any check not as declared (undeclared: expected to agree), or unresolved",
    "--jobs N": "processes at once (default: one a processor)",
    "--markdown FILE": "write the table as a page of the documentation too",
    "--quiet": "print one line only",
    "--json": "print summary.json in place of the tables",
}
"""The help texts of options that several commands have."""
OF_A_TABLE = {
    "--jobs N": "", "--markdown FILE": "", "--quiet": "print the outcome only, one line",
    "--json": "print the table as JSON",
}  # fmt: skip


def add(parser: argparse.ArgumentParser, options: Mapping[str, str]) -> None:
    """Adds options with their helps (empty for those above), in the words of a usage line: "--voltage V" takes a value,
    "--only {3d,1d}" one of these, "--column NAME=COLUMN ..." is given as often as needed, "--check ID!" must be given,
    "--steady" is a switch, and "--no-figures" switches ``figures`` off. What has no dashes stands by itself, in
    brackets where it may be left out: "[scene SCENE.toml]"."""
    for usage, said in options.items():
        bare = usage[1:-1] if usage.startswith("[") else usage.removesuffix("!").removesuffix(" ...")
        name, _, value = bare.partition(" ")
        keywords: dict[str, Any] = {"help": said or _SHARED[usage]}
        if value.startswith("{"):
            keywords["choices"] = value.strip("{}").split(",")
        elif value:
            keywords["metavar"] = value
        elif name.startswith("--no-"):
            keywords |= {"action": "store_false", "dest": name.removeprefix("--no-")}
        else:
            keywords["action"] = "store_true"
        if usage.endswith(" ..."):
            keywords |= {"action": "append", "default": []}
        if usage.endswith("!"):
            keywords["required"] = True
        if usage.startswith("["):
            keywords["nargs"] = "?"
        parser.add_argument(name, **keywords)


def of_run(scene: str, example: str, accuracy: str) -> dict[str, str]:
    """The options of a run: the default ``scene``, an ``example`` of an override, what ``--accuracy`` means."""
    return {
        "[scene SCENE.toml]": f'a scene file (default: the built-in "{scene}")',
        "--set KEY=VALUE ...": f"override a key of the scene, as often as needed: {example}",
        "--accuracy A": accuracy, "--out DIR": "", "--no-figures": "", "--explain": "", "--dry-run": "", "--strict": "",
        "--quiet": "print the answer and the verdict only, in one line", "--json": "",
    }  # fmt: skip


def of_inputs(example: str, pair: str) -> dict[str, str]:
    """The options that say how well keys are known, with an ``example`` of that, and a ``pair`` that goes together."""
    return {
        "--uncertain KEY=U ...": f"the standard uncertainty of a key, as often as needed: {example}",
        "--correlated KEY,KEY=R ...": f"the correlation of two uncertain keys, from -1 to 1: {pair}",
    }


OF_DATA = {
    "--against FILE": "compare your own traces with 3D: a COMSOL table, a CSV or other table, an ngspice file",
    "--column NAME=COLUMN ...": "what a column of that file is, where its name does not tell: {column}; "
    "as often as needed",
    "--data-uncertainty U ...": 'the standard uncertainty of the data: 0.5K, 1%%, {name}=0.5K or {name}="a column"',
    "--calibrate KEY ...": "fit a key to that data in 3D, as often as needed, and go on with what is fitted",
}


def of_data(column: str, name: str) -> dict[str, str]:
    """The options of a user's own data, with an example of a ``column`` and the ``name`` of a quantity."""
    return {option: said.format(column=column, name=name) for option, said in OF_DATA.items()}


def data_of(arguments: argparse.Namespace, scene: Any) -> Data | None:
    """The user's own data, read before anything is solved. Raises SceneError."""
    if arguments.against is None:
        refuse(
            (arguments.column, "--column says what a column of --against FILE is: give that, too"),
            (arguments.data_uncertainty, "--data-uncertainty is that of the data of --against FILE: give that, too"),
            (arguments.calibrate, "--calibrate fits keys to the data of --against FILE: give that, too"),
        )
        return None
    from compare.data import read

    data = read(Path(arguments.against), scene, arguments.column, arguments.data_uncertainty)
    if arguments.calibrate:
        from validate.inputs.calibration import keys_of
        from validate.run.kinds.inputs import of_model

        if not arguments.data_uncertainty:
            raise SceneError("--calibrate weighs the data by what they are known to: give --data-uncertainty, too")
        if not of_model(tuple(arguments.calibrate)):
            keys_of(scene, arguments.calibrate, data)
    return data


OF_MODEL = {
    "--export DIR": "write a compact model of a few states to DIR: JSON, Python, SPICE, FMU; with its error",
    "--states N": "with --export, how many states the model has (default: as few as --model-accuracy takes)",
    "--model-accuracy A": "with --export, the relative accuracy of the model (default: the scene's)",
}


def refuse(*faults: tuple[object, str]) -> None:
    """SceneError with the sentence of the first fault that is one."""
    for is_one, sentence in faults:
        if is_one:
            raise SceneError(sentence)


def request(arguments: argparse.Namespace, scene: object, accuracy: float, **more: Any) -> Request:
    """What is asked for by the options that are called as the fields of a Request are, and ``more``, which an option's
    own text is no value of; ``accuracy`` is an exported model's where none is given. SceneError for what can't be."""
    from scenes.plan import Request

    read = {"uncertain": uncertain(arguments, scene), "export": export(arguments, accuracy)}
    values: dict[str, Any] = vars(arguments) | read | {"command": arguments.command_line} | more
    chosen = {field.name: values[field.name] for field in fields(Request) if field.name in values}
    for name in chosen:
        chosen[name] = tuple(chosen[name]) if isinstance(chosen[name], list) else chosen[name]
    return Request(**chosen)


def uncertain(arguments: argparse.Namespace, scene: object) -> Uncertain | None:
    """How well the keys are known; None where nothing is said of it."""
    if not arguments.uncertain and not arguments.correlated:
        return None
    from scenes.uncertain import read

    return read(scene, arguments.uncertain, arguments.correlated)


def settings(arguments: argparse.Namespace, *more: tuple[str, str | None], accuracy: str = "run.accuracy") -> list[str]:
    """Overrides, and options that stand for some (``accuracy``: that one's key). SceneError where two set one key."""
    options = [(key, value) for key, value in (*more, (accuracy, arguments.accuracy)) if value is not None]
    for key, value in options:
        for setting in arguments.set:
            # By the key's path, the end of that, or as an item of its section.
            override, _, said = (part.strip() for part in setting.partition("="))
            item = key.removeprefix(f"{override}.")
            if override == key or key.endswith(f".{override}") or (item != key and item in said):
                option = f"--{key.rpartition('.')[2].removesuffix('_3d')} {value}"
                raise SceneError(f"{option} and --set {printable(setting)} both set {key}: give one of them")
    return [*arguments.set, *(f"{key}={value}" for key, value in options)]


def run(
    arguments: argparse.Namespace,
    scene: Any,
    request: Request,
    overrides: Sequence[str],
    given: Sequence[str] = (),
    data: Data | None = None,
    then: Callable[..., Any] | None = None,
) -> int:
    """Explains, solves, reports and writes a scene as asked, the answer first, and returns the exit status. The name of
    the folder has the ``overrides`` in it and, of a user's own ``data``, the file ``given`` and what is said of its
    columns; ``then`` adds to what was found."""
    from validate.report import of
    from validate.report.folder import folder_of
    from validate.report.table import found_text, kept_text, plan_text
    from validate.run.plan import declared

    scene = declared(scene, request)
    folder, planned = out(arguments) or folder_of(scene, request, overrides, given), None
    outputs = [
        f"--{name}" for name in ("explain", "dry-run", "quiet", "json") if vars(arguments)[name.replace("-", "_")]
    ]
    refuse((len(outputs) > 1, f"{' and '.join(outputs)} print different things: give one of them"))
    if arguments.explain or arguments.dry_run:
        from validate.run.pipeline import plan

        planned = plan(scene, request, data)
        if arguments.dry_run and arguments.out:
            _picture(scene, folder)
        show(plan_text(planned, style()) + ("\n" if arguments.explain else ""))
    if arguments.dry_run:
        return FINE
    from validate.report.output import run

    against: tuple[Check, ...] = ()
    with progress(arguments.quiet) as say:

        def tell(outcome: Outcome[Any]) -> None:
            from compare.verdict import contrary

            nonlocal against
            against = tuple(contrary(outcome.checks, scene, getattr(arguments, "strict", False)))
            say("")  # which clears the line
            if arguments.quiet:
                show(" ".join(of(scene).headline(outcome, against, style()).split()))
            elif not arguments.json:
                show(found_text(outcome, against, style()) + "\n")

        outcome = run(scene, request, folder, say, data, then and partial(then, say=say), tell)
    if arguments.json:
        show((outcome.folder / "summary.json").read_text(encoding="utf-8").rstrip("\n"))
    elif not arguments.quiet:
        show(kept_text(outcome, style(), planned))
    if outcome.runs_away:
        return complain(outcome.runs_away, NUMERICS)
    if outcome.failed:
        kept = f"{outcome.failed}; what 3D found is kept"
        return complain(kept, BAD_INPUT if isinstance(outcome.failed, SceneError) else NUMERICS)
    if outcome.interrupted:
        return INTERRUPTED
    return DIFFERS if against else FINE


def _picture(scene: Any, folder: Path) -> None:
    """Draws a scene that is not solved, where it is one of boxes."""
    from validate.folder import Folder
    from validate.report.figures.scene_picture import save
    from validate.report.folder import PICTURE, RUN
    from validate.viewer.boxes import of_boxes

    show(f"Wrote {Folder(folder, RUN).add(PICTURE, partial(save, of_boxes(scene)))}\n")


def out(arguments: argparse.Namespace) -> Path | None:
    """The folder that was asked for; SceneError where it has no name."""
    if arguments.out is not None and not arguments.out.strip():
        raise SceneError('--out "" names no folder: give one, such as results/mine')
    return Path(arguments.out) if arguments.out else None


def whole(option: str, given: str, least: int, most: int) -> int:
    """A whole number that was given; SceneError for what is none, or out of range."""
    if not given.isascii() or not given.isdigit() or not least <= int(given) <= most:
        raise SceneError(f"{option} is {quoted(given)}: give a whole number from {least} to {most}")
    return int(given)


def table(
    arguments: argparse.Namespace, report: Report[R], rows: Callable[..., Sequence[R]], more: str = ""
) -> Sequence[R]:  # fmt: skip
    """The rows of a table, which a number of processes find, printed in the form that was asked for, of those that
    ``report`` has, and written as a page, which says ``more``; SceneError where that can't be done."""
    from compare.processes import processors
    from validate.report.summary import provenance

    jobs = processors() if arguments.jobs is None else whole("--jobs", arguments.jobs, 1, 256)
    started = time.perf_counter()
    with progress() as say:
        answers = rows(jobs, say)
    seconds = time.perf_counter() - started
    if arguments.markdown is not None:
        page = report.markdown(answers, provenance(), more).rstrip("\n") + "\n"
        try:
            Path(arguments.markdown).write_text(page, encoding="utf-8")
        except OSError as error:
            raise SceneError(f"--markdown {quoted(arguments.markdown)} can't be written: {reason(error)}") from None
    if arguments.json:
        show(json.dumps(report.document(answers, provenance(), seconds), indent=1, allow_nan=False))
    elif arguments.quiet:
        show(report.headline(answers))
    else:
        show(f"{report.text(answers, style())}\n\n{seconds:.0f} s")
    return answers


def export(arguments: argparse.Namespace, accuracy: float) -> Export | None:
    """The model that is asked for, of an ``accuracy`` where none is given; SceneError for one that can't be."""
    from scenes.keys import ACCURACY
    from scenes.plan import Export

    states, model_accuracy = vars(arguments).get("states"), vars(arguments).get("model_accuracy")
    if vars(arguments).get("export") is None:
        option = f"--model-accuracy {model_accuracy}" if states is None else f"--states {states}"
        more = states is not None or model_accuracy is not None
        refuse((more, f"{printable(option)} is of the model that --export DIR writes: give that, too"))
        return None
    both = states is not None and model_accuracy is not None
    refuse(
        (not arguments.export.strip(), '--export "" names no folder: give one, such as my-model'),
        (both, "--states says how many states, --model-accuracy takes as many as it needs: give one of them"),
    )
    if model_accuracy is not None:
        accuracy = ACCURACY.read("--model-accuracy", model_accuracy) or accuracy
    count = None if states is None else whole("--states", states, 1, MOST_STATES)
    return Export(Path(arguments.export), accuracy, count)
