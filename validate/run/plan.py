"""What a run of each kind of scene solves, checks, draws and writes, and why it leaves out the rest: the one place that
decides it, and the plan that says so.

``of_sink``, ``of_device`` and ``of_free`` make the whole plan; the lines of the 3D model are its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from compare.made import DEVICE_FIGURES, LATE, figure_of, made_3d_checks, made_checks, not_about, only, skipped_checks
from scenes.device import Device
from scenes.errors import SceneError, quoted
from scenes.physics import heat
from scenes.plan import Request, Step, skipped_together, step
from scenes.sink import Sink
from scenes.units import THERMAL_CONTACT

if TYPE_CHECKING:
    from compare.against import Data
    from scenes.model import AnyScene

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
"""Figures of a sink of several spans, which has no figure 5."""
BLAME = "blame"
"""The plan's step that finds what is to blame."""
_NO_FIGURES = "no figures were asked for"
_STEADY = "only the steady state was asked for"
_NO_FIELD = "there is no 3D field"
_FIELD_FILES = "fem3d.pvd with its .vtu files, and fem3d.vtkhdf where VTK can"
LEFT_OUT = Step("left_out", "done", "3D again with each effect that both models leave out, and with all")
ONLY_1D = Step("3D model", "skipped", "only the 1D model was asked for")


def declared(scene: Any, request: Request) -> Any:
    """The scene with what it says of checks beforehand: that is of the paper's model, without a meter in its loop."""
    if request.reduction == "paper" and request.meter is None:
        return scene
    return replace(scene, expected_to_differ=None)


def of_sink(sink: Sink, request: Request, solver: tuple[Step, ...], data: Data | None = None) -> tuple[Step, ...]:
    """The plan of a sink around the lines of the 3D ``solver``."""
    in_3d, omitted = "fem3d" in request.models, skipped_of_sink(sink, request)
    if in_3d and sink.substrate_thickness is not None:
        about_oxide = (
            "the paper's oxide stands on room temperature" if request.reduction == "paper" else "its resistance in 1D"
        )
        solver = (*solver, step("substrate", f"in 3D; {about_oxide}"))
    if in_3d and sink.contact_resistance is not None:
        about_oxide = (
            "the paper's oxide touches perfectly" if request.reduction == "paper" else "in series with the oxide in 1D"
        )
        at = f"{THERMAL_CONTACT.show(sink.contact_resistance)} at both faces of the oxide"
        solver = (*solver, step("contacts", f"{at}, where the 3D temperature jumps; {about_oxide}"))
    if sink.gap_gas_conductivity:
        apart = sink.substrate_thickness is not None and request.reduction == "paper"
        where = "; in the paper's model to room temperature" if apart else ""
        solver = (*solver, step("gas in the gap", f"a film of {sink.gap_coefficient:.4g} W/(m2 K){where}"))
    if in_3d and sink.emissivity:
        bare = f"all bare faces of beam and pads, emissivity {sink.emissivity:g}, to {sink.room_temperature:g} K"
        about_oxide = "the 1D model leaves it out" if request.reduction in ("paper", "anchored") else "in 1D too"
        solver = (*solver, step("radiation", f"{bare}; {about_oxide}"))
    steps = [*solver, _reduction(request), *_checks(sink, request), *_figures(figures_of(sink), omitted)]
    steps.append(step("traces.csv", "every quantity against time", "" if request.transient else _STEADY))
    # What is done only when asked for, and so has no line where it isn't.
    if request.why:
        steps.append(step("why", f"the ladder of models between {request.reduction} and 3D, one assumption each"))
    elif request.models == Request().models:
        steps.append(step(BLAME, "by the ladder between the models, where the 1D model differs"))
    steps += _uncertain(request)
    if request.left_out:
        steps.append(LEFT_OUT)
    if request.sensitivities:
        how = "by dual solutions in 3D, by the formulas in 1D" if len(request.models) > 1 else "of one model"
        steps.append(step("sensitivity", f"how quantities follow each key, {how}"))
    steps += _export(request)
    steps.append(step("field files", _FIELD_FILES, fields_reason(request, "" if in_3d else _NO_FIELD)))
    turned = "" if "figure4" in omitted else ", with the field to turn"
    steps.append(step("report.html", f"everything on one page{turned}"))
    steps += _against(request, data)
    return tuple(steps)


