"""Simulate the paper's whole sensor in 1D, and in 3D with --3d: sink, insulator, sensor, polymer and their
controllers, and say what of Figures 9 to 14 comes out; with the limits of gains, range and resolution.

examples:
  validate device
  validate device --3d --accuracy 1e-4
  validate device --left-out
  validate device --figure 11 --set control.sample_time=2ms
  validate device --scheme paper --figure 9
  validate device --3d --uncertain materials --uncertain pdms.thermal_conductivity=5%
  validate device --max-power 20mW --meter PXI-4070
  validate device --export my-sensor

results: summary.json, traces.csv and figures in results/<scene>-<what distinguishes it>/
exit status: 0 every check came out as the scene declares, 1 one did not, 2 bad input, 3 the numerics failed
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from scenes.errors import SceneError
from validate.cli import common

if TYPE_CHECKING:
    from scenes.device import Device
    from scenes.plan import Request

OPTIONS = {
    **common.of_run("device", "control.sample_time=1ms",
                    "accuracy of the temperatures, relative to the set rise; with --3d that of the 3D model"),
    "--3d": "in 3D too, and how far 1D is off",
    "--left-out": "what both models leave out, each solved in 3D, and all at once: the gas below and others",
    "--figure {9,10,11,12,13,14} ...": "this figure and its checks only, as often as needed",
    "--scheme {accurate,paper}": "the accurate scheme (default), or the paper's own and how far it is off",
    "--meter {PXI-4070,MAX1367}": "round the resistances to what a meter resolves",
    "--sensitivities": "how the steady state follows each key: d ln Q / d ln key",
    **common.of_inputs("oxide_thickness=0.1um, pdms.thermal_conductivity=5%%; or materials",
                       "pad_width,oxide_width=0.9"),
    **common.OF_MODEL,
    "--export DIR": "write a compact model, of 3D with --3d, and its controllers to DIR: JSON, Python, SPICE, FMU",
    "--model-accuracy A": "with --export, the relative accuracy of the model (default: twice the run's)",
    "--max-voltage V": "the sensor's largest voltage, for the range: 100mV",
    "--max-power W": "the sensor's largest power, for the range: 20mW",
}  # fmt: skip

OF_THE_EXPORTED = 2.0
"""Default accuracy of an exported model over the run's: one part is the run's, one what few states leave out."""


def run(arguments: argparse.Namespace) -> int:
    from scenes.keys import DEVICE
    from scenes.loading import load

    def loaded(in_3d: bool) -> Device:
        key = "run.accuracy_3d" if in_3d else "run.accuracy"
        return load(arguments.scene or "device", common.settings(arguments, accuracy=key), scene_type=DEVICE)

    device = loaded(vars(arguments)["3d"])
    return common.run(arguments, device, _request(arguments, device), arguments.set)


def _request(arguments: argparse.Namespace, device: Device) -> Request:
    """What is asked for; SceneError where one thing leaves out another."""
    from compare.made import DEVICE_FIGURES, LATE
    from scenes.kinds import Quantity
    from scenes.units import POWER, VOLTAGE
    from validate.run.plan import design_reason

    limits = {"--max-voltage": (arguments.max_voltage, VOLTAGE), "--max-power": (arguments.max_power, POWER)}
    voltage, power = (
        float("inf") if given is None else Quantity(dimension, 1e-12, 1e6).read(option, given) or 0.0
        for option, (given, dimension) in limits.items()
    )
    in_3d = vars(arguments)["3d"]
    accuracy = device.accuracy_3d if in_3d else device.accuracy
    request = common.request(
        arguments, device, OF_THE_EXPORTED * accuracy, in_3d=in_3d, scheme=arguments.scheme or "accurate",
        about=tuple(name for name in DEVICE_FIGURES if name.removeprefix("figure") in arguments.figure),
        largest_voltage=voltage, largest_power=power,
    )  # fmt: skip
    for option, (given, _) in limits.items():
        if given is not None and design_reason(request):
            other = "--figure" if request.about else "--scheme paper"
            raise SceneError(f"{option} is of the range, which {other} leaves out: give one of them")
    if request.export is not None:
        option = f"--model-accuracy {arguments.model_accuracy}"
        common.refuse(
            (request.scheme == "paper", "--export writes a model of the accurate scheme: leave out --scheme paper"),
            (request.meter, f"--export writes controllers that measure exactly: leave out --meter {request.meter}"),
            (
                request.export.states is None and request.export.accuracy < accuracy,
                f"{option} is closer than what it is made of is known, {accuracy:g}: give --accuracy, too",
            ),
        )
    late = [name for name in request.about if request.scheme == "paper" and name in LATE]
    if late:
        raise SceneError(f"--figure {late[0].removeprefix('figure')} needs the accurate scheme")
    return request
