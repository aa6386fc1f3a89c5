"""What a run of each kind of scene solves, checks, draws and writes, and why it leaves out the rest: the one place that
decides it, and the plan that says so.

``of_sink``, ``of_device`` and ``of_free`` make the whole plan; the lines of the 3D model are its own.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from compare.verdict import FIRST_TIME
from scenes.checks import (
    DEFAULT_TOLERANCES,
    DEVICE_3D_TOLERANCES,
    DEVICE_TOLERANCES,
    ISLAND_TOLERANCES,
    OF_THE_REDUCTION,
    OVER_TIME,
)  # fmt: skip
from scenes.device import Device
from scenes.plan import Request, Step, skipped_together, step
from scenes.sink import Sink

if TYPE_CHECKING:
    from compare.against import Data
    from scenes.model import AnyScene
    from scenes.plan import Export
    from scenes.uncertain import Uncertain

SINK_FIGURES = {
    "figure4": "the steady 3D temperature field, rendered off screen",
    "figure5": "the rise along the beam and eq 9's parabola",
    "figure6": "rises against time",
    "figure7": "current against time",
}
ROW_FIGURES = {
    "islands": "the rise along the whole row",
    "islands_runs": "how the differences run with the number of spans and with an island's length",
}
"""Of a sink of several spans, which has no figure 5."""
DEVICE_FIGURES = {
    "figure9": "power of sink and sensor against time",
    "figure10": "heat flow into the polymer against time",
    "figure11": "the same as figure 9, sampled every 5 ms with gains of 0.5 and 0.05 V",
    "figure12": "the sensor's power after outer steps from -80 to +20 K",
    "figure13": "the steady power of the sensor against the outer temperature",
}
LATE = ("figure11", "figure12", "figure13")
"""The figures of a device that need runs of their own, which the paper's scheme does not make."""
BLAME = "blame"
"""The plan's line of what is to blame."""
_NO_FIGURES = "no figures were asked for"
_STEADY = "only the steady state was asked for"
_FIELD_FILES = "fem3d.pvd with its .vtu files, and fem3d.vtkhdf where VTK can"
ONLY_1D = Step("3D model", "skipped", "only the 1D model was asked for")


def of_sink(sink: Sink, request: Request, solver: tuple[Step, ...], data: Data | None = None) -> tuple[Step, ...]:
    """The plan of a sink around the lines of the 3D ``solver``."""
    made, drawn = made_checks(sink, request), skipped_figures(request, sink)
    steps = [*solver, _reduction(request)]
    if made:
        steps.append(Step("checks", "done", ", ".join(made)))
    steps += skipped_together("checks", skipped_checks(sink, request))
    steps += [Step(name, "done", what) for name, what in figures_of(sink).items() if name not in drawn]
    steps += skipped_together("figures", drawn)
    steps.append(step("traces.csv", "every quantity against time", "" if request.transient else _STEADY))
    steps += _where_asked_for(request)
    steps.append(step("field files", _FIELD_FILES, fields_reason(request, "fem3d" in request.models)))
    turned = "" if "figure4" in drawn else ", with the field to turn"
    steps.append(Step("report.html", "done", f"everything on one page{turned}"))
    if data is not None and request.calibrate:
        steps.append(
            Step("fit", "done", f"{', '.join(request.calibrate)} by least squares, the rest with what is fitted")
        )
    if data is not None and (request.uncertain is not None or request.data_uncertainty):
        steps.append(Step("validation", "done", "E = S - D against u_val of ASME V&V 20, of both models"))
    if data is not None:
        said = data.said().partition(": ")[2].rstrip(".")
        steps.append(Step(f"against {data.name}", "done", f"{said}; interpolated in time"))
    return tuple(steps)


