"""The whole sensor in 1D: sink, insulator, sensor film, polymer and their sampled controllers."""

from reduced1d.device.runs import solve
from scenes.loop.result import QUANTITIES, DeviceResult

__all__ = ["QUANTITIES", "DeviceResult", "solve"]