def of_device(device: Device, request: Request) -> tuple[Step, ...]:
    scheme = {
        "accurate": "all layers at once, exact between samples but for V2/R, its error estimated",
        "paper": "the paper's own: partitioned, Crank-Nicolson and Runge-Kutta; the accurate one beside it",
    }
    in_3d, omitted = "" if request.in_3d else "not asked for (--3d)", skipped_of_device(device, request)
    steps = [
        step("3D model", f"a few states of the whole device, known to {device.accuracy_3d:g}", in_3d),
        step("1D device", f"{scheme[request.scheme]}; from cold to {device.end_time:g} s"),
    ]
    if request.meter:
        steps.append(step("meter", f"resistances are rounded to what the {request.meter} resolves"))
    if request.sensitivities:
        also = ", and in 3D on the cells that are there, moved" if request.in_3d else ""
        steps.append(step("sensitivity", f"how the steady state in 1D follows each key, by its closed form{also}"))
    if request.uncertain is not None:
        steps += [*_uncertain(request), step("u_input of claims", "1D runs with each input more and less, by its u")]
    if needs(device, request, "figure11"):
        steps.append(step("1D device, slow", "sampled every 5 ms with gains of 0.5 and 0.05 V"))
    if needs(device, request, "figure12", "figure13"):
        steps.append(step("1D device, steps", "from the steady state, for outer steps from -80 to +20 K"))
    if request.in_3d:
        idle = "only figures 11 to 13 show them, and none is drawn" if omitted.keys() >= set(LATE) else ""
        what = "the slow one and the outer steps, as far as figures show them"
        steps.append(step("3D runs of other steps", what, idle))
    steps += _checks(device, request)
    if made := made_3d_checks(device, request):
        steps.append(step("checks of 3D", ", ".join(made)))
    if "dev3d_shielding" in made:
        steps.append(step("shielding", "what 1 K of the substrate does to both powers, steady and after a step"))
    if request.left_out:
        steps.append(LEFT_OUT)
    steps += _figures(DEVICE_FIGURES, omitted)
    steps.append(step("traces.csv", "a row per controller sample"))
    steps += _export(request)
    steps.append(step("designer's questions", "largest gains, range and resolution", design_reason(request)))
    return tuple(steps)


def of_free(
    scene: AnyScene, request: Request, solver: tuple[Step, ...], data: Data | None = None
) -> tuple[Step, ...]:  # fmt: skip
    """The plan of a free scene around the lines of the 3D ``solver``."""
    skipped, when = skipped_of_free(scene, request), "steady" if scene.steady else "hottest moment's"
    steps = [*solver, *_own_model(scene, request), *_uncertain(request)]
    if request.sensitivities:
        how = "by dual solutions" if scene.steady else "in the reduced space, widened by dual fields"
        steps.append(step("sensitivity", f"how the probes follow each number of the scene, {how}"))
    field = f"the {when} temperature field, rendered off screen"
    steps += [
        step("figure field", field, skipped.get("field", "")),
        step("figure traces", "every probe against time", skipped.get("traces", "")),
        *[step("figure differences", "how far the model is from 3D, probe by probe")]
        * bool(own_model(scene, request) and request.figures),
        *[step("figure network", "the lines of the network over the boxes")]
        * bool((own_model(scene, request) or ("",))[0] == "network" and request.figures),
        step("traces.csv", "a column for each probe", _no_traces(scene)),
        step("field files", _FIELD_FILES, fields_reason(request, _no_heat(scene))),
        *_export(request),
        *_against(request, data),
    ]
    return tuple(steps)


def own_model(scene: AnyScene, request: Request) -> tuple[str | Callable[..., Any], str] | None:
    """The user's own model and the folder that its file is relative to: the one asked for, or the scene's own where
    that runs no program. Raises SceneError where the scene is to have one and has none."""
    from compare.models import OF_THE_SCENE, runs_code

    given, model = request.model, scene.model
    if given and given != OF_THE_SCENE:
        return given, ""
    if model is None or not model.file:
        if given:
            raise SceneError(f"--model scene: {quoted(scene.name)} has no [model] with a file: name one there, or here")
        return None
    return None if not given and runs_code(model.file) else (model.file, model.folder)


def _own_model(scene: AnyScene, request: Request) -> list[Step]:
    model = own_model(scene, request)
    if model is not None:
        name = getattr(model[0], "__name__", model[0])
        return [step("1D model", f"{name}, where 3D has an answer"), step("checks", "of every probe that it answers")]
    if scene.model is None or not scene.model.file:
        return []
    return [Step("1D model", "skipped", f"{scene.model.file} is a program, which runs with --model scene")]


