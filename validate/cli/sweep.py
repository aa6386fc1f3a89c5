"""Solve and compare at many designs: a grid of the values of some keys, or a sample of their ranges.
Each solved point is stored at once: the same command goes on where it was stopped.

examples:
  validate sweep sink --vary sink.width=10um:200um:20 --vary anchor.oxide_length=10um:140um:14 --steady
  validate sweep sink --vary sink.width=5um:200um:12:log --vary drive.voltage=0.5,1,2 --reduction paper,fin
  validate sweep sink --sample 256 --vary sink.width=10um:200um --vary sink.thickness=1um:10um
  validate sweep mine.toml --vary "box.arm.upper.x=50um:150um:11" --model lumped.py:arm --check tip

results: points.csv, sweep.json, figures and report.html in results/<scene>-sweep-<what varies>/
exit status: 0 finished (points without an answer are rows with the reason), 2 bad input, 3 no point has an answer
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from compare.options import SINK, settings
from scenes.errors import SceneError, quoted
from validate.cli import common
from validate.cli.common import whole
from validate.cli.terminal import FINE, INTERRUPTED, NUMERICS, complain, progress, show

if TYPE_CHECKING:
    from validate.sweep.design import Design

ACCURACY = "1e-2"  # Default relative accuracy of each 3D solution.


def shared(vary: str) -> dict[str, str]:
    """Return the options of both commands; ``vary`` is the metavariable of --vary."""
    return {
        "scene SCENE": "sink, a scene file, or an example: bridge, plate, hotplate",
        "--vary KEY=... ...": vary,
        "--set KEY=VALUE ...": "override a key at every point",
        "--accuracy A": f"relative, of each 3D solution (default {ACCURACY}); open verdicts are solved again more "
        "accurately",
        "--voltage V": "the voltage at every point; for --set drive.voltage=V",
        "--reduction R,R...": "the sink's 1D models: paper (default), anchored, fin ...; blame is of the first. Or one "
        "of your own: FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv, network",
        "--model M": "a 1D model of your own, of any other scene: the same, or scene",
        "--workers N": "processes (default: one a processor)",
        "--scheduler ADDRESS": "a Dask cluster that is there, such as tcp://127.0.0.1:8786",
        "--point-timeout T": "stop a point after so long, 30s; it becomes a row that says so",
        "--no-blame": "don't split differences by assumption: a third quicker",
        "--fresh": "start over in the folder",
        "--out DIR": "the results folder; one with the same sweep goes on",
        "--no-figures": "", "--quiet": "", "--json": "print sweep.json in place of text",
    }  # fmt: skip


OPTIONS = {
    **shared("KEY=FROM:TO:COUNT[:log], or KEY=a,b,c; keys that move together: KEY+KEY=..."),
    "--sample N": "N points of a Sobol' sequence in ranges KEY=FROM:TO[:log], in place of a grid",
    "--seed S": "of the sample (default 0)",
    "--check ID": "the check, or probe, that figures and sentence are of (default fig4)",
    "--steady": "",
}


def run(arguments: argparse.Namespace) -> int:
    from validate.sweep.design import MOST, Design, parse

    base, asked = scene(arguments)
    if arguments.sample is None and arguments.seed is not None:
        raise SceneError(f"--seed {quoted(arguments.seed)} is of a sample: give --sample N too")
    sample = None if arguments.sample is None else whole("--sample", arguments.sample, 1, MOST)
    seed = whole("--seed", arguments.seed or "0", 0, 2**31)
    axes = tuple(parse(base, text, "grid" if sample is None else "sample") for text in arguments.vary)
    return execute(arguments, base, asked, Design(axes, sample, seed), steady=arguments.steady)


def scene(arguments: argparse.Namespace) -> tuple[Any, dict[str, Any]]:
    """Return the scene with the settings that hold at every point, and a record of them."""
    from scenes.loading import document, known_names, type_of_file
    from validate.sweep.design import load

    free = type_of_file(document(arguments.scene, known_names())[0]) is None
    for option in ("voltage", "reduction"):
        if getattr(arguments, option, None) and free:
            raise SceneError(f"--{option} is for a sink: set the keys of {quoted(arguments.scene)} with --set")
    if arguments.model and not free:
        raise SceneError("--model is of a scene of boxes or on a mesh: a sink has --reduction")
    steady = ["run.steady=true"] if free and getattr(arguments, "steady", False) else []
    return load(arguments.scene, [f"run.accuracy={ACCURACY}", *_settings(arguments), *steady])


def _models(arguments: argparse.Namespace, base: Any) -> tuple[tuple[str, ...], str]:
    """Return the names of the models, and the absolute path of the user's own model, if there is one.

    Raises SceneError for a name that is no model, as a run does."""
    from compare.models import chosen_model, open_model
    from validate.sweep.design import parse_reductions

    if not arguments.model:
        return parse_reductions([name.strip() for name in (arguments.reduction or "paper").split(",")])
    source = chosen_model(base, arguments.model)
    assert source is not None
    given, folder = str(source[0]), source[1]
    path = given if given == "network" else str((Path(folder) / given).resolve())
    open_model(path)
    return (Path(path).name,), path


def _settings(arguments: argparse.Namespace) -> list[str]:
    given = {"voltage": arguments.voltage, "accuracy": arguments.accuracy}
    return settings(SINK, given, arguments.set)


def execute(
    arguments: argparse.Namespace, base: Any, asked: dict[str, Any], design: Design, **request: Any
) -> int:  # fmt: skip
    """Run a sweep or a map and report on it; ``request`` is for `validate.sweep.design.prepare`."""
    from scenes.kinds import Quantity
    from scenes.units import TIME
    from validate.folder import folder_of_sweep
    from validate.report.text import wrapped
    from validate.sweep.design import prepare, read
    from validate.sweep.run import Store, run

    fixed = [read(base, *text.split("=", 1))[0] for text in _settings(arguments)]
    for key in design.keys:
        if set(fixed) & set(key.split("+")):
            raise SceneError(f"{key} is varied and set: give it one of the two")
    models = _models(arguments, base)
    job = prepare(base, asked, design, models, arguments.check, blame=arguments.blame, **request)
    if arguments.scheduler is not None and arguments.workers is not None:
        raise SceneError("--workers are those of this machine, and a --scheduler has its own: give one of the two")
    workers = None if arguments.workers is None else whole("--workers", arguments.workers, 1, 256)
    seconds = None
    if arguments.point_timeout is not None:
        seconds = Quantity(TIME, 0.01, 1e6).read("--point-timeout", arguments.point_timeout)
    # results/<scene>-sweep-<what varies>-<other options>.
    options = ("sample", "seed", "cells", "check", "tolerance", "solves")
    words = [f"{name}{value}" for name in options if (value := getattr(arguments, name, None)) is not None]
    words += ["model", arguments.model] if arguments.model else []
    words += ["steady"] * getattr(arguments, "steady", False) + [(arguments.reduction or "").replace(",", "-")]
    named = [*arguments.vary, *_settings(arguments)]
    folder = common.out(arguments) or folder_of_sweep(base.name, job.asked["kind"], named, *words)
    started = time.monotonic()
    with Store(folder, job.asked, arguments.fresh) as store:
        try:
            with progress(arguments.quiet) as say:
                table, document = run(
                    job, store, say, workers=workers, scheduler=arguments.scheduler, seconds=seconds,
                    figures=arguments.figures,
                )  # fmt: skip
        except KeyboardInterrupt:
            kept = f"{len(store.rows)} points are stored in {folder}"
            return complain(f"interrupted; {kept}, and the same command goes on", INTERRUPTED)
    said = f"{document['sentence']}."
    if arguments.json:
        show(json.dumps(document, indent=1))
    elif arguments.quiet:
        show(said)
    else:
        files = ", ".join(name for name in document["files"] if not name.endswith(".svg"))
        took = wrapped(f"{files}. Took {time.monotonic() - started:.1f} s.", "  ", "  ")
        show(f"{wrapped(said)}\n\nResults in {folder}/\n{took}")
    return FINE if table.ok.any() else complain("no point has an answer; points.csv says why of each", NUMERICS)
