"""March the closed loop of a device from sample to sample.

Between samples the voltages hold, and the modes are propagated exactly. The heat V^2/R(T) of each film is a polynomial
in x = (t/h)^(1/2), given by its values at Chebyshev points: after a voltage jump the temperatures go like t, t^(3/2),
t^2 ... once heat has entered the layers, which is smooth in x. The response of each mode to each Lagrange polynomial is
integrated once for each interval length h. The heats of an interval come from Picard's iteration, else by Newton's
method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.polynomial.legendre import leggauss

from scenes.device import Device
from statespace import circuit
from statespace.circuit import metered, settings, timetable
from statespace.controllers import Controllers
from statespace.device_model import Modal
from statespace.result import QUANTITIES, TOP
from statespace.stability import state_of

CEILING = 2000.0
"""K, beyond any metal: a run in which a film's rise gets there is stopped."""


@dataclass(frozen=True)
class March:
    """A run of the closed loop: values just before each sample, and the voltages from the sample on.

    rises, voltages, powers : (samples, 2) of (sink, sensor), K, V and W
    flows : (samples, k), heat flows in W
    limited : (samples, 2), whether the limiter held the voltage
    stopped : whether the run ended early, at a rise above `CEILING`
    """

    rises: np.ndarray
    voltages: np.ndarray
    powers: np.ndarray
    flows: np.ndarray
    limited: np.ndarray
    stopped: bool

    @cached_property
    def traces(self) -> np.ndarray:
        """(samples, 7 or 8) in the order of QUANTITIES and TOP, temperatures as rises."""
        return np.concatenate([self.rises, self.voltages, self.powers, self.flows], axis=1)

    def distance(self, other: March) -> dict[str, float]:
        """The largest difference to another run over their common time, of each quantity.

        Raises ArithmeticError where a trace is beyond the range of numbers.
        """
        count = min(len(self.traces), len(other.traces))
        worst = np.abs(self.traces[:count] - other.traces[:count]).max(axis=0)
        if not np.isfinite(worst).all():
            raise ArithmeticError("the simulated device has left the range of numbers")
        return dict(zip((*QUANTITIES, TOP), worst.tolist(), strict=False))


