from compare import testing as testing
from validate.interface import DeviceRun as DeviceRun
from validate.interface import Run as Run
from validate.interface import Solution as Solution
from validate.interface import device as device
from validate.interface import run as run
from validate.interface import solve as solve
from validate.sweep.run import sweep as sweep
