"""The steady state that the controllers bring a model of the device to."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from scenes.loop.modal import Modal


@dataclass(frozen=True, eq=False)
class State:
    """A steady state: ``rise`` (m,) of the responses in K, ``power`` in W and ``voltage`` in V of (sink, sensor), heat
    ``flow`` (k,) in W, and whether a film is ``held`` at the set temperature (2,)."""

    rise: np.ndarray
    power: np.ndarray
    voltage: np.ndarray
    flow: np.ndarray = field(default_factory=lambda: np.zeros(0))
    held: np.ndarray = field(default_factory=lambda: np.ones(2, bool))


def steady(modal: Modal, target: float, controlled: np.ndarray, outer: float) -> State:
    """The steady state of a model for an outer rise (K), with the films that have a controller (2,) at the ``target``
    rise (K) or, where they would need a negative power for that, without any.

    The heat of local departures follows from the rises, which follow from it: it is a hundredth of the rest, and a few
    rounds settle it. Raises ArithmeticError where they don't.
    """
    per_heat = (modal.shape / modal.rates) @ modal.shape.T
    rise, own = np.zeros(modal.responses), np.eye(2)[modal.film]
    for _ in range(100):
        per_power = per_heat @ (modal.heat(np.ones(2), rise)[:, None] * own)
        conductance = np.linalg.inv(per_power[:2])
        load = conductance @ modal.external[:2] * outer
        _, power, held = complementary(conductance, load, target, controlled)
        before, rise = rise, per_power @ power + modal.external * outer
        if np.abs(rise - before).max() <= 1e-13 * max(abs(target), np.abs(rise).max()):
            break
    else:
        raise ArithmeticError("the steady state of the device does not converge")
    heat = modal.heat(power, rise)
    voltage = np.sqrt(power * modal.resistance * (1 + modal.coefficient * rise[:2]))
    flow = (modal.flux / modal.rates) @ (heat @ modal.shape) + modal.flux_external * outer + modal.feed @ heat
    return State(rise, power, voltage, flow, held)


def complementary(
    K: np.ndarray, load: np.ndarray, target: float, controlled: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rises and powers of both elements with K rise = load + power, where a controlled one has either the target rise
    and a power of at least 0, or no power and more than the target; and which ones are held at the target."""
    for choice in ((True, True), (True, False), (False, True), (False, False)):
        held = np.array(choice) & controlled
        rise = np.where(held, target, 0.0)
        free = ~held
        if free.any():
            rise[free] = np.linalg.solve(K[np.ix_(free, free)], (load - K @ rise)[free])
        power = np.where(held, K @ rise - load, 0.0)
        tolerance = 1e-12 * np.abs(K).max() * max(abs(target), np.abs(rise).max())
        if (power >= -tolerance).all() and (rise[controlled & free] >= target * (1 - 1e-12)).all():
            return rise, np.maximum(power, 0.0), held
    raise ArithmeticError("no steady state found: the conductances of the device are not positive")
