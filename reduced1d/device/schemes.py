"""The 1D device over time: the paper's own scheme, and an accurate one with sentences about its run.

The accurate scheme has all layers at once, exact between samples but for the powers, with its error estimated.

The paper's scheme is partitioned: dt 1 us, N_x 25, N_t 10 (sections 4.1 and 5, Appendix B). In each step both layers
advance by N_t steps of Crank-Nicolson with the faces at the films' present temperatures; the heat flows follow from the
first difference at each face, are held, and each film advances by the classical Runge-Kutta method of fourth order. The
films see a flow that is late by a step, which limits dt; and the difference at the face blurs the first boundary
layers, which is the scheme's error during the start. Eq 3 in one layer is Appendix B with its misprints corrected:

    A(gamma) T_(j+1) = A(-gamma) T_j + b,   gamma = alpha dt/dx^2,   b = gamma/2 (f(t_j) + f(t_(j+1))) at both ends

with A(gamma) tridiagonal, 1 + gamma on the diagonal and -gamma/2 beside it, of size N_x - 1. The paper prints alpha and
gamma inverted (B.3, B.4), A(gamma) on both sides (B.6) and b without gamma (B.8).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from reduced1d.device.lumped import Lumped, Slab, around, lump, modes, stability, steady
from reduced1d.equations import Values
from scenes.device import Device
from statespace.circuit import metered, settings, timetable
from statespace.controllers import Controllers
from statespace.device_model import FILMS
from statespace.march import CEILING, March, march
from statespace.result import QUANTITIES, DeviceResult, device_result
from statespace.stability import Stability

LESS = 3
"""The run that estimates the error in space has elements of a degree lower by this: half of a refinement's 6."""


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


def layer_step(gamma: float, nx: int, nt: int) -> tuple[np.ndarray, np.ndarray]:
    """nt steps of Crank-Nicolson on nx intervals, with end temperatures that do not change meanwhile, as one map:
    inner' = a @ inner + b @ (lower, upper) with a (nx - 1, nx - 1) and b (nx - 1, 2)."""
    unit = np.eye(nx - 1)
    A = (1 + gamma) * unit - gamma / 2 * (np.eye(nx - 1, k=1) + np.eye(nx - 1, k=-1))
    a = np.linalg.matrix_power(np.linalg.solve(A, 2 * unit - A), nt)
    # The straight line between the ends stays as it is.
    upper = np.arange(1, nx) / nx
    line = np.column_stack([1 - upper, upper])
    return a, line - a @ line


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
        gamma = mesh_ratio(slab, scheme.nx, scheme.dt / scheme.nt)
        M[rows, rows], M[rows, faces] = layer_step(gamma, scheme.nx, scheme.nt)
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


def stability_limit(device: Device, scheme: PaperScheme = PaperScheme()) -> float:
    """The largest stable time step in s of the scheme on this device, N_x and N_t kept, to 1e-4."""
    from scipy.optimize import brentq

    lumped = lump(device)

    def growth(dt: float) -> float:
        return spectral_radius(lumped, replace(scheme, dt=dt)) - 1 - 1e-12

    low, high = scheme.dt / 2, scheme.dt
    while growth(low) > 0:
        low, high = low / 2, low
    while growth(high) <= 0:
        low, high = high, 2 * high
        if high > 1.0:
            return float("inf")
    return float(brentq(growth, low, high, xtol=1e-4 * low))


