"""`validate sweep`: the comparison at many designs; and what `validate map` has in common with it."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from scenes.errors import SceneError, quoted
from validate.cli import common
from validate.cli.common import whole
from validate.cli.terminal import FINE, INTERRUPTED, NUMERICS, Progress, complain, show

if TYPE_CHECKING:
    from pathlib import Path

    from validate.sweep.base import Base
    from validate.sweep.design import Design
    from validate.sweep.job import Means
    from validate.sweep.output import Outcome

ACCURACY, PAPER = "1e-2", "paper"
EXIT = "exit status: 0 finished (points without an answer are rows that say why), 2 bad input, 3 no point has an answer"


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Solve and compare at many designs: a grid of the values of some keys, or a sample of their ranges.\n"
        "What is solved is stored at once: the same command goes on where it was stopped."
    )
    parser.epilog = (
        "examples:\n"
        "  validate sweep sink --vary sink.width=10um:200um:20 --vary anchor.oxide_length=10um:140um:14 --steady\n"
        "  validate sweep sink --vary sink.width=5um:200um:12:log --vary drive.voltage=0.5,1,2 --reduction paper,fin\n"
        "  validate sweep sink --sample 256 --vary sink.width=10um:200um --vary sink.thickness=1um:10um\n"
        '  validate sweep mine.toml --vary "box.arm.upper.x=50um:150um:11"\n\n'
        "results: points.csv, sweep.json, figures and report.html in results/<scene>-sweep-<what varies>/\n"
    ) + EXIT
    options(parser, "KEY=FROM:TO:COUNT[:log], or KEY=a,b,c; keys that move together: KEY+KEY=...")
    add = parser.add_argument
    add("--sample", metavar="N", help="N points of a Sobol' sequence in ranges KEY=FROM:TO[:log], in place of a grid")
    add("--seed", metavar="S", help="of the sample (default 0)")
    add("--check", metavar="ID", help="the check, or probe, that figures and sentence are of (default fig4)")
    common.shared(parser, {"--steady": ""})


_VALUES = {
    "voltage": ("V", "the voltage at every point; for --set drive.voltage=V"),
    "reduction": ("R,R...", "the 1D models: paper (default), anchored, fin ...; blame is of the first"),
    "workers": ("N", "processes (default: one a processor)"),
    "scheduler": ("ADDRESS", "a Dask cluster that is there, such as tcp://127.0.0.1:8786"),
    "point-timeout": ("T", "stop a point after so long, 30s; it becomes a row that says so"),
}


def options(parser: argparse.ArgumentParser, vary: str) -> None:
    """What both commands take."""
    add = parser.add_argument
    add("scene", metavar="SCENE", help="sink, a scene file, or an example: bridge, plate, hotplate")
    add("--vary", action="append", default=[], metavar="KEY=...", help=vary)
    accuracy = f"relative, of each 3D solution (default {ACCURACY}); open verdicts are solved again more accurately"
    common.shared(parser, {"--set": "override a key at every point", "--accuracy": accuracy})
    for name, (metavar, said) in _VALUES.items():
        add(f"--{name}", metavar=metavar, help=said)
    add("--no-blame", action="store_false", dest="blame", help="don't split differences by assumption: a third quicker")
    add("--fresh", action="store_true", help="start over in the folder")
    folder = "the results folder; one with the same sweep goes on"
    common.shared(parser, {
        "--out": folder, "--no-figures": "", "--quiet": "", "--json": "print sweep.json in place of text",
    })  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    """Sweeps, writes and reports."""
    from validate.sweep.axes import parse
    from validate.sweep.design import MOST, Design

    base = scene(arguments, [])
    if arguments.sample is None and arguments.seed is not None:
        raise SceneError(f"--seed {quoted(arguments.seed)} is of a sample: give --sample N too")
    sample = None if arguments.sample is None else whole("--sample", arguments.sample, 1, MOST)
    seed = whole("--seed", arguments.seed or "0", 0, 2**31)
    axes = tuple(parse(base, text, "grid" if sample is None else "sample") for text in arguments.vary)
    return execute(arguments, base, Design(axes, sample, seed), None, arguments.steady)


def scene(arguments: argparse.Namespace, more: list[str]) -> Base:
    """The scene with the settings that hold at every point."""
    from validate.sweep.base import base

    given = common.settings(arguments, ("drive.voltage", arguments.voltage))
    keys = {text.partition("=")[0].strip() for text in (*given, *arguments.vary)}
    if not keys & {"run.accuracy", "accuracy"}:
        given = [f"run.accuracy={ACCURACY}", *given]
    found = base(arguments.scene, [*given, *more])
    of_a_sink = {
        "--voltage": arguments.voltage,
        "--reduction": arguments.reduction,
        "--steady": getattr(arguments, "steady", False),
    }
    for option, is_given in of_a_sink.items():
        if is_given and found.kind == "free":
            raise SceneError(f"{option} is for a sink: set the keys of {quoted(arguments.scene)} with --set")
    return found


def execute(arguments: argparse.Namespace, base: Base, design: Design, solves: int | None, steady: bool) -> int:
    """Runs a job and reports on it; both commands end here."""
    import time

    from validate.sweep.job import Job, checked
    from validate.sweep.output import write
    from validate.sweep.point import Scope
    from validate.sweep.run import run
    from validate.sweep.store import Store

    base.at(())
    _refuse_set_and_varied(base, design)
    check = checked(base, arguments.check, steady, design.keys)
    reductions = _reductions(arguments.reduction or PAPER)
    job = Job(base, design, Scope(reductions, steady, check, arguments.blame, solves is None), solves)
    means = _means(arguments)
    folder = common.out(arguments) or _folder(arguments, base, solves is not None)
    started = time.monotonic()
    with Store(folder, job.document(), arguments.fresh) as store:
        try:
            with Progress(arguments.quiet) as say:
                found = run(job, store, means, say)
                say("writing the results")
                outcome = write(job, store, found, arguments.figures, time.monotonic() - started)
        except KeyboardInterrupt:
            kept = f"{len(store)} points are stored in {folder}"
            return complain(f"interrupted; {kept}, and the same command goes on", INTERRUPTED)
    _report(arguments, outcome, folder, time.monotonic() - started)
    return FINE if outcome.table.ok.any() else complain("no point has an answer; points.csv says why of each", NUMERICS)


def _report(arguments: argparse.Namespace, outcome: Outcome, folder: Path, seconds: float) -> None:
    import json

    from validate.report.table import wrapped

    if arguments.json:
        show(json.dumps(outcome.document, indent=1))
        return
    said = f"{outcome.sentence[0].upper()}{outcome.sentence[1:]}."
    if arguments.quiet:
        show(said)
        return
    files = ", ".join(name for name in outcome.document["files"] if not name.endswith(".svg"))
    show(f"{wrapped(said)}\n\nResults in {folder}/\n{wrapped(f'{files}. Took {seconds:.1f} s.', '  ', '  ')}")


def _reductions(given: str) -> tuple[str, ...]:
    from reduced1d.ladder import canonical

    return tuple(dict.fromkeys(canonical(part.strip()) for part in given.split(",")))


def _refuse_set_and_varied(base: Base, design: Design) -> None:
    given = {base.read(*(part.strip() for part in text.split("=", 1)))[0] for text in base.settings}
    for key in design.keys:
        if given & set(key.split("+")):
            raise SceneError(f"{key} is varied and set: give it one of the two")


def _means(arguments: argparse.Namespace) -> Means:
    from scenes.kinds import Quantity
    from scenes.units import TIME
    from validate.processes import processors
    from validate.sweep.job import Means

    if arguments.scheduler is not None and arguments.workers is not None:
        raise SceneError("--workers are those of this machine, and a --scheduler has its own: give one of the two")
    seconds = None
    if arguments.point_timeout is not None:
        seconds = Quantity(TIME, 0.01, 1e6).read("--point-timeout", arguments.point_timeout)
    workers = processors() if arguments.workers is None else whole("--workers", arguments.workers, 1, 256)
    return Means(workers, arguments.scheduler, seconds)


def _folder(arguments: argparse.Namespace, base: Base, mapped: bool) -> Path:
    """results/<scene>-sweep-<what varies>, with what else is asked for."""
    from validate.report.names import of_sweep

    settings = [*arguments.vary, *common.settings(arguments, ("drive.voltage", arguments.voltage))]
    given = [
        (name, getattr(arguments, name, None)) for name in ("sample", "seed", "cells", "check", "tolerance", "solves")
    ]
    words = [f"{name}{value}" for name, value in given if value is not None]
    words += ["steady"] * getattr(arguments, "steady", False)
    words += [arguments.reduction.replace(",", "-")] if arguments.reduction else []
    return of_sweep(base.name, "map" if mapped else "sweep", settings, *words)
