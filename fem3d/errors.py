"""What can go wrong in a solver, each with one clear sentence."""


class NumericsError(ArithmeticError):
    """The numerics failed; the message says why."""


class ConvergenceError(NumericsError):
    """An iteration doesn't converge, which no property of the scene explains."""


class RunawayError(NumericsError):
    """No steady state exists at the asked voltage; ``limit`` is the voltage (V) from which on there is none."""

    def __init__(self, voltage: float, limit: float) -> None:
        super().__init__(
            f"thermal runaway: at {voltage:g} V no steady state exists, because the resistance falls as it heats; "
            f"the largest voltage with a steady state is {limit:.4g} V"
        )
        self.voltage = voltage
        self.limit = limit