def solve_paper(
    device: Device, scheme: PaperScheme = PaperScheme(), *, meter: tuple[float, float] = (0.0, 0.0)
) -> DeviceResult:
    """Traces of a device by the paper's scheme, and how far they are from the accurate scheme's (as ``errors``).

    The step is shortened where the sample time is no multiple of it. Raises UnstableStepError where it is beyond the
    stability limit, and ValueError for values that make no device.
    """
    lumped, h = lump(device), device.control.sample_time
    per_sample = math.ceil(h / scheme.dt - 1e-9)
    used = replace(scheme, dt=h / per_sample)
    limit = stability_limit(device, used)
    if spectral_radius(lumped, used) > 1 + 1e-12:
        raise UnstableStepError(
            f"the paper's scheme is unstable on this device with its time step of {used.dt * 1e6:.3g} us: "
            f"it is stable only up to {limit * 1e6:.3g} us"
        )
    traces = _march(device, lumped, meter, used, per_sample)
    accurate = solve_accurate(device, meter=meter)
    rows = min(len(traces), len(accurate.time_s))
    result = device_result("paper", device, traces, {}, **around(device))
    off = {q: np.abs(result.trace(q)[:rows] - accurate.trace(q)[:rows]) for q in QUANTITIES}
    worst = {q: (float(d.max()), float(accurate.time_s[int(d.argmax())])) for q, d in off.items()}
    text = (
        f"the paper's scheme is off by up to {worst['sink_K'][0]:.3g} K (sink, at {worst['sink_K'][1]:.4g} s) and "
        f"{worst['sensor_K'][0]:.3g} K (sensor, at {worst['sensor_K'][1]:.4g} s); most of that is an error in space, "
        "from the first differences at the faces, which a smaller step keeps"
    )
    return replace(
        result, errors={q: w for q, (w, _) in worst.items()},
        findings=(text, *accurate.findings),
        details={"dt_s": used.dt, "stability_limit_s": limit, "nx": used.nx, "nt": used.nt},
    )  # fmt: skip


def _march(
    device: Device, lumped: Lumped, meter: tuple[float, float], scheme: PaperScheme, per_sample: int
) -> np.ndarray:
    """Traces (samples, 7) in the order of QUANTITIES, as rises."""
    table, M, dt = timetable(device), step_matrix(lumped, scheme), scheme.dt
    samples, control = table.samples, Controllers(settings(device, lumped.resistance, lumped.coefficient))
    steps = {k * per_sample + round(after / dt): outer for k, at in table.steps.items() for after, outer in at}
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


def solve_accurate(
    device: Device, *, meter: tuple[float, float] = (0.0, 0.0), start: Literal["cold", "settled"] = "cold",
    with_findings: bool = True,
) -> DeviceResult:  # fmt: skip
    """Traces of a device, to its ``accuracy`` where that can be reached.

    Three resolutions are run: the answer, one with elements of a degree LESS lower, and one with two powers fewer
    between samples. The differences estimate the errors of the coarser runs in space and in time. All are refined while
    the errors exceed the accuracy and refinement helps. ``meter`` is the resolution in ohm to which the resistances of
    (sink, sensor) are measured, 0 for an ideal meter. ``start`` "settled" begins in the steady state at the initial
    outer temperature, "cold" at room temperature without voltage. Without findings no limits of stability are sought,
    which of slowly sampled loops takes as long as the run. Raises ValueError for values that make no device, and
    ArithmeticError where the powers between two samples do not converge.
    """
    goal, lumped = device.accuracy * device.set_rise, lump(device)
    before = math.inf
    # Degree of the elements in space, and unknown powers per film and interval in time.
    for degree, nodes in ((12, 6), (18, 10), (24, 14), (30, 18)):
        spectrum, tolerance = modes(lumped, degree), min(1e-4 * goal, 1e-8)
        coarser = modes(lumped, degree - LESS)
        run, less_space, less_time = (
            march(each, q, device, tolerance, meter, start)
            for each, q in ((spectrum, nodes), (coarser, nodes), (spectrum, nodes - 2))
        )
        parts = {"space": run.distance(less_space), "time": run.distance(less_time)}
        space, time = (max(part["sink_K"], part["sensor_K"]) for part in parts.values())
        if max(space, time) <= goal / 2 or space + time > before / 2:
            break
        before = space + time
    errors = {q: parts["space"][q] + parts["time"][q] + 1e-12 * float(np.abs(run.traces[:, i]).max())
              for i, q in enumerate(QUANTITIES)}  # fmt: skip
    said = findings(device, run, max(errors["sink_K"], errors["sensor_K"]), goal) if with_findings else ()
    return device_result(
        "accurate",
        device,
        run.traces,
        errors,
        **around(device),
        error_parts=parts,
        findings=said,
        details={"states": spectrum.count, "degree": degree, "nodes": nodes, "stopped": run.stopped},
    )


