"""The whole sensor in 1D: sink, insulator, sensor film, polymer and their sampled controllers."""

from reduced1d.device.result import QUANTITIES, DeviceResult
from reduced1d.device.solve import solve

__all__ = ["QUANTITIES", "DeviceResult", "solve"]
