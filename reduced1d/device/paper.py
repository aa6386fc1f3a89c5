"""The paper's own scheme, kept as it is: partitioned, dt 1 us, N_x 25, N_t 10 (its sections 4.1 and 5, Appendix B).

In each step both layers advance by N_t steps of Crank-Nicolson with the faces at the films' present temperatures; the
heat flows follow from the first difference at each face, are held, and each film advances by the classical
Runge-Kutta method of fourth order. The films see a flow that is late by a step, which limits dt; and the difference at
the face blurs the first boundary layers, which is the scheme's error during the start.

Eq 3 in one layer by Crank-Nicolson is Appendix B with its misprints corrected:

    A(gamma) T_(j+1) = A(-gamma) T_j + b,   gamma = alpha dt/dx^2,   b = gamma/2 (f(t_j) + f(t_(j+1))) at both ends

with A(gamma) tridiagonal, 1 + gamma on the diagonal and -gamma/2 beside it, of size N_x - 1. The paper prints alpha and
gamma inverted (B.3, B.4), A(gamma) on both sides (B.6) and b without gamma (B.8).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_banded

from reduced1d.device.accurate import solve_accurate
from reduced1d.device.lumped import Lumped, Slab, around, lump
from reduced1d.equations import Values
from scenes.device import Device
from statespace.controllers import Controllers
from statespace.march import CEILING
from statespace.result import QUANTITIES, DeviceResult, device_result
from statespace.sampling import metered, settings, timetable


class UnstableStepError(ValueError):
    """The scheme's time step is beyond its stability limit, which the message names."""


@dataclass(frozen=True)
class PaperScheme:
    """Time step in s, intervals per layer, and steps of Crank-Nicolson per time step."""

    dt: float = 1e-6
    nx: int = 25
    nt: int = 10

    @property
    def states(self) -> int:
        """Inner temperatures of both layers, sink, sensor, and the outer temperature."""
        return 2 * (self.nx - 1) + 3


def mesh_ratio(slab: Slab, nx: int, dt: float) -> float:
    """The paper's gamma = alpha dt/dx^2 for nx intervals and a step dt in s (B.4 corrected)."""
    return slab.diffusivity * dt / (slab.thickness / nx) ** 2


