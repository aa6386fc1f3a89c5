"""What a run of the device solves, checks and draws, and why it leaves out the rest: the one place that decides it."""

from __future__ import annotations

from dataclasses import dataclass

from scenes.checks import DEVICE_TOLERANCES
from scenes.device import Device
from scenes.plan import Step

FIGURES = {
    "figure9": "power of sink and sensor against time",
    "figure10": "heat flow into the polymer against time",
    "figure11": "the same as figure 9, sampled every 5 ms with gains of 0.5 and 0.05 V",
    "figure12": "the sensor's power after outer steps from -80 to +20 K",
    "figure13": "the steady power of the sensor against the outer temperature",
}

LATE = ("figure11", "figure12", "figure13")
"""The figures that need runs of their own, which the paper's scheme does not make."""


@dataclass(frozen=True)
class DeviceRequest:
    """What the user asked of a run: the scheme, the figures it is about (all where none are named), whether to draw
    them, the meter in the loop, the sensor's largest voltage (V) and power (W), and the command line, if it was one."""

    scheme: str = "accurate"
    about: tuple[str, ...] = ()
    figures: bool = True
    meter: str | None = None
    largest_voltage: float = float("inf")
    largest_power: float = float("inf")
    command: str = ""


def figure_of(check: str) -> str:
    """The figure that a check is about."""
    return check.partition("_")[0].replace("fig", "figure")


def without(device: Device, request: DeviceRequest) -> dict[str, str]:
    """The figures that a run is not about, each with the reason."""
    found = {name: f"only {', '.join(request.about)} asked for" for name in FIGURES if request.about}
    found = {name: why for name, why in found.items() if name not in request.about}
    if request.scheme == "paper":
        found |= dict.fromkeys(LATE, "they need nine more runs, and the accurate scheme for them")
    return found


def skipped_checks(device: Device, request: DeviceRequest) -> dict[str, str]:
    """The checks that a run can't make, each with the reason."""
    left = without(device, request)
    skipped = {check: left[figure_of(check)] for check in DEVICE_TOLERANCES if figure_of(check) in left}
    if request.about:
        meters = (check for check in DEVICE_TOLERANCES if check.startswith("meter"))
        skipped |= dict.fromkeys(meters, f"only {', '.join(request.about)} asked for")
    if not steps(device):
        needing = ("fig9_settling", "fig9_balance", "fig10_steady", "fig11_slow")
        skipped |= dict.fromkeys(needing, "the run ends before the outer step, or there is none")
    return skipped


def made_checks(device: Device, request: DeviceRequest) -> tuple[str, ...]:
    """The checks that a run makes, in the order in which they are reported."""
    skipped = skipped_checks(device, request)
    return tuple(check for check in DEVICE_TOLERANCES if check not in skipped)


def drawn_figures(device: Device, request: DeviceRequest) -> tuple[str, ...]:
    """The figures that a run draws."""
    left = without(device, request)
    return tuple(name for name in FIGURES if name not in left) if request.figures else ()


def needs(device: Device, request: DeviceRequest, *figures: str) -> bool:
    """Whether the runs behind any of these figures are needed, for the figure or its checks."""
    wanted = {figure_of(check) for check in made_checks(device, request)} | set(drawn_figures(device, request))
    return bool(wanted & set(figures))


def steps(device: Device) -> bool:
    """Whether the outer temperature steps during the run."""
    external = device.external
    return 0 < external.step_time < device.end_time and external.initial_temperature != external.final_temperature


def design_reason(request: DeviceRequest) -> str:
    """Why a designer's questions are not answered; empty where they are."""
    if request.about:
        return f"only {', '.join(request.about)} asked for"
    return "the accurate scheme answers them" if request.scheme == "paper" else ""


def plan(device: Device, request: DeviceRequest) -> tuple[Step, ...]:
    """What a run will do, before it does it."""
    scheme = {
        "accurate": "all layers at once, exact between samples but for V2/R, its error estimated",
        "paper": "the paper's own: partitioned, Crank-Nicolson and Runge-Kutta; the accurate one beside it",
    }
    found = [
        Step("3D model", "skipped", "the device is modelled in 1D only"),
        Step("1D device", "done", f"{scheme[request.scheme]}; from cold to {device.end_time:g} s"),
    ]
    if request.meter:
        found.append(Step("meter", "done", f"resistances are rounded to what the {request.meter} resolves"))
    if needs(device, request, "figure11"):
        found.append(Step("1D device, slow", "done", "sampled every 5 ms with gains of 0.5 and 0.05 V"))
    if needs(device, request, "figure12", "figure13"):
        found.append(Step("1D device, steps", "done", "from the steady state, for outer steps from -80 to +20 K"))
    made = made_checks(device, request)
    if made:
        found.append(Step("checks", "done", ", ".join(made)))
    found += _grouped("checks", skipped_checks(device, request))
    drawn = drawn_figures(device, request)
    found += [Step(name, "done", FIGURES[name]) for name in drawn]
    left = without(device, request) if request.figures else dict.fromkeys(FIGURES, "no figures were asked for")
    found += _grouped("figures", left)
    found.append(Step("traces.csv", "done", "a row per controller sample"))
    why = design_reason(request)
    what = "largest gains, range and resolution"
    found.append(Step("designer's questions", "skipped" if why else "done", why or what))
    return tuple(found)


def _grouped(kind: str, skipped: dict[str, str]) -> list[Step]:
    reasons = dict.fromkeys(skipped.values())
    return [Step(f"{kind} {', '.join(n for n, w in skipped.items() if w == why)}", "skipped", why) for why in reasons]