def skipped_checks(sink: Sink, request: Request) -> dict[str, str]:
    """The checks that a run of a sink can't make, each with the reason."""
    if "fem3d" not in request.models:
        return dict.fromkeys(checks_of(sink), "they need the 3D model")
    skipped: dict[str, str] = {}
    if not request.transient:
        skipped |= dict.fromkeys(OVER_TIME, "they need the transient")
    elif sink.end_time <= FIRST_TIME:
        skipped |= dict.fromkeys(OVER_TIME, "they compare from 10 us on, and the run ends before")
    if "reduced1d" not in request.models:
        skipped |= dict.fromkeys(OF_THE_REDUCTION, "they need the 1D model")
    if sink.spans == 2:
        inner = (check for check in ISLAND_TOLERANCES if "inner" in check)
        skipped |= dict.fromkeys(inner, "both of two spans are outer ones")
    return {check: skipped[check] for check in checks_of(sink) if check in skipped}


def checks_of(sink: Sink) -> tuple[str, ...]:
    """The checks that there are of a sink, in the order in which they are reported: of one span those of the paper's
    equations and figures, of several those of their equivalence, and the peak's."""
    return tuple(DEFAULT_TOLERANCES) if sink.spans == 1 else (*ISLAND_TOLERANCES, "fig4", "energy")


def made_checks(sink: Sink, request: Request) -> tuple[str, ...]:
    """The checks that a run of a sink makes, in the order in which they are reported."""
    skipped = skipped_checks(sink, request)
    return tuple(check for check in checks_of(sink) if check not in skipped)


def figures_of(sink: Sink) -> dict[str, str]:
    """The figures that there are of a sink, and what each shows."""
    return SINK_FIGURES if sink.spans == 1 else {n: w for n, w in SINK_FIGURES.items() if n != "figure5"} | ROW_FIGURES


def skipped_figures(request: Request, sink: Sink) -> dict[str, str]:
    """The figures that a run of a sink doesn't draw, each with the reason."""
    if not request.figures:
        return dict.fromkeys(figures_of(sink), _NO_FIGURES)
    skipped: dict[str, str] = {}
    if not request.why:
        skipped["islands_runs"] = "other rows are solved for it only with --why"
    if "fem3d" not in request.models:
        skipped |= dict.fromkeys(("figure4", "figure5", *ROW_FIGURES), "there is no 3D field")
    if not request.transient:
        skipped |= dict.fromkeys(("figure6", "figure7"), _STEADY)
    return {name: why for name, why in skipped.items() if name in figures_of(sink)}


def fields_reason(request: Request, solved: bool = True, missing: str = "there is no 3D field") -> str:
    """Why no field files are written; empty where they are. ``solved`` says whether there is a temperature field."""
    return "not asked for (--fields)" if not request.fields else "" if solved else missing


def _reduction(request: Request) -> Step:
    if "reduced1d" not in request.models:
        return Step("1D model", "skipped", "only the 3D model was asked for")
    when = "steady and at the 3D model's times" if "fem3d" in request.models else "steady and over time"
    from reduced1d.ladder import describe

    name = request.reduction
    model = describe(name) if name == "paper" else f"{name}, {describe(name)}"
    return Step("1D model", "done", f"{model}, {when if request.transient else 'steady only'}")


def _where_asked_for(request: Request) -> list[Step]:
    """What is done only when asked for, and so has no line where it isn't."""
    steps = []
    if request.why:
        said = f"the ladder of models between {request.reduction} and 3D, one assumption each"
        steps.append(Step("why", "done", said))
    elif request.models == Request().models:
        steps.append(Step(BLAME, "done", "by the ladder between the models, where the 1D model differs"))
    if request.uncertain is not None:
        steps.append(_uncertain(request.uncertain))
    if request.air:
        steps.append(Step("air", "done", "3D at coefficients from 0 to 1e5 W/(m2 K), and where the limits are"))
    if request.sensitivities:
        of = "by dual solutions in 3D, by the formulas in 1D" if len(request.models) > 1 else "of one model"
        steps.append(Step("sensitivity", "done", f"how quantities follow each key, {of}"))
    if request.export is not None:
        from reduced1d.ladder import few_states_of

        few = f"{few_states_of(request.reduction)} as JSON, Python and SPICE"
        steps.append(Step("export", "done", _exported(request.export) if request.export.compact else few))
    return steps