def findings(device: Device, run: March, error: float, goal: float) -> tuple[str, ...]:
    """Sentences on limiter, saturation, stability, a run that was stopped, and an error estimate (K) above its goal."""
    h, external, sentences = device.control.sample_time, device.external, []
    end = (len(run.rises) - 1) * h
    if run.stopped:
        hot = int(np.argmax(run.rises[-1]))
        wrong = "; its voltage is negative, and heats an element that is too hot" * bool(run.voltages[-1, hot] < 0)
        sentences.append(
            f"the run was stopped at {end:.6g} s: the {FILMS[hot]} was {run.rises[-1, hot]:.0f} K above room "
            f"temperature (ceiling {CEILING:.0f} K) at {run.voltages[-1, hot]:.3g} V{wrong}"
        )
    for name, limited in zip(FILMS, run.limited.T, strict=True):
        if len(at := np.flatnonzero(limited)):
            when = f"{len(at)} of {len(limited)} samples, from {at[0] * h:.6g} s to {at[-1] * h:.6g} s"
            sentences.append(f"the limit V >= 0 held the {name} at {when}")
    seen = [("initial", external.initial_temperature)] if external.step_time > 0 else []
    if external.step_time < end or not seen:
        seen.append(("final", external.final_temperature))
    for name, temperature in seen:
        state, where = steady(device, temperature), f"at the {name} outer temperature, {temperature:g} K,"
        if state.cycles:
            sentences.append(
                f"{where} there is no steady state: over the common ground a film can neither be held at the set "
                "temperature nor rest without power, and its loop swings"
            )
        for i, element in enumerate(() if state.cycles else FILMS):
            kelvin, watts = getattr(state, f"{element}_K"), getattr(state, f"{element}_power_W")
            if getattr(state, f"{element}_saturated"):
                instead = f"{kelvin:.6g} K instead of the set {device.control.set_temperature:g} K"
                sentences.append(f"{where} the {element} needs no power: it settles at {instead}")
            elif name == "final" and device.control.ground_resistance and run.limited[-20:, i].any():
                sentences.append(
                    f"{where} the {element}'s loop swings from no voltage on, though it could be held with "
                    f"{watts * 1e3:.4g} mW: over the common ground the other's current hides a film without its own"
                )
        if said := loop_text(device, stability(device, temperature)):
            sentences.append(f"about the steady state {where} {said}")
    if error > goal:
        sentences.append(
            f"the estimated error of a temperature, {error:.1e} K, is above the accuracy asked for, {goal:.1e} K: "
            "where the loop is unstable no computation can follow it for long"
        )
    return tuple(sentences)


def shown(eigenvalue: complex) -> str:
    """An eigenvalue: "-1.21 (alternating)", or the size of a complex pair."""
    if eigenvalue.imag:
        return f"{abs(eigenvalue):.4g} in size (oscillating)"
    return f"{eigenvalue.real:.4g}{' (alternating)' if eigenvalue.real < 0 else ''}"


def loop_text(device: Device, about: Stability) -> str:
    """Whether the loop is unstable or near it, with its largest eigenvalue and the gains' limits; empty for neither."""
    gains = {name: getattr(device.control, f"{name}_gain") for name in FILMS}
    limits = {name: getattr(about, f"{name}_gain_limit") for name in FILMS}
    # A gain margin of 6 dB is the least that textbooks ask for (Franklin, Powell and Emami-Naeini, Feedback Control of
    # Dynamic Systems, section 6.4).
    near = [name for name in FILMS if 2 * gains[name] > limits[name]]
    if about.stable and not near:
        return ""
    said = "the loop is near instability" if about.stable else "the loop is unstable"
    listed = [
        f"the {name}'s gain of {gains[name]:.4g} V is {gains[name] / limits[name]:.3g} times its largest stable one"
        if limits[name] > 0 else f"no gain of the {name} is stable"
        for name in near
    ]  # fmt: skip
    said += f": its largest eigenvalue per sample is {shown(about.eigenvalue)}"
    if not about.stable:
        said += f": small disturbances grow at {about.growth_rate:.4g} 1/s"
    return f"{said}; {' and '.join(listed)}, each with the other gain as it is"
