"""`validate sink`: the active sink in 3D and in 1D, and how far they agree."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Literal

from validate.cli import common

if TYPE_CHECKING:
    from compare.against.data import Data
    from scenes.plan import Request
    from scenes.sink import Sink

_ACCURACY = "1e-3"


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.description = (
        "Solve the paper's active sink in 3D and with its 1D reduction, and say how far they agree:\n"
        "a verdict for equations 12 to 18 and Figures 4 to 7, with the estimated numerical error."
    )
    parser.epilog = (
        "examples:\n"
        "  validate sink --voltage 1\n"
        "  validate sink --voltage 2V --set sink.width=20um --set drive.electrodes=pad-edge\n"
        "  validate sink --reduction moments:4 --export mine\n"
        "  validate sink --why\n"
        "  validate scene sink > mine.toml; validate sink mine.toml --accuracy 1e-4 --strict\n\n"
        "results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/\n"
    ) + common.STATUS
    common.options(
        parser, "sink", "sink.width=20um", f"relative accuracy of the 3D solution (default {_ACCURACY} or the scene's)"
    )
    add = parser.add_argument
    add("--voltage", metavar="V", help='voltage across the electrodes: 1, 2V or "500 mV"; for --set drive.voltage=V')
    add("--against", metavar="FILE",
        help="compare your own traces with 3D: a COMSOL table, a CSV or other table, an ngspice file")  # fmt: skip
    add("--column", action="append", default=[], metavar="NAME=COLUMN",
        help='what a column of that file is, where its name does not tell: peak="T (K), Point 1", "end rise (K)=3", '
        "drive.voltage=Va; as often as needed")  # fmt: skip
    add("--steady", action="store_true", help="the steady state only, no transient")
    add("--only", choices=("3d", "1d"), help="one model only")
    add("--reduction", metavar="R",
        help="the 1D model: paper (default), anchored, fin-massless, fin, plate or moments[:N]")  # fmt: skip
    add("--why", action="store_true", help="split the 1D model's differences from 3D by the assumptions behind them")
    add("--export", metavar="DIR",
        help="write the few-state model to DIR: JSON, a Python function, a SPICE subcircuit")  # fmt: skip
    add("--fields", action="store_true", help="write the 3D fields (fem3d.pvd with .vtu files, fem3d.vtkhdf)")
    add("--field-times", metavar="T,T...", help="with --fields, times to store beside the usual ones: 0.1ms,2ms")


def run(arguments: argparse.Namespace) -> int:
    """Solves, compares, writes and reports."""
    from dataclasses import replace

    from scenes.loading import load

    sink = load(arguments.scene, common.settings(arguments, ("drive.voltage", arguments.voltage)))
    request = _request(arguments, sink.end_time)
    if request.reduction != "paper":
        # What a scene declares is of the paper's model.
        sink = replace(sink, expected_to_differ=None)
    given = [arguments.against, *arguments.column] if arguments.against else []
    return common.run(arguments, sink, request, arguments.settings, given, _data(arguments, sink, request))


def _data(arguments: argparse.Namespace, sink: Sink, request: Request) -> Data | None:
    """The user's own traces, read before anything is solved."""
    from pathlib import Path

    from scenes.errors import SceneError

    if arguments.against is None:
        if arguments.column:
            raise SceneError("--column says what a column of --against FILE is: give that, too")
        return None
    if not request.transient or "fem3d" not in request.models:
        raise SceneError("--against compares with the 3D model over time: leave out --steady and --only 1d")
    from compare.against.data import read

    return read(Path(arguments.against), sink, arguments.column)


def _request(arguments: argparse.Namespace, end_time: float) -> Request:
    from pathlib import Path

    from reduced1d.ladder import canonical, few_states_of
    from scenes.errors import SceneError, printable
    from scenes.plan import Request

    if arguments.why and arguments.only:
        raise SceneError(f"--why compares both models: leave out --only {arguments.only}")
    if arguments.fields and arguments.only == "1d":
        raise SceneError("--fields writes the 3D model's fields: leave out --only 1d")
    if arguments.reduction is not None and arguments.only == "3d":
        raise SceneError(f"--reduction {printable(arguments.reduction)} is a 1D model: leave out --only 3d")
    reduction = canonical(arguments.reduction or "paper")
    if arguments.reduction is not None and arguments.export is not None and few_states_of(reduction) != reduction:
        raise SceneError(
            f"--export writes a model of a few states, which --reduction {reduction} is not: give moments:4 or the "
            "like, or leave out --reduction"
        )
    if arguments.export is not None and not arguments.export.strip():
        raise SceneError('--export "" names no folder: give one, such as my-model')
    models: dict[str | None, tuple[Literal["fem3d", "reduced1d"], ...]]
    models = {None: Request().models, "3d": ("fem3d",), "1d": ("reduced1d",)}
    return Request(
        models[arguments.only],
        transient=not arguments.steady,
        figures=arguments.figures,
        fields=arguments.fields,
        field_times=_field_times(arguments, end_time),
        reduction=reduction,
        why=arguments.why,
        export=Path(arguments.export) if arguments.export else None,
        command=arguments.command_line,
    )


def _field_times(arguments: argparse.Namespace, end_time: float) -> tuple[float, ...]:
    """The times (s) of --field-times; SceneError where they are none, beyond the end, or without fields to store."""
    if arguments.field_times is None:
        return ()
    from scenes.dimensions import TIME
    from scenes.errors import SceneError
    from scenes.kinds import Quantity

    if not arguments.fields or arguments.steady:
        raise SceneError("--field-times needs --fields, and the transient: leave out --steady")
    kind = Quantity(TIME, 0.0, end_time, note=", the end of the run")
    return tuple(float(kind.read("--field-times", part.strip()) or 0.0) for part in arguments.field_times.split(","))