class _Places:
    """The places of an interval: responses at the start, at the nodes, and flows.

    Of each place: ``film``, 0 for the sink and 1 for the sensor; ``mean``, the place of the film's mean rise at the
    same time; ``both`` (2, places), the places of both means; ``conductance`` (1/ohm) and ``change`` (1/K), both zero
    for a flow; ``outer``, the value per kelvin of the outer rise, and ``offset``. ``departs`` marks local departures;
    ``feed`` (k, places) adds the heats just before a sample to its flows.
    """

    def __init__(self, modal: Modal, q: int, ground: float) -> None:
        m, k = modal.responses, len(modal.flux)
        response = np.r_[np.arange(m), np.repeat(np.arange(m), q)]
        node = np.r_[np.zeros(m, int), np.tile(np.arange(1, q + 1), m)]
        flow, places = np.zeros(k, int), np.arange(m * (q + 1), m * (q + 1) + k)
        self.film = np.r_[modal.film[response], flow]
        self.both = np.array([np.r_[np.where(node, m + e * q + node - 1, e), np.full(k, e)] for e in (0, 1)])
        self.mean = np.r_[np.choose(modal.film[response], self.both[:, : len(node)]), places]
        self.departs = np.r_[response > 1, flow > 0]
        self.conductance = np.r_[1 / modal.resistance[modal.film[response]], flow]
        self.change = np.r_[modal.coefficient[modal.film[response]], flow]
        self.outer = np.r_[modal.external[response], modal.flux_external]
        self.offset = np.r_[np.broadcast_to(modal.offset, m)[response], np.broadcast_to(modal.flux_offset, k)]
        self.feed = np.zeros((k, len(self.film)))
        self.feed[:, m + np.arange(m) * q + q - 1] = modal.feed
        self.flows, self.ground, self.local = slice(m * (q + 1), None), ground, m > 2

    def driven(self, voltage: np.ndarray, ratio: np.ndarray) -> tuple[np.ndarray, np.ndarray | float]:
        """V^2/R_0 at each place, V across the film, and the part of a power's change by its own conductance 1/R.

        ``ratio`` is R/R_0. A common lead takes the drop R_g sum(V/R)/(1 + R_g sum(1/R)) from both voltages.
        """
        volts = voltage[self.film]
        if not self.ground:
            return volts * volts * self.conductance, 1.0
        sink, sensor = self.both
        one, other = (self.conductance[at] / ratio[at] for at in (sink, sensor))
        lead = 1 + self.ground * (one + other)
        volts = volts - self.ground * (one * volts[sink] + other * volts[sensor]) / lead
        conductance = self.conductance / ratio[self.mean]
        return volts * volts * self.conductance, 1 - 2 * self.ground * conductance / lead

    def heats(self, heating: np.ndarray, ratio: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """The heat (W) at each place, from V^2/R_0, R/R_0 and the rises."""
        power = heating / ratio
        return np.where(self.departs, power * self.change * rise / ratio, power) if self.local else power

    def solve(
        self, free: np.ndarray, kernel: np.ndarray, voltage: np.ndarray, ratio: np.ndarray, tolerance: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Solve for the heats P = V^2/R with R/R_0 = 1 + change T and T = free + kernel P, and for R/R_0.

        ``ratio`` is a guess. Newton's iteration starts without any power: 1/R is convex, so that it climbs to the
        solution from below; the coupling of departures to the mean and of films by a lead is left out of its slope.
        Raises ArithmeticError where neither iteration converges.
        """
        rise = free + kernel @ self.heats(self.driven(voltage, ratio)[0], ratio, free)
        picard, newton = 8, 30
        for attempt in range(picard + newton):
            if attempt == picard:
                rise = free
            ratio = 1 + self.change * (rise[self.mean] if self.local else rise)
            heating, part = self.driven(voltage, ratio)
            powers = self.heats(heating, ratio, rise)
            residual = free + kernel @ powers - rise
            if attempt >= picard:
                slope = heating / ratio * np.where(self.departs, -1.0, part) * self.change / ratio
                residual = np.linalg.solve(np.eye(len(kernel)) + kernel * slope, residual)
                tolerance = max(tolerance, 1e-12 * float(np.abs(rise).max()))
            rise = rise + residual
            if residual @ residual < tolerance * tolerance:
                return powers, ratio
        raise ArithmeticError("the iteration for the electrical powers between two samples did not converge")


def march(
    modal: Modal, nodes: int, device: Device, tolerance: float, meter: tuple[float, float] = (0.0, 0.0),
    start: Literal["cold", "settled"] = "cold",
) -> March:  # fmt: skip
    """Run the closed loop of a device.

    Parameters
    ----------
    modal : Modal
        The model of the device.
    nodes : int
        Unknown heats per response and interval in time.
    tolerance : float
        Change (K) that ends the iteration for the powers.
    meter : (float, float)
        Resolution in ohm of the measured resistances of (sink, sensor), 0 for an ideal meter.
    start : "cold" or "settled"
        At room temperature without voltage, or in the steady state at the initial outer temperature.

    Raises
    ------
    ArithmeticError
        Where the iteration for the powers fails.
    """
    control, table = Controllers(settings(device, modal.resistance, modal.coefficient)), timetable(device)
    at, m = _Places(modal, nodes, device.control.ground_resistance), modal.responses
    history, voltages = np.empty((table.samples, len(at.film))), np.empty((table.samples, 2))
    b, voltage, outer, stopped = np.zeros(modal.count), np.zeros(2), 0.0, False
    ratio, powers = np.ones(len(at.film)), np.zeros(len(at.film))
    if start == "settled":
        settled = state_of(modal, device, device.external.initial_temperature)
        heat, voltage = modal.heat(settled.power, settled.rise), settled.voltage
        control.voltage = voltage
        b = heat @ modal.shape / modal.rates
        powers[m : m * (nodes + 1)] = np.repeat(heat, nodes)
        outer = device.external.initial_temperature - device.sink.room_temperature
    static = outer * at.outer + at.offset
    fed, intervals = bool(at.feed.any()), dict[float, Interval]()
    for k, measure, step, length in table.stretches():
        key = length or table.sample_time
        if key not in intervals:
            intervals[key] = interval(modal, key, nodes)
        t = intervals[key]
        free = t.reading @ b
        free += static
        if measure:
            history[k] = free
            if fed:
                history[k, at.flows] += at.feed @ powers
            warm = modal.resistance * (1 + modal.coefficient * free[:2])
            voltages[k] = voltage = control.sample(metered(voltage, warm, at.ground, meter))
            stopped = bool(free[0] > CEILING or free[1] > CEILING)
            if stopped or not length:
                break
        if step is not None:
            # Just after the sample at its time.
            b = b - (step - outer) * modal.jump
            outer, static = step, step * at.outer + at.offset
            free = t.reading @ b + static
        powers, ratio = at.solve(free, t.kernel, voltage, ratio, tolerance)
        b = t.decay * b + t.gain @ powers
    history, voltages = history[: k + 1], voltages[: k + 1]
    resistance = modal.resistance * (1 + modal.coefficient * history[:, :2])
    limited = (voltages == control.lowest) & (control.gain > 0)
    return March(
        history[:, :2], voltages, circuit.powers(voltages, resistance, at.ground), history[:, at.flows], limited,
        stopped,
    )  # fmt: skip


@dataclass(frozen=True)
class Interval:
    """Matrices of one interval length, for n modes, m responses, k flows and q unknown heats per response.

    The size = m (q + 1) + k places are the responses at the start, then at the nodes (response by response), and the
    flows at the start.

    reading : (size, n), rises (K) at the places and flows (W) per amplitude at the start, without heat
    kernel : (size, size), rises per heat (K/W)
    gain : (n, size), amplitudes at the end per heat
    decay : (n,), amplitudes at the end per amplitude at the start
    """

    reading: np.ndarray
    kernel: np.ndarray
    gain: np.ndarray
    decay: np.ndarray


def interval(modal: Modal, length: float, q: int) -> Interval:
    """Integrate the responses of a model's modes over an interval of some length (s)."""
    m, k, n = modal.responses, len(modal.flux), modal.count
    x = (1 - np.cos(np.pi * np.arange(q + 1) / q)) / 2
    response = np.stack([_response(modal.rates * length, x, node) for node in range(1, q + 1)]) * length
    later = np.einsum("in,mnl,jn->imjl", modal.shape, response, modal.shape)
    free = np.einsum("in,mn->imn", modal.shape, np.exp(-np.outer(x[1:] ** 2, modal.rates * length)))
    last = np.einsum("nl,jn->njl", response[-1], modal.shape)
    size = m * (q + 1) + k
    kernel, gain = np.zeros((size, size)), np.zeros((n, size))
    nodes = slice(m, m * (q + 1))
    kernel[nodes, :m], kernel[nodes, nodes] = later[..., 0].reshape(m * q, m), later[..., 1:].reshape(m * q, m * q)
    gain[:, :m], gain[:, nodes] = last[..., 0], last[..., 1:].reshape(-1, m * q)
    reading = np.vstack([modal.shape, free.reshape(m * q, -1), modal.flux])
    return Interval(reading, kernel, gain, np.exp(-modal.rates * length))


def _response(decay: np.ndarray, x: np.ndarray, node: int) -> np.ndarray:
    """Integrals of exp(-decay (x_m^2 - s^2)) times the Lagrange polynomials in s over ds^2, (modes, nodes), by Gauss
    points on panels of (0, x_m) that halve towards x_m."""
    panels = int(np.ceil(np.log2(2 * decay.max() + 1))) + 4
    edges = x[node] * np.r_[1 - 0.5 ** np.arange(panels), 1.0]
    points, weights = leggauss(len(x) + 7)
    half = np.diff(edges)[:, None] / 2
    s, w = (edges[:-1, None] + half * (1 + points)).ravel(), (half * weights).ravel()
    # A Chebyshev series of as many terms as nodes takes any values there.
    lagrange = chebvander(2 * s - 1, len(x) - 1) @ np.linalg.inv(chebvander(2 * x - 1, len(x) - 1))
    return np.exp(np.outer(decay, s**2 - x[node] ** 2)) @ ((w * 2 * s)[:, None] * lagrange)
