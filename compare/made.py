"""Choose the checks of a run, and give the reasons for the others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from compare.options import Options
from scenes import checks as known
from scenes.checks import FIRST_TIME
from scenes.device import Device
from scenes.plan import Step, skipped_together, step
from scenes.sink import Sink

DEVICE_FIGURES = {
    "figure9": "power of sink and sensor against time",
    "figure10": "heat flow into the polymer against time",
    "figure11": "the same as figure 9, sampled every 5 ms with gains of 0.5 and 0.05 V",
    "figure12": "the sensor's power after outer steps from -80 to +20 K",
    "figure13": "the steady power of the sensor against the outer temperature",
    "figure14": "what a lead to ground that sink and sensor share does to both",
}
LATE = ("figure11", "figure12", "figure13")
"""The figures of a device that need runs of their own, which the paper's scheme does not make."""


def _of_sink(sink: Sink) -> tuple[str, ...]:
    return tuple(known.DEFAULT_TOLERANCES) if sink.spans == 1 else (*known.ISLAND_TOLERANCES, "fig4", "energy")


def _skipped_of_device(device: Device, options: Options) -> dict[str, str]:
    omitted = not_about(options)
    skipped = {check: omitted[figure_of(check)] for check in known.DEVICE_TOLERANCES if figure_of(check) in omitted}
    if options.about:
        skipped |= {check: only(options) for check in known.DEVICE_TOLERANCES if check.startswith("meter")}
    if not device.steps_outside:
        needing = ("fig9_settling", "fig9_balance", "fig10_steady", "fig11_slow")
        skipped |= dict.fromkeys(needing, "the run ends before the outer step, or there is none")
    return skipped


def _skipped_of_sink(sink: Sink, options: Options) -> dict[str, str]:
    if "fem3d" not in options.models:
        return dict.fromkeys(_of_sink(sink), "they need the 3D model")
    skipped: dict[str, str] = {}
    if any(isinstance(given, tuple) for material in (sink.silicon, sink.oxide) for _, given in material.given()):
        skipped |= dict.fromkeys(set(_of_sink(sink)) - {"energy"}, "the paper's equations take one conductivity")
    if not options.transient:
        skipped |= dict.fromkeys(known.OVER_TIME, "they need the transient")
    elif sink.end_time <= FIRST_TIME:
        skipped |= dict.fromkeys(known.OVER_TIME, "they compare from 10 us on, and the run ends before")
    if sink.current is not None:
        skipped["fig7_current"] = "the current is given"
    if "reduced1d" not in options.models:
        skipped |= dict.fromkeys(known.OF_THE_REDUCTION, "they need the 1D model")
    if sink.spans == 2:
        skipped |= {check: "both of two spans are outer ones" for check in known.ISLAND_TOLERANCES if "inner" in check}
    return {check: skipped[check] for check in _of_sink(sink) if check in skipped}


_CHECKS: dict[str, tuple[Callable[[Any], tuple[str, ...]], Callable[[Any, Options], dict[str, str]]]] = {
    "sink": (_of_sink, _skipped_of_sink),
    "device": (lambda _: tuple(known.DEVICE_TOLERANCES), _skipped_of_device),
}
"""By the kind of scene: the checks that there are, and those that a run can't make."""


def checks_of(scene: Sink | Device) -> tuple[str, ...]:
    """Return the checks that there are, in the order of the report."""
    return _CHECKS[scene.kind][0](scene)


def skipped_checks(scene: Sink | Device, options: Options) -> dict[str, str]:
    """Return the checks that a run cannot make, each with the reason."""
    return _CHECKS[scene.kind][1](scene, options)


def made_checks(scene: Sink | Device, options: Options) -> tuple[str, ...]:
    """Return the checks that a run makes, in the order of the report."""
    skipped = skipped_checks(scene, options)
    return tuple(check for check in checks_of(scene) if check not in skipped)


def checks_lines(scene: Sink | Device, options: Options) -> list[Step]:
    """Return the lines of a plan for checks that are made and skipped."""
    made = made_checks(scene, options)
    lines = [step("checks", ", ".join(made))] if made else []
    return lines + skipped_together("checks", skipped_checks(scene, options))


def made_3d_checks(device: Device, options: Options) -> tuple[str, ...]:
    """Return the checks of 1D against 3D that a run of a device makes."""
    stepped = ("dev3d_settling", "dev3d_claim_steady", "dev3d_claim_over_time")
    omitted = not_about(options)

    def made(check: str) -> bool:
        if check.endswith("_gain"):
            return not options.about
        figure = "figure13" if check == "dev3d_slope" else "figure9"
        return (device.steps_outside or check not in stepped) and figure not in omitted

    return tuple(filter(made, known.DEVICE_3D_TOLERANCES)) if options.in_3d else ()


def not_about(options: Options) -> dict[str, str]:
    """Return the figures that a run of a device leaves out, each with the reason."""
    omitted = {name: only(options) for name in DEVICE_FIGURES if options.about and name not in options.about}
    if options.scheme == "paper":
        omitted |= dict.fromkeys(LATE, "they need nine more runs, and the accurate scheme for them")
    return omitted


def only(options: Options) -> str:
    return f"only {', '.join(options.about)} asked for"


def figure_of(check: str) -> str:
    return check.partition("_")[0].replace("fig", "figure")
