"""The device by other means: triquadratic bricks of a quarter on a mesh of its own, every unknown stepped implicitly.

Nothing of the model under test is used but the scene's numbers: uniform current densities, local heat P (1 + a T) /
(1 + a mean T) per volume, TR-BDF2 (Bank et al., IEEE Trans. CAD 4, 1985) on steps that grow from each sample on, each
stage's resistances from its own temperatures.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex2, LinearForm, MeshHex
from skfem.helpers import dot, grad

GAMMA = 2 - np.sqrt(2)


@BilinearForm
def conduction(u, v, w):
    return w.k * dot(grad(u), grad(v))


@BilinearForm
def capacity(u, v, w):
    return w.c * u * v


@LinearForm
def volume(v, w):
    return w.on * v


def towards(a, b, ratios):
    """Breakpoints from a to b in these parts of the length."""
    parts = np.cumsum([0, *ratios]) / np.sum(ratios)
    return a + (b - a) * parts


def quarter(device, cuts):
    """Breakpoints of x, y and z (m), ``cuts`` times as many as the coarsest."""
    sink = device.sink
    w, p, o = sink.width / 2, sink.pad_width / 2, sink.oxide_width / 2
    x = [towards(-p, -w, [2, 1]), towards(-w, -o, [1, 2, 2, 1]), towards(-o, 0, [1, 2, 3])]
    near = sink.anchor_distance
    y = [
        towards(-sink.pad_length, -near - sink.oxide_length, [2, 1]),
        towards(-near - sink.oxide_length, -near, [1, 2, 1]),
        towards(-near, 0, [1, 2, 2, 1]), towards(0, sink.length / 2, [1, 2, 5, 15, 40, 80]),
    ]  # fmt: skip
    heights = np.cumsum([0, sink.thickness, device.insulator_thickness, device.sensor_thickness,
                         device.polymer_thickness])  # fmt: skip
    z = [
        np.array([-sink.oxide_thickness, 0.0]), heights[:2], towards(heights[1], heights[2], [1, 2, 3, 3, 2, 1]),
        heights[2:4], towards(heights[3], heights[4], [1, 2, 4, 8, 12, 8, 4, 2, 1]),
    ]  # fmt: skip
    return [joined(axis, cuts) for axis in (x, y, z)]


def joined(pieces, cuts):
    """Breakpoints of adjoining pieces, each interval cut in as many."""
    breaks = np.concatenate([pieces[0][:1], *(p[1:] for p in pieces)])
    return np.concatenate([*(np.linspace(a, b, cuts + 1)[:-1] for a, b in pairwise(breaks)), breaks[-1:]])


def simulate(device, samples, cuts=1, steps=6):
    """(samples, 2): the mean rises of sink and sensor at each sample from cold, with no outer step."""
    x, y, z = quarter(device, cuts)
    mesh = MeshHex.init_tensor(x, y, z)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    sink = device.sink
    boxes = {b.name: b for b in device.scene().boxes}

    def inside(name):
        box = boxes[name]
        return np.all([(middle[d] > box.lower[d]) & (middle[d] < box.upper[d]) for d in range(3)], axis=0)

    solid = np.any([inside(name) for name in boxes], axis=0)
    mesh = mesh.restrict(np.flatnonzero(solid))
    middle = mesh.p[:, mesh.t].mean(axis=1)
    k, c = np.zeros(mesh.nelements), np.zeros(mesh.nelements)
    for name, box in boxes.items():
        k[inside(name)], c[inside(name)] = box.material.thermal_conductivity, box.material.heat_capacity
    basis = Basis(mesh, ElementHex2(), intorder=4)

    def at(values):
        return np.repeat(values[:, None], basis.X.shape[-1], axis=1)

    K, M = conduction.assemble(basis, k=at(k)), capacity.assemble(basis, c=at(c))
    films, rises = [], []
    for name, material in (("beam", sink.silicon), ("gold", device.gold)):
        part = Basis(mesh, ElementHex2(), elements=np.flatnonzero(inside(name)), intorder=4)
        one = volume.assemble(part, on=1.0)
        box = boxes[name]
        length, area = np.subtract(box.upper, box.lower)[1], np.prod(np.subtract(box.upper, box.lower)[[0, 2]])
        films.append((part, one / one.sum(), material.resistivity * length / area, material.temperature_coefficient))
    low, top = z[0], z[-1]
    held = basis.get_dofs(lambda p: (np.abs(p[2] - low) < 1e-12) | (np.abs(p[2] - top) < 1e-12)).flatten()
    free = np.setdiff1d(np.arange(basis.N), held)
    K, M = csc_matrix(K)[free][:, free], csc_matrix(M)[free][:, free]
    control, gains = device.control, np.array([device.control.sink_gain, device.control.sensor_gain])
    edges = control.sample_time * (np.arange(steps + 1) / steps) ** 2
    solves = {}

    def solve(h):
        if h not in solves:
            solves[h] = splu(M + GAMMA / 2 * h * K, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
        return solves[h].solve

    def heat(T, voltage):
        """The Joule load of the quarter."""
        full, load = np.zeros(basis.N), np.zeros(basis.N)
        full[free] = T
        for (part, mean, R0, a), V in zip(films, voltage, strict=True):
            average = mean @ full
            power = V**2 / (R0 * (1 + a * average)) / 4
            local = (1 + a * part.interpolate(full)) / (1 + a * average)
            size = np.prod(np.ptp(part.mesh.p[:, part.mesh.t[:, part.tind]].reshape(3, -1), axis=1))
            load += volume.assemble(part, on=power / size * local)
        return load[free]

    T, voltage = np.zeros(len(free)), np.zeros(2)
    for _ in range(samples):
        full = np.zeros(basis.N)
        full[free] = T
        seen = np.array([mean @ full for _, mean, _, _ in films])
        rises.append(seen)
        voltage = np.maximum(voltage + gains * (1 - seen / device.set_rise), 0.0)
        for h in np.diff(edges).tolist():
            here, before = heat(T, voltage), K @ T
            middle = last = T
            for _ in range(3):  # the resistances follow what a stage gives, and settle at once
                middle = solve(h)(M @ T + GAMMA * h / 2 * (here + heat(middle, voltage) - before))
            weights = 1 / (GAMMA * (2 - GAMMA)), (1 - GAMMA) ** 2 / (GAMMA * (2 - GAMMA))
            given = M @ (weights[0] * middle - weights[1] * T)
            for _ in range(3):
                last = solve(h)(given + (1 - GAMMA) / (2 - GAMMA) * h * heat(last, voltage))
            T = last
    return np.array(rises)
