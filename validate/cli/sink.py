"""`validate sink`: the active sink in 3D and in 1D, and how far they agree."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Literal

from validate.cli import common

if TYPE_CHECKING:
    from collections.abc import Callable

    from compare.against import Data
    from compare.outcome import Outcome
    from scenes.plan import Request
    from scenes.sink import Sink

_ACCURACY = "1e-3"


def describe(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    from reduced1d.ladder import REDUCTIONS

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
        "  validate sink --sensitivities\n"
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
    add("--data-uncertainty", action="append", default=[], metavar="U",
        help='the standard uncertainty of the data: 0.5K, 1%%, peak=0.5K or peak="a column"')  # fmt: skip
    add("--calibrate", action="append", default=[], metavar="KEY",
        help="fit a key to that data in 3D, as often as needed, and go on with what is fitted")  # fmt: skip
    common.shared(parser, {"--steady": ""})
    add("--only", choices=("3d", "1d"), help="one model only")
    first, *between, last = REDUCTIONS
    add("--reduction", metavar="R",
        help=f"the 1D model: {first} (default), {', '.join(between)} or {last}[:N]")  # fmt: skip
    add("--why", action="store_true", help="split the 1D model's differences from 3D by the assumptions behind them")
    add("--air", action="store_true",
        help="up to which coefficient losses to the air may be left out, and what a lumped term gives")  # fmt: skip
    add("--sensitivities", action="store_true",
        help="how both models follow each key: d ln quantity / d ln key, 1D against 3D")  # fmt: skip
    common.uncertain_options(add, "oxide_thickness=0.1um, voltage=1%%; or materials, for the scene's table of them",
                             "pad_width,oxide_width=0.9")  # fmt: skip
    add("--monte-carlo", metavar="N",
        help="with --uncertain, solve N samples of the inputs too: where is linear propagation off?")  # fmt: skip
    add("--export", metavar="DIR",
        help="write the few-state model to DIR: JSON, a Python function, a SPICE subcircuit")  # fmt: skip
    common.of_model(add, "in place of the 1D few-state model", "in place of the 1D few-state model")
    add("--fields", action="store_true", help="write the 3D fields (fem3d.pvd with .vtu files, fem3d.vtkhdf)")
    add("--field-times", metavar="T,T...", help="with --fields, times to store beside the usual ones: 0.1ms,2ms")


def run(arguments: argparse.Namespace) -> int:
    """Solves, compares, writes and reports."""
    from dataclasses import replace

    from scenes.loading import load

    sink = load(arguments.scene, common.settings(arguments, ("drive.voltage", arguments.voltage)))
    uncertain = common.uncertain(arguments, sink)
    request = replace(
        _request(arguments, sink.end_time),
        uncertain=uncertain,
        monte_carlo=_samples(arguments),
        data_uncertainty=tuple(arguments.data_uncertainty),
        calibrate=tuple(arguments.calibrate),
    )
    if request.reduction != "paper":
        # What a scene declares is of the paper's model.
        sink = replace(sink, expected_to_differ=None)
    given = [arguments.against, *arguments.column] if arguments.against else []
    data = _data(arguments, sink, request)
    return common.run(arguments, sink, request, arguments.settings, given, data, _sampling(request))


def _samples(arguments: argparse.Namespace) -> int:
    """The number of samples; none where they are not asked for."""
    if arguments.monte_carlo is None:
        return 0
    from scenes.errors import SceneError, printable
    from validate.monte_carlo import FEWEST, MOST

    text = arguments.monte_carlo
    if not arguments.uncertain:
        raise SceneError(f"--monte-carlo {printable(text)} samples uncertain inputs: give some with --uncertain, too")
    if arguments.only:
        raise SceneError(f"--monte-carlo compares both models: leave out --only {arguments.only}")
    if not text.isascii() or not text.isdigit() or not FEWEST <= int(text) <= MOST:
        raise SceneError(f"--monte-carlo {printable(text)}: give a whole number from {FEWEST} to {MOST}")
    return int(text)


def _sampling(request: Request) -> Callable[..., Outcome[Sink]] | None:
    """What adds the samples to a run, where they are asked for."""
    if not request.monte_carlo:
        return None
    from validate.monte_carlo import added

    return lambda outcome, say: added(outcome, request.monte_carlo, say)


def _data(arguments: argparse.Namespace, sink: Sink, request: Request) -> Data | None:
    """The user's own traces, read before anything is solved."""
    from pathlib import Path

    from scenes.errors import SceneError

    if arguments.against is None:
        if arguments.column:
            raise SceneError("--column says what a column of --against FILE is: give that, too")
        if arguments.data_uncertainty:
            raise SceneError("--data-uncertainty is that of the data of --against FILE: give that, too")
        if arguments.calibrate:
            raise SceneError("--calibrate fits keys to the data of --against FILE: give that, too")
        return None
    if not request.transient or "fem3d" not in request.models:
        raise SceneError("--against compares with the 3D model over time: leave out --steady and --only 1d")
    from validate.against.read import read

    data = read(Path(arguments.against), sink, arguments.column)
    if arguments.data_uncertainty:
        from compare.inputs.validation import data_uncertainty

        data_uncertainty(sink, data, arguments.data_uncertainty)
    if arguments.calibrate:
        from compare.inputs.calibration import asked

        if not arguments.data_uncertainty:
            raise SceneError("--calibrate weighs the data by what they are known to: give --data-uncertainty, too")
        asked(sink, arguments.calibrate, data)
    return data


def _request(arguments: argparse.Namespace, end_time: float) -> Request:
    from reduced1d.ladder import canonical, few_states_of
    from scenes.errors import SceneError, printable
    from scenes.plan import Request

    if arguments.why and arguments.only:
        raise SceneError(f"--why compares both models: leave out --only {arguments.only}")
    if arguments.air and arguments.only:
        raise SceneError(f"--air compares both models: leave out --only {arguments.only}")
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
    export = common.export(arguments)
    if export is not None and export.compact and arguments.reduction is not None:
        raise SceneError("--states and --model-accuracy are of a compact model in 3D: leave them or --reduction out")
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
        sensitivities=arguments.sensitivities,
        air=arguments.air,
        export=export,
        command=arguments.command_line,
    )


def _field_times(arguments: argparse.Namespace, end_time: float) -> tuple[float, ...]:
    """The times (s) of --field-times; SceneError where they are none, beyond the end, or without fields to store."""
    if arguments.field_times is None:
        return ()
    from scenes.errors import SceneError
    from scenes.kinds import Quantity
    from scenes.units import TIME

    if not arguments.fields or arguments.steady:
        raise SceneError("--field-times needs --fields, and the transient: leave out --steady")
    kind = Quantity(TIME, 0.0, end_time, note=", the end of the run")
    return tuple(float(kind.read("--field-times", part.strip()) or 0.0) for part in arguments.field_times.split(","))