def _checks(scene: Sink | Device, request: Request) -> list[Step]:
    made = made_checks(scene, request)
    lines = [step("checks", ", ".join(made))] if made else []
    return lines + skipped_together("checks", skipped_checks(scene, request))


def figures_of(sink: Sink) -> dict[str, str]:
    """The figures that there are of a sink, and what each shows."""
    return SINK_FIGURES if sink.spans == 1 else {n: w for n, w in SINK_FIGURES.items() if n != "figure5"} | ROW_FIGURES


def skipped_of_device(device: Device, request: Request) -> dict[str, str]:
    """The figures that a run of a device doesn't draw, each with the reason."""
    return not_about(request) if request.figures else dict.fromkeys(DEVICE_FIGURES, _NO_FIGURES)


def skipped_of_free(scene: AnyScene, request: Request) -> dict[str, str]:
    """The same of a free scene."""
    skips = {"field": _no_heat(scene), "traces": _no_traces(scene)}
    return {name: why if request.figures else _NO_FIGURES for name, why in skips.items() if why or not request.figures}


def skipped_of_sink(sink: Sink, request: Request) -> dict[str, str]:
    """The same of a sink."""
    if not request.figures:
        return dict.fromkeys(figures_of(sink), _NO_FIGURES)
    skipped: dict[str, str] = {}
    if not request.why:
        skipped["islands_runs"] = "other rows are solved for it only with --why"
    if "fem3d" not in request.models:
        skipped |= dict.fromkeys(("figure4", "figure5", *ROW_FIGURES), _NO_FIELD)
    if not request.transient:
        skipped |= dict.fromkeys(("figure6", "figure7"), _STEADY)
    return {name: why for name, why in skipped.items() if name in figures_of(sink)}


def _figures(all_: Mapping[str, str], omitted: Mapping[str, str]) -> list[Step]:
    drawn = [step(name, what) for name, what in all_.items() if name not in omitted]
    return drawn + skipped_together("figures", omitted)


def needs(device: Device, request: Request, *figures: str) -> bool:
    """Whether the runs behind any of these figures are needed, for the figure or its checks."""
    return drawn(device, request, *figures) or any(figure_of(c) in figures for c in made_checks(device, request))


def drawn(device: Device, request: Request, *figures: str) -> bool:
    return not skipped_of_device(device, request).keys() >= set(figures)


def design_reason(request: Request) -> str:
    """Why a designer's questions are not answered; empty where they are."""
    if request.about:
        return only(request)
    return "the accurate scheme answers them" if request.scheme == "paper" else ""


def fields_reason(request: Request, missing: str) -> str:
    """Why no field files are written; empty where they are. ``missing`` says why there is no temperature field."""
    return missing if request.fields else "not asked for (--fields)"


def _reduction(request: Request) -> Step:
    if "reduced1d" not in request.models:
        return Step("1D model", "skipped", "only the 3D model was asked for")
    when = "steady and at the 3D model's times" if "fem3d" in request.models else "steady and over time"
    name = request.reduction
    if request.model:
        return step("1D model", f"{name}, {when if request.transient else 'steady only'}")
    from reduced1d.ladder import describe

    model = describe(name) if name == "paper" else f"{name}, {describe(name)}"
    return step("1D model", f"{model}, {when if request.transient else 'steady only'}")


def _uncertain(request: Request) -> list[Step]:
    if request.uncertain is None:
        return []
    given = ", ".join(request.uncertain.given)
    return [step("uncertain inputs", f"{given}: u_input by the sensitivities, to first order")]


def _against(request: Request, data: Data | None) -> list[Step]:
    """What is done with a user's own data."""
    if data is None:
        return []
    steps = []
    if request.calibrate:
        steps.append(step("fit", f"{', '.join(request.calibrate)} by least squares, the rest with what is fitted"))
    if request.uncertain is not None or request.data_uncertainty:
        steps.append(step("validation", "E = S - D against u_val of ASME V&V 20, of every model"))
    said = data.said().partition(": ")[2].rstrip(".")
    return [*steps, step(f"against {data.name}", f"{said}; {'at rest' if data.at_rest else 'at its own times'}")]


def _export(request: Request) -> list[Step]:
    export = request.export
    if export is None:
        return []
    count = f"of {export.states} states" if export.states else f"of as few states as {export.accuracy:g} takes"
    return [step("export", f"a compact model {count}, held against the full one for a step of every input")]


def _no_heat(scene: AnyScene) -> str:
    return "" if heat(scene) else "no temperature is solved for"


def _no_traces(scene: AnyScene) -> str:
    return f"{_STEADY} (run.steady)" if scene.steady else ""