def _uncertain(uncertain: Uncertain) -> Step:
    given = ", ".join(uncertain.given)
    return Step("uncertain inputs", "done", f"{given}: u_input by the sensitivities, to first order")


def of_device(device: Device, request: Request) -> tuple[Step, ...]:
    """The plan of a device."""
    scheme = {
        "accurate": "all layers at once, exact between samples but for V2/R, its error estimated",
        "paper": "the paper's own: partitioned, Crank-Nicolson and Runge-Kutta; the accurate one beside it",
    }
    found = [
        step("3D model", f"a few states of the whole device, known to {device.accuracy_3d:g}", _not_in_3d(request)),
        Step("1D device", "done", f"{scheme[request.scheme]}; from cold to {device.end_time:g} s"),
    ]
    if request.meter:
        found.append(Step("meter", "done", f"resistances are rounded to what the {request.meter} resolves"))
    if request.sensitivities:
        found.append(Step("sensitivity", "done", "how the steady state in 1D follows each key, by its closed form"))
    if needs(device, request, "figure11"):
        found.append(Step("1D device, slow", "done", "sampled every 5 ms with gains of 0.5 and 0.05 V"))
    if needs(device, request, "figure12", "figure13"):
        found.append(Step("1D device, steps", "done", "from the steady state, for outer steps from -80 to +20 K"))
    if request.in_3d:
        drawn = {"figure11", "figure12", "figure13"} & set(drawn_figures(request))
        idle = "" if drawn else "only figures 11 to 13 show them, and none is drawn"
        found.append(
            step("3D runs of other steps", "the slow one and the outer steps, as far as figures show them", idle)
        )
    made = made_device_checks(device, request)
    if made:
        found.append(Step("checks", "done", ", ".join(made)))
    found += skipped_together("checks", skipped_device_checks(device, request))
    if in_3d := made_3d_checks(device, request):
        found.append(Step("checks of 3D", "done", ", ".join(in_3d)))
    found += [Step(name, "done", DEVICE_FIGURES[name]) for name in drawn_figures(request)]
    left = figures_left_out(request) if request.figures else dict.fromkeys(DEVICE_FIGURES, _NO_FIGURES)
    found += skipped_together("figures", left)
    found.append(Step("traces.csv", "done", "a row per controller sample"))
    found.append(step("designer's questions", "largest gains, range and resolution", design_reason(request)))
    return tuple(found)


def figures_left_out(request: Request) -> dict[str, str]:
    """The figures that a run of a device is not about, each with the reason."""
    found = {name: _only(request) for name in DEVICE_FIGURES if request.about and name not in request.about}
    if request.scheme == "paper":
        found |= dict.fromkeys(LATE, "they need nine more runs, and the accurate scheme for them")
    return found


def drawn_figures(request: Request) -> tuple[str, ...]:
    """The figures that a run of a device draws."""
    left = figures_left_out(request)
    return tuple(name for name in DEVICE_FIGURES if name not in left) if request.figures else ()


def skipped_device_checks(device: Device, request: Request) -> dict[str, str]:
    """The checks that a run of a device can't make, each with the reason."""
    left = figures_left_out(request)
    skipped = {check: left[_figure_of(check)] for check in DEVICE_TOLERANCES if _figure_of(check) in left}
    if request.about:
        skipped |= {check: _only(request) for check in DEVICE_TOLERANCES if check.startswith("meter")}
    if not device.steps_outside:
        needing = ("fig9_settling", "fig9_balance", "fig10_steady", "fig11_slow")
        skipped |= dict.fromkeys(needing, "the run ends before the outer step, or there is none")
    return skipped


