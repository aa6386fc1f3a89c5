"""What the 1D models raise when the physics, not the input, has no answer."""

from __future__ import annotations


class RunawayError(ArithmeticError):
    """Thermal runaway: the resistance falls with temperature faster than the heat can leave.

    The message is one sentence for the user; ``limit_voltage`` is the voltage (V) above which no steady state exists.
    """

    def __init__(self, message: str, limit_voltage: float) -> None:
        super().__init__(message)
        self.limit_voltage = limit_voltage


def no_steady_state(voltage: float, limit_voltage: float) -> RunawayError:
    """The error of a model without a steady state at ``voltage``, the limit being ``limit_voltage`` (both V)."""
    return RunawayError(
        f"the sink has no steady state at {voltage:g} V: above {limit_voltage:.6g} V its falling resistance draws more"
        " power than its ends carry away (thermal runaway)",
        limit_voltage,
    )
