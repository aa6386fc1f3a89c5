"""The whole sensor in somebody's system: its FMU and the FMU of its controllers, coupled by fmpy, beside the traces of
`validate device`. Needs pythonfmu and fmpy (pip install '.[fmu]')."""

import csv
import sys
import tempfile
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from validate.cli import main

SCENE = ("--set", "control.sample_time=1ms", "--set", "control.sink_gain=0.5", "--set", "external.step_time=30ms")
FILMS = ("sink", "sensor")


class Unit:
    """An FMU that runs, its variables by name."""

    def __init__(self, path):
        description = read_model_description(str(path))
        self.number = {v.name: v.valueReference for v in description.modelVariables}
        self.slave = FMU2Slave(
            guid=description.guid, unzipDirectory=extract(str(path)), instanceName=path.stem,
            modelIdentifier=description.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()

    def give(self, **values):
        self.slave.setReal([self.number[name] for name in values], list(values.values()))

    def read(self, *names):
        return self.slave.getReal([self.number[name] for name in names])

    def step(self, time, length):
        self.slave.doStep(currentCommunicationPoint=time, communicationStepSize=length)


def coupled(folder, sample_time, samples, outside):
    """By name both films' temperatures (K) at each sample, and the voltages and powers from then on; ``outside`` maps a
    time (s) to the outer temperature (K) from then on."""
    sensor, controllers = (Unit(Path(folder) / f"{name}.fmu") for name in ("model", "controllers"))
    rows = []
    sensor.give(sink_voltage=0.0, sensor_voltage=0.0)
    for k in range(samples):
        time = k * sample_time
        measured = sensor.read("sink_ohm", "sensor_ohm")
        warm = sensor.read("sink_K", "sensor_K")
        # The controllers first: their output at a sample holds from there on.
        controllers.give(sink_ohm=measured[0], sensor_ohm=measured[1])
        controllers.step(time, sample_time)
        volts = controllers.read("sink_V", "sensor_V")
        sensor.give(sink_voltage=volts[0], sensor_voltage=volts[1])
        rows.append([*warm, *volts, *sensor.read("sink_power_W", "sensor_power_W")])
        sensor.give(outside_temperature=outside(time))
        sensor.step(time, sample_time)
    names = (f"{film}_{what}" for what in ("K", "V", "power_W") for film in FILMS)
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


def example():
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        run = ["device", *SCENE, "--set", "run.end_time=60ms", "--figure", "9", "--no-figures", "--quiet"]
        if main([*run, "--out", str(place / "run"), "--export", str(place / "my-sensor")]):
            return 1
        with (place / "run" / "traces.csv").open(encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        traces = coupled(place / "my-sensor", 1e-3, len(rows), lambda t: 273.0 if t > 0.0295 else 293.0)
        for name, values in traces.items():
            exact = [float(row[f"reduced1d_{name}"]) for row in rows]
            off = max(abs(a - b) for a, b in zip(values, exact, strict=True))
            print(f"{name:<15} largest {max(exact):10.4g}, the FMUs are off by at most {off:.1e}")
    return 0


if __name__ == "__main__":
    sys.exit(example())
