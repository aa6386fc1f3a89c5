"""The device by other means: triquadratic bricks of a quarter on a mesh of its own, every unknown stepped implicitly.

Nothing of the model under test is used but the scene's numbers: uniform current densities, local heat P (1 + a T) /
(1 + a mean T) per volume, TR-BDF2 (Bank et al., IEEE Trans. CAD 4, 1985) on steps that grow from each sample on, each
stage's resistances from its own temperatures.
"""

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


class Full:
    """The quarter of a device in every unknown; ``above`` is where the polymer's outer face is, ``below`` the
    substrate."""

    def __init__(self, device, cuts=1, steps=6):
        x, y, z = quarter(device, cuts)
        mesh = MeshHex.init_tensor(x, y, z)
        middle = mesh.p[:, mesh.t].mean(axis=1)
        sink, boxes = device.sink, {b.name: b for b in device.scene().boxes}

        def inside(name):
            box = boxes[name]
            return np.all([(middle[d] > box.lower[d]) & (middle[d] < box.upper[d]) for d in range(3)], axis=0)

        solid = np.any([inside(name) for name in boxes], axis=0)
        mesh = mesh.restrict(np.flatnonzero(solid))
        middle = mesh.p[:, mesh.t].mean(axis=1)
        k, c = np.zeros(mesh.nelements), np.zeros(mesh.nelements)
        for name, box in boxes.items():
            k[inside(name)], c[inside(name)] = box.material.thermal_conductivity, box.material.heat_capacity
        self.basis = basis = Basis(mesh, ElementHex2(), intorder=4)

        def at(values):
            return np.repeat(values[:, None], basis.X.shape[-1], axis=1)

        self.K = csc_matrix(conduction.assemble(basis, k=at(k)))
        mass = csc_matrix(capacity.assemble(basis, c=at(c)))
        self.films = []
        for name, material in (("beam", sink.silicon), ("gold", device.gold)):
            part = Basis(mesh, ElementHex2(), elements=np.flatnonzero(inside(name)), intorder=4)
            one = volume.assemble(part, on=1.0)
            box = boxes[name]
            length, area = np.subtract(box.upper, box.lower)[1], np.prod(np.subtract(box.upper, box.lower)[[0, 2]])
            resistance = material.resistivity * length / area
            self.films.append((part, one / one.sum(), resistance, material.temperature_coefficient))
        low, top = z[0], z[-1]
        self.below = basis.get_dofs(lambda p: np.abs(p[2] - low) < 1e-12).flatten()
        self.above = basis.get_dofs(lambda p: np.abs(p[2] - top) < 1e-12).flatten()
        self.free = np.setdiff1d(np.arange(basis.N), np.r_[self.below, self.above])
        self.inner, self.M = self.K[self.free][:, self.free], mass[self.free][:, self.free]
        self.edges = device.control.sample_time * (np.arange(steps + 1) / steps) ** 2
        self.device, self.solves = device, {}
        self.gains = np.array([device.control.sink_gain, device.control.sensor_gain])

    def lift(self, nodes):
        """The steady field of 1 K at some of the given nodes, none at the others and no heat."""
        full = np.zeros(self.basis.N)
        full[nodes] = 1.0
        full[self.free] = self.steady(-(self.K @ full)[self.free])
        return full

    def steady(self, load):
        if "steady" not in self.solves:
            options = {"SymmetricMode": True}
            self.solves["steady"] = splu(self.inner, permc_spec="MMD_AT_PLUS_A", options=options).solve
        return self.solves["steady"](load)

    def solve(self, h):
        if h not in self.solves:
            options = {"SymmetricMode": True}
            matrix = csc_matrix(self.M + GAMMA / 2 * h * self.inner)
            self.solves[h] = splu(matrix, permc_spec="MMD_AT_PLUS_A", options=options).solve
        return self.solves[h]

    def seen(self, full):
        return np.array([mean @ full for _, mean, _, _ in self.films])

    def resistances(self, full):
        return np.array([R0 * (1 + a * (mean @ full)) for _, mean, R0, a in self.films])

    def heat(self, full, powers):
        """The Joule load of the quarter for powers of the whole."""
        load = np.zeros(self.basis.N)
        for (part, mean, _, a), power in zip(self.films, powers, strict=True):
            local = (1 + a * part.interpolate(full)) / (1 + a * (mean @ full))
            size = np.prod(np.ptp(part.mesh.p[:, part.mesh.t[:, part.tind]].reshape(3, -1), axis=1))
            load += volume.assemble(part, on=power / 4 / size * local)
        return load[self.free]

    def settled(self, given, rise):
        """The field in which both films have a mean rise (K), and the powers for that, with a ``given`` field."""
        full, powers = given, np.zeros(2)
        for _ in range(6):
            fields = np.zeros((2, self.basis.N))
            for e in (0, 1):
                fields[e, self.free] = self.steady(self.heat(full, np.eye(2)[e]))
            per_power = np.array([self.seen(field) for field in fields]).T
            powers = np.linalg.solve(per_power, rise - self.seen(given))
            full = given + powers @ fields
        return full, powers

    def sample(self, v, given, voltage):
        """The remainder, a sample later, of the part ``v`` (free) that a ``given`` field (all nodes) is added to."""

        def whole(v):
            full = given.copy()
            full[self.free] += v
            return full

        def heat(v):
            full = whole(v)
            return self.heat(full, voltage**2 / self.resistances(full))

        for h in np.diff(self.edges).tolist():
            here, before = heat(v), self.inner @ v
            middle = last = v
            for _ in range(3):  # the resistances follow what a stage gives, and settle at once
                middle = self.solve(h)(self.M @ v + GAMMA * h / 2 * (here + heat(middle) - before))
            weights = 1 / (GAMMA * (2 - GAMMA)), (1 - GAMMA) ** 2 / (GAMMA * (2 - GAMMA))
            given_v = self.M @ (weights[0] * middle - weights[1] * v)
            for _ in range(3):
                last = self.solve(h)(given_v + (1 - GAMMA) / (2 - GAMMA) * h * heat(last))
            v = last
        return v


def simulate(device, samples, cuts=1, steps=6):
    """(samples, 2): the mean rises of sink and sensor at each sample from cold, with no outer step."""
    full = Full(device, cuts, steps)
    given, v = np.zeros(full.basis.N), np.zeros(len(full.free))
    rises, voltage = [], np.zeros(2)
    for _ in range(samples):
        whole = given.copy()
        whole[full.free] += v
        rises.append(full.seen(whole))
        voltage = np.maximum(voltage + full.gains * (1 - rises[-1] / device.set_rise), 0.0)
        v = full.sample(v, given, voltage)
    return np.array(rises)


def above_a_warmer_substrate(device, outer, samples, cuts=1, steps=6):
    """(samples, 2): the change by a substrate 1 K warmer of the powers of sink and sensor at each sample from then on,
    from the steady state with the outer face at a rise ``outer`` (K)."""
    full = Full(device, cuts, steps)
    given = outer * full.lift(full.above)
    start, before = full.settled(given, np.full(2, device.set_rise))
    voltage = np.sqrt(before * full.resistances(start))
    given = given + full.lift(full.below)
    v, found = (start - given)[full.free], []
    for _ in range(samples):
        whole = given.copy()
        whole[full.free] += v
        voltage = np.maximum(voltage + full.gains * (1 - full.seen(whole) / device.set_rise), 0.0)
        found.append(voltage**2 / full.resistances(whole) - before)
        v = full.sample(v, given, voltage)
    return np.array(found)