def made_device_checks(device: Device, request: Request) -> tuple[str, ...]:
    """The checks that a run of a device makes, in the order in which they are reported."""
    skipped = skipped_device_checks(device, request)
    return tuple(check for check in DEVICE_TOLERANCES if check not in skipped)


def made_3d_checks(device: Device, request: Request) -> tuple[str, ...]:
    """The checks of 1D against 3D that a run of a device makes, in the order in which they are reported."""
    if not request.in_3d:
        return ()
    left = figures_left_out(request)
    stepped = ("dev3d_settling", "dev3d_claim_steady", "dev3d_claim_over_time")

    def made(check: str) -> bool:
        of_gains = check.endswith("_gain")
        figure = "figure13" if check == "dev3d_slope" else "figure9"
        return (device.steps_outside or check not in stepped) and (
            not request.about if of_gains else figure not in left
        )

    return tuple(check for check in DEVICE_3D_TOLERANCES if made(check))


def _not_in_3d(request: Request) -> str:
    return "" if request.in_3d else "not asked for (--3d)"


def needs(device: Device, request: Request, *figures: str) -> bool:
    """Whether the runs behind any of these figures are needed, for the figure or its checks."""
    wanted = {_figure_of(check) for check in made_device_checks(device, request)} | set(drawn_figures(request))
    return bool(wanted & set(figures))


def design_reason(request: Request) -> str:
    """Why a designer's questions are not answered; empty where they are."""
    if request.about:
        return _only(request)
    return "the accurate scheme answers them" if request.scheme == "paper" else ""


def _only(request: Request) -> str:
    return f"only {', '.join(request.about)} asked for"


def _figure_of(check: str) -> str:
    """The figure that a check of the device is about."""
    return check.partition("_")[0].replace("fig", "figure")


def of_free(scene: AnyScene, request: Request, solver: tuple[Step, ...]) -> tuple[Step, ...]:
    """The plan of a free scene around the lines of the 3D ``solver``."""
    skipped, when = skipped_free_figures(scene, request), "steady" if scene.steady else "hottest moment's"
    field = f"the {when} temperature field, rendered off screen"
    steps = []
    if request.uncertain is not None:
        steps.append(_uncertain(request.uncertain))
    if request.sensitivities:
        how = "by dual solutions" if scene.steady else "in the reduced space, widened by dual fields"
        steps.append(Step("sensitivity", "done", f"how the probes follow each number of the scene, {how}"))
    return (
        *solver,
        *steps,
        step("figure field", field, skipped.get("field", "")),
        step("figure traces", "every probe against time", skipped.get("traces", "")),
        step("traces.csv", "a column for each probe", _no_traces(scene)),
        step("field files", _FIELD_FILES, free_fields_reason(scene, request)),
        *([] if request.export is None else [Step("export", "done", _exported(request.export))]),
    )


def _exported(export: Export) -> str:
    """What is written of a free scene."""
    count = f"of {export.states} states" if export.states else f"of as few states as {export.accuracy:g} takes"
    return f"a compact model {count}, held against the full one for a step of every input"


def skipped_free_figures(scene: AnyScene, request: Request) -> dict[str, str]:
    """The figures that a run of a free scene does not draw, each with the reason."""
    if not request.figures:
        return dict.fromkeys(("field", "traces"), _NO_FIGURES)
    found = {"field": "" if _heat(scene) else "no temperature is solved for", "traces": _no_traces(scene)}
    return {name: reason for name, reason in found.items() if reason}


def free_fields_reason(scene: AnyScene, request: Request) -> str:
    """Why no field files are written of a free scene; empty where they are."""
    return fields_reason(request, _heat(scene), "no temperature is solved for")


def _heat(scene: AnyScene) -> bool:
    from scenes.physics import heat

    return heat(scene)


def _no_traces(scene: AnyScene) -> str:
    return f"{_STEADY} (run.steady)" if scene.steady else ""