def crank_nicolson(inner: np.ndarray, gamma: float, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """One step of Crank-Nicolson for the inner temperatures (nx - 1, ...), any unit of temperature.

    ``before`` and ``after`` (2, ...) are the temperatures of the lower and upper face at the step's two ends.
    """
    n = len(inner)
    padded = np.concatenate([before[:1], inner, before[1:]])
    right = (1 - gamma) * inner + gamma / 2 * (padded[:-2] + padded[2:])
    right[0] += gamma / 2 * after[0]
    right[-1] += gamma / 2 * after[1]
    bands = np.zeros((3, n))
    bands[0, 1:] = bands[2, :-1] = -gamma / 2
    bands[1] = 1 + gamma
    return np.asarray(solve_banded((1, 1), bands, right))


def layer_step(slab: Slab, nx: int, nt: int, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """nt steps of Crank-Nicolson over dt (s) on nx intervals, with end temperatures that do not change meanwhile, as
    one map: inner' = a @ inner + b @ (lower, upper) with a (nx - 1, nx - 1) and b (nx - 1, 2)."""
    gamma = mesh_ratio(slab, nx, dt / nt)
    inner, ends = np.eye(nx - 1), np.zeros((nx - 1, 2))
    none, unit = np.zeros((2, nx - 1)), np.eye(2)
    for _ in range(nt):
        inner, ends = crank_nicolson(inner, gamma, none, none), crank_nicolson(ends, gamma, unit, unit)
    return inner, ends


def step_matrix(lumped: Lumped, scheme: PaperScheme) -> np.ndarray:
    """One step of both layers, (states, states): from (insulator, polymer, sink, sensor, outer) rises in K.

    The rows of sink, sensor and outer give instead the heat flows in W: out of the sink into the insulator, out of the
    insulator into the sensor, out of the sensor into the polymer.
    """
    n, size = scheme.nx - 1, scheme.states
    sink, sensor, outer = range(size - 3, size)
    M, keep = np.zeros((size, size)), np.eye(size)
    for slab, rows, faces in (
        (lumped.insulator, slice(n), [sink, sensor]), (lumped.polymer, slice(n, 2 * n), [sensor, outer]),
    ):  # fmt: skip
        M[rows, rows], M[rows, faces] = layer_step(slab, scheme.nx, scheme.nt, scheme.dt)
    insulator, polymer = (scheme.nx * slab.conductance for slab in (lumped.insulator, lumped.polymer))
    M[sink] = insulator * (keep[sink] - M[0])
    M[sensor] = insulator * (M[n - 1] - keep[sensor])
    M[outer] = polymer * (keep[sensor] - M[n])
    return M


def spectral_radius(lumped: Lumped, scheme: PaperScheme) -> float:
    """Spectral radius of one step of the whole scheme without electrical power: stable up to 1."""
    loop, keep = step_matrix(lumped, scheme), np.eye(scheme.states)
    flow_in, flow_across, flow_out = loop[-3:].copy()
    loop[-3] = runge_kutta_step(keep[-3], -flow_in, lumped.conductance, 0.0, 0.0, scheme.dt / lumped.capacity[0])
    loop[-2] = runge_kutta_step(keep[-2], flow_across - flow_out, 0.0, 0.0, 0.0, scheme.dt / lumped.capacity[1])
    return float(np.abs(np.linalg.eigvals(loop[:-1, :-1])).max())


def stability_limit(device: Device, scheme: PaperScheme | None = None) -> float:
    """The largest stable time step in s of the scheme on this device, N_x and N_t kept, to 1e-4."""
    from scipy.optimize import brentq

    lumped, scheme = lump(device), scheme or PaperScheme()

    def growth(dt: float) -> float:
        return spectral_radius(lumped, PaperScheme(dt, scheme.nx, scheme.nt)) - 1 - 1e-12

    low, high = scheme.dt / 2, scheme.dt
    while growth(low) > 0:
        low, high = low / 2, low
    while growth(high) <= 0:
        low, high = high, 2 * high
        if high > 1.0:
            return float("inf")
    return float(brentq(growth, low, high, xtol=1e-4 * low))


def paper_traces(
    device: Device, scheme: PaperScheme, meter: tuple[float, float] = (0.0, 0.0)
) -> tuple[np.ndarray, PaperScheme]:
    """Traces (samples, 7) in the order of QUANTITIES, as rises, and the scheme with the step that was taken: where the
    sample time is no multiple of it, a shorter one. Raises UnstableStepError, and ValueError."""
    lumped, table = lump(device), timetable(device)
    per_sample = int(np.ceil(table.sample_time / scheme.dt - 1e-9))
    used = PaperScheme(table.sample_time / per_sample, scheme.nx, scheme.nt)
    if spectral_radius(lumped, used) > 1 + 1e-12:
        raise UnstableStepError(
            f"the paper's scheme is unstable on this device with its time step of {used.dt * 1e6:.3g} us: "
            f"it is stable only up to {stability_limit(device, used) * 1e6:.3g} us"
        )
    control = Controllers(settings(device, lumped.resistance, lumped.coefficient))
    steps = {k * per_sample + round(after / used.dt): outer for k, at in table.steps.items() for after, outer in at}
    return _march(lumped, control, meter, used, table.samples, per_sample, steps), used


def solve_paper(
    device: Device, scheme: PaperScheme | None = None, *, meter: tuple[float, float] = (0.0, 0.0)
) -> DeviceResult:  # fmt: skip
    """Traces of a device by the paper's scheme, and how far they are from the accurate scheme's (as ``errors``).

    The step is shortened where the sample time is no multiple of it. Raises UnstableStepError where it is beyond the
    stability limit, and ValueError for values that make no device.
    """
    traces, used = paper_traces(device, scheme or PaperScheme(), meter)
    accurate, limit = solve_accurate(device, meter=meter), stability_limit(device, used)
    rows = min(len(traces), len(accurate.time_s))
    result = device_result("paper", device, traces, {}, **around(device))
    off = {q: np.abs(result.trace(q)[:rows] - accurate.trace(q)[:rows]) for q in QUANTITIES}
    worst = {q: (float(d.max()), float(accurate.time_s[int(d.argmax())])) for q, d in off.items()}
    late = accurate.time_s[:rows] >= 0.05
    text = (
        f"the paper's scheme is off by up to {worst['sink_K'][0]:.3g} K (sink, at {worst['sink_K'][1]:.4g} s) and "
        f"{worst['sensor_K'][0]:.3g} K (sensor, at {worst['sensor_K'][1]:.4g} s)"
    )
    if late.any():
        text += f"; after 50 ms by up to {max(off['sink_K'][late].max(), off['sensor_K'][late].max()):.2g} K"
    text += "; most of that is an error in space, from the first differences at the faces, which a smaller step keeps"
    return replace(
        result, errors={q: w for q, (w, _) in worst.items()},
        findings=(text, *accurate.findings),
        details={"dt_s": used.dt, "stability_limit_s": limit, "nx": used.nx, "nt": used.nt},
    )  # fmt: skip


def _march(
    lumped: Lumped, control: Controllers, meter: tuple[float, float], scheme: PaperScheme, samples: int,
    per_sample: int, steps: dict[int, float],
) -> np.ndarray:  # fmt: skip
    M, dt = step_matrix(lumped, scheme), scheme.dt
    z, y = np.zeros(scheme.states), np.zeros(scheme.states)
    voltage, traces = np.zeros(2), np.empty((samples, 7))
    (r_sink, r_sensor), (a_sink, a_sensor) = lumped.resistance.tolist(), lumped.coefficient.tolist()
    (c_sink, c_sensor), loss = lumped.capacity.tolist(), lumped.conductance
    sink, sensor, face = 0.0, 0.0, scheme.nx - 1
    for k in range(samples):
        rises = np.array([sink, sensor])
        warm = lumped.resistance * (1 + lumped.coefficient * rises)
        voltage = control.sample(metered(voltage, warm, 0.0, meter))
        flow = lumped.polymer.conductance * scheme.nx * (sensor - z[face])
        traces[k] = np.r_[rises, voltage, lumped.power(voltage, rises), flow]
        if k == samples - 1 or rises.max() > CEILING:
            break
        heat_sink, heat_sensor = (voltage**2).tolist()
        heat_sink, heat_sensor = heat_sink / r_sink, heat_sensor / r_sensor
        for i in range(k * per_sample, (k + 1) * per_sample):
            if i in steps:
                z[-1] = steps[i]
            np.dot(M, z, out=y)
            flow_in, flow_across, flow_out = y[-3:].tolist()
            sink = runge_kutta_step(sink, -flow_in, loss, heat_sink, a_sink, dt / c_sink)
            sensor = runge_kutta_step(sensor, flow_across - flow_out, 0.0, heat_sensor, a_sensor, dt / c_sensor)
            y[-3:] = sink, sensor, z[-1]
            z, y = y, z
    return traces[: k + 1]


def runge_kutta_step(
    rise: Values, flow: Values, loss: float, heat: float, change: float, dt: float
) -> Values:  # fmt: skip
    """One step of C dT/dt = flow - loss T + heat/(1 + change T) over ``dt`` (here divided by C) with a held flow."""
    k1 = flow - loss * rise + heat / (1 + change * rise)
    t = rise + dt / 2 * k1
    k2 = flow - loss * t + heat / (1 + change * t)
    t = rise + dt / 2 * k2
    k3 = flow - loss * t + heat / (1 + change * t)
    t = rise + dt * k3
    k4 = flow - loss * t + heat / (1 + change * t)
    return rise + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
