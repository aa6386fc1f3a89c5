"""Series of conduction problems (Carslaw and Jaeger, Conduction of Heat in Solids, 2nd ed.)."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

TERMS = 400


def cooling(position: np.ndarray | float, number: float) -> np.ndarray:
    """Return the missing part of a step at ``position`` (-1 to 1) in a slab whose faces have taken it at once;
    ``number`` is the Fourier number alpha t/l^2 of the half thickness (3.3, eq 8)."""
    n = np.arange(TERMS)
    a = (2 * n + 1) * np.pi / 2
    terms = 2 * (-1.0) ** n / a * np.exp(-(a**2) * number) * np.cos(np.multiply.outer(np.asarray(position), a))
    return np.asarray(terms.sum(axis=-1))


def mean_cooling(number: float) -> float:
    """The mean of `cooling` over the slab."""
    a = (2 * np.arange(TERMS) + 1) * np.pi / 2
    return float((2 / a**2 * np.exp(-(a**2) * number)).sum())


def film_roots(biot: float, count: int) -> np.ndarray:
    """The positive roots of b tan b = biot."""
    return np.array([
        brentq(lambda b: b * np.sin(b) - biot * np.cos(b), n * np.pi, n * np.pi + np.pi / 2, xtol=1e-15)
        for n in range(count)
    ])  # fmt: skip


def film_cooling(position: float, biot: float, number: float) -> float:
    """Return `cooling` by films: ``biot`` is h l/k (3.11, eq 10)."""
    b = film_roots(biot, 60)
    terms = 2 * biot / ((b**2 + biot**2 + biot) * np.cos(b)) * np.exp(-(b**2) * number) * np.cos(b * position)
    return float(terms.sum())


def sine_driven(fraction: float, diffusion_time: float, omega: float, time: float) -> float:
    """The rise at ``fraction`` of a slab, 0 at its near face, whose far face follows sin(omega t) from t = 0, over that
    sine's amplitude; ``diffusion_time`` is L^2/alpha (s). By Duhamel's theorem (3.5)."""
    n = np.arange(1, 4 * TERMS + 1)
    rate = n**2 * np.pi**2 / diffusion_time
    # The straight line follows at once; each sine follows its rate of change.
    lag = omega * (rate * np.cos(omega * time) + omega * np.sin(omega * time) - rate * np.exp(-rate * time))
    lag = lag / (rate**2 + omega**2)
    terms = 2 * (-1.0) ** n / (n * np.pi) * np.sin(n * np.pi * fraction) * lag
    return float(fraction * np.sin(omega * time) + terms.sum())


def ramped(fraction: float, diffusion_time: float, times: np.ndarray, values: np.ndarray, time: float) -> float:
    """Return `sine_driven` for a far face that follows straight lines from the first of some ``times`` (s) on."""
    n = np.arange(1, 4 * TERMS + 1)
    rate = n**2 * np.pi**2 / diffusion_time
    lag = np.zeros(len(n))
    for a, b, slope in zip(times[:-1], times[1:], np.diff(values) / np.diff(times), strict=True):
        if a < time:
            lag += slope * (np.exp(-rate * (time - min(b, time))) - np.exp(-rate * (time - a))) / rate
    terms = 2 * (-1.0) ** n / (n * np.pi) * np.sin(n * np.pi * fraction) * lag
    return float(fraction * np.interp(time, times, values) + terms.sum())


def half_heated_square(across: float, down: float) -> float:
    """A unit square's temperature, one side at 1, the others at 0, ``across`` and ``down`` from the warm side."""
    n = 2 * np.arange(200) + 1
    a = n * np.pi
    # sinh(a (1 - d)) / sinh(a) without overflow.
    ratio = np.exp(-a * down) * (1 - np.exp(-2 * a * (1 - down))) / (1 - np.exp(-2 * a))
    return float((4 / a * np.sin(a * across) * ratio).sum())


def convective_rectangle(
    width: float, height: float, conductivity: float, coefficient: float, x: float, y: float
) -> float:  # fmt: skip
    """The temperature in a rectangle, 1 along y = 0, adiabatic at x = 0, films to 0 at x = width and y = height."""
    b = film_roots(coefficient * width / conductivity, 200) / width
    start = 2 * np.sin(b * width) / (b * width + np.sin(b * width) * np.cos(b * width))
    h = coefficient / (conductivity * b)

    def falling(distance: float) -> np.ndarray:
        """cosh(b d) + h sinh(b d) over e^(b height)."""
        e, shrink = np.exp(b * (distance - height)), np.exp(-b * (distance + height))
        return ((1 + h) * e + (1 - h) * shrink) / 2

    return float((start * np.cos(b * x) * falling(height - y) / falling(height)).sum())
