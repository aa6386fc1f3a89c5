"""Solve the paper's active sink in 3D and with its 1D reduction, and say how far they agree:
a verdict for equations 12 to 18 and Figures 4 to 7, with the estimated numerical error.

examples:
  validate sink --voltage 1
  validate sink --voltage 2V --set sink.width=20um --set drive.electrodes=pad-edge
  validate sink --export my-model
  validate sink --why
  validate sink --left-out
  validate sink --sensitivities
  validate scene sink > mine.toml; validate sink mine.toml --accuracy 1e-4 --strict

results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/
exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

import argparse
from functools import partial
from typing import TYPE_CHECKING

from reduced1d.ladder import REDUCTIONS
from scenes.errors import SceneError, printable
from validate.cli import common

if TYPE_CHECKING:
    from scenes.plan import Request
    from scenes.sink import Sink


_FIRST, *_BETWEEN, _LAST = REDUCTIONS
OPTIONS = {
    **common.of_run("sink", "sink.width=20um", "relative accuracy of the 3D solution (default 1e-3 or the scene's)"),
    "--voltage V": 'voltage across the electrodes: 1, 2V or "500 mV"; for --set drive.voltage=V',
    **common.of_data('peak="T (K), Point 1", "end rise (K)=3", drive.voltage=Va', "peak"),
    "--steady": "",
    "--only {3d,1d}": "one model only",
    "--reduction R": f"the 1D model: {_FIRST} (default), {', '.join(_BETWEEN)} or {_LAST}[:N]; or one of your own, "
    "FILE.py:FUNCTION, FILE.cir, FILE.fmu, FILE.csv, or network",
    "--why": "split the 1D model's differences from 3D by the assumptions behind them",
    "--left-out": "what both models leave out, each solved in 3D, and all at once: the gas below and others",
    "--sensitivities": "how both models follow each key: d ln quantity / d ln key, 1D against 3D",
    **common.of_inputs("oxide_thickness=0.1um, voltage=1%%; or materials, for the scene's table of them",
                       "pad_width,oxide_width=0.9"),
    "--monte-carlo N": "with --uncertain, solve N samples of the inputs too: where is linear propagation off?",
    **common.OF_MODEL,
    "--fields": "write the 3D fields (fem3d.pvd with .vtu files, fem3d.vtkhdf)",
    "--field-times T,T...": "with --fields, times to store beside the usual ones: 0.1ms,2ms",
}  # fmt: skip


def run(arguments: argparse.Namespace) -> int:
    from scenes.keys import SINK
    from scenes.loading import load

    sink = load(
        arguments.scene or "sink", common.settings(arguments, ("drive.voltage", arguments.voltage)), scene_type=SINK
    )
    request = _request(arguments, sink)
    data_arguments = [arguments.against, *arguments.column] if arguments.against else []
    if arguments.against is not None and (not request.transient or "fem3d" not in request.models):
        raise SceneError("--against compares with the 3D model over time: leave out --steady and --only 1d")
    data, sampled = common.data_of(arguments, sink), None
    if request.monte_carlo:
        from validate.monte_carlo import added, check_apart

        if request.uncertain is not None:
            check_apart(sink, tuple(request.uncertain.relative))
        sampled = partial(added, count=request.monte_carlo)
    return common.run(arguments, sink, request, arguments.set, data_arguments, data, sampled)


def _request(arguments: argparse.Namespace, sink: Sink) -> Request:
    """What is asked for; SceneError where one thing leaves out another."""
    from compare.models import parse_reduction
    from scenes.kinds import Quantity
    from scenes.units import TIME

    only, named, times, samples = arguments.only, arguments.reduction, arguments.field_times, arguments.monte_carlo
    sampling = f"--monte-carlo {printable(samples or '')}"
    common.refuse(
        (arguments.why and only, f"--why compares both models: leave out --only {only}"),
        (arguments.left_out and only == "1d", "--left-out solves in 3D: leave out --only 1d"),
        (arguments.fields and only == "1d", "--fields writes the 3D model's fields: leave out --only 1d"),
        (
            arguments.export is not None and only == "1d",
            "--export writes a model of the 3D problem: leave out --only 1d",
        ),
        (
            only == "3d" and named is not None,
            f"--reduction {printable(named or '')} is a 1D model: leave out --only 3d",
        ),
        (
            times is not None and (not arguments.fields or arguments.steady),
            "--field-times needs --fields, and the transient: leave out --steady",
        ),
        (
            samples is not None and not arguments.uncertain,
            f"{sampling} samples uncertain inputs: give some with --uncertain, too",
        ),
        (samples is not None and only, f"--monte-carlo compares both models: leave out --only {only}"),
    )
    reduction, model = parse_reduction(named or "paper")
    reason = f"--reduction {printable(named or '')} is judged against 3D as it is: leave out"
    for option, chosen in (("--why", arguments.why), ("--only 1d", only == "1d"), ("--monte-carlo", samples)):
        common.refuse((model and chosen, f"{reason} {option}"))
    if samples is not None:
        from validate.monte_carlo import FEWEST, MOST

        samples = common.whole("--monte-carlo", samples, FEWEST, MOST)
    kind, stored = Quantity(TIME, 0.0, sink.end_time, note=", the end of the run"), times.split(",") if times else ()
    return common.request(
        arguments, sink, sink.accuracy,
        models={None: ("fem3d", "reduced1d"), "3d": ("fem3d",), "1d": ("reduced1d",)}[only],
        transient=not arguments.steady, reduction=reduction, model=model, monte_carlo=samples or 0,
        field_times=tuple(kind.read("--field-times", part.strip()) or 0.0 for part in stored),
    )  # fmt: skip
